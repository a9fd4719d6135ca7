"""Planes, cylinders, cones, spheres and tori of a STEP file in numbers; needs OCP."""

from __future__ import annotations

from typing import Any

import numpy as np

from ocmm_cad.step.brep._library import vector
from ocmm_cad.step.brep._step_face import StepFace, Triple
from ocmm_core.geometry import Float


def elementary_face(surface: Any, reverse: bool) -> StepFace | None:
    from OCP.GeomAbs import (
        GeomAbs_Cone,
        GeomAbs_Cylinder,
        GeomAbs_Plane,
        GeomAbs_Sphere,
        GeomAbs_Torus,
    )

    kind = surface.GetType()
    u0, u1 = surface.FirstUParameter(), surface.LastUParameter()
    v0, v1 = surface.FirstVParameter(), surface.LastVParameter()
    middle, normal = _normal(surface, 0.5 * (u0 + u1), 0.5 * (v0 + v1), reverse)
    if kind == GeomAbs_Plane:
        across = vector(surface.Plane().Position().XDirection())
        return StepFace(
            shape="Plane", point=_tuple(middle), direction=_tuple(normal), across=_tuple(across),
            low=-0.5 * (u1 - u0), high=0.5 * (u1 - u0), width=v1 - v0,
        )  # fmt: skip
    if kind == GeomAbs_Cylinder:
        return _cylinder(surface, middle, normal, v0, v1)
    if kind == GeomAbs_Cone:
        return _cone(surface, middle, normal, v0, v1)
    if kind == GeomAbs_Sphere:
        ball = surface.Sphere()
        centre, axis = vector(ball.Location()), vector(ball.Position().Direction())
        return StepFace(
            shape="Sphere", point=_tuple(centre), direction=_tuple(axis), radius=ball.Radius(),
            inner=float(normal @ (middle - centre)) < 0.0,
        )  # fmt: skip
    if kind == GeomAbs_Torus:
        ring = surface.Torus()
        centre, axis = vector(ring.Location()), vector(ring.Position().Direction())
        arm = middle - centre
        flat = arm - (arm @ axis) * axis
        core = centre + ring.MajorRadius() * flat / np.linalg.norm(flat)
        return StepFace(
            shape="Torus", point=_tuple(centre), direction=_tuple(axis), radius=ring.MajorRadius(),
            second=ring.MinorRadius(), inner=float(normal @ (middle - core)) < 0.0,
        )  # fmt: skip
    return None


def _cylinder(surface: Any, middle: Float, normal: Float, v0: float, v1: float) -> StepFace:
    cylinder = surface.Cylinder()
    axis, start = vector(cylinder.Axis().Direction()), vector(cylinder.Location())
    sense = _sense(axis)
    # All faces of one cylinder get the same point: that of the axis nearest to the origin.
    foot = start - (start @ axis) * axis
    ends = sorted(float(start @ axis + v) * sense for v in (v0, v1))
    arm = middle - foot
    return StepFace(
        shape="Cylinder", point=_tuple(foot), direction=_tuple(sense * axis),
        radius=cylinder.Radius(), low=ends[0], high=ends[1],
        inner=float(normal @ (arm - (arm @ axis) * axis)) < 0.0,
    )  # fmt: skip


def _cone(surface: Any, middle: Float, normal: Float, v0: float, v1: float) -> StepFace:
    """Return a cone by its tip, common to all its faces; its axis leads out of it."""
    cone = surface.Cone()
    half = cone.SemiAngle()
    axis, start = vector(cone.Axis().Direction()), vector(cone.Location())
    axis = axis if half > 0.0 else -axis
    tip = start - cone.RefRadius() / np.tan(abs(half)) * axis
    sense = 1.0 if half > 0.0 else -1.0
    far = cone.RefRadius() / np.sin(abs(half))
    ends = sorted(float((far + sense * v) * np.cos(half)) for v in (v0, v1))
    arm = middle - tip
    return StepFace(
        shape="Cone", point=_tuple(tip), direction=_tuple(axis), half_angle=abs(half), low=ends[0],
        high=ends[1], inner=float(normal @ (arm - (arm @ axis) * axis)) < 0.0,
    )  # fmt: skip


def _normal(surface: Any, u: float, v: float, reverse: bool) -> tuple[Float, Float]:
    from OCP.gp import gp_Pnt, gp_Vec

    point, by_u, by_v = gp_Pnt(), gp_Vec(), gp_Vec()
    surface.D1(u, v, point, by_u, by_v)
    # `np.cross` would take a tenth of a millisecond at every edge.
    crossed = by_u.Crossed(by_v)
    length = crossed.Magnitude()
    normal = vector(crossed) / (length if length > 0.0 else 1.0)
    return vector(point), -normal if reverse else normal


def _sense(axis: Float) -> float:
    largest = int(np.argmax(np.abs(np.round(axis, 6))))
    return 1.0 if axis[largest] > 0.0 else -1.0


def _tuple(vector: Float) -> Triple:
    x, y, z = (float(value) for value in vector)
    return (x, y, z)
