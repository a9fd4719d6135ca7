"""From which side a place on a part is seen."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ocmm_core.geometry import Float, perpendicular_pair

_KEPT_COS = float(np.cos(np.radians(72.0)))
"""A side is kept while the surface is turned less than this away from the eye."""
_GOOD_COS = float(np.cos(np.radians(58.0)))
"""A new one is looked for nearer to square, so that it is kept for a while."""
_ELEVATIONS = np.radians([28.0, 45.0, 62.0, 12.0, 80.0, -12.0, -30.0, -50.0])
_AZIMUTHS = np.radians(np.arange(0.0, 360.0, 20.0))
_LATER_WORTH = 1.6
"""So many radians a side may be farther away from which all later places are seen."""
_LIFT_PRICE = 0.35
"""What turning over the upright costs beside turning about it: people walk round a part."""


def choose_side(
    toward: Float, normal: Float, up: Float, is_hidden: Callable[[Float], bool], later: Float
) -> Float:
    """Return a unit vector (3,) to the eye from where a place on a surface is seen.

    The one that is there stays as long as the place is in sight; else it is the nearest one from
    which it is, from above rather than from below. Where the place is in sight from nowhere it is
    the one that looks at it most squarely.

    Parameters
    ----------
    toward
        (3,), unit: to the eye as it is.
    normal
        (3,), unit, outward at the place; zero where nobody knows it.
    up
        (3,), unit.
    is_hidden
        Whether the part stands between the place and an eye far away in a direction (3,).
    later
        (n, 3): outward normals at the places that come after it. A side from which more of them are
        seen, too, is worth a longer way: the next place turns nothing then.
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
    # A place in a deep bore, say. The part is drawn over it, and it shows through.
    return sides[int(np.argmax(facing - 0.01 * price))] if known else toward


def _sides(up: Float) -> Float:
    east, north = perpendicular_pair(up)
    flat = np.outer(np.cos(_AZIMUTHS), east) + np.outer(np.sin(_AZIMUTHS), north)
    sides: Float = (
        np.cos(_ELEVATIONS)[:, None, None] * flat + np.sin(_ELEVATIONS)[:, None, None] * up
    ).reshape(-1, 3)
    return sides
