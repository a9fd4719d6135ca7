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
USUAL_MM: tuple[float, ...] = tuple(0.015 * 2.0 ** (0.5 * k) for k in range(33))
"""Scatter to be expected of a feature, in steps: it depends on all others and changes with each of
their touches, on which no search of this feature shall wait."""


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
    scatters = scatters_of(actual)
    plane = actual.get(nominal.projection)
    if not is_examined(nominal, scatters, plane):
        return None
    return commanding_among(nominal, points, plane, usual_scatter(nominal.name, scatters))


_Found = ActualFeature | FitError


def scatters_of(actual: Mapping[str, _Found]) -> dict[str, float]:
    """Return the rms of the residuals of probed features by name, mm."""
    return {
        name: float(np.sqrt(np.mean(one.raw.residuals**2)))
        for name, one in actual.items()
        if isinstance(one, ActualFeature) and one.raw is not None
    }


def is_examined(
    nominal: NominalFeature, scatters: Mapping[str, float], plane: _Found | None
) -> bool:
    """Return whether a feature may have commanding points: large rms, or no fit."""
    if nominal.projection and not isinstance(plane, ActualFeature):
        return False
    # Otherwise nothing to refit, and independent of all other features.
    return scatters.get(nominal.name, np.inf) > SMALLEST_MM


def usual_scatter(name: str, scatters: Mapping[str, float]) -> float:
    """Return one of `USUAL_MM`: the median of the other features, rounded up."""
    others = [size for other, size in scatters.items() if other != name]
    middle = float(np.median(others)) if others else 0.0
    return next((step for step in USUAL_MM if step >= middle), USUAL_MM[-1])


def commanding_among(
    nominal: NominalFeature, points: Sequence[MeasuredPoint], plane: _Found | None, usual: float
) -> CommandingPoints | None:
    """Return the commanding points of a feature that `is_examined`, for a ``usual`` scatter."""
    normal = plane.fit.geometry[DIRECTION] if isinstance(plane, ActualFeature) else None
    return commanding_touches(nominal, points, normal, usual, SMALLEST_MM)
