"""Straightness of an axis and of a probed edge (ISO 1101, 17.2)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import DIRECTION, POINT, Shape, element
from ocmm_core.geometry import RigidTransform, perpendicular_pair
from ocmm_core.measuring import Rows
from ocmm_core.tolerances.kinds._form_zone import form_range
from ocmm_core.tolerances.zones import (
    BEST_FIT,
    Evaluation,
    Surface,
    ZoneFrame,
    derived_zone,
    free_frame,
    least_squares,
    median_line,
    own_fit,
    surface_points,
    surface_zone,
)


def straight_axis(feature: ActualFeature) -> Evaluation:
    centres = median_line(feature)
    frame = free_frame(RigidTransform.identity(), feature.fit.point)
    across = np.stack(perpendicular_pair(feature.fit.direction))
    found = derived_zone(centres, feature.fit.point, across, frame)
    # The middle line of a straight cylinder has no vector that could cross zero.
    return replace(
        found, components=None, component_gradients=None, association="minimum zone", frame="",
        note=f"Centres of {len(centres)} sections.",
    )  # fmt: skip


def straight_line(feature: ActualFeature, *, smallest: bool) -> Evaluation:
    """Return straightness of a probed edge, seen along the face's normal."""
    surface = surface_points(feature)
    towards, direction = surface.normals[0], feature.fit.direction
    if not smallest:
        touches = own_fit(feature)[0]
        arms = touches.tips - least_squares(feature).point
        along = arms @ direction
        by_place = towards @ feature.jacobian[POINT]
        by_turn = towards @ feature.jacobian[DIRECTION]
        own = Rows.of_own_points(touches.places, np.tile(towards, (len(arms), 1)))
        rows = own - by_place.outer(np.ones(len(arms))) - by_turn.outer(along)
        return form_range(arms @ towards, rows.without_radius(), "least squares")
    middle = feature.fit.point
    turn = np.cross(direction, towards)
    motions = np.zeros((6, 2))
    motions[3:, 0] = towards
    motions[:3, 1], motions[3:, 1] = turn, np.cross(middle, turn)
    frame = ZoneFrame(RigidTransform.identity(), Rows.nothing(6), motions, BEST_FIT)
    found = surface_zone([Surface(surface, Shape.LINE, element(middle, towards))], frame)
    return replace(found, association="minimum zone", frame="")
