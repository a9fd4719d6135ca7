"""Statements on a true value from a measured one: normal, a length, or a size by rank.

Errors of a diameter are symmetric. A position (twice a distance) or a form (a range) cannot be
negative, and noise makes both appear greater. For them the statements come from the scatter of the
measured value about a supposed true one:

- the part conforms if a value as small as the measured one would be improbable for a part at the
  limit, counted so that noise never helps;
- it does not if a value as great would be improbable for a part at the limit, including the noise
  that increases it.

Ranges of many deviations are in `_spread`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from statistics import NormalDist
from typing import Protocol

import numpy as np
import scipy

from ocmm_core.geometry import Float

TWO_SIDED = 0.954499736103642
"""Probability within two standard deviations, the coverage of U = 2 u."""

ONE_SIDED = 0.9772498680518208
"""Probability below two standard deviations on one side."""

_WIDTH = 9.0
"""Integration range of a normal density, in standard deviations to each side."""

_REACH = 8.0
"""Search range of a rank's bound, in standard uncertainties."""

_HALVINGS = 11
"""Bisections of a bound: to two thousandths of the value."""

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(48)


class Spread(Protocol):
    """Distribution of a measured value about the true one."""

    @property
    def sigma(self) -> float: ...

    @property
    def one_sided(self) -> bool:
        """Return whether the value has no lower limit because it is nonnegative."""
        ...

    def inside(self, low: float, high: float) -> float:
        """Return the probability that the true value is between the limits."""
        ...

    def beyond(self, low: float, high: float) -> float:
        """Return the probability that it is beyond one limit, the more probable one."""
        ...

    def least(self, probability: float) -> float:
        """Return the lower confidence bound of the true value."""
        ...

    def most(self, probability: float) -> float:
        """Return the upper confidence bound of the true value."""
        ...


@dataclass(frozen=True, slots=True)
class Normal:
    """A value with a normal error."""

    value: float
    sigma: float
    """`value`, `sigma`: As measured, and its standard uncertainty."""
    one_sided: bool = False
    """Only the upper limit counts."""

    def inside(self, low: float, high: float) -> float:
        """Return the probability that the true value is between the limits."""
        return normal_probability((high - self.value) / self.sigma) - normal_probability(
            (low - self.value) / self.sigma
        )

    def beyond(self, low: float, high: float) -> float:
        """Return the probability that it is beyond one limit, the more probable one.

        One limit at a time: else a value amid a narrow tolerance would be proven outside.
        """
        return max(
            normal_probability((low - self.value) / self.sigma),
            normal_probability((self.value - high) / self.sigma),
        )

    def least(self, probability: float) -> float:
        """Return the lower confidence bound of the true value."""
        return self.value - self.sigma * normal_quantile(probability)

    def most(self, probability: float) -> float:
        """Return the upper confidence bound of the true value."""
        return self.value + self.sigma * normal_quantile(probability)


@dataclass(frozen=True, slots=True)
class Length:
    """The length of a vector with a normal error: position, coaxiality."""

    vector: Float
    """(k,), k of 1 to 3, as measured."""
    covariance: Float
    """(k, k) of its error."""

    @property
    def one_sided(self) -> bool:
        """Return True: a length has an upper limit only."""
        return True

    @property
    def value(self) -> float:
        return float(np.linalg.norm(self.vector))

    @property
    def sigma(self) -> float:
        """Return the standard uncertainty along `way`; NaN for an invalid covariance."""
        variance = float(self.way @ self.covariance @ self.way)
        return math.sqrt(variance) if variance >= 0.0 else math.nan

    @property
    def way(self) -> Float:
        """Return the unit vector (k,) along the vector, or of greatest error if it is zero."""
        length = float(np.linalg.norm(self.vector))
        if length > 0.0:
            return self.vector / length
        if not np.all(np.isfinite(self.covariance)):
            return np.full(len(self.vector), math.nan)
        return np.linalg.eigh(self.covariance)[1][:, -1]

    def inside(self, low: float, high: float) -> float:
        """Return the probability that the true vector ends within the zone.

        All are equally likely a priori: ISO 14253-1 in the dimensions of the zone.
        """
        return within(high, self.vector, self.covariance)

    def beyond(self, low: float, high: float) -> float:
        """Return the improbability of such a length for a part at the limit, less from one."""
        return within(float(np.linalg.norm(self.vector)), self.way * high, self.covariance)

    def least(self, probability: float) -> float:
        """Return the lower confidence bound of the true value."""
        return bisect_least(self.value, lambda supposed: self.beyond(0.0, supposed), probability)

    def most(self, probability: float) -> float:
        """Return the upper confidence bound of the true value."""
        farthest = float(np.linalg.norm(self.vector)) + _WIDTH * math.sqrt(
            max(float(np.linalg.eigvalsh(self.covariance)[-1]), 0.0)
        )
        low, high = self.value, farthest
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            if self.beyond(0.0, middle) >= 1.0 - probability:
                low = middle
            else:
                high = middle
        return low


@dataclass(frozen=True, slots=True)
class Rank:
    """The greatest or smallest of many sizes with normal errors."""

    value: float
    sigma: float
    """`value`, `sigma`: The size of that rank, and its standard uncertainty."""
    sizes: Float
    """(m,): all of them."""
    covariance: Float
    """(m, m) of their errors."""
    greatest: bool
    seed: int = 1
    _noise: list[Float] = field(default_factory=list, repr=False, compare=False)

    @property
    def one_sided(self) -> bool:
        """Return False: a size has two limits."""
        return False

    def inside(self, low: float, high: float) -> float:
        """Return the probability that the true value is between the limits, without noise gain.

        On the side towards which noise moves the value, `_nearer` gives the appearance of a part at
        the limit; on the other side noise cannot help.
        """
        near, far = (low, high) if self.greatest else (high, low)
        sign = 1.0 if self.greatest else -1.0
        beyond_far = normal_probability(sign * (self.value - far) / self.sigma)
        return self._nearer(near) - beyond_far

    def beyond(self, low: float, high: float) -> float:
        """Return the probability that it is beyond one limit, the more probable one."""
        near, far = (low, high) if self.greatest else (high, low)
        sign = 1.0 if self.greatest else -1.0
        return max(self._nearer(far), normal_probability(sign * (near - self.value) / self.sigma))

    def least(self, probability: float) -> float:
        """Return the lower confidence bound of the true value."""
        if self.greatest:
            return self._bound(probability)
        return self.value - self.sigma * normal_quantile(probability)

    def most(self, probability: float) -> float:
        """Return the upper confidence bound of the true value."""
        if not self.greatest:
            return self._bound(probability)
        return self.value + self.sigma * normal_quantile(probability)

    def _nearer(self, supposed: float) -> float:
        """Return the share of parts with this true value that would appear less extreme."""
        if self.greatest:
            shown = np.minimum(self.sizes, supposed) + self._errors()
            return float(np.mean(shown.max(axis=1) <= self.value))
        shown = np.maximum(self.sizes, supposed) + self._errors()
        return float(np.mean(shown.min(axis=1) >= self.value))

    def _bound(self, probability: float) -> float:
        reach = _REACH * self.sigma
        sign = 1.0 if self.greatest else -1.0
        off = bisect_least(
            reach, lambda from_far: self._nearer(self.value - sign * (reach - from_far)),
            probability,
        )  # fmt: skip
        return self.value - sign * (reach - off)

    def _errors(self) -> Float:
        return drawn_errors(self._noise, self.covariance, 3000, self.seed)


def drawn_errors(kept: list[Float], covariance: Float, most: int, seed: int) -> Float:
    """Return cached draws of errors, (d, n); fewer draws for more errors."""
    if not kept:
        n = len(covariance)
        values, vectors = np.linalg.eigh(covariance)
        factor = vectors * np.sqrt(np.maximum(values, 0.0))
        draws = int(np.clip(100_000 // n, 500, most))
        kept.append(np.random.default_rng(seed).standard_normal((draws, n)) @ factor.T)
    return kept[0]


def within(radius: float, mean: Float, covariance: Float) -> float:
    """Return the probability that a normal vector of k = 1 to 3 components is not longer.

    In the principal axes: the last component in closed form, Gauss-Legendre over the others.
    ``covariance`` is positive semi-definite; ``radius`` is in mm.
    """
    if radius <= 0.0:
        return 0.0
    variances, axes = np.linalg.eigh(covariance)
    greatest = max(float(variances[-1]), 0.0)
    if greatest == 0.0:
        return float(np.linalg.norm(mean) <= radius)
    sigmas = np.sqrt(np.maximum(variances, 1e-12 * greatest))
    centre = axes.T @ np.asarray(mean, dtype=np.float64)
    square = np.array([radius**2])
    weights = np.ones(1)
    # The narrowest is last: harmless in closed form, but not for quadrature.
    for k in range(len(centre) - 1, 0, -1):
        half = np.sqrt(np.maximum(square, 1e-300))
        low = np.clip(centre[k] - _WIDTH * sigmas[k], -half, half)
        high = np.clip(centre[k] + _WIDTH * sigmas[k], -half, half)
        # The sine removes the infinite slope at the rim of the disc from the integrand.
        first, last = np.arcsin(low / half), np.arcsin(high / half)
        turn = 0.5 * (first + last)[:, None] + 0.5 * (last - first)[:, None] * _NODES
        at = half[:, None] * np.sin(turn)
        width = 0.5 * (last - first)[:, None] * half[:, None] * np.cos(turn)
        density = np.exp(-0.5 * ((at - centre[k]) / sigmas[k]) ** 2)
        density /= sigmas[k] * math.sqrt(2.0 * math.pi)
        weights = (weights[:, None] * width * _WEIGHTS * density).ravel()
        square = (square[:, None] - at**2).ravel()
    half = np.sqrt(np.maximum(square, 0.0))
    shares = np.subtract(*scipy.special.ndtr((np.stack([half, -half]) - centre[0]) / sigmas[0]))
    return min(max(float(weights @ shares), 0.0), 1.0)


def expanded(spread: Spread, value: float) -> float:
    """Return U: half the width of the interval about ``value`` that covers the true value.

    2 u; if noise increases the value, up to the lower and upper confidence bounds.
    """
    linear = 2.0 * spread.sigma
    if isinstance(spread, Normal) or not math.isfinite(linear):
        return linear
    return max(linear, value - spread.least(TWO_SIDED), spread.most(ONE_SIDED) - value)


def bisect_least(value: float, beyond: Callable[[float], float], probability: float) -> float:
    """Return the greatest supposed value with at least this probability ``beyond``."""
    if beyond(0.0) < probability:
        return 0.0
    low, high = 0.0, value
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if beyond(middle) >= probability:
            low = middle
        else:
            high = middle
    return low


def normal_probability(x: float) -> float:
    """Return the probability that a standard normal variable lies below ``x``."""
    return 0.5 * (1.0 + math.erf(x / math.sqrt(2.0)))


def normal_quantile(probability: float) -> float:
    """Return the quantile of the standard normal distribution."""
    return NormalDist().inv_cdf(probability)
