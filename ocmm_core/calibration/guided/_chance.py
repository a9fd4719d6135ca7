"""Critical values of test statistics from the covariance of their inputs."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq
from scipy.special import chdtri, ndtr

from ocmm_core.geometry import Float


def square_limit(covariance: Float, probability: float) -> float:
    """Return the value that a sum of squares exceeds with a probability.

    Chi-square of the same three moments (Pearson; J. P. Imhof, Biometrika 48, 1961, 419-426,
    equation 4.1). ``covariance`` (n, n): of the squared normal numbers of mean zero.
    """
    values = np.maximum(np.linalg.eigvalsh(covariance), 0.0)
    first, second, third = (float(np.sum(values**power)) for power in (1, 2, 3))
    if third <= 0.0:
        return 0.0
    freedom = second**3 / third**2
    deviation = (float(chdtri(freedom, probability)) - freedom) / np.sqrt(freedom)
    return float(first + deviation * np.sqrt(second))


def range_limit(covariance: Float, probability: float) -> float:
    """Return the range that normal numbers exceed with at most a probability.

    Sum of the probabilities of all pairs, nearly sharp far out. ``covariance`` (n, n), mean zero.
    """
    variances = np.diag(covariance)
    upper = np.triu_indices(len(variances), 1)
    sigmas = np.sqrt(
        np.maximum((variances[:, None] + variances[None] - 2.0 * covariance)[upper], 0.0)
    )
    largest = float(np.max(sigmas, initial=0.0))
    if largest == 0.0:
        return 0.0
    sigmas = sigmas[sigmas > 1e-6 * largest] / largest

    def excess(limit: float) -> float:
        return float(np.sum(2.0 * ndtr(-limit / sigmas))) - probability

    return largest * float(brentq(excess, 0.1, 40.0, xtol=1e-6))
