"""Flags on points of a feature that lie far from the others."""

from __future__ import annotations

from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature, fit_shape
from ocmm_core.features.measured import outliers as outlier_rows
from ocmm_core.features.search import unambiguous
from ocmm_core.features.shapes import Criterion

SMALLEST_MM = 0.02
"""mm: smaller distances from the element of the other points are form, not flagged."""


def outliers(feature: ActualFeature) -> tuple[int, ...]:
    """Return the numbers of the points contradicted by the others.

    Flags and never removes; see `features.outliers`. Constructed features have no points.
    """
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
