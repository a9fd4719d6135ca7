"""Places on the surface of a face, many at once; needs OCP."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ocmm_core.geometry import Float
from ocmm_core.inspection.step._library import vector


def evaluated(surface: Any) -> Callable[[Float], Float]:
    """Return what gives places (n, 3), mm, for parameters (n, 2) of a surface of the library.

    Planes, cylinders, cones, spheres and tori are written out, as `ElSLib` of the library has them;
    to ask it for each place costs more than all else about a face. Others are asked.
    """
    from OCP import GeomAbs

    kind = surface.GetType()
    if kind == GeomAbs.GeomAbs_Plane:
        return _flat(surface.Plane())
    if kind == GeomAbs.GeomAbs_Cylinder:
        cylinder = surface.Cylinder()
        radius = cylinder.Radius()
        return _turned(cylinder, lambda v: (np.full_like(v, radius), v))
    if kind == GeomAbs.GeomAbs_Cone:
        cone = surface.Cone()
        radius, half = cone.RefRadius(), cone.SemiAngle()
        return _turned(cone, lambda v: (radius + v * np.sin(half), v * np.cos(half)))
    if kind == GeomAbs.GeomAbs_Sphere:
        sphere = surface.Sphere()
        radius = sphere.Radius()
        return _turned(sphere, lambda v: (radius * np.cos(v), radius * np.sin(v)))
    if kind == GeomAbs.GeomAbs_Torus:
        torus = surface.Torus()
        ring, tube = torus.MajorRadius(), torus.MinorRadius()
        return _turned(torus, lambda v: (ring + tube * np.cos(v), tube * np.sin(v)))
    return _asked(surface)


def _frame(shape: Any) -> tuple[Float, Float, Float, Float]:
    position = shape.Position()
    # One that was mirrored is left-handed: y is its own and not a product.
    x, y, z = (position.XDirection(), position.YDirection(), position.Direction())
    return vector(shape.Location()), vector(x), vector(y), vector(z)


def _flat(plane: Any) -> Callable[[Float], Float]:
    origin, x, y, _ = _frame(plane)
    across = np.array([x, y])

    def places(uv: Float) -> Float:
        found: Float = origin + uv @ across
        return found

    return places


def _turned(
    shape: Any, outline: Callable[[Float], tuple[Float, Float]]
) -> Callable[[Float], Float]:
    """Return the places of what is turned about an axis: its outline is radius and height by v."""
    origin, x, y, z = _frame(shape)

    def places(uv: Float) -> Float:
        radius, height = outline(uv[:, 1])
        found: Float = (
            origin
            + (radius * np.cos(uv[:, 0]))[:, None] * x
            + (radius * np.sin(uv[:, 0]))[:, None] * y
            + height[:, None] * z
        )
        return found

    return places


def _asked(surface: Any) -> Callable[[Float], Float]:
    from OCP.gp import gp_Pnt

    def places(uv: Float) -> Float:
        point = gp_Pnt()
        found = np.empty((len(uv), 3))
        for row, (u, v) in enumerate(uv.tolist()):
            surface.D0(u, v, point)
            found[row] = point.X(), point.Y(), point.Z()
        return found

    return places
