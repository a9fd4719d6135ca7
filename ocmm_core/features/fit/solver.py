"""Nonlinear least squares for the fits: Newton steps guarded by Levenberg and Marquardt.

Orthogonal-distance problems have few parameters and cheap second derivatives. With these the
steps converge quadratically also where residuals are large or arcs short, where Gauss-Newton
steps alone crawl. Source of the method: J. Nocedal and S. Wright, Numerical Optimization
(2nd ed.), chapter 10; the damping is Marquardt's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ocmm_core.geometry import Float

MAX_STEPS = 100
CONVERGED = 1e-13
"""Length of a step, against that of the parameters, below which the iteration has converged."""
STAGNATED = 1e-8
"""The same where rounding keeps the steps from becoming shorter."""
NOISE_OF_COST = 1e-12
"""Relative increase of the cost that counts as rounding."""


class Problem(Protocol):
    """A sum of squares over n points with k parameters; parameters may live on a manifold."""

    def derivatives(self, parameters: Float) -> tuple[Float, Float, Float]:
        """Return residuals and their derivatives by a step.

        Residuals (n,), first derivatives (n, k), and the sum (k, k) of every residual times its
        matrix of second derivatives.
        """
        ...

    def move(self, parameters: Float, step: Float) -> Float:
        """Return the parameters after a step (k,)."""
        ...


@dataclass(frozen=True, slots=True)
class Solution:
    """Where the iteration ended.

    Attributes
    ----------
    parameters
        As the problem defines them.
    cost
        Sum of squared residuals.
    converged
        False where the steps did not become short.
    """

    parameters: Float
    cost: float
    converged: bool


def minimise(problem: Problem, start: Float) -> Solution:
    """Return the local minimum of ``problem`` that is reached from ``start``."""
    parameters = start
    residuals, jacobian, curvature = problem.derivatives(parameters)
    cost = float(residuals @ residuals)
    damping = 0.0
    last_length = np.inf
    for _ in range(MAX_STEPS):
        step = _step(jacobian, residuals, curvature, damping)
        moved = problem.move(parameters, step)
        trial = problem.derivatives(moved)
        new_cost = float(trial[0] @ trial[0])
        length = float(np.linalg.norm(step)) / (1.0 + float(np.linalg.norm(parameters)))
        if not new_cost <= cost * (1.0 + NOISE_OF_COST) + len(residuals) * 1e-30:
            if length < CONVERGED:
                return Solution(parameters, cost, True)
            damping = max(10.0 * damping, 1e-4)
            if damping > 1e20:
                break
            continue
        parameters, cost = moved, new_cost
        residuals, jacobian, curvature = trial
        # A damped step is short because it is damped, which proves nothing.
        if damping < 1e-3 and (
            length < CONVERGED or (length < STAGNATED and length > 0.5 * last_length)
        ):
            return Solution(parameters, cost, True)
        last_length = length
        damping = 0.1 * damping if damping > 1e-9 else 0.0
    return Solution(parameters, cost, False)


def _step(jacobian: Float, residuals: Float, curvature: Float, damping: float) -> Float:
    gradient = jacobian.T @ residuals
    normal = jacobian.T @ jacobian
    ridge = np.diag(damping * np.diag(normal))
    hessian = normal + curvature + ridge
    try:
        np.linalg.cholesky(hessian)
        solution = np.linalg.solve(hessian, gradient)
    except np.linalg.LinAlgError:
        # Not convex here: a Newton step might climb, a Gauss-Newton step does not.
        solution = np.linalg.lstsq(normal + ridge, gradient, rcond=None)[0]
    return np.asarray(-solution, dtype=np.float64)


def sensitivity(jacobian: Float) -> tuple[Float, float]:
    """Return the pseudoinverse (k, n) of ``jacobian`` (n, k) and its condition number.

    The columns are scaled to length one first, so that the condition number tells of the
    geometry of the points and not of units.
    """
    scale = np.linalg.norm(jacobian, axis=0)
    scale = np.where(scale > 0.0, scale, 1.0)
    inverse: Float
    u, s, vt = np.linalg.svd(jacobian / scale, full_matrices=False)
    condition = float(s[0] / s[-1]) if s[-1] > 0.0 else np.inf
    inverse_s = np.where(s > 1e-300, 1.0 / np.maximum(s, 1e-300), 0.0)
    inverse = (vt.T * inverse_s) @ u.T / scale[:, None]
    return inverse, condition
