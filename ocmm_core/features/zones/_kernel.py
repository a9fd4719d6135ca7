"""Compiled linear step of minimum-zone fits: dual simplex method for few unknowns.

The distances of all points are linear in the step; the narrowest zone within a box around the
present element is a linear programme with up to eight unknowns and two rows a point. A dual
feasible basis is available at once (the two extreme points and the sides of the box against the
slope), so that the dual method starts without a search: the exchange of E. Stiefel, Numerische
Mathematik 1 (1959), with bounds.
"""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float, Int

# Relative to the greatest weight; a smaller one would make a basis singular within rounding.
SMALLEST_PIVOT = 1e-11
ROUNDING = 1e-15
"""Relative error of a sum that counts as rounding."""
MAX_EXCHANGES = 400
PLAIN_EXCHANGES = 150
"""Exchanges after which the first violated row enters instead of the worst, against cycles."""


@compiled()
def _inverted(matrix: Float, work: Float) -> bool:
    """Write the inverse of ``matrix`` (m, m) to the right half of ``work`` (m, 2 m)."""
    m = len(matrix)
    work[:, :m] = matrix
    work[:, m:] = 0.0
    for i in range(m):
        work[i, m + i] = 1.0
    for i in range(m):
        pivot = i
        # Gauss-Jordan with the greatest pivot of the column; m is at most ten.
        for row in range(i + 1, m):
            if abs(work[row, i]) > abs(work[pivot, i]):
                pivot = row
        if abs(work[pivot, i]) < 1e-13:
            return False
        if pivot != i:
            for column in range(2 * m):
                work[i, column], work[pivot, column] = work[pivot, column], work[i, column]
        scale = 1.0 / work[i, i]
        for column in range(2 * m):
            work[i, column] *= scale
        for row in range(m):
            factor = work[row, i]
            if row != i and factor != 0.0:
                for column in range(2 * m):
                    work[row, column] -= factor * work[i, column]
    return True


@compiled()
def _set_row(
    code: int, distances: Float, jacobian: Float, box: Float, lower: bool, row: Float
) -> float:
    """Write the coefficients of constraint ``code`` to ``row``; return its right-hand side."""
    n, k = jacobian.shape
    row[:] = 0.0
    # distance + slope . step <= upper: the row is (slope, -1, 0), its side -distance.
    if code < n:
        row[:k] = jacobian[code]
        row[k] = -1.0
        return float(-distances[code])
    # distance + slope . step >= lower, turned round to a less-or-equal.
    if code < 2 * n:
        row[:k] = -jacobian[code - n]
        if lower:
            row[k + 1] = 1.0
        return float(distances[code - n])
    j = code - 2 * n
    # step_j <= box_j, and below -step_j <= box_j.
    if j < k:
        row[j] = 1.0
        return float(box[j])
    row[j - k] = -1.0
    return float(box[j - k])


@compiled()
def narrowest_zone(
    distances: Float, jacobian: Float, box: Float, lower: bool, tolerance: float,
    solution: Float, basis: Int, multipliers: Float,
) -> int:  # fmt: skip
    """Minimise the greatest minus the smallest of ``distances + slopes @ step`` in a box.

    ``distances`` (n,), ``jacobian`` (n, k) by the step, ``box`` (k,): largest step in every
    direction; without ``lower``, minimise the greatest alone; ``tolerance``: violation of a row
    that counts as rounding. With m = k + 1 or k + 2, written: ``solution`` (m,), the step and the
    upper bound, then the lower one; ``basis`` (m,), its rows (i: point i above, n + i: below, from
    2 n on: sides of the box); ``multipliers`` (m,) of these rows, nonnegative; those of either
    bound add up to one. Returns the number of exchanges, negative if stopped by rounding.
    """
    n, k = jacobian.shape
    m = k + 2 if lower else k + 1
    matrix, right, work = np.empty((m, m)), np.empty(m), np.empty((m, 2 * m))
    entering, weights = np.empty(m), np.empty(m)
    # Without a step the greatest distance is the upper bound, the smallest the lower.
    top, bottom = np.argmax(distances), np.argmin(distances)
    basis[k] = top
    multipliers[:] = 1.0
    if lower:
        basis[k + 1] = n + bottom
    for j in range(k):
        # Derivative of the zone by this unknown with these two contacts: move against it to the
        # side of the box, whose multiplier is the slope.
        slope = jacobian[top, j] - (jacobian[bottom, j] if lower else 0.0)
        basis[j] = 2 * n + j + (k if slope > 0.0 else 0)
        multipliers[j] = abs(slope)
    for i in range(m):
        right[i] = _set_row(basis[i], distances, jacobian, box, lower, matrix[i])
    for exchange in range(MAX_EXCHANGES):
        if not _inverted(matrix, work):
            return -exchange - 1
        for i in range(m):
            total = 0.0
            for j in range(m):
                # The rows of the basis are active.
                total += work[i, m + j] * right[j]
            solution[i] = total
            # Multipliers are recomputed from the basis to avoid accumulating errors. They are minus
            # the derivative of upper less lower by the right-hand sides, all nonnegative for a dual
            # feasible basis.
            value = -work[k, m + i]
            if lower:
                value += work[k + 1, m + i]
            multipliers[i] = max(value, 0.0)
        worst, code = tolerance, -1
        for i in range(n):
            # The sizes of the terms bound the rounding of their sum.
            value, sizes = distances[i], abs(distances[i]) + abs(solution[k])
            for j in range(k):
                value += jacobian[i, j] * solution[j]
                sizes += abs(jacobian[i, j] * solution[j])
            rounding = ROUNDING * sizes
            above = value - solution[k] - rounding
            # -1 never enters: without a lower bound there is no such row.
            below = solution[k + 1] - value - rounding if lower else -1.0
            if above > worst:
                worst, code = above, i
            if below > worst:
                worst, code = below, n + i
            # The first violated row instead of the worst (Bland) breaks most cycles among ties, and
            # MAX_EXCHANGES ends the rest.
            if code >= 0 and exchange > PLAIN_EXCHANGES:
                break
        for j in range(k):
            beyond = abs(solution[j]) - box[j]
            # Sides of the box have the unit of the step, not of a distance, and their own rounding.
            if beyond > max(worst, 1e-12 * box[j]):
                worst, code = beyond, 2 * n + j + (0 if solution[j] > 0.0 else k)
        # Primal feasible: the basis is optimal.
        if code < 0:
            return exchange
        for i in range(m):
            # A row of the basis is violated by rounding only.
            if basis[i] == code:
                return exchange
        bound = _set_row(code, distances, jacobian, box, lower, entering)
        greatest = 0.0
        for i in range(m):
            total = 0.0
            for j in range(m):
                # The entering row as a combination of those of the basis.
                total += entering[j] * work[j, m + i]
            weights[i] = total
            greatest = max(greatest, abs(total))
        leaving, ratio = -1, np.inf
        for i in range(m):
            # Ratio test: the row whose multiplier reaches zero first leaves. Ties go to the
            # greatest weight, the safest pivot.
            if weights[i] > SMALLEST_PIVOT * greatest:
                here = multipliers[i] / weights[i]
                tie = here < ratio + 1e-14 and leaving >= 0 and weights[i] > weights[leaving]
                if here < ratio - 1e-14 or tie:
                    leaving, ratio = i, here
        # No row can leave: infeasible, which in a box means rounding.
        if leaving < 0:
            return -exchange - 1
        basis[leaving], right[leaving] = code, bound
        matrix[leaving] = entering
    return -MAX_EXCHANGES
