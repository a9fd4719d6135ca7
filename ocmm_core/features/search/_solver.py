"""Nonlinear least squares for the fits: Newton steps guarded by Levenberg-Marquardt.

Orthogonal-distance problems have few parameters and cheap second derivatives, with which steps
converge quadratically even for large residuals or short arcs, where Gauss-Newton alone is slow.
Source: J. Nocedal and S. Wright, Numerical Optimization (2nd ed.), chapter 10; the damping is
Marquardt's. The loops are those of `newton_kernel`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.features.search._axis_kernel import RING
from ocmm_core.features.search._newton_kernel import STEP_SIZE, gain_of, move, newton, terms
from ocmm_core.geometry import Float

WELL_CONDITIONED = 1e-10
"""Smallest over greatest eigenvalue of scaled normal equations above which they are used."""


@dataclass(frozen=True, slots=True)
class Solution:
    """Result of the iteration."""

    parameters: Float
    """(8,), as defined by `axis_kernel` and `flat_kernel` for the kind."""
    cost: float
    converged: bool
    """False if the steps did not become short."""


def minimise(kind: int, points: Float, start: Float) -> Solution:
    """Return the local minimum reached from ``start`` (8,) with points (n, d)."""
    parameters = start.copy()
    cost, converged = newton(kind, points, parameters)
    return Solution(parameters, float(cost), bool(converged))


def derivatives(kind: int, points: Float, parameters: Float) -> tuple[Float, Float, Float]:
    """Return residuals and their derivatives by a step.

    Residuals (n,), first derivatives (n, k), and the sum (k, k) of every residual times its matrix
    of second derivatives; 2 n rows for a ring.
    """
    k = STEP_SIZE[kind]
    rows = len(points) * (2 if kind == RING else 1)
    residuals, jacobian, curvature = np.empty(rows), np.empty((k, rows)).T, np.empty((k, k))
    terms(kind, points, parameters, residuals, jacobian, curvature)
    return residuals, jacobian, curvature


def moved(kind: int, parameters: Float, step: Float) -> Float:
    """Return the parameters (8,) after a step (k,); for tests."""
    after = np.empty(8)
    move(kind, parameters, step, after)
    return after


def gains(jacobian: Float) -> tuple[Float, Float, float]:
    """Return the pseudoinverse of ``jacobian`` (n, k) in two parts, and its condition.

    It is the first part (k, k) times the second (n, k) transposed. Columns are scaled to unit
    length, so that the condition number depends on the geometry of the points, not on units.
    """
    k = jacobian.shape[1]
    gain = np.empty((k, k))
    least, greatest = gain_of(jacobian, gain)
    if least > WELL_CONDITIONED * greatest:
        return gain, jacobian, float(np.sqrt(greatest / least))
    # Squaring lost too many digits; use the pseudoinverse itself.
    scale = np.linalg.norm(jacobian, axis=0)
    scale[scale == 0.0] = 1.0
    u, s, vt = np.linalg.svd(jacobian / scale, full_matrices=False)
    condition = float(s[0] / s[-1]) if s[-1] > 0.0 else np.inf
    inverse_s = np.where(s > 1e-300, 1.0 / np.maximum(s, 1e-300), 0.0)
    return np.eye(k), u @ (vt * inverse_s[:, None] / scale), condition


def sensitivity(jacobian: Float) -> tuple[Float, float]:
    """Return the pseudoinverse (k, n) of ``jacobian`` (n, k) and its condition number."""
    gain, shifts, condition = gains(jacobian)
    inverse: Float = gain @ shifts.T
    return inverse, condition
