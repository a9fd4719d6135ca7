"""Derivatives of a frame by the points of the job."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ocmm_core.alignment._datums import frame_of
from ocmm_core.alignment._model_frame import model_fit, model_frame_slopes
from ocmm_core.alignment._rules import (
    AnyAlignment,
    BestFit,
    BoundAlignment,
    ModelBestFit,
    ReferencePoints,
    Relocation,
)
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import GEOMETRY_SIZE, POINT, RADIUS, SECOND
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.measuring import Rows

_POINT_PLACES = range(POINT.start, POINT.stop)

_STEPS = np.full(GEOMETRY_SIZE, 1e-5)
_STEPS[[0, 1, 2, RADIUS, SECOND]] = 1e-3
"""Steps of the central differences, mm, and for directions and angles rad.

World coordinates are at most a few metres: rounding of 1e-12 mm in them is 1e-9 in a derivative.
Geometry with significant curvature over a step has a lever of less than a millimetre, and is
refused.
"""


def frame_jacobian(
    rule: AnyAlignment, actual: Mapping[str, ActualFeature], T_part_from_world: RigidTransform
) -> Rows:
    """Return the derivatives of the part frame by the points, 6 rows.

    Rotation, rad, about its axes through its origin, over shift, mm, of the part; senses are fixed.
    """
    geometries = {name: actual[name].fit.geometry for name in rule.features}
    if isinstance(rule, BoundAlignment) and isinstance(rule.rule, ModelBestFit):
        found = model_fit(rule.rule, geometries, rule.nominals, actual)
        return model_frame_slopes(rule.rule, found, actual)
    rows = Rows.nothing(6)
    back = T_part_from_world.inverse()
    for name in rule.features:
        by_geometry = np.zeros((6, GEOMETRY_SIZE))
        for place in np.flatnonzero(actual[name].jacobian.moving()):
            if place not in _POINT_PLACES and _only_points(rule, name):
                continue
            ends = []
            for sign in (1.0, -1.0):
                moved = geometries[name].copy()
                moved[place] += sign * _STEPS[place]
                frame = frame_of(rule, {**geometries, name: moved})
                ends.append(_small_motion(frame.compose(back)))
            by_geometry[:, place] = (ends[0] - ends[1]) / (2.0 * _STEPS[place])
        rows += by_geometry @ actual[name].jacobian
    return rows


def _only_points(rule: AnyAlignment, name: str) -> bool:
    """Return whether a frame depends only on the place of a feature."""
    kind = rule.rule if isinstance(rule, BoundAlignment) else rule
    if isinstance(kind, (BestFit, ReferencePoints)):
        return kind.start is None or name not in kind.start.features
    return isinstance(kind, Relocation)


def _small_motion(motion: RigidTransform) -> Float:
    """Return rotation (rad) and shift (mm) of a small motion, (6,)."""
    rotation = motion.rotation
    turn = 0.5 * np.array(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    return np.concatenate([turn, motion.translation])
