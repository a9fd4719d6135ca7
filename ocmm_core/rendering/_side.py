"""Choice of the view direction to a place on a part."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ocmm_core.geometry import Float, perpendicular_pair

_KEPT_COS = float(np.cos(np.radians(72.0)))
"""A view is kept while the surface is turned less than this from the eye."""
_GOOD_COS = float(np.cos(np.radians(58.0)))
"""New views are closer to perpendicular, so that they last for a while."""
_ELEVATIONS = np.radians([28.0, 45.0, 62.0, 12.0, 80.0, -12.0, -30.0, -50.0])
_AZIMUTHS = np.radians(np.arange(0.0, 360.0, 20.0))
_LATER_WORTH = 1.6
"""Extra turn, rad, for a view from which all later places are visible."""
_LIFT_PRICE = 0.35
"""Cost of turning over the vertical relative to turning about it: people walk round a part."""


def choose_side(
    toward: Float, normal: Float, up: Float, is_hidden: Callable[[Float], bool], later: Float
) -> Float:
    """Return a unit vector (3,) to the eye for viewing a place on a surface.

    The current view is kept while the place is visible; otherwise the nearest with a view of it,
    preferably from above. If there is none, the most perpendicular one.

    Parameters
    ----------
    toward
        (3,), unit: to the current eye.
    normal
        (3,), unit, outward at the place; zero if unknown.
    up
        (3,), unit.
    is_hidden
        Whether the part is between the place and a distant eye in a direction (3,).
    later
        (n, 3): outward normals at later places. A view that shows more of them may be farther, as
        it saves later turns.
    """
    known = bool(np.any(normal))
    if (not known or float(normal @ toward) > _KEPT_COS) and not is_hidden(toward):
        return toward
    sides = _sides(up)
    facing = sides @ normal if known else np.ones(len(sides))
    turn = np.arccos(np.clip(sides @ toward, -1.0, 1.0))
    price = turn + _LIFT_PRICE * np.abs(np.arcsin(np.clip(sides @ up, -1.0, 1.0)) - _ELEVATIONS[0])
    if len(later):
        price = price - _LATER_WORTH * (sides @ later.T > _KEPT_COS).mean(axis=1)
    order = np.argsort(price, kind="stable")
    for least in (_GOOD_COS, 0.12):
        for side in sides[order[facing[order] > least]]:
            if not is_hidden(side):
                best: Float = side
                return best
    # Such as a deep bore. The place is then drawn through the part.
    return sides[int(np.argmax(facing - 0.01 * price))] if known else toward


def _sides(up: Float) -> Float:
    east, north = perpendicular_pair(up)
    flat = np.outer(np.cos(_AZIMUTHS), east) + np.outer(np.sin(_AZIMUTHS), north)
    sides: Float = (
        np.cos(_ELEVATIONS)[:, None, None] * flat + np.sin(_ELEVATIONS)[:, None, None] * up
    ).reshape(-1, 3)
    return sides
