"""Points of one feature contradicted by the others: one, two, or a group of neighbours.

Points on a burr support each other, so `features.outliers` can miss them. Here groups are judged as
a whole, by the decrease of the sum of squared residuals without them (R. D. Cook and S. Weisberg,
Residuals and Influence in Regression, 1982, 2.2.2), with Bonferroni's bound over all groups of that
size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.special import fdtrc

from ocmm_core.errors import FitError
from ocmm_core.features.elements import distance_derivatives
from ocmm_core.features.measured import ActualFeature, fit_shape
from ocmm_core.features.search import unambiguous
from ocmm_core.features.shapes import Criterion, Fit, Shape
from ocmm_core.geometry import Float

SMALLEST_MM = 0.02
"""Smaller deviations are no suspects: form explains them."""

FALSE_ALARM = 0.01
_MOST_POINTS = 3
_ALL_PAIRS = 40
"""Number of points up to which all pairs are tried, else neighbours only."""
_PRIOR = 8.0
_NEIGHBOUR = 1.5
"""Neighbours are closer than this multiple of the usual distance to the nearest point."""


@dataclass(frozen=True, slots=True)
class Suspects:
    """Points contradicted by the others of their feature."""

    feature: str
    numbers: tuple[int, ...]
    off: tuple[float, ...]
    """mm, in the same order: distance out of the material shown by the others."""
    probability: float
    """Probability of such points on a good feature."""
    together: bool
    """They are neighbours."""

    @property
    def is_burr(self) -> bool:
        """Return whether neighbouring points protrude from the material."""
        return self.together and len(self.numbers) > 1 and min(self.off) > 0.0


def suspects_of(
    feature: ActualFeature, noise: float, usual: float | None = None
) -> Suspects | None:
    """Return the points of a feature contradicted by the others; None if all agree.

    `noise`, mm^2: mean square of a residual by the noise of the points; less scatter is chance.
    `usual`, mm^2: that of the other features of the job; one that scatters no more without some
    points gets a prior of `_PRIOR` degrees of freedom, as few remaining points are weak evidence.
    """
    touches = feature.touches
    fit = _least_squares(feature)
    if fit is None or touches is None or fit.shape is Shape.POINT:
        return None
    tips, residuals = touches.tips, fit.residuals
    n = len(tips)
    by_geometry, normals = distance_derivatives(fit, tips)
    blocks = np.einsum("kni,ni->kn", fit.jacobian.reshape(-1, n, 3), normals)
    kept = by_geometry @ blocks + np.diag(np.sum(normals**2, axis=1))
    kept = 0.5 * (kept + kept.T)
    freedom = round(float(np.trace(kept)))
    most = min(_MOST_POINTS, freedom - (2 if usual is None else 1), n // 2)
    squares = float(residuals @ residuals)
    near = _neighbours(tips)
    chosen: tuple[int, ...] = ()
    gained, probability = 0.0, 1.0
    for size in range(1, most + 1):
        groups = _groups(n, size, near)
        if not groups:
            continue
        loss, best = max((_loss(group, kept, residuals), group) for group in groups)
        left = freedom - size
        scatter, degrees = max((squares - loss) / left, noise), float(left)
        if usual is not None and float(fdtrc(left, _PRIOR, scatter / usual)) > FALSE_ALARM:
            scatter = (left * scatter + _PRIOR * usual) / (left + _PRIOR)
            degrees += _PRIOR
        more = size - len(chosen)
        ratio = max(loss - gained, 0.0) / more / scatter
        chance = float(fdtrc(more, degrees, ratio)) * len(groups)
        if chance < FALSE_ALARM:
            chosen, gained, probability = best, loss, min(chance, 1.0)
    if not chosen:
        return None
    rows = list(chosen)
    off = np.linalg.solve(kept[np.ix_(rows, rows)], residuals[rows])
    if float(np.abs(off).min()) < SMALLEST_MM:
        return None
    inner = fit.shape.spec.is_curved and feature.nominal.side == "inner"
    together = len(rows) == 1 or _connected(rows, near)
    signed = -off if inner else off
    return Suspects(
        feature.nominal.name,
        tuple(feature.numbers[row] for row in rows),
        tuple(float(value) for value in signed),
        probability,
        together,
    )


def _least_squares(feature: ActualFeature) -> Fit | None:
    if feature.raw is None or feature.touches is None:
        return None
    if feature.raw.criterion is Criterion.LEAST_SQUARES:
        return feature.raw
    try:
        fit = fit_shape(
            feature.raw.shape, feature.touches.tips, direction_hint=feature.raw.direction
        )
        return unambiguous(fit)
    except FitError:
        return None


def _loss(group: Sequence[int], kept: Float, residuals: Float) -> float:
    """Return the decrease of the sum of squares without these points; zero if all rests on them."""
    rows = list(group)
    own = kept[np.ix_(rows, rows)]
    if float(np.linalg.eigvalsh(own)[0]) < 1e-3:
        return 0.0
    return float(residuals[rows] @ np.linalg.solve(own, residuals[rows]))


def _neighbours(tips: Float) -> Float:
    apart = np.linalg.norm(tips[:, None] - tips[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    usual = float(np.median(apart.min(axis=1)))
    found: Float = (apart < _NEIGHBOUR * usual).astype(np.float64)
    return found


def _groups(n: int, size: int, near: Float) -> list[tuple[int, ...]]:
    if size == 1:
        return [(i,) for i in range(n)]
    pairs: list[tuple[int, ...]] = [
        pair for pair in combinations(range(n), 2) if near[pair] or n <= _ALL_PAIRS
    ]
    if size == 2:
        return pairs
    side_by_side = [pair for pair in pairs if near[pair]]
    found = {
        tuple(sorted((*pair, third)))
        for pair in side_by_side
        for third in np.flatnonzero(near[list(pair)].any(axis=0)).tolist()
        if third not in pair
    }
    return sorted(found)


def _connected(rows: Sequence[int], near: Float) -> bool:
    reached, rest = {rows[0]}, set(rows[1:])
    while rest:
        further = {row for row in rest if any(near[row, other] for other in reached)}
        if not further:
            return False
        reached |= further
        rest -= further
    return True
