"""Which points of a feature lie far from the element that the others show."""

from __future__ import annotations

import numpy as np

from ocmm_core.features.actual import ActualFeature

FALSE_ALARM = 0.01
"""Probability that any point of a good feature is flagged."""

SMALLEST_MM = 0.02
"""Nearer than this to the element of the other points nothing is flagged: form does that."""

_SMALLEST_SHARE = 1e-6


def outliers(feature: ActualFeature) -> tuple[int, ...]:
    """Return the numbers of the points that do not belong to what the others show.

    Each residual is compared with the scatter of the others by Student's distribution (deleted
    residuals, R. D. Cook and S. Weisberg, Residuals and Influence in Regression, 1982, 2.2), with
    Bonferroni's bound over all points. It flags and never removes: a dent in the part looks the
    same as a touch beside it.

    Parameters
    ----------
    feature
        With n points; nothing is flagged with fewer than two more than determine it.
    """
    from scipy.special import stdtrit

    residuals = feature.fit.residuals
    n = len(residuals)
    own = np.array([
        np.linalg.norm(feature.residual_jacobian[row, 3 * place : 3 * place + 3])
        for row, place in enumerate(_places(feature))
    ])
    # How much of a point's own shift is seen in its residual: one less its leverage.
    share = np.clip(own, 0.0, 1.0)
    freedom = round(float(share.sum()))
    if freedom < 2:
        return ()
    seen = share > _SMALLEST_SHARE
    deleted = np.zeros(n)
    deleted[seen] = residuals[seen] / share[seen]
    others = (np.sum(residuals**2) - residuals * deleted) / (freedom - 1)
    scatter = np.sqrt(np.maximum(others, 0.0) * share)
    limit = float(stdtrit(freedom - 1, 1.0 - 0.5 * FALSE_ALARM / n))
    far = (np.abs(residuals) > limit * scatter) & (np.abs(deleted) > SMALLEST_MM) & seen
    return tuple(number for number, bad in zip(feature.numbers, far, strict=True) if bad)


def _places(feature: ActualFeature) -> list[int]:
    """Return where the feature's points stand among all points of the job."""
    blocks = np.abs(feature.residual_jacobian[:, :-1]).reshape(len(feature.fit.residuals), -1, 3)
    used = np.flatnonzero(blocks.sum(axis=(0, 2)))
    if len(used) == len(feature.numbers):
        return [int(place) for place in used]
    # A feature projected onto another one depends on that one's points, too: its own are those
    # by which each residual changes most.
    return [int(place) for place in np.argmax(np.linalg.norm(blocks, axis=2), axis=1)]
