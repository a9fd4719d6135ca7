"""The nominal surface of a feature: where to touch it, and how far a ball is from it.

All is in the frame of the plan's nominals. The ``point`` of a feature is the middle of what is
touched: of the length of a line, cylinder or cone, of the area of a plane. `SURFACES` is the
registry: one entry a shape.
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
    """How a ball lies to a nominal surface."""

    gap: float
    """mm: from the ball's surface to the nominal one; zero where it touches."""
    normal: Float
    """(3,), unit: from the material towards the probe, at the nearest place; zero for a line."""


def near_point(
    nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
) -> Nearness:
    """Return how a ball lies to a point."""
    return Nearness(float(np.linalg.norm(arm - radius * axis)), axis)


def near_line(
    nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
) -> Nearness:
    """Return how a ball lies to a line, on whichever face."""
    height, reach, _ = _about_axis(arm, axis)
    beyond = _beyond(abs(height), 0.5 * nominal.length)
    return Nearness(float(np.hypot(abs(reach - radius), beyond)), np.zeros(3))


def near_plane(
    nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
) -> Nearness:
    """Return how a ball lies to a plane, as far as the plan says it reaches."""
    height = float(arm @ axis)
    along = across_of(nominal)
    beyond_u = _beyond(abs(float(arm @ along)), 0.5 * nominal.length)
    beyond_v = _beyond(abs(float(arm @ np.cross(axis, along))), 0.5 * nominal.width)
    return Nearness(float(np.linalg.norm([height - radius, beyond_u, beyond_v])), axis)


def near_axis(
    nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
) -> Nearness:
    """Return how a ball lies to a circle, cylinder or cone."""
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
    """Return how a ball lies to a sphere."""
    far = float(np.linalg.norm(arm))
    gap = far - 0.5 * nominal.diameter - sign * radius
    return Nearness(abs(gap), sign * arm / max(far, 1e-9))


def near_torus(
    nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
) -> Nearness:
    """Return how a ball lies to the tube of a torus."""
    ring = arm - 0.5 * nominal.diameter * _about_axis(arm, axis)[2]
    far = float(np.linalg.norm(ring))
    return Nearness(abs(far - 0.5 * nominal.width - sign * radius), sign * ring / max(far, 1e-9))


def near_places(places: Places, arm: Float, axis: Float, radius: float) -> Nearness:
    """Return how a ball lies to an outline that is known by many places on it.

    Parameters
    ----------
    places
        About the point of the feature.
    """
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
    """Return how far outside a stretch of half length ``half`` something is; 0 unbounded."""
    return max(distance - half, 0.0) if half > 0.0 else 0.0


_OUTLINE = 200
_ON_IT_MM = 0.05
"""A target that is farther from the surface is one of another surface."""

PlacesOf: TypeAlias = Callable[[NominalFeature, Float, Float, float, int], Places]
"""From a feature, its point (3,), its direction (3,), 1 or -1 for outer or inner, and a count."""
NearnessTo: TypeAlias = Callable[[NominalFeature, Float, Float, float, float], Nearness]
"""From a feature, the arm (3,) of a ball from its point, its direction (3,), 1 or -1 for outer or
inner, and the radius of the ball, mm."""


@dataclass(frozen=True, slots=True)
class SurfaceSpec:
    """The nominal surface of one shape."""

    places: PlacesOf
    """Where to touch it."""
    nearness: NearnessTo
    """How a ball lies to it."""


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
"""The entries."""


def places_of(nominal: NominalFeature, count: int) -> Places:
    """Return ``count`` places on the nominal surface.

    Those that the plan names, fewer where it names fewer; where it names none, or where one of
    them is not on the surface any more, because the surface was changed since, spread over it.
    """
    named = _named(nominal, count)
    if named is not None:
        return named
    axis, centre = unit(np.array(nominal.direction)), np.array(nominal.point)
    return SURFACES[nominal.shape].places(nominal, centre, axis, _sign(nominal), count)


def nearness(nominal: NominalFeature, ball: Float, radius: float) -> Nearness:
    """Return how a ball at ``ball`` (3,), mm, with ``radius``, mm, lies to the nominal surface.

    A circle is the bore or shaft that it is touched in: how deep does not count up to ten
    millimetres. What the plan says about lengths bounds the surface, else it has no end.
    """
    arm, axis = ball - np.array(nominal.point), unit(np.array(nominal.direction))
    return SURFACES[nominal.shape].nearness(nominal, arm, axis, _sign(nominal), radius)


def _named(nominal: NominalFeature, count: int) -> Places | None:
    """Return the places that the plan names; None where there are none to be used."""
    if not nominal.targets:
        return None
    points = np.array(nominal.targets)
    # As small a ball as can be: the surface itself is asked for.
    found = [nearness(nominal, point, 0.0) for point in points]
    if not all(one.gap <= _ON_IT_MM for one in found):
        return None
    return Places(points[:count], np.array([one.normal for one in found])[:count])


def _sign(nominal: NominalFeature) -> float:
    return 1.0 if nominal.side == "outer" else -1.0
