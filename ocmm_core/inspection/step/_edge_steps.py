"""Where along an edge its line has corners; needs OCP."""

from __future__ import annotations

from typing import Any

import numpy as np

from ocmm_core.geometry import Float
from ocmm_core.inspection.step._library import SameShape, static

_DEFLECTION_MM = 0.02
"""Edges become lines that are off by no more."""
_BEND_RAD = 0.1


class EdgeSteps:
    """Parameters along edges, found once for all faces that meet in one."""

    def __init__(self) -> None:
        self._kept: dict[tuple[SameShape, float, float], Float] = {}

    def of(self, edge: Any, first: float, last: float) -> Float:
        """Return what `edge_steps` does."""
        key = SameShape(edge), first, last
        kept = self._kept.get(key)
        if kept is None:
            kept = self._kept[key] = edge_steps(edge, first, last)
        return kept


def edge_steps(edge: Any, first: float, last: float) -> Float:
    """Return parameters along an edge between which it is nearly straight, an odd number.

    Of a spline they stand closer where it bends, or where its parameter runs fast: evenly, the
    line would leave the edge there. An edge of two faces gets the same ones on both.
    """
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.GCPnts import GCPnts_TangentialDeflection
    from OCP.GeomAbs import GeomAbs_Circle, GeomAbs_Line

    inner: list[float] = []
    curve = None if static(BRep_Tool, "Degenerated")(edge) else BRepAdaptor_Curve(edge)
    if curve is not None and curve.GetType() != GeomAbs_Line:
        bent = GCPnts_TangentialDeflection(curve, _BEND_RAD, _DEFLECTION_MM)
        if curve.GetType() == GeomAbs_Circle:
            ends = curve.FirstParameter(), curve.LastParameter()
            inner = np.linspace(*ends, bent.NbPoints())[1:-1].tolist()
        else:
            inner = [bent.Parameter(index) for index in range(2, bent.NbPoints())]
    steps = np.array([first, *inner, last])
    if len(steps) % 2 == 0:
        # The one in the middle is needed, see Rim.
        half = len(steps) // 2
        middle = 0.5 * (steps[half - 1] + steps[half])
        steps = np.concatenate([steps[:half], [middle], steps[half:]])
    return steps


def parameters_on(curve: Any, along: Float) -> Float:
    """Return the parameters (n, 2) of a face at ``along`` (n,) of an edge of it.

    Lines and circles, which most edges are, are written out; the library is asked for others.

    Parameters
    ----------
    curve
        `BRepAdaptor_Curve2d` of the edge on the face.
    """
    from OCP.GeomAbs import GeomAbs_Circle, GeomAbs_Line

    kind = curve.GetType()
    if kind == GeomAbs_Line:
        line = curve.Line()
        start, way = line.Location(), line.Direction()
        return _pair(start) + along[:, None] * _pair(way)
    if kind == GeomAbs_Circle:
        ring = curve.Circle()
        radius, frame = ring.Radius(), ring.Position()
        # A ring that runs the other way has its y the other way.
        x, y = radius * _pair(frame.XDirection()), radius * _pair(frame.YDirection())
        turned: Float = np.cos(along)[:, None] * x + np.sin(along)[:, None] * y
        return _pair(ring.Location()) + turned
    return np.array([(p.X(), p.Y()) for p in map(curve.Value, along.tolist())])


def _pair(point: Any) -> Float:
    return np.array([point.X(), point.Y()])
