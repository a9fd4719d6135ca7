"""Noise floor of form results: value of a perfect part; printed, never subtracted."""

from __future__ import annotations

import numpy as np

from ocmm_core.geometry import Float
from ocmm_core.tolerances.zones import FormNoise

DRAWS = 100
"""Their ranges scatter by some 20 %: the mean is good to 2 %."""
MANY = 200
DRAWS_OF_MANY = 30
"""Ranges of many points scatter less."""
SEED = 20
_STEPS = 40
_NOTHING = 1e-7
"""Relative effect of a parameter that counts as zero."""
_JITTER = 1e-9
"""Relative addition to the variances, as rounding may make the matrix indefinite."""


def noise_floor(noise: FormNoise, errors: Float, seed: int = SEED) -> float:
    """Return the mean value, mm, of a perfect part by noise; ``errors``: (m, m), mm^2."""
    rows = len(errors) // 2 if noise.mirrored else len(errors)
    errors = errors[:rows, :rows]
    variances = np.maximum(np.diagonal(errors), 0.0)
    greatest = float(variances.max())
    if not greatest > 0.0:
        return 0.0
    lower = np.linalg.cholesky(errors + 2.0 * _JITTER * greatest * np.eye(len(errors)))
    count = DRAWS if rows < MANY else DRAWS_OF_MANY
    draws = np.random.default_rng(seed).standard_normal((count, rows)) @ lower.T
    if noise.free.shape[1]:
        return 2.0 * float(least_greatest(draws, noise.free[:rows]).mean())
    if noise.mirrored:
        return 2.0 * float(np.abs(draws).max(axis=1).mean())
    return float(np.ptp(draws, axis=1).mean())


def least_greatest(deviations: Float, free: Float) -> Float:
    """Return the minimised greatest amount (b,) of rows over ``free``, to two percent."""
    lower, upper = bounds_of_least(deviations, free, _STEPS)
    middle: Float = 0.5 * (upper + np.minimum(lower, upper))
    return middle


def bounds_of_least(deviations: Float, free: Float, steps: int) -> tuple[Float, Float]:
    """Return lower and upper bounds of the minimised greatest amount of each row, (b,).

    `deviations`: (b, n). `free`: (n, k): any combination of the columns may be subtracted from each
    row. `steps`: more steps give tighter bounds. Lawson's weights (C. Lawson, thesis, UCLA 1961):
    weighted least squares whose weights grow with the residuals. The weighted mean square is a
    lower bound, the greatest residual an upper one.
    """
    u, strengths, _ = np.linalg.svd(free, full_matrices=False)
    basis = u[:, strengths > _NOTHING * max(float(strengths[0]), 1e-300)]
    weights = np.full(deviations.shape, 1.0 / deviations.shape[1])
    upper = np.full(len(deviations), np.inf)
    lower = np.zeros(len(deviations))
    ridge = 1e-12 * np.eye(basis.shape[1])
    for _ in range(steps):
        weighted = weights[:, :, None] * basis
        normal = basis.T @ weighted + ridge * np.max(weights, axis=1)[:, None, None]
        right = np.einsum("bnk,bn->bk", weighted, deviations)
        taken = np.linalg.solve(normal, right[:, :, None])[:, :, 0]
        left = np.abs(deviations - taken @ basis.T)
        upper = np.minimum(upper, left.max(axis=1))
        lower = np.maximum(lower, np.sqrt(np.sum(weights * left**2, axis=1)))
        weights = weights * left
        weights /= np.maximum(weights.sum(axis=1), 1e-300)[:, None]
    return lower, upper
