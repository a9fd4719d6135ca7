"""Nominal surface of a feature: where to touch it, and the distance of a ball from it.

In the frame of the plan's nominals. A feature's ``point`` is the middle of the touched region: of
the length of a line, cylinder or cone, of the area of a plane. `SURFACES` has one entry per shape.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float, perpendicular_pair, unit
from ocmm_core.inspection.evaluation import _places as places
from ocmm_core.inspection.evaluation._places import Places, across_of

_DEEP_MM = 10.0


@dataclass(frozen=True, slots=True)
class Nearness:
    """Position of a ball relative to a nominal surface."""

    gap: float
    """mm: from the ball's surface to the nominal one; zero in contact."""
    normal: Float
    """(3,), unit: from the material towards the probe, at the nearest place; zero for a line."""


def near_point(
    nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
) -> Nearness:
    return Nearness(float(np.linalg.norm(arm - radius * axis)), axis)


def near_line(
    nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
) -> Nearness:
    """Return the nearness to a line, on either face."""
    height, reach, _ = _about_axis(arm, axis)
    beyond = _beyond(abs(height), 0.5 * nominal.length)
    return Nearness(float(np.hypot(abs(reach - radius), beyond)), np.zeros(3))


def near_plane(
    nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
) -> Nearness:
    """Return the nearness to a plane within its planned extent."""
    height = float(arm @ axis)
    along = across_of(nominal)
    beyond_u = _beyond(abs(float(arm @ along)), 0.5 * nominal.length)
    beyond_v = _beyond(abs(float(arm @ np.cross(axis, along))), 0.5 * nominal.width)
    return Nearness(float(np.linalg.norm([height - radius, beyond_u, beyond_v])), axis)


def near_axis(
    nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
) -> Nearness:
    height, reach, outward = _about_axis(arm, axis)
    half, flat = np.radians(0.5 * nominal.angle_deg), nominal.shape.spec.is_flat
    free = _DEEP_MM if flat else 0.5 * nominal.length + radius
    beyond = _beyond(abs(height), free) if flat or nominal.length > 0.0 else 0.0
    surface = 0.5 * nominal.diameter + height * np.tan(half)
    gap = (reach - surface) * np.cos(half) - sign * radius
    normal = sign * (np.cos(half) * outward - np.sin(half) * axis)
    return Nearness(float(np.hypot(gap, beyond)), normal)


def near_sphere(
    nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
) -> Nearness:
    far = float(np.linalg.norm(arm))
    gap = far - 0.5 * nominal.diameter - sign * radius
    return Nearness(abs(gap), sign * arm / max(far, 1e-9))


def near_torus(
    nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
) -> Nearness:
    ring = arm - 0.5 * nominal.diameter * _about_axis(arm, axis)[2]
    far = float(np.linalg.norm(ring))
    return Nearness(abs(far - 0.5 * nominal.width - sign * radius), sign * ring / max(far, 1e-9))


def near_places(places: Places, arm: Float, axis: Float, radius: float) -> Nearness:
    """Return the nearness to an outline given by many places about the feature's point."""
    height = float(arm @ axis)
    offsets = arm - height * axis - (places.points + radius * places.normals)
    nearest = int(np.argmin(np.sum(offsets**2, axis=1)))
    beyond = _beyond(abs(height), _DEEP_MM)
    gap = float(np.hypot(np.linalg.norm(offsets[nearest]), beyond))
    return Nearness(gap, places.normals[nearest])


def _about_axis(arm: Float, axis: Float) -> tuple[float, float, Float]:
    """Return height along an axis, distance from it, and the unit vector (3,) away from it."""
    height = float(arm @ axis)
    flat = arm - height * axis
    reach = float(np.linalg.norm(flat))
    outward: Float = flat / reach if reach > 1e-9 else perpendicular_pair(axis)[0]
    return height, reach, outward


def _beyond(distance: float, half: float) -> float:
    """Return the distance outside a stretch of half length ``half``; 0 if unbounded."""
    return max(distance - half, 0.0) if half > 0.0 else 0.0


_OUTLINE = 200
_ON_IT_MM = 0.05
"""mm: a target farther from the surface belongs to another one."""

PlacesOf: TypeAlias = Callable[[NominalFeature, Float, Float, float, int], Places]
"""From a feature, its point (3,), its direction (3,), 1 or -1 for outer or inner, and a count."""
NearnessTo: TypeAlias = Callable[[NominalFeature, Float, Float, float, float], Nearness]
"""From a feature, the arm (3,) of a ball from its point, its direction (3,), 1 or -1 for outer or
inner, and the radius of the ball, mm."""


@dataclass(frozen=True, slots=True)
class SurfaceSpec:
    places: PlacesOf
    nearness: NearnessTo


def _outline(on_it: PlacesOf) -> SurfaceSpec:
    def nearness_to(
        nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
    ) -> Nearness:
        return near_places(on_it(nominal, np.zeros(3), axis, sign, _OUTLINE), arm, axis, radius)

    return SurfaceSpec(on_it, nearness_to)


_AROUND = SurfaceSpec(places.around_axis, near_axis)
_RECTANGLE = _outline(places.on_rectangle)

SURFACES = {
    Shape.POINT: SurfaceSpec(places.at_point, near_point),
    Shape.LINE: SurfaceSpec(places.along_line, near_line),
    Shape.PLANE: SurfaceSpec(places.on_plane, near_plane),
    Shape.CIRCLE: _AROUND,
    Shape.SPHERE: SurfaceSpec(places.on_cap, near_sphere),
    Shape.CYLINDER: _AROUND,
    Shape.ELLIPSE: _outline(places.on_ellipse),
    Shape.ROUND_SLOT: _outline(places.on_round_slot),
    Shape.SQUARE_SLOT: _RECTANGLE,
    Shape.RECTANGLE: _RECTANGLE,
    Shape.CONE: _AROUND,
    Shape.TORUS: SurfaceSpec(places.on_torus, near_torus),
}


def places_of(nominal: NominalFeature, count: int) -> Places:
    """Return ``count`` places on the nominal surface.

    The targets of the plan, maybe fewer; places spread over it if there are none, or if one is off
    the surface, changed since.
    """
    named = _named(nominal, count)
    if named is not None:
        return named
    axis, centre = unit(np.array(nominal.direction)), np.array(nominal.point)
    return SURFACES[nominal.shape].places(nominal, centre, axis, _sign(nominal), count)


def nearness(nominal: NominalFeature, ball: Float, radius: float) -> Nearness:
    """Return the nearness of a ball at ``ball`` (3,), mm, with ``radius``, mm, to the surface.

    A circle is a bore or shaft: depth counts beyond ten millimetres. Lengths bound the surface.
    """
    arm, axis = ball - np.array(nominal.point), unit(np.array(nominal.direction))
    return SURFACES[nominal.shape].nearness(nominal, arm, axis, _sign(nominal), radius)


def _named(nominal: NominalFeature, count: int) -> Places | None:
    """Return the targets of the plan; None without usable ones."""
    if not nominal.targets:
        return None
    points = np.array(nominal.targets)
    # Radius 0: distance from the surface itself.
    found = [nearness(nominal, point, 0.0) for point in points]
    if not all(one.gap <= _ON_IT_MM for one in found):
        return None
    return Places(points[:count], np.array([one.normal for one in found])[:count])


def _sign(nominal: NominalFeature) -> float:
    return 1.0 if nominal.side == "outer" else -1.0
