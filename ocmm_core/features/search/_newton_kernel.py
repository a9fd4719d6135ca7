"""Compiled iterations of all fits: guarded Newton steps, and descent of many starts."""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.features.search import _axis_kernel as axis_kernel
from ocmm_core.features.search import _ellipse_kernel as ellipse_kernel
from ocmm_core.features.search import _flat_kernel as flat_kernel
from ocmm_core.features.search import _lanes_kernel as lanes_kernel
from ocmm_core.features.search._axis_kernel import CYLINDER, RING, axis_costs, axis_terms, move_axis
from ocmm_core.features.search._ellipse_kernel import ellipse_terms
from ocmm_core.features.search._flat_kernel import (
    BALL,
    DISC,
    ELLIPSE,
    ball_terms,
    move_flat,
    slot_terms,
)
from ocmm_core.features.search._lanes_kernel import (
    ENOUGH,
    FIRST_DAMPING,
    MOST_DAMPING,
    descend_lanes,
)
from ocmm_core.geometry import Float

# Cylinder, cone, torus, ring; disc, ball, ellipse, slot with round and with square ends.
STEP_SIZE = (5, 6, 7, 6, 3, 4, 5, 5, 5)
"""Length of a step by the kind of `axis_kernel` and `flat_kernel`."""

MAX_STEPS = 100
CONVERGED = 1e-13
"""Length of a step, relative to that of the parameters, at convergence."""
STAGNATED = 1e-8
"""The same if rounding prevents shorter steps."""
ROUNDING = 1e-15
"""Of residuals, for coordinates scaled to one."""
QUADRATIC = 1e-10
"""Length of an undamped Newton step whose square is negligible."""
NOISE_OF_COST = 1e-12
"""Relative increase of the cost that counts as rounding."""
LEFT = 1e-9
"""Relative gain of the cost that a full Newton step may still predict at a minimum."""
# Relative to the diagonal of J'J, after Marquardt.
NEWTON_DAMPING, LEAST_DAMPING = 1e-4, 1e-16
"""Initial damping, and the value below which it is zero. In a valley with an aspect ratio of a
million, a damping of 1e-9 still reduces the step by a ten thousandth.
"""

UNMOVED = 1e-60
"""Pivot that fixes an unknown without effect on residuals, such as the length of half a slot."""


@compiled(axis_kernel, ellipse_kernel, flat_kernel)
def move(kind: int, p: Float, step: Float, moved: Float) -> None:
    """Write the parameters (8,) after a step (k,) to ``moved``."""
    if kind <= RING:
        move_axis(kind, p, step, moved)
    else:
        move_flat(kind, p, step, moved)


@compiled(axis_kernel, ellipse_kernel, flat_kernel)
def terms(
    kind: int, points: Float, p: Float, residuals: Float, jacobian: Float, curvature: Float
) -> float:
    """Write the derivatives by a step and return the cost; see `axis_kernel.axis_terms`."""
    if kind <= RING:
        return axis_terms(kind, points, p, residuals, jacobian, curvature)
    if kind in (DISC, BALL):
        return ball_terms(kind - DISC + 2, points, p, residuals, jacobian, curvature)
    if kind == ELLIPSE:
        return ellipse_terms(points, p, residuals, jacobian, curvature)
    return slot_terms(kind, points, p, residuals, jacobian, curvature)


@compiled(reorder=True)
def _normal(jacobian: Float, residuals: Float, normal: Float, gradient: Float) -> None:
    """Write the lower half of J'J to ``normal`` (k, k) and J'r to ``gradient`` (k,)."""
    n, k = jacobian.shape
    for i in range(k):
        total = 0.0
        for row in range(n):
            total += jacobian[row, i] * residuals[row]
        gradient[i] = total
        for j in range(i + 1):
            total = 0.0
            for row in range(n):
                total += jacobian[row, i] * jacobian[row, j]
            normal[i, j] = total


@compiled()
def solve_step(
    normal: Float, curvature: Float, gradient: Float, damping: float, share: float, factor: Float,
    step: Float,
) -> bool:  # fmt: skip
    """Write minus the solution of the damped equations to ``step``; False if not convex.

    ``share`` is the fraction of the curvature added to the normal matrix. ``factor`` (k, k) is a
    work array and may be ``normal`` itself, which is then destroyed.
    """
    k = len(gradient)
    for i in range(k):
        for j in range(i + 1):
            # J'J + share C, lower triangle. With r'r / 2 as the function, J'r is its gradient and
            # J'J + C its Hessian, so that share 1 is Newton and share 0 Gauss-Newton.
            total = normal[i, j] + share * curvature[i, j]
            if i == j:
                # UNMOVED is far below any square of a coordinate near one, and changes no digit of
                # a pivot that affects a residual.
                total += damping * normal[i, i] + UNMOVED
            for m in range(j):
                total -= factor[i, m] * factor[j, m]
            if i == j:
                # No Cholesky factor: not convex here, or NaN.
                if not total > 0.0:
                    return False
                factor[i, i] = np.sqrt(total)
            else:
                factor[i, j] = total / factor[j, j]
    for i in range(k):
        # The step is against the gradient; residuals are distance minus size.
        total = -gradient[i]
        for m in range(i):
            total -= factor[i, m] * step[m]
        step[i] = total / factor[i, i]
    for i in range(k - 1, -1, -1):
        total = step[i]
        for m in range(i + 1, k):
            total -= factor[m, i] * step[m]
        step[i] = total / factor[i, i]
    return True


@compiled()
def gain_of(jacobian: Float, gain: Float) -> tuple[float, float]:
    """Write the inverse of J'J to ``gain`` (k, k), for ``jacobian`` (n, k).

    Returns the least and the greatest eigenvalue of J'J with columns scaled to unit length.
    """
    n, k = jacobian.shape
    normal, scale, unused = np.zeros((k, k)), np.ones(k), np.empty(k)
    _normal(jacobian, np.zeros(n), normal, unused)
    for i in range(k):
        if normal[i, i] > 0.0:
            # Unit columns make angles and lengths comparable; the eigenvalues then measure how well
            # the points separate the unknowns. A zero column stays.
            scale[i] = 1.0 / np.sqrt(normal[i, i])
    for i in range(k):
        for j in range(i + 1):
            normal[i, j] *= scale[i] * scale[j]
            normal[j, i] = normal[i, j]
    values, vectors = np.linalg.eigh(normal)
    for i in range(k):
        for j in range(i + 1):
            total = 0.0
            for m in range(k):
                # (S J'J S)^-1 by its eigenvectors, then S on both sides: the inverse of J'J.
                total += vectors[i, m] * vectors[j, m] / values[m]
            gain[i, j] = total * scale[i] * scale[j]
            gain[j, i] = gain[i, j]
    return values[0], values[k - 1]


@compiled()
def at_rest(
    normal: Float, curvature: Float, gradient: Float, least: float, factor: Float, step: Float
) -> bool:
    """Return whether a full step predicts a decrease of the cost of at most ``least``.

    A short damped step, or a step that no damping helps, does not prove a minimum. For ``factor``
    and ``step`` (work arrays) see `solve_step`.
    """
    if not solve_step(normal, curvature, gradient, 0.0, 1.0, factor, step) and not solve_step(
        normal, curvature, gradient, 1e-14, 0.0, factor, step
    ):
        return False
    promised = 0.0
    for i in range(len(gradient)):
        # Half of the cost, the sum of squares, changes by g's + s'Hs / 2, with H s = -g by g's / 2:
        # the cost falls by -g's.
        promised -= gradient[i] * step[i]
    return promised <= least


@compiled(axis_kernel, ellipse_kernel, flat_kernel)
def newton(kind: int, points: Float, p: Float) -> tuple[float, bool]:
    """Move ``p`` (8,) to the next minimum, in place; return its cost and convergence."""
    k = STEP_SIZE[kind]
    # A point of a ring has two residuals, radial and along its axis.
    rows = len(points) * (2 if kind == RING else 1)
    # Column by column: sums over the rows then vectorise.
    residuals, jacobian, curvature = np.empty(rows), np.empty((k, rows)).T, np.empty((k, k))
    new_residuals, new_jacobian, new_curvature = (
        np.empty(rows), np.empty((k, rows)).T, np.empty((k, k))
    )  # fmt: skip
    normal, factor = np.zeros((k, k)), np.zeros((k, k))
    gradient, step, moved = np.empty(k), np.empty(k), np.empty(8)
    cost = terms(kind, points, p, residuals, jacobian, curvature)
    _normal(jacobian, residuals, normal, gradient)
    damping = 0.0
    last_length = np.inf
    for _ in range(MAX_STEPS):
        # Without convexity a Newton step might climb; a Gauss-Newton step does not.
        convex = solve_step(normal, curvature, gradient, damping, 1.0, factor, step)
        solved = convex or solve_step(
            normal, curvature, gradient, max(damping, 1e-14), 0.0, factor, step
        )
        new_cost = np.inf
        length = np.inf
        # The step is tried on a copy: p stays until the cost is accepted.
        if solved:
            move(kind, p, step, moved)
            new_cost = terms(kind, points, moved, new_residuals, new_jacobian, new_curvature)
            of_step = of_p = 0.0
            for i in range(k):
                of_step += step[i] * step[i]
            for i in range(8):
                of_p += p[i] * p[i]
            length = np.sqrt(of_step) / (1.0 + np.sqrt(of_p))
        # Residuals carry the rounding of coordinates near one, however small they are. A difference
        # of two costs carries it twice.
        noise = NOISE_OF_COST * cost + ROUNDING * np.sqrt(rows * cost) + rows * ROUNDING**2
        # Rejected; written so that NaN and infinity are rejected also. A rise by rounding is
        # accepted, or the last steps at a minimum would be refused at random.
        if not new_cost <= cost + noise:
            # So short a step cannot decrease the cost: a minimum, unless damping made it short.
            if length < CONVERGED:
                return cost, damping == 0.0 or at_rest(
                    normal, curvature, gradient, LEFT * cost + 2.0 * noise, factor, step
                )
            damping = 10.0 * damping if damping > 0.0 else NEWTON_DAMPING
            # Beyond float64 resolution.
            if damping > 1e20:
                break
            continue
        p[:] = moved
        cost = new_cost
        residuals, new_residuals = new_residuals, residuals
        jacobian, new_jacobian = new_jacobian, jacobian
        curvature, new_curvature = new_curvature, curvature
        _normal(jacobian, residuals, normal, gradient)
        if (
            # Converged in one of three ways: the step is rounding; it stays small and no longer
            # halves; or it was a pure Newton step, whose error is about its square.
            length < CONVERGED
            or (length < STAGNATED and length > 0.5 * last_length)
            or (length < QUADRATIC and convex and damping == 0.0)
        ) and (
            damping == 0.0
            or at_rest(normal, curvature, gradient, LEFT * cost + 2.0 * noise, factor, step)
        ):
            return cost, True
        # Step accepted: ten times less damping, and zero below the least.
        last_length = length
        damping = 0.1 * damping if damping > LEAST_DAMPING else 0.0
    return cost, False


@compiled(axis_kernel, ellipse_kernel, flat_kernel, lanes_kernel)
def descend(kind: int, points: Float, starts: Float, steps: int, costs: Float) -> None:
    """Apply some damped Gauss-Newton steps to every start (8,), in place.

    A sample of the points (n, d) suffices, as the best ends are refined with all. ``costs`` (m,)
    are written: sums of squared residuals. Any kind but a ring and a ball.
    """
    n, k = len(points), STEP_SIZE[kind]
    if kind < RING:
        descend_lanes(kind, k, points, starts, steps, costs)
        return
    residuals, jacobian, unused = np.empty(n), np.empty((k, n)).T, np.empty((0, 0))
    normal, factor = np.zeros((k, k)), np.zeros((k, k))
    gradient, step, moved = np.empty(k), np.empty(k), np.empty(8)
    for m in range(len(starts)):
        p = starts[m]
        cost = terms(kind, points, p, residuals, jacobian, unused)
        # Starts are rough, and only their order and basin matter: plain Gauss-Newton without second
        # derivatives, selected by an empty curvature.
        damping = FIRST_DAMPING
        fresh = True
        for _ in range(steps):
            if fresh:
                _normal(jacobian, residuals, normal, gradient)
            # With a share of zero the curvature is not used.
            if not solve_step(normal, normal, gradient, damping, 0.0, factor, step):
                break
            move(kind, p, step, moved)
            new_cost = terms(kind, points, moved, residuals, jacobian, unused)
            fresh = new_cost < cost
            if fresh:
                enough = new_cost > cost * (1.0 - ENOUGH)
                p[:] = moved
                cost = new_cost
                damping *= 0.1
                if enough:
                    break
            else:
                damping *= 10.0
                # No further descent here; other starts continue.
                if damping > MOST_DAMPING:
                    break
        costs[m] = cost


@compiled(axis_kernel, ellipse_kernel, flat_kernel)
def rank(kind: int, points: Float, starts: Float, costs: Float) -> None:
    """Write the sum of squared residuals at every start (m, 8) to ``costs`` (m,)."""
    if CYLINDER <= kind < RING:
        axis_costs(kind, points, starts, costs)
        return
    n, k = len(points), STEP_SIZE[kind]
    residuals, jacobian, unused = np.empty(n), np.empty((k, n)).T, np.empty((0, 0))
    for m in range(len(starts)):
        costs[m] = terms(kind, points, starts[m], residuals, jacobian, unused)
