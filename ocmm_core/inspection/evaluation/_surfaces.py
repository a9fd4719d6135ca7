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
from ocmm_core.geometry import Float, unit
from ocmm_core.inspection.evaluation import _nearness as near
from ocmm_core.inspection.evaluation import _places as places
from ocmm_core.inspection.evaluation._nearness import Nearness
from ocmm_core.inspection.evaluation._places import Places

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
        return near.near_places(
            on_it(nominal, np.zeros(3), axis, sign, _OUTLINE), arm, axis, radius
        )

    return SurfaceSpec(on_it, nearness_to)


_AROUND = SurfaceSpec(places.around_axis, near.near_axis)
_RECTANGLE = _outline(places.on_rectangle)

SURFACES = {
    Shape.POINT: SurfaceSpec(places.at_point, near.near_point),
    Shape.LINE: SurfaceSpec(places.along_line, near.near_line),
    Shape.PLANE: SurfaceSpec(places.on_plane, near.near_plane),
    Shape.CIRCLE: _AROUND,
    Shape.SPHERE: SurfaceSpec(places.on_cap, near.near_sphere),
    Shape.CYLINDER: _AROUND,
    Shape.ELLIPSE: _outline(places.on_ellipse),
    Shape.ROUND_SLOT: _outline(places.on_round_slot),
    Shape.SQUARE_SLOT: _RECTANGLE,
    Shape.RECTANGLE: _RECTANGLE,
    Shape.CONE: _AROUND,
    Shape.TORUS: SurfaceSpec(places.on_torus, near.near_torus),
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
