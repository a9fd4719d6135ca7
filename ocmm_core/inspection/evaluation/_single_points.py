"""Single points: compensated along the direction of the plan once the part frame is known.

The fit of any other shape gives the normal of the surface. A point has only its approach, which is
as straight as the hand: a slant lets the radius of the ball act too little, always to the same
side. Where the plan's direction can be turned into the world it is the better one, and a point
that came from far off it, because the ball slid into place, gives no number.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature, actual_features
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float, RigidTransform, unit
from ocmm_core.measuring import MeasuredPoint

MAX_SLANT_DEG = 30.0
"""A point approached further off the direction of the plan is not compensated."""


def compensate_by_plan(
    nominals: Sequence[NominalFeature],
    points: Sequence[MeasuredPoint],
    T_part_from_world: RigidTransform,
    places: Sequence[int] | None = None,
) -> dict[str, ActualFeature | FitError]:
    """Return the single points of a plan, compensated along its directions, by name.

    Parameters
    ----------
    nominals
        Features of the plan; those of another shape are left out of the result.
    points
        All points of the job, or those of these features.
    places
        As for `features.measured.actual_features`.
    """
    single = [item for item in nominals if item.shape is Shape.POINT]
    to_world = T_part_from_world.rotation.T
    directions = {item.name: to_world @ unit(np.array(item.direction)) for item in single}
    turned = [
        replace(point, direction=directions[point.feature])
        if point.feature in directions
        else point
        for point in points
    ]
    actual = actual_features(single, turned, places)
    for name, direction in directions.items():
        slant = max(
            (_slant_deg(point, direction) for point in points if point.feature == name), default=0.0
        )
        if slant > MAX_SLANT_DEG:
            actual[name] = FitError(
                "session.slant",
                f"{name} was approached {slant:.0f}° off the planned direction.",
                "Undo it and touch again, square to the surface.",
            )
    return actual


def _slant_deg(point: MeasuredPoint, direction_world: Float) -> float:
    cosine = float(np.clip(point.direction @ direction_world, -1.0, 1.0))
    return float(np.degrees(np.arccos(cosine)))
