"""Compiled descent to the narrowest zone from one start; terms as in `_solver`."""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.features.zones import _distance_kernel as distance_kernel
from ocmm_core.features.zones import _kernel as kernel
from ocmm_core.features.zones._distance_kernel import (
    STEP_SIZE,
    bounds_of,
    move_zone,
    possible_sizes,
    to_local,
    zone_about,
    zone_distances,
)
from ocmm_core.features.zones._kernel import narrowest_zone
from ocmm_core.geometry import Float, Int

SETTLED = 4e-16
"""Predicted gain of zone width, relative to the distances, that is rounding."""
POLISHES = 3
"""Newton steps after the width has settled."""
CLOSE = 1e-5
"""Longest of these, relative to the distances."""
FARTHEST = 1e3
"""Distance of an axis or centre, over the size of the points, at which a start is abandoned."""
_TINY = 1e-30
_SINGULAR = 1e-300


@compiled()
def _solved(matrix: Float, right: Float) -> bool:
    """Solve linear equations in place, the solution in ``right``; False if they are singular."""
    m = len(right)
    for i in range(m):
        pivot = i
        for row in range(i + 1, m):
            if abs(matrix[row, i]) > abs(matrix[pivot, i]):
                pivot = row
        if not abs(matrix[pivot, i]) > _SINGULAR:
            return False
        if pivot != i:
            for column in range(m):
                matrix[i, column], matrix[pivot, column] = matrix[pivot, column], matrix[i, column]
            right[i], right[pivot] = right[pivot], right[i]
        for row in range(i + 1, m):
            factor = matrix[row, i] / matrix[i, i]
            if factor != 0.0:
                for column in range(i, m):
                    matrix[row, column] -= factor * matrix[i, column]
                right[row] -= factor * right[i]
    for i in range(m - 1, -1, -1):
        for column in range(i + 1, m):
            right[i] -= matrix[i, column] * right[column]
        right[i] /= matrix[i, i]
    return True


@compiled(distance_kernel)
def _curvature(
    kind: int, sign: float, free: Int, local: Float, sizes: Float, weights: Float, steps: Float,
    hessian: Float,
) -> None:  # fmt: skip
    """Write the second derivatives by ``steps`` of the sum of weighted distances to (k, k)."""
    k, c = len(free), len(weights)
    places, found = local.astype(np.complex128), np.empty(c, np.complex128)
    jacobian, step = np.empty((c, STEP_SIZE), np.complex128), np.zeros(STEP_SIZE, np.complex128)
    plain = np.empty((k, k))
    for j in range(k):
        step[:] = 0.0
        step[free[j]] = _TINY * 1j
        zone_distances(kind, sign, places, sizes, step, found, jacobian)
        for i in range(k):
            total = 0.0
            for row in range(c):
                total += weights[row] * jacobian[row, free[i]].imag / _TINY
            plain[j, i] = total
    hessian[:] = steps.T @ plain @ steps


@compiled(distance_kernel)
def newton_step(
    kind: int, sign: float, lower: bool, even: bool, free: Int, local: Float, sizes: Float,
    middle: float, found: Float, by_step: Float, steps: Float, contacts: Int, multipliers: Float,
    limit: float, step: Float,
) -> bool:  # fmt: skip
    """Write the step to contact of all ``contacts`` with balanced forces to ``step`` (k,).

    Returns False if it is undefined or longer than ``limit``. Distances ``found`` are relative to
    ``middle``; contacts are coded as in `_kernel`.
    """
    n, k = by_step.shape
    c, bounds = len(contacts), 2 if lower else 1
    rows, signs, at = np.empty(c, np.int64), np.empty(c), np.empty((c, 3))
    for i in range(c):
        rows[i] = contacts[i] % n
        signs[i] = 1.0 if contacts[i] < n else -1.0
        at[i] = local[rows[i]]
    hessian = np.zeros((k, k))
    # As many contacts as unknowns pin the element.
    if c < k + bounds:
        _curvature(kind, sign, free, at, sizes, signs * multipliers, steps, hessian)
    size = k + bounds + c
    matrix, right = np.zeros((size, size)), np.zeros(size)
    matrix[:k, :k] = hessian
    for i in range(c):
        row = k + bounds + i
        for j in range(k):
            matrix[row, j] = by_step[rows[i], j]
            matrix[j, row] = signs[i] * by_step[rows[i], j]
        # A symmetric zone has one bound for both sides: the gap is |distance| - bound.
        bound = k + 1 if lower and signs[i] < 0.0 else k
        share = -signs[i] if even else -1.0
        matrix[row, bound], matrix[bound, row] = share, signs[i] * share
        right[row] = -found[rows[i]]
    right[k] = -1.0
    if lower:
        right[k + 1] = 1.0
    full, there, jacobian = np.zeros(STEP_SIZE), np.empty(c), np.empty((c, STEP_SIZE))
    for _ in range(2):
        # The second round uses the distances after the first (N. Maratos): contacts that curve away
        # would otherwise cancel the gain of a step along them.
        answer = right.copy()
        if not _solved(matrix.copy(), answer):
            return False
        for j in range(k):
            step[j] = answer[j]
            if not abs(step[j]) < limit:
                return False
        _full_step(free, steps, step, full)
        zone_distances(kind, sign, at, sizes, full, there, jacobian)
        for i in range(c):
            linear = 0.0
            for j in range(k):
                linear += by_step[rows[i], j] * step[j]
            right[k + bounds + i] = -(there[i] - middle - linear)
    return True


@compiled()
def _full_step(free: Int, steps: Float, step: Float, full: Float) -> None:
    """Write the step (8,) for free entries ``steps @ step`` to ``full``."""
    full[:] = 0.0
    for i in range(len(free)):
        total = 0.0
        for j in range(len(step)):
            total += steps[i, j] * step[j]
        full[free[i]] = total


@compiled(distance_kernel, kernel)
def settle_zone(
    kind: int, sign: float, lower: bool, even: bool, free: Int, points: Float, frame: Float,
    origin: Float, sizes: Float, steps: Float, radius: float, greatest: float, most: int,
) -> tuple[float, float, bool]:  # fmt: skip
    """Move an element to the narrowest zone about points (n, 3), in place.

    Returns the bounds of its zone and whether it settled. ``radius`` is the initial size of the
    trust region, ``greatest`` the largest, ``most`` the largest number of steps.
    """
    n, k = len(points), len(free)
    m = k + 2 if lower else k + 1
    local, found, jacobian = np.empty((n, 3)), np.empty(n), np.empty((n, STEP_SIZE))
    rows = 2 * n if even else n
    gaps, by_step = np.empty(rows), np.empty((rows, k))
    none, full, box = np.zeros(STEP_SIZE), np.empty(STEP_SIZE), np.empty(k)
    solution, basis, multipliers = np.zeros(m), np.zeros(m, np.int64), np.zeros(m)
    to_frame, to_origin, to_sizes = np.empty((3, 3)), np.empty(3), np.empty(3)
    newton = np.zeros(k)
    if not possible_sizes(kind, sizes):
        return np.inf, 0.0, False
    to_local(points, frame, origin, local)
    zone_distances(kind, sign, local, sizes, none, found, jacobian)
    upper, least = bounds_of(found, lower, even)
    polishes = 0
    for _ in range(most):
        to_local(points, frame, origin, local)
        zone_distances(kind, sign, local, sizes, none, found, jacobian)
        scale = max(1.0, np.abs(found).max())
        middle = 0.0
        if not even:
            # Relative to this, small differences of the distances stay exact.
            middle = 0.5 * (upper + least) if lower else upper
        for i in range(n):
            gaps[i] = found[i] - middle
            for j in range(k):
                total = 0.0
                for place in range(k):
                    total += jacobian[i, free[place]] * steps[place, j]
                by_step[i, j] = total
                if even:
                    by_step[n + i, j] = -total
            if even:
                # Every point counts with both signs; row n + i is then point i below.
                gaps[n + i] = -gaps[i]
        box[:] = radius
        narrowest_zone(gaps, by_step, box, lower, 0.0, solution, basis, multipliers)
        longest = 0.0
        for j in range(k):
            longest = max(longest, abs(solution[j]))
        before, after = bounds_of(gaps, lower, False), _linear(gaps, by_step, solution, lower)
        gain = (before[0] - before[1]) - (after[0] - after[1])
        held = basis < 2 * n
        touched = newton_step(
            kind, sign, lower, even, free, local, sizes, middle, gaps[:n], by_step[:n], steps,
            basis[held], multipliers[held], greatest, newton,
        )  # fmt: skip
        reach = np.abs(newton).max()
        width = upper - least
        top, bottom = upper, least
        if touched:
            _full_step(free, steps, newton, full)
            move_zone(frame, origin, sizes, full, to_frame, to_origin, to_sizes)
            top, bottom = zone_about(
                kind, sign, lower, even, points, to_frame, to_origin, to_sizes, local, found,
                jacobian,
            )  # fmt: skip
        if gain <= SETTLED * scale:
            # If curvature pins the element, its position converges later than its width.
            if not touched or polishes == POLISHES or reach > CLOSE * scale:
                return upper, least, True
            if top - bottom > width + 4.0 * SETTLED * scale:
                return upper, least, True
            polishes += 1
            upper, least = top, bottom
            frame[:], origin[:], sizes[:] = to_frame, to_origin, to_sizes
            continue
        if touched and width - (top - bottom) > 0.25 * gain:
            upper, least = top, bottom
            frame[:], origin[:], sizes[:] = to_frame, to_origin, to_sizes
            radius = min(max(radius, 2.0 * reach), greatest)
            continue
        _full_step(free, steps, solution[:k], full)
        move_zone(frame, origin, sizes, full, to_frame, to_origin, to_sizes)
        top, bottom = zone_about(
            kind, sign, lower, even, points, to_frame, to_origin, to_sizes, local, found, jacobian
        )
        won = width - (top - bottom)
        if won < 0.25 * gain:
            radius = 0.25 * min(radius, longest)
        elif won > 0.75 * gain:
            radius = min(2.0 * radius, greatest)
        if won > 0.0:
            upper, least = top, bottom
            frame[:], origin[:], sizes[:] = to_frame, to_origin, to_sizes
        elif radius < 1e-17:
            break
        if np.abs(origin).max() > FARTHEST:
            break
    return upper, least, False


@compiled()
def _linear(gaps: Float, by_step: Float, solution: Float, lower: bool) -> tuple[float, float]:
    """Return the bounds of the linear problem after its step."""
    greatest, smallest = -np.inf, np.inf
    for i in range(len(gaps)):
        value = gaps[i]
        for j in range(by_step.shape[1]):
            value += by_step[i, j] * solution[j]
        greatest, smallest = max(greatest, value), min(smallest, value)
    return greatest, smallest if lower else 0.0
