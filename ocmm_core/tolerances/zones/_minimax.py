"""Smallest zone: minimise the greatest of many deviations over free motions.

Deviations of surface points are numbers, those of axes are vectors whose length counts. Both are
solved by linear programs about the present place (sequential linear programming, as in D. Zhang, X.
Jiang et al., Precision Eng., and NIST's minimum-zone references); lengths are bounded by their
components along directions added on demand. The multipliers of the last program are the weights of
the contact points: by the envelope theorem they are the derivative of the smallest zone by the
deviations.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from ocmm_core.errors import FitError
from ocmm_core.geometry import Float, Int

_STEPS = 60
_CONVERGED = 1e-8
"""Relative gain of a step at convergence."""
_NULL = 1e-7
"""Relative effect of motions that counts as zero."""
_FIRST_TRUST_MM = 1.0
_LEAST_TRUST_MM = 1e-11
_HALF_FANS = 8
"""Initial directions per half turn that bound a length."""


@dataclass(frozen=True, slots=True)
class Smallest:
    motion: Float
    """(k,): the free parameters."""
    value: float
    """mm: the greatest deviation."""
    shares: Float
    """(m,): weights of deviations (signed) or ends of axes, in order; they add up to one."""


Deviations = Callable[[Float], tuple[Float, Float]]
"""Parameters (k,) to deviations, derivatives: (m,), (m, k) or vectors (m, d), (m, d, k)."""


def smallest_zone(deviations: Deviations, size: int) -> Smallest:
    """Return the motion (size,), from zero, of least greatest deviation (m,), mm; else FitError."""

    def as_vectors(motion: Float) -> tuple[Float, Float]:
        values, jacobian = deviations(motion)
        return values[:, None], jacobian[:, None, :]

    found = smallest_length(as_vectors, size)
    signs = np.where(deviations(found.motion)[0] < 0.0, -1.0, 1.0)
    return Smallest(found.motion, found.value, signs * found.shares)


def smallest_length(deviations: Deviations, size: int) -> Smallest:
    """Return the motion that minimises the longest vector deviation; see `smallest_zone`."""
    motion = np.zeros(size)
    vectors, jacobian = deviations(motion)
    lengths = np.linalg.norm(vectors, axis=1)
    value = float(lengths.max())
    shares = _one_hot(lengths)
    if size == 0:
        return Smallest(motion, value, shares)
    cuts = _first_cuts(vectors.shape[1], len(vectors))
    trust = _FIRST_TRUST_MM
    for _ in range(_STEPS):
        cuts = _with_present(cuts, vectors)
        step, bound, duals = _program(cuts, vectors, jacobian, trust)
        moved = motion + step
        new_vectors, new_slopes = deviations(moved)
        new_value = float(np.linalg.norm(new_vectors, axis=1).max())
        gain, hoped = value - new_value, value - bound
        shares = duals
        if hoped <= _CONVERGED * value + _LEAST_TRUST_MM:
            return Smallest(motion, value, shares)
        if gain > 0.0:
            motion, vectors, jacobian, value = moved, new_vectors, new_slopes, new_value
        else:
            # Tangents of the lengths at the tried place prevent its repetition.
            cuts = _with_present(cuts, vectors + jacobian @ step)
        trust = 2.0 * trust if gain > 0.5 * hoped else 0.25 * trust if gain < 0.1 * hoped else trust
        if trust < _LEAST_TRUST_MM:
            return Smallest(motion, value, shares)
    raise FitError(
        "characteristic.zone",
        "Minimum zone not found: the search did not converge.",
        "Check that the points belong to the feature, and name datums that constrain it.",
    )


def _one_hot(lengths: Float) -> Float:
    shares = np.zeros(len(lengths))
    shares[int(np.argmax(lengths))] = 1.0
    return shares


@dataclass(frozen=True, slots=True)
class _Cuts:
    """Directions (c, d), unit, along which the vectors of rows (c,) are bounded."""

    rows: Int
    directions: Float


def _first_cuts(dimension: int, count: int) -> _Cuts:
    if dimension == 2:
        turn = np.arange(2 * _HALF_FANS) * np.pi / _HALF_FANS
        fan = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    else:
        fan = np.vstack([np.eye(dimension), -np.eye(dimension)])
    return _Cuts(np.repeat(np.arange(count), len(fan)), np.tile(fan, (count, 1)))


def _with_present(cuts: _Cuts, vectors: Float) -> _Cuts:
    """Return the cuts and those along the present vectors; numbers have only two directions."""
    if vectors.shape[1] == 1:
        return cuts
    lengths = np.linalg.norm(vectors, axis=1)
    rows = np.flatnonzero(lengths > 1e-12)
    return _Cuts(
        np.concatenate([cuts.rows, rows]),
        np.vstack([cuts.directions, vectors[rows] / lengths[rows, None]]),
    )


def _program(
    cuts: _Cuts, vectors: Float, jacobian: Float, trust: float
) -> tuple[Float, float, Float]:
    """Return the best step (k,) within ``trust``, its predicted bound, and the weights (m,)."""
    rows = cuts.rows
    now = np.sum(cuts.directions * vectors[rows], axis=1)
    by_step = np.einsum("cd,cdk->ck", cuts.directions, jacobian[rows])
    # Motions without effect are excluded: a program would be unbounded.
    _, strengths, ways = np.linalg.svd(by_step, full_matrices=False)
    kept = ways[strengths > _NULL * max(float(strengths[0]), 1e-12)]
    size = len(kept)
    # The solver keeps constraints to 1e-7: negligible in units of the zone.
    scale = max(float(now.max()), _LEAST_TRUST_MM)
    answer = linprog(
        np.append(np.zeros(size), 1.0),
        A_ub=np.column_stack([by_step @ kept.T, -np.ones(len(now))]),
        b_ub=-now / scale,
        bounds=[(-trust / scale, trust / scale)] * size + [(None, None)],
        method="highs",
    )
    if answer.x is None:
        raise FitError(
            "characteristic.zone",
            "Minimum zone not found: its linear program has no solution.",
            "Check that the points belong to the feature.",
        )
    duals = -np.asarray(answer.ineqlin.marginals, dtype=np.float64)
    shares = np.bincount(rows, weights=duals, minlength=len(vectors)).astype(np.float64)
    step = scale * np.asarray(answer.x[:-1], dtype=np.float64) @ kept
    return step, scale * float(answer.x[-1]), shares
