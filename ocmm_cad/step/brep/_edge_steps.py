"""Library to kernel: polyline parameters along edges, surfaces as numbers; needs OCP."""

from __future__ import annotations

import math
from functools import cache
from typing import Any, TypeAlias

import numpy as np

from ocmm_cad.step.brep import _surface_kernel as kernel
from ocmm_cad.step.brep._library import SameShape, kind_of, static
from ocmm_core.geometry import Float

DEFLECTION_MM = 0.02
_MOST_CHORDS = 20_000
"""Of an arc: one that needs more is longer than 10 km, and no edge of a part."""
"""Bound of the deviation of polylines from edges."""
BEND_RAD = 0.1
Place: TypeAlias = tuple[float, float, float]
_NOWHERE: Place = (math.nan, math.nan, math.nan)


class EdgeSteps:
    """Parameters along edges, cached for all faces that meet in one."""

    def __init__(self) -> None:
        self._kept: dict[tuple[SameShape, float, float], tuple[Float, Place]] = {}

    def lookup(self, edge: Any, first: float, last: float) -> tuple[Float, Place]:
        """Return `edge_steps` (NaN if degenerate), and the place of the middle one, mm."""
        key = SameShape(edge), first, last
        kept = self._kept.get(key)
        if kept is None:
            along = edge_steps(edge, first, last)
            degenerated, adaptor, *_ = _tools()
            middle = _NOWHERE
            if not degenerated(edge):
                point = adaptor(edge).Value(float(along[len(along) // 2]))
                middle = (point.X(), point.Y(), point.Z())
            kept = self._kept[key] = along, middle
        return kept


@cache
def _tools() -> tuple[Any, Any, Any, Any, Any]:
    """Return the classes for edges, cached: there are tens of thousands of edges."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.GCPnts import GCPnts_TangentialDeflection
    from OCP.GeomAbs import GeomAbs_Circle, GeomAbs_Line

    degenerated = static(BRep_Tool, "Degenerated")
    return degenerated, BRepAdaptor_Curve, GCPnts_TangentialDeflection, GeomAbs_Line, GeomAbs_Circle


def edge_steps(edge: Any, first: float, last: float) -> Float:
    """Return an odd number of parameters along an edge between which it is nearly straight.

    Denser where a spline bends or its parameter runs fast. Both faces of an edge get the same ones.
    """
    degenerated, adaptor, bent_curve, line, circle = _tools()
    inner: list[float] = []
    curve = None if degenerated(edge) else adaptor(edge)
    kind = line if curve is None else curve.GetType()
    if curve is not None and kind == circle:
        ends = curve.FirstParameter(), curve.LastParameter()
        inner = np.linspace(*ends, chords_of(curve.Circle().Radius(), ends[1] - ends[0]) + 1)[
            1:-1
        ].tolist()
    elif curve is not None and kind != line:
        bent = bent_curve(curve, BEND_RAD, DEFLECTION_MM)
        inner = [bent.Parameter(index) for index in range(2, bent.NbPoints())]
    steps = np.array([first, *inner, last])
    if len(steps) % 2 == 0:
        # The middle one is needed, see Rim.
        half = len(steps) // 2
        middle = 0.5 * (steps[half - 1] + steps[half])
        steps = np.concatenate([steps[:half], [middle], steps[half:]])
    return steps


def chords_of(radius: float, turn: float) -> int:
    """Return the number of chords of an arc, limiting deflection and angle.

    A chord over the angle a is off by r (1 - cos(a / 2)). Above r = 1e14 mm the cosine is 1, a 0.
    """
    cosine = max(1.0 - DEFLECTION_MM / radius, 0.0) if radius > 0.0 else 0.0
    angle = min(BEND_RAD, 2.0 * math.acos(cosine))
    return max(1, math.ceil(abs(turn) / max(angle, abs(turn) / _MOST_CHORDS, 1e-9)))


def parameters_on(curve: Any, along: Float) -> Float:
    """Return the parameters (n, 2) of a face at ``along`` (n,) of an edge of it.

    Lines and circles are computed here. `curve`: `BRepAdaptor_Curve2d` of the edge on the face.
    """
    kind, numbers = curve_numbers(curve)
    if kind == kernel.LINE:
        start, way = np.array(numbers[:2]), np.array(numbers[2:4])
        on_line: Float = start + along[:, None] * way
        return on_line
    if kind == kernel.RING:
        middle, x, y = np.array(numbers).reshape(3, 2)
        on_ring: Float = middle + np.cos(along)[:, None] * x + np.sin(along)[:, None] * y
        return on_ring
    return np.array([(p.X(), p.Y()) for p in map(curve.Value, along.tolist())])


def curve_numbers(curve: Any) -> tuple[int, tuple[float, ...]]:
    """Return kind and six numbers of a curve on a face, see `_surface_kernel.run_along`."""
    _, _, _, straight, circle = _tools()
    kind = curve.GetType()
    if kind == straight:
        line = curve.Line()
        start, way = line.Location(), line.Direction()
        return kernel.LINE, (start.X(), start.Y(), way.X(), way.Y(), 0.0, 0.0)
    if kind == circle:
        ring = curve.Circle()
        radius, frame, middle = ring.Radius(), ring.Position(), ring.Location()
        # A reversed ring has its y reversed.
        x, y = frame.XDirection(), frame.YDirection()
        sides = (radius * x.X(), radius * x.Y(), radius * y.X(), radius * y.Y())
        return kernel.RING, (middle.X(), middle.Y(), *sides)
    return kernel.OTHER, (0.0,) * 6


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
