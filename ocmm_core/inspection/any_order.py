"""Which feature was touched, by where the ball was."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.inspection.plan import Plan
from ocmm_core.inspection.surfaces import nearness
from ocmm_core.measuring.point import Refusal, RefusalCode

SEARCH_MM = 10.0
"""A touch further than this from every nominal surface belongs to none (as PC-DMIS has it)."""

APART_MM = 2.0
"""The second nearest surface must be so much further: part and frame are never quite nominal."""

MOST_SLANT_DEG = 60.0
"""A ball that came from further off the normal did not mean that surface."""


def touched_feature(
    plan: Plan,
    T_nominal_from_world: RigidTransform,
    tip_world: Float,
    direction_world: Float | None,
    radius: float,
    skipped: Collection[str],
    time_s: float,
) -> str | Refusal:
    """Return the name of the feature that was touched, or why that is not clear.

    Parameters
    ----------
    T_nominal_from_world
        Where the part is.
    tip_world
        (3,), mm: ball centre at rest.
    direction_world
        (3,), unit: where the ball came from; None leaves out what it says.
    radius
        Of the ball, mm.
    skipped
        Features that nobody means.
    """
    ball = T_nominal_from_world.apply(tip_world)
    came = None if direction_world is None else T_nominal_from_world.rotation @ direction_world
    steepest = float(np.cos(np.radians(MOST_SLANT_DEG)))
    found: list[tuple[float, str]] = []
    for feature in plan.features:
        near = nearness(feature, ball, radius)
        slanted = came is not None and np.any(near.normal) and near.normal @ came < steepest
        if feature.name not in skipped and near.gap <= SEARCH_MM and not slanted:
            found.append((near.gap, feature.name))
    found.sort()
    if not found:
        return Refusal(
            RefusalCode.AMBIGUOUS,
            f"No feature of the plan is within {SEARCH_MM:g} mm of the ball.",
            "Touch nearer to a feature, or select the feature that you mean and probe in the order "
            "of the plan.",
            time_s,
        )
    if len(found) > 1 and found[1][0] - found[0][0] < APART_MM:
        (first, one), (second, other) = found[:2]
        return Refusal(
            RefusalCode.AMBIGUOUS,
            f"The touch may belong to {one} ({first:.1f} mm away) or to {other} "
            f"({second:.1f} mm away).",
            "Touch where they are further apart, or probe in the order of the plan.",
            time_s,
        )
    return found[0][1]
