"""Touch layouts on a sphere about a pole, and assignment of points to places.

The qualification uses ISO 10360-5 (25 points over half a sphere). The quick check concentrates on
the diameter: on the equator, left and right as seen by the cameras, the most accurate directions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import scipy

from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, Int, Points3, perpendicular_pair, unit

Rings: TypeAlias = tuple[tuple[float, int, float], ...]
"""Angle below the pole, places around it, and azimuth of the first one; degrees."""

QUALIFICATION_RINGS: Rings = (
    (0.0, 1, 0.0), (22.5, 4, 0.0), (45.0, 8, 22.5), (67.5, 4, 45.0), (90.0, 8, 67.5)
)  # fmt: skip
"""ISO 10360-5: 1, 4, 8, 4 and 8 points, each ring turned by 22.5 degrees against the one above."""

CHECK_RINGS: Rings = ((0.0, 1, 0.0), (90.0, 8, 0.0), (90.0, 2, 12.0), (90.0, 2, -12.0))
"""Four more to the left and right halve the uncertainty for the effort of half the points."""

TOLERANCE = np.radians(15.0)
"""Places are hit by hand to about 3 mm on a sphere of 30 mm."""

CONE_LEAN = np.radians(25.0)
"""Farther back, the LEDs would turn away from the cameras."""

CONE_TOLERANCE = np.radians(12.0)
"""Half the angle between two attitudes."""

_SIDES = (
    "right", "back right", "back", "back left", "left", "front left", "front", "front right"
)  # fmt: skip
_CONE_NAMES = (
    "upright", "leaning right", "leaning left", "leaning away from the cameras",
    "leaning towards the cameras",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Layout:
    """Wanted directions with their names."""

    names: tuple[str, ...]
    directions: Points3
    """(n, 3): unit vectors, world."""


@dataclass(frozen=True, slots=True)
class LayoutFrame:
    """Frame of a layout; unit vectors (3,), world, right-handed."""

    right: Float
    """Across the view of the cameras."""
    back: Float
    """Away from them."""
    pole: Float
    """Start of the layout."""


def frame_about(pole: Float, rig: Rig) -> LayoutFrame:
    """Return the frame about a pole as seen by the cameras of a rig."""
    top = unit(np.asarray(pole, dtype=np.float64))
    centres = np.array([camera.centre_world for camera in rig.cameras])
    across = np.linalg.svd(centres - centres.mean(axis=0))[2][0]
    across = across - (across @ top) * top
    right = (
        unit(across) if np.linalg.norm(across) > 1e-3 else np.asarray(perpendicular_pair(top)[0])
    )
    away = rig.volume_world.mean(axis=0) - centres.mean(axis=0)
    if np.cross(top, right) @ away < 0.0:
        right = -right
    return LayoutFrame(right, np.cross(top, right), top)


def sphere_layout(rings: Rings, frame: LayoutFrame) -> Layout:
    """Return the places of rings about a pole."""
    names, directions = [], []
    for polar, count, turn in rings:
        for azimuth in turn + 360.0 * np.arange(count) / count:
            p, a = np.radians(polar), np.radians(azimuth)
            directions.append(
                np.sin(p) * (np.cos(a) * frame.right + np.sin(a) * frame.back)
                + np.cos(p) * frame.pole
            )
            names.append(place_name(directions[-1], frame))
    return Layout(tuple(names), np.array(directions))


def place_name(direction: Float, frame: LayoutFrame) -> str:
    """Return a direction in words, as seen from the cameras."""
    polar = float(np.degrees(np.arccos(np.clip(direction @ frame.pole, -1.0, 1.0))))
    if polar < 5.0:
        return "at the pole"
    azimuth = float(np.degrees(np.arctan2(direction @ frame.back, direction @ frame.right)))
    # A tie between two sides gives the next one, independent of rounding.
    side = _SIDES[int(np.floor(azimuth / 45.0 + 0.5 + 1e-6)) % 8]
    ring = "at the equator" if abs(polar - 90.0) < 5.0 else f"{polar:.0f} degrees below the pole"
    return f"{ring}, {side}"


def round_equator(frame: LayoutFrame, count: int = 24) -> Points3:
    """Return directions (count, 3) all around the equator."""
    angle = 2.0 * np.pi * np.arange(count) / count
    around: Points3 = np.outer(np.cos(angle), frame.right) + np.outer(np.sin(angle), frame.back)
    return around


def cone_layout(frame: LayoutFrame) -> Layout:
    """Return five directions of the handle: upright and leaning to all sides."""
    sine, cosine = np.sin(CONE_LEAN), np.cos(CONE_LEAN)
    leaning = [frame.right, -frame.right, frame.back, -frame.back]
    directions = [frame.pole, *(sine * side + cosine * frame.pole for side in leaning)]
    return Layout(_CONE_NAMES, np.array(directions))


def match_places(directions: Points3, layout: Layout, tolerance: float = TOLERANCE) -> Int:
    """Return the place of each direction (n, 3), -1 if none, once each: least squared angles."""
    places = np.full(len(directions), -1, dtype=np.int64)
    if not len(directions):
        return places
    angles = np.arccos(np.clip(directions @ layout.directions.T, -1.0, 1.0))
    # Pairs beyond the tolerance must cost more than any number of pairs within it.
    costs = np.where(angles <= tolerance, angles**2, 1e3 * tolerance**2)
    rows, columns = scipy.optimize.linear_sum_assignment(costs)
    near = angles[rows, columns] <= tolerance
    places[rows[near]] = columns[near]
    return places


def points_of_places(places: Int, count: int) -> tuple[int | None, ...]:
    """Return for each of ``count`` places the index of the point there, or None."""
    found: list[int | None] = [None] * count
    for point, place in enumerate(places.tolist()):
        if place >= 0:
            found[place] = point
    return tuple(found)
