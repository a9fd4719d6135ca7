"""Fit of one element of any shape, by any criterion; all fits are cold started.

Outlier points, relative to the element of the others, are flagged and never removed: a dent in the
part looks the same as a misplaced touch.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ocmm_core.features.elements import ELEMENTS, FitPrior, distance_derivatives
from ocmm_core.features.search import with_rival
from ocmm_core.features.shapes import Criterion, Fit, Shape
from ocmm_core.features.zones import ZoneProof, certificate, fit_bounded, fit_zone
from ocmm_core.geometry import Float, Points3

__all__ = ["ZoneProof", "associate", "certificate", "fit", "fit_shape"]


def fit_shape(
    shape: Shape,
    points: Points3,
    *,
    direction_hint: Float | None = None,
    radius_hint: float | None = None,
    second_hint: float | None = None,
    half_angle_hint: float | None = None,
    criterion: Criterion = Criterion.LEAST_SQUARES,
    free: bool = False,
    offset: float = 0.0,
) -> Fit:
    """Return ``shape`` associated with ``points``.

    Parameters
    ----------
    points
        (n, 3), mm, in any order and place.
    direction_hint
        (3,): the result points along it; default: largest component positive. No effect on the
        position of the element. A cone has a direction of its own.
    radius_hint, second_hint, half_angle_hint
        mm, mm, rad: may decide between rivals (`Fit.rival`); else not used.
    criterion
        Association criterion; all others start from least squares.
    free
        Circle only: in space as one problem, not plane first.
    offset
        mm, shapes whose ball is ``kept``: distance of the points outside of the element.

    Returns
    -------
    The best element, with another one in `Fit.rival` if the points do not exclude it. `unambiguous`
    refuses such a fit.

    Raises
    ------
    FitError
        The points do not determine the shape, or it does not support the criterion.
    """
    if criterion is not Criterion.LEAST_SQUARES:
        start = fit_shape(
            shape, points, direction_hint=direction_hint, radius_hint=radius_hint,
            second_hint=second_hint, half_angle_hint=half_angle_hint, free=free, offset=offset,
        )  # fmt: skip
        return associate(start, points, criterion, offset)
    known = FitPrior(direction_hint, radius_hint, second_hint, half_angle_hint, free, offset)
    return ELEMENTS[shape].fit(points, known)


fit = fit_shape
"""Its short name in programs that use the library."""


def associate(start: Fit, points: Points3, criterion: Criterion, offset: float = 0.0) -> Fit:
    """Return the element of another criterion from a least-squares fit; FitError as `fit_zone`."""
    if start.rival is not None:
        first = associate(replace(start, rival=None), points, criterion, offset)
        return with_rival(first, associate(start.rival, points, criterion, offset))
    if criterion is Criterion.MINIMUM_ZONE:
        return fit_zone(start, points, offset)
    return fit_bounded(start, points, criterion)


FALSE_ALARM = 0.01
"""Probability that any point of a good set is flagged."""

MOST = 5
"""At most one point in this number is flagged."""

SMALLEST_SHARE = 1e-6
"""Minimum share of a point's shift in its own residual (redundancy) for a test."""

AGAINST_ALL = 1e-9
"""Residuals, relative to the size of the points, below which they are rounding."""


def outliers(
    fit: Fit, points: Points3, covariances: Float | None = None, smallest: float = 0.0
) -> tuple[int, ...]:
    """Return the indices of outliers.

    Each residual is compared with the scatter of the others by Student's distribution (deleted
    residuals, R. D. Cook and S. Weisberg, Residuals and Influence in Regression, 1982, 2.2), with
    Bonferroni's bound over all points. The worst point is removed from scatter and leverage, then
    the next, up to a fifth of them; all up to the last beyond its limit are flagged, so that two of
    them do not mask each other (B. Rosner, Technometrics 25, 1983).

    Parameters
    ----------
    fit
        Least squares.
    points
        (n, 3), mm, that were fitted. With less than two redundant points, nothing is flagged.
    covariances
        (n, 3, 3), mm^2, of the points. An outlier must also exceed its own covariance and that of
        the element, so that an uncertain point is not flagged.
    smallest
        mm: smaller distances from the element of the others are never flagged.
    """
    from scipy.special import ndtri, stdtrit

    n = len(points)
    by_geometry, normals = distance_derivatives(fit, points)
    # Response of all residuals to normal shifts of points: identity less leverage, with columns
    # computed on demand.
    blocks = np.einsum("kni,ni->kn", fit.jacobian.reshape(-1, n, 3), normals)
    own_shares = np.sum(normals**2, axis=1) + np.sum(by_geometry * blocks.T, axis=1)
    kept = np.arange(n)
    freedom = round(float(own_shares.sum()))
    columns: list[tuple[Float, float]] = []
    size = float(np.sqrt(np.mean(np.sum((points - points.mean(axis=0)) ** 2, axis=1))))
    taken: list[int] = []
    flagged = 0
    residuals = fit.residuals.copy()
    while freedom - len(taken) >= 2 and len(taken) < max(1, n // MOST):
        own = np.clip(own_shares[kept], 0.0, 1.0)
        judged = own > SMALLEST_SHARE
        deleted = np.zeros(len(kept))
        deleted[judged] = residuals[kept][judged] / own[judged]
        left = freedom - len(taken) - 1
        others = (np.sum(residuals[kept] ** 2) - residuals[kept] * deleted) / left
        scatter = np.sqrt(np.maximum(others, 0.0) / np.maximum(own, SMALLEST_SHARE))
        scatter = np.maximum(scatter, AGAINST_ALL * size)
        limit = float(stdtrit(left, 1.0 - 0.5 * FALSE_ALARM / n))
        ratio = np.where(judged, np.abs(deleted) / scatter, 0.0)
        ratio[np.abs(deleted) <= smallest] = 0.0
        if covariances is not None:
            own_normals = normals[kept]
            variance = np.einsum("ni,nij,nj->n", own_normals, covariances[kept], own_normals)
            known = np.sqrt(variance / np.maximum(own, SMALLEST_SHARE))
            ratio[np.abs(deleted) <= -ndtri(0.5 * FALSE_ALARM / n) * known] = 0.0
        worst = int(np.argmax(ratio))
        if not ratio[worst] > 0.0:
            break
        row = int(kept[worst])
        taken.append(row)
        if ratio[worst] > limit:
            flagged = len(taken)
        # Removing that point updates the others: one step of Gauss-Jordan elimination.
        column = by_geometry @ blocks[:, row]
        column[row] += 1.0
        for other, pivot in columns:
            column = column - other * (other[row] / pivot)
        residuals = residuals - column * (residuals[row] / column[row])
        own_shares = own_shares - column**2 / column[row]
        columns.append((column, float(column[row])))
        kept = np.delete(kept, worst)
    return tuple(sorted(taken[:flagged]))
