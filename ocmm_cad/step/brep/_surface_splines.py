"""The surface of a face as one rational B-spline over the range of the face.

Planes, cylinders, cones, spheres, tori, and surfaces turned or extruded from a line, an arc or a
spline are exact. Two functions lead from the library's parameters to those of the spline, because
an arc of a rational spline has no constant speed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from ocmm_cad.step.brep._library import kind_of, static, vector
from ocmm_core.geometry import Float
from ocmm_core.part_model import SplineSurface

_MOST_POLES = 250_000
_WIDEST = 0.5 * np.pi
Map: TypeAlias = Callable[[Float], Float]


@dataclass(frozen=True, slots=True)
class _Row:
    """A curve as a rational B-spline: poles (n, k), weights (n,), knots with repetitions."""

    poles: Float
    weights: Float
    knots: Float
    degree: int
    map: Map


@dataclass(frozen=True, slots=True)
class MappedSurface:
    """A spline, and the maps from the parameters of the library to its own."""

    spline: SplineSurface
    map_u: Map
    map_v: Map
    is_exact: bool
    """By construction; else it must be checked on points of the face."""


def surface_of(surface: Any, bounds: tuple[float, float, float, float]) -> MappedSurface | None:
    """Return the spline of a surface; None if impossible.

    `surface`: placed `BRepAdaptor_Surface` of a face. `bounds`: first and last u, v.
    """
    return _MAKERS.get(kind_of(surface), _by_library)(surface, *bounds)


def _plane(surface: Any, u0: float, u1: float, v0: float, v1: float) -> MappedSurface:
    frame = surface.Plane().Position()
    origin, x, y = (
        vector(one) for one in (frame.Location(), frame.XDirection(), frame.YDirection())
    )
    u, v = _line(u0, u1), _line(v0, v1)
    return _tensor(origin + u.poles[:, None] * x + v.poles[None] * y, u, v)


def _turned(frame: Any, u: _Row, v: _Row) -> MappedSurface:
    """Return the surface of a profile ``v`` of (radius, height) turned about the axis."""
    origin, x, y, z = (
        vector(one)
        for one in (
            frame.Location(), frame.XDirection(), frame.YDirection(), frame.Direction()
        )
    )  # fmt: skip
    ring = u.poles[:, :1] * x + u.poles[:, 1:] * y
    radii, heights = v.poles[:, 0], v.poles[:, 1]
    return _tensor(origin + radii[None, :, None] * ring[:, None] + heights[:, None] * z, u, v)


def _cylinder(surface: Any, u0: float, u1: float, v0: float, v1: float) -> MappedSurface:
    cylinder = surface.Cylinder()
    line = _line(v0, v1)
    profile = np.concatenate([np.full((2, 1), cylinder.Radius()), line.poles], axis=1)
    return _turned(cylinder.Position(), _arc(u0, u1), _with_poles(line, profile))


def _cone(surface: Any, u0: float, u1: float, v0: float, v1: float) -> MappedSurface:
    cone = surface.Cone()
    line, half = _line(v0, v1), cone.SemiAngle()
    profile = np.concatenate(
        [cone.RefRadius() + line.poles * np.sin(half), line.poles * np.cos(half)], axis=1
    )
    return _turned(cone.Position(), _arc(u0, u1), _with_poles(line, profile))


def _sphere(surface: Any, u0: float, u1: float, v0: float, v1: float) -> MappedSurface:
    ball, arc = surface.Sphere(), _arc(v0, v1)
    return _turned(ball.Position(), _arc(u0, u1), _with_poles(arc, ball.Radius() * arc.poles))


def _torus(surface: Any, u0: float, u1: float, v0: float, v1: float) -> MappedSurface:
    ring, arc = surface.Torus(), _arc(v0, v1)
    profile = ring.MinorRadius() * arc.poles + [ring.MajorRadius(), 0.0]
    return _turned(ring.Position(), _arc(u0, u1), _with_poles(arc, profile))


def _revolution(surface: Any, u0: float, u1: float, v0: float, v1: float) -> MappedSurface | None:
    profile = _curve(surface.BasisCurve(), v0, v1)
    if profile is None:
        return None
    axis = surface.AxeOfRevolution()
    origin, along = vector(axis.Location()), vector(axis.Direction())
    u = _arc(u0, u1)
    arms = profile.poles - origin
    feet = (arms @ along)[:, None] * along
    arms -= feet
    turned = np.cross(along, arms)
    poles = (origin + feet) + u.poles[:, :1, None] * arms + u.poles[:, 1:, None] * turned
    return _tensor(poles, u, profile, is_exact=False)


def _extrusion(surface: Any, u0: float, u1: float, v0: float, v1: float) -> MappedSurface | None:
    profile = _curve(surface.BasisCurve(), u0, u1)
    if profile is None:
        return None
    line = _line(v0, v1)
    poles = profile.poles[:, None] + line.poles[None] * vector(surface.Direction())
    return _tensor(poles, profile, line, is_exact=False)


def _by_library(surface: Any, u0: float, u1: float, v0: float, v1: float) -> MappedSurface | None:
    """Return a spline of the library; for an offset surface it is approximate."""
    from OCP.Geom import Geom_RectangularTrimmedSurface
    from OCP.GeomConvert import GeomConvert

    plain = surface.GeomSurfaceTransformed()
    is_its_own = type(plain).__name__ == "Geom_BSplineSurface"
    if is_its_own:
        spline = plain.Copy()
    else:
        trimmed = Geom_RectangularTrimmedSurface(plain, u0, u1, v0, v1)
        spline = static(GeomConvert, "SurfaceToBSplineSurface")(trimmed)
    if spline is None or type(spline).__name__ != "Geom_BSplineSurface":
        return None
    if spline.IsUPeriodic() or spline.IsVPeriodic():
        is_its_own = False
        spline.Segment(u0, u1, v0, v1)
        if spline.IsUPeriodic():
            spline.SetUNotPeriodic()
        if spline.IsVPeriodic():
            spline.SetVNotPeriodic()
    elif not _is_clamped(spline):
        # A part holds clamped splines only: this one is, after clipping to its range.
        is_its_own = False
        spline.Segment(
            max(u0, spline.UKnot(spline.FirstUKnotIndex())),
            min(u1, spline.UKnot(spline.LastUKnotIndex())),
            max(v0, spline.VKnot(spline.FirstVKnotIndex())),
            min(v1, spline.VKnot(spline.LastVKnotIndex())),
        )
    rows, columns = spline.NbUPoles(), spline.NbVPoles()
    if rows * columns > _MOST_POLES:
        return None
    places = [(i, j) for i in range(1, rows + 1) for j in range(1, columns + 1)]
    poles = np.array([_triple(spline.Pole(i, j)) for i, j in places]).reshape(rows, columns, 3)
    weights = np.ones((rows, columns))
    if spline.IsURational() or spline.IsVRational():
        weights = np.array([spline.Weight(i, j) for i, j in places]).reshape(rows, columns)
    degree_u, degree_v = spline.UDegree(), spline.VDegree()
    knots_u = _knots(spline.NbUKnots(), spline.UKnot, spline.UMultiplicity, degree_u)
    knots_v = _knots(spline.NbVKnots(), spline.VKnot, spline.VMultiplicity, degree_v)
    if len(knots_u) != rows + degree_u + 1 or len(knots_v) != columns + degree_v + 1:
        return None
    if not np.isfinite(poles).all():
        return None
    made = SplineSurface(poles, weights, knots_u, knots_v, degree_u, degree_v)
    map_u = _shifted(u0, u1, float(knots_u[0]), float(knots_u[-1]))
    map_v = _shifted(v0, v1, float(knots_v[0]), float(knots_v[-1]))
    # Unchanged with its own parameters: nothing to check.
    within = (
        knots_u[0] <= u0 and u1 <= knots_u[-1] and knots_v[0] <= v0 and v1 <= knots_v[-1]
    )  # fmt: skip
    return MappedSurface(made, map_u, map_v, is_exact=bool(is_its_own and within))


def _is_clamped(spline: Any) -> bool:
    u, v = spline.UDegree() + 1, spline.VDegree() + 1
    return bool(
        spline.UMultiplicity(1) == u
        and spline.UMultiplicity(spline.NbUKnots()) == u
        and spline.VMultiplicity(1) == v
        and spline.VMultiplicity(spline.NbVKnots()) == v
    )


_MAKERS: dict[str, Callable[[Any, float, float, float, float], MappedSurface | None]] = {
    "Plane": _plane,
    "Cylinder": _cylinder,
    "Cone": _cone,
    "Sphere": _sphere,
    "Torus": _torus,
    "SurfaceOfRevolution": _revolution,
    "SurfaceOfExtrusion": _extrusion,
}


def _tensor(poles: Float, u: _Row, v: _Row, is_exact: bool = True) -> MappedSurface:
    weights = u.weights[:, None] * v.weights
    spline = SplineSurface(poles, weights, u.knots, v.knots, u.degree, v.degree)
    return MappedSurface(spline, u.map, v.map, is_exact)


def _line(first: float, last: float) -> _Row:
    ends = np.array([first, last])
    return _Row(ends[:, None], np.ones(2), np.repeat(ends, 2), 1, lambda at: at)


def _arc(first: float, last: float) -> _Row:
    """Return the arc of a unit circle between two angles, rad.

    In segments of at most a quarter, each the quadratic with the weights 1, cos a, 1 where a is
    half its angle (Piegl and Tiller, The NURBS Book, 7.3). With the angle p from its middle its
    parameter is t = (1 + tan(p / 2) / tan(a / 2)) / 2: a circle's rational parameter is the tangent
    of half the angle, and a Moebius map that keeps both ends and the middle is linear.
    """
    count = max(1, int(np.ceil((last - first) / _WIDEST - 1e-9)))
    ends = np.linspace(first, last, count + 1)
    half = 0.5 * (last - first) / count
    angles = np.empty(2 * count + 1)
    angles[::2], angles[1::2] = ends, 0.5 * (ends[1:] + ends[:-1])
    weights = np.ones(2 * count + 1)
    weights[1::2] = np.cos(half)
    poles = np.stack([np.cos(angles), np.sin(angles)], axis=1) / weights[:, None]
    knots = np.repeat(ends, [3, *([2] * (count - 1)), 3])

    def to_spline(at: Float) -> Float:
        at = np.clip(at, first, last)
        span = np.clip(((at - first) / (2.0 * half)).astype(np.int64), 0, count - 1)
        from_middle = at - (first + (2 * span + 1) * half)
        share = 0.5 * (1.0 + np.tan(0.5 * from_middle) / np.tan(0.5 * half))
        mapped: Float = np.clip(first + 2.0 * half * (span + share), first, last)
        return mapped

    return _Row(poles, weights, knots, 2, to_spline)


def _with_poles(row: _Row, poles: Float) -> _Row:
    return _Row(poles, row.weights, row.knots, row.degree, row.map)


def _curve(curve: Any, first: float, last: float) -> _Row | None:
    from OCP.Geom import Geom_TrimmedCurve
    from OCP.GeomAdaptor import GeomAdaptor
    from OCP.GeomConvert import GeomConvert

    kind = kind_of(curve)
    if kind == "Line":
        line, row = curve.Line(), _line(first, last)
        along = vector(line.Direction())
        return _with_poles(row, vector(line.Location()) + row.poles * along)
    if kind in ("Circle", "Ellipse"):
        ring = getattr(curve, kind)()
        frame = ring.Position()
        sizes = (ring.Radius(), ring.Radius()) if kind == "Circle" else (
            ring.MajorRadius(), ring.MinorRadius()
        )  # fmt: skip
        row = _arc(first, last)
        x, y = sizes[0] * vector(frame.XDirection()), sizes[1] * vector(frame.YDirection())
        poles = vector(frame.Location()) + row.poles[:, :1] * x + row.poles[:, 1:] * y
        return _with_poles(row, poles)
    plain = curve.BSpline() if kind == "BSplineCurve" else None
    if plain is None:
        trimmed = Geom_TrimmedCurve(static(GeomAdaptor, "MakeCurve")(curve), first, last)
        plain = static(GeomConvert, "CurveToBSplineCurve")(trimmed)
    if plain.IsPeriodic():
        plain = plain.Copy()
        plain.Segment(first, last)
        if plain.IsPeriodic():
            plain.SetNotPeriodic()
    degree, count = plain.Degree(), plain.NbPoles()
    knots = _knots(plain.NbKnots(), plain.Knot, plain.Multiplicity, degree)
    if len(knots) != count + degree + 1 or count > _MOST_POLES // 4:
        return None
    poles = np.array([_triple(plain.Pole(index)) for index in range(1, count + 1)])
    weights = np.array([plain.Weight(index) for index in range(1, count + 1)])
    to_spline = _shifted(first, last, float(knots[0]), float(knots[-1]))
    return _Row(poles, weights, knots, degree, to_spline)


def _knots(
    count: int, knot: Callable[[int], float], often: Callable[[int], int], degree: int
) -> Float:
    """Return knots with their repetitions; surplus ones at the ends are removed."""
    numbers = range(1, count + 1)
    return np.repeat([knot(index) for index in numbers], [often(index) for index in numbers])


def _shifted(first: float, last: float, low: float, high: float) -> Map:
    """Return the map onto an equal range, or one that differs by start or length.

    Parameters inside the spline's range are kept; periodic ones come shifted by whole periods.
    """
    spare = 1e-6 * (high - low)
    if first >= low - spare and last <= high + spare:
        return lambda at: np.clip(at, low, high)
    if abs((high - low) - (last - first)) <= spare:
        return lambda at: np.clip(at + (low - first), low, high)
    return lambda at: low + (at - first) * (high - low) / (last - first)


def _triple(point: Any) -> tuple[float, float, float]:
    return (point.X(), point.Y(), point.Z())
