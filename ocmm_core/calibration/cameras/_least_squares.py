"""Levenberg-Marquardt for any differentiable projection.

Scaled by column norms (Marquardt), damped by achieved over predicted decrease. The problem updates
its state, so that rotations are composed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from ocmm_core.geometry import Float

S = TypeVar("S")

FIRST_DAMPING = 1e-4
LARGEST_DAMPING = 1e12
RELATIVE_DECREASE = 1e-11
ABSOLUTE_DECREASE = 1e-12
"""Residuals are in units of sigma; chi-square is minimal if it can decrease by no more."""


class Projector(Protocol[S]):
    """Problem to be fitted."""

    def linearise(self, state: S) -> tuple[Float, Float]:
        """Return residuals (m,), predicted minus observed, in sigmas, and d/d(step), (m, p).

        Non-finite residuals mark an impossible state.
        """
        ...

    def moved(self, state: S, step: Float) -> S:
        """Return the state after a small ``step`` (p,)."""
        ...


@dataclass(frozen=True, slots=True)
class Minimum(Generic[S]):
    """Result of a fit."""

    state: S
    residuals: Float
    jacobian: Float
    """`residuals`, `jacobian`: (m,) and (m, p) there."""
    cost: float
    """Sum of the squared residuals."""
    iterations: int
    """Number of linearisations after the first."""
    converged: bool
    """Whether the cost cannot decrease further."""


def minimise(
    problem: Projector[S], start: S, max_iterations: int = 60, enough: float = ABSOLUTE_DECREASE
) -> Minimum[S]:
    """Return the minimum from ``start``, or infinite cost; ends at falls up to ``enough``."""
    state = start
    residuals, jacobian = problem.linearise(state)
    cost = _cost(residuals)
    if not np.isfinite(cost):
        return Minimum(state, residuals, jacobian, np.inf, 0, converged=False)
    normal, gradient, scale = _normal_equations(residuals, jacobian)
    damping = FIRST_DAMPING
    for iteration in range(1, max_iterations + 1):
        damped = normal.copy()
        damped.flat[:: len(damped) + 1] += damping
        step = -np.linalg.solve(damped, gradient)
        predicted = -float(step @ (2.0 * gradient + normal @ step))
        small = predicted <= RELATIVE_DECREASE * cost + enough
        if small and damping <= 1.0:
            return Minimum(state, residuals, jacobian, cost, iteration - 1, converged=True)
        trial = problem.moved(state, step / scale)
        trial_residuals, trial_jacobian = problem.linearise(trial)
        trial_cost = _cost(trial_residuals)
        ratio = (cost - trial_cost) / predicted if predicted > 0.0 else -np.inf
        if not ratio > 0.0:
            damping *= 10.0
            if damping > LARGEST_DAMPING:
                # No step length helps: the slope is pure rounding.
                return Minimum(state, residuals, jacobian, cost, iteration, converged=small)
            continue
        state, residuals, jacobian, cost = trial, trial_residuals, trial_jacobian, trial_cost
        normal, gradient, scale = _normal_equations(residuals, jacobian)
        if ratio > 0.75:
            damping = max(0.1 * damping, 1e-15)
        elif ratio < 0.25:
            damping *= 4.0
    return Minimum(state, residuals, jacobian, cost, max_iterations, converged=False)


def covariance_of(jacobian: Float) -> Float | None:
    """Return the covariance (p, p) for residuals of unit variance; None if undetermined."""
    scale = np.linalg.norm(jacobian, axis=0)
    if not np.all(scale > 0.0):
        return None
    scaled = jacobian / scale
    normal = scaled.T @ scaled
    try:
        inverse = np.linalg.inv(normal)
    except np.linalg.LinAlgError:
        return None
    # Above this condition the leading digit of a variance is rounding error.
    if not np.abs(normal).sum(axis=0).max() * np.abs(inverse).sum(axis=0).max() < 1e14:
        return None
    covariance: Float = inverse / scale / scale[:, None]
    return 0.5 * (covariance + covariance.T)


def _cost(residuals: Float) -> float:
    cost = float(residuals @ residuals)
    return cost if np.isfinite(cost) else np.inf


def _normal_equations(residuals: Float, jacobian: Float) -> tuple[Float, Float, Float]:
    """Return the normal matrix and gradient in scaled parameters, and the scale (p,)."""
    normal = jacobian.T @ jacobian
    scale = np.sqrt(normal.diagonal())
    scale[scale == 0.0] = 1.0
    return normal / scale / scale[:, None], (jacobian.T @ residuals) / scale, scale
