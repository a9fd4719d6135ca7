"""A surface of the library as numbers, for the kernel; needs OCP."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from ocmm_cad.step.brep import _surface_kernel as kernel
from ocmm_cad.step.brep._library import kind_of
from ocmm_core.geometry import Float


@cache
def _kinds() -> dict[Any, tuple[int, str]]:
    from OCP import GeomAbs

    return {
        GeomAbs.GeomAbs_Plane: (kernel.PLANE, "Plane"),
        GeomAbs.GeomAbs_Cylinder: (kernel.CYLINDER, "Cylinder"),
        GeomAbs.GeomAbs_Cone: (kernel.CONE, "Cone"),
        GeomAbs.GeomAbs_Sphere: (kernel.SPHERE, "Sphere"),
        GeomAbs.GeomAbs_Torus: (kernel.TORUS, "Torus"),
    }


def surface_numbers(surface: Any) -> tuple[int, Float, Float]:
    """Return kind, frame (4, 3), sizes (2,) as for `_surface_kernel.run_along`, or ValueError."""
    known = _kinds().get(surface.GetType())
    if known is None:
        msg = f"a {kind_of(surface)} is not written out"
        raise ValueError(msg)
    kind, word = known
    shape = getattr(surface, word)()
    position, at = shape.Position(), shape.Location()
    x, y, z = position.XDirection(), position.YDirection(), position.Direction()
    frame = np.array([[one.X(), one.Y(), one.Z()] for one in (at, x, y, z)])
    if kind == kernel.CONE:
        sizes = shape.RefRadius(), shape.SemiAngle()
    elif kind == kernel.TORUS:
        sizes = shape.MajorRadius(), shape.MinorRadius()
    else:
        sizes = 0.0 if kind == kernel.PLANE else shape.Radius(), 0.0
    return kind, frame, np.array(sizes)
