"""Check of targets by the library's own classifier; needs OCP."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ocmm_cad.step.brep._library import static
from ocmm_core.geometry import Float

_OFF_MM = 0.02
"""A target farther from its face is wrong: more than the deviation of a recognised spline."""
_ON_EDGE = 1e-7


class FaceCheck:
    """Whether places lie on faces, numbered from 1, inside edges, by surface and classifier."""

    def __init__(self, faces: Sequence[Any]) -> None:
        self._faces = faces

    def inside(self, numbers: Sequence[int], points: Float) -> NDArray[np.bool_]:
        """Return which of the points (n, 3), mm, lie on any of the faces and inside its edges."""
        found = np.zeros(len(points), dtype=np.bool_)
        for number in numbers:
            left = np.flatnonzero(~found)
            if not len(left):
                break
            found[left] = _inside(self._faces[number - 1], points[left])
        return found


def _inside(face: Any, points: Float) -> NDArray[np.bool_]:
    from OCP.BRep import BRep_Tool
    from OCP.BRepClass import BRepClass_FaceClassifier
    from OCP.BRepTools import BRepTools
    from OCP.gp import gp_Pnt, gp_Pnt2d
    from OCP.ShapeAnalysis import ShapeAnalysis_Surface
    from OCP.TopAbs import TopAbs_IN

    plain = static(BRep_Tool, "Surface")(face)
    surface = ShapeAnalysis_Surface(plain)
    u0, _, v0, _ = static(BRepTools, "UVBounds")(face)
    u_period = plain.UPeriod() if plain.IsUPeriodic() else 0.0
    v_period = plain.VPeriod() if plain.IsVPeriodic() else 0.0
    found = np.zeros(len(points), dtype=np.bool_)
    for row, (x, y, z) in enumerate(points.tolist()):
        at = surface.ValueOfUV(gp_Pnt(x, y, z), _ON_EDGE)
        if surface.Gap() > _OFF_MM:
            continue
        u, v = _from(at.X(), u0, u_period), _from(at.Y(), v0, v_period)
        asked = BRepClass_FaceClassifier(face, gp_Pnt2d(u, v), _ON_EDGE)
        found[row] = asked.State() == TopAbs_IN
    return found


def _from(value: float, start: float, period: float) -> float:
    """Return a parameter in the period that begins where the face does."""
    if period <= 0.0:
        return value
    return start + (value - start + _ON_EDGE) % period - _ON_EDGE
