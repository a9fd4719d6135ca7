"""Flags on points of a feature that lie far from the others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.measured import (
    ActualFeature,
    CommandingPoints,
    commanding_touches,
    fit_shape,
)
from ocmm_core.features.measured import outliers as outlier_rows
from ocmm_core.features.search import unambiguous
from ocmm_core.features.shapes import DIRECTION, Criterion, NominalFeature
from ocmm_core.measuring import MeasuredPoint

SMALLEST_MM = 0.02
"""mm: smaller distances from the element of the other points are form, not flagged."""
REMOVE = "Delete it, or touch the place again to confirm it."
"""Remedy for points that command a fit."""
USUAL_MM = 0.03
"""Least scatter that is expected of a feature before it has many points."""


def outliers(feature: ActualFeature) -> tuple[int, ...]:
    """Return the numbers of contradicted points, for flags only; see `features.outliers`."""
    if feature.raw is None or feature.touches is None:
        return ()
    fit, tips = feature.raw, feature.touches.tips
    if fit.criterion is not Criterion.LEAST_SQUARES:
        try:
            fit = unambiguous(fit_shape(fit.shape, tips, direction_hint=fit.direction))
        except FitError:
            return ()
    rows = outlier_rows(fit, tips, smallest=SMALLEST_MM)
    return tuple(feature.numbers[row] for row in rows)


def commanding(
    nominal: NominalFeature,
    points: Sequence[MeasuredPoint],
    actual: Mapping[str, ActualFeature | FitError],
) -> CommandingPoints | None:
    """Return the points of a probed feature that command its fit, or prevent it; or None.

    ``actual``, all features: the plane it is projected onto, and the scatter to be expected.
    """
    own = actual.get(nominal.name)
    if isinstance(own, ActualFeature) and _rms(own) <= SMALLEST_MM:
        # Nothing to refit, and independent of all other features: those change with each touch.
        return None
    plane = actual.get(nominal.projection)
    if nominal.projection and not isinstance(plane, ActualFeature):
        return None
    normal = plane.fit.geometry[DIRECTION] if isinstance(plane, ActualFeature) else None
    others = [
        _rms(one)
        for name, one in actual.items()
        if name != nominal.name and isinstance(one, ActualFeature) and one.raw is not None
    ]
    usual = max(USUAL_MM, float(np.median(others)) if others else 0.0)
    return commanding_touches(nominal, points, normal, usual, SMALLEST_MM)


def _rms(feature: ActualFeature) -> float:
    """Return the rms of the residuals of a feature, mm; infinity without points."""
    return np.inf if feature.raw is None else float(np.sqrt(np.mean(feature.raw.residuals**2)))
