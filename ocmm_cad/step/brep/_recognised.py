"""Surfaces of a STEP file in numbers: planes, cylinders, cones, spheres and tori; needs OCP.

A surface is one face, or the faces of one round surface. Planes and round surfaces may be stored as
splines. The library recognises them; the result is checked on places and edges of the face, and
used only within `RECOGNISED_MM`.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from ocmm_cad.step.brep import _surface_kernel as kernel
from ocmm_cad.step.brep._library import kind_of, vector
from ocmm_core.geometry import Float, triple

Triple = tuple[float, float, float]


LESS = "Export the model without parts and details that nobody measures."
"""Remedy for a model that is too large."""


class StepFace(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    shape: str
    """Word of `features.shapes.Shape`."""
    point: Triple
    direction: Triple
    across: Triple = (1.0, 0.0, 0.0)
    """`point`, `direction`, `across`: mm and unit: middle of the face, normal out of the material
    or axis, and direction of its length."""
    radius: float = 0.0
    second: float = 0.0
    half_angle: float = 0.0
    """`radius`, `second`, `half_angle`: As in `features.shapes.element`, mm and rad."""
    low: float = 0.0
    high: float = 0.0
    """`low`, `high`: mm: extent from ``point`` along ``direction`` (round), ``across`` (plane)."""
    width: float = 0.0
    """mm: extent of a plane perpendicular to ``across``."""
    inner: bool = False
    deviation_mm: float | None = None
    """Largest distance of a spline in the file from this surface; None for a native surface."""


def normals_of(face: StepFace, points: Float) -> Float:
    """Return the normals out of the material (n, 3) of a surface at points on it (n, 3), mm."""
    direction = np.array(face.direction)
    if face.shape == "Plane":
        return np.tile(direction, (len(points), 1))
    arms = points - np.array(face.point)
    across = arms - (arms @ direction)[:, None] * direction
    if face.shape == "Cone":
        # The axis leads from the tip into the cone: the normal is across, tilted back by the angle.
        round_it = across / _lengths(across)
        arms = np.cos(face.half_angle) * round_it - np.sin(face.half_angle) * direction
    elif face.shape == "Cylinder":
        arms = across
    elif face.shape == "Torus":
        arms = arms - face.radius * across / _lengths(across)
    normals: Float = arms / _lengths(arms)
    return -normals if face.inner else normals


def offsets_of(face: StepFace, points: Float) -> Float:
    """Return the distances of points (n, 3) out of the material of a surface (n,), mm."""
    arms = points - np.array(face.point)
    along: Float = arms @ np.array(face.direction)
    if face.shape == "Plane":
        return along
    across = np.linalg.norm(arms - along[:, None] * np.array(face.direction), axis=1)
    if face.shape == "Cylinder":
        away = across - face.radius
    elif face.shape == "Cone":
        away = across * np.cos(face.half_angle) - along * np.sin(face.half_angle)
    elif face.shape == "Torus":
        away = np.hypot(across - face.radius, along) - face.second
    else:
        away = np.linalg.norm(arms, axis=1) - face.radius
    offsets: Float = -away if face.inner else away
    return offsets


def _lengths(rows: Float) -> Float:
    found: Float = np.sqrt((rows * rows).sum(axis=1))[:, None]
    return found


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
            shape="Plane", point=triple(middle), direction=triple(normal), across=triple(across),
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
            shape="Sphere", point=triple(centre), direction=triple(axis), radius=ball.Radius(),
            inner=float(normal @ (middle - centre)) < 0.0,
        )  # fmt: skip
    if kind == GeomAbs_Torus:
        ring = surface.Torus()
        centre, axis = vector(ring.Location()), vector(ring.Position().Direction())
        arm = middle - centre
        flat = arm - (arm @ axis) * axis
        core = centre + ring.MajorRadius() * flat / np.linalg.norm(flat)
        return StepFace(
            shape="Torus", point=triple(centre), direction=triple(axis), radius=ring.MajorRadius(),
            second=ring.MinorRadius(), inner=float(normal @ (middle - core)) < 0.0,
        )  # fmt: skip
    return None


def _cylinder(surface: Any, middle: Float, normal: Float, v0: float, v1: float) -> StepFace:
    cylinder = surface.Cylinder()
    axis, start = vector(cylinder.Axis().Direction()), vector(cylinder.Location())
    sense = 1.0 if axis[int(np.argmax(np.abs(np.round(axis, 6))))] > 0.0 else -1.0
    # All faces of one cylinder get the same point: that of the axis nearest to the origin.
    foot = start - (start @ axis) * axis
    ends = sorted(float(start @ axis + v) * sense for v in (v0, v1))
    arm = middle - foot
    return StepFace(
        shape="Cylinder", point=triple(foot), direction=triple(sense * axis),
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
        shape="Cone", point=triple(tip), direction=triple(axis), half_angle=abs(half), low=ends[0],
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


RECOGNISED_MM = 0.005
"""A face that leaves its plane, cylinder, cone or sphere by more stays a free form: well below the
uncertainty of a touch, far above the rounding of exporters."""
_KINDS = frozenset(
    ("BSplineSurface", "BezierSurface", "SurfaceOfRevolution", "SurfaceOfExtrusion",
     "OffsetSurface", "OtherSurface")
)  # fmt: skip
_SHAPES = ("Plane", "Cylinder", "Cone", "Sphere")
_CLASSES = ("Plane", "CylindricalSurface", "ConicalSurface", "SphericalSurface")
_GRIDS = (20, 60)
_ENOUGH = 60


def recognised_face(
    face: Any, surface: Any, reverse: bool, uv: Float, starts: NDArray[np.int64]
) -> tuple[StepFace, Float, Float, Float, Float] | None:
    """Return the surface of a spline, places inside its edges, and its edges; None if free form.

    ``surface``: `BRepAdaptor_Surface` of the face; ``uv``, ``starts``: edges as in
    `kernel.run_along`. Returns the surface, with ``deviation_mm``; places (n, 3), mm, on it; edges
    (len(uv), 3), mm, on the spline; their normals and lengths, as in `kernel.run_along`.
    """
    if kind_of(surface) not in _KINDS:
        return None
    found = _found_by_library(face)
    if found is None:
        return None
    word, canonical = found
    lines = _values(surface, uv)
    places = _places_inside(surface, uv, starts)
    if not len(places) or not np.isfinite(lines).all():
        return None
    samples = np.concatenate([lines, places])
    said = _as_face(word, canonical, samples)
    if said is None:
        return None
    # The side of the material follows from the spline, not from the recognised surface.
    middle = starts[:-1] + (np.diff(starts) // 2)
    truth = _normals(surface, uv[middle], reverse)
    if float(np.nan_to_num(truth * normals_of(said, lines[middle])).sum()) < 0.0:
        said = _turned(said)
    deviation = float(np.abs(offsets_of(said, samples)).max())
    if deviation > RECOGNISED_MM:
        return None
    onto = places - offsets_of(said, places)[:, None] * normals_of(said, places)
    steps = np.linalg.norm(np.diff(lines, axis=0), axis=1)
    lengths = np.array([steps[first : last - 1].sum() for first, last in pairwise(starts.tolist())])
    return msgspec.structs.replace(said, deviation_mm=deviation), onto, lines, truth, lengths


def _found_by_library(face: Any) -> tuple[str, Any] | None:
    """Return word and surface recognised by the library; None for a free form."""
    import OCP.Geom as Geom
    import OCP.gp as gp
    from OCP.ShapeAnalysis import ShapeAnalysis_CanonicalRecognition

    asked = ShapeAnalysis_CanonicalRecognition(face)
    for word, owner in zip(_SHAPES, _CLASSES, strict=True):
        filled = getattr(gp, f"gp_{'Pln' if word == 'Plane' else word}")()
        if getattr(asked, f"Is{word}")(RECOGNISED_MM, filled):
            return word, getattr(Geom, f"Geom_{owner}")(filled)
    return None


def _as_face(word: str, canonical: Any, samples: Float) -> StepFace | None:
    from OCP.GeomAdaptor import GeomAdaptor_Surface

    frame = canonical.Position()
    arms = samples - vector(frame.Location())
    u, v = arms @ vector(frame.XDirection()), arms @ vector(frame.YDirection())
    height = arms @ vector(frame.Direction())
    if word == "Plane":
        bounds = (u.min(), u.max(), v.min(), v.max())
    elif word == "Sphere":
        bounds = (0.0, 2.0 * np.pi, -0.5 * np.pi, 0.5 * np.pi)
    else:
        slant = np.cos(canonical.SemiAngle()) if word == "Cone" else 1.0
        bounds = (0.0, 2.0 * np.pi, height.min() / slant, height.max() / slant)
    if bounds[1] - bounds[0] <= 0.0 or bounds[3] - bounds[2] <= 0.0:
        return None
    return elementary_face(GeomAdaptor_Surface(canonical, *map(float, bounds)), False)


def _turned(face: StepFace) -> StepFace:
    if face.shape != "Plane":
        return msgspec.structs.replace(face, inner=not face.inner)
    x, y, z = face.direction
    return msgspec.structs.replace(face, direction=(-x, -y, -z))


def _places_inside(surface: Any, uv: Float, starts: NDArray[np.int64]) -> Float:
    """Return places of a spline inside its edges (n, 3), mm: refined if there are few."""
    if not len(uv):
        return np.empty((0, 3))
    loops = kernel.closed_loops(uv, starts)
    (u0, v0), (u1, v1) = uv.min(axis=0), uv.max(axis=0)
    inside = np.empty((0, 2))
    for count in _GRIDS:
        us = u0 + (u1 - u0) * (np.arange(count) + 0.5) / count
        vs = v0 + (v1 - v0) * (np.arange(count) + 0.5) / count
        found = np.zeros((count, count), dtype=np.bool_)
        kernel.inside(us, vs, loops, found)
        rows, columns = np.nonzero(found)
        inside = np.column_stack([us[rows], vs[columns]])
        if len(inside) >= _ENOUGH:
            break
    return _values(surface, inside)


def _values(surface: Any, uv: Float) -> Float:
    points = (surface.Value(u, v) for u, v in uv.tolist())
    return np.array([(p.X(), p.Y(), p.Z()) for p in points]).reshape(-1, 3)


def _normals(surface: Any, uv: Float, reverse: bool) -> Float:
    """Return the normals out of the material (n, 3); zero where undefined."""
    from OCP.gp import gp_Pnt, gp_Vec

    found = np.zeros((len(uv), 3))
    for row, (u, v) in enumerate(uv.tolist()):
        point, by_u, by_v = gp_Pnt(), gp_Vec(), gp_Vec()
        surface.D1(u, v, point, by_u, by_v)
        crossed = by_u.Crossed(by_v)
        if crossed.Magnitude() > 0.0:
            found[row] = vector(crossed) / crossed.Magnitude()
    return -found if reverse else found
