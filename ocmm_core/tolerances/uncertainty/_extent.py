"""Uncertainty of the range, or the extreme, of many noisy deviations.

Noise increases a range and the maximum of many sizes, and decreases the minimum. The amount depends
on the number of deviations truly near the extreme: the supposed part is the measured one with all
beyond the limit cut off.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ocmm_core.geometry import Float
from ocmm_core.tolerances.uncertainty._floor import bounds_of_least
from ocmm_core.tolerances.uncertainty._interval import (
    bisect_least,
    normal_probability,
    normal_quantile,
)

_ZONE_STEPS = 12
"""Steps towards the smallest zone of each noise draw: within some percent of it."""

_REACH = 8.0
"""Search range of a rank's bound, in standard uncertainties."""


@dataclass(frozen=True, slots=True)
class Extent:
    """A range of deviations with normal errors: form, run-out, profile."""

    value: float
    sigma: float
    """Standard uncertainty of the difference of the extreme deviations."""
    deviations: Float
    """(n,): as measured; their range is the value."""
    covariance: Float
    """(n, n) of their errors."""
    free: Float | None = None
    """(n, k): derivatives of the deviations by the parameters minimised; None if none."""
    about_nominal: bool = False
    """Twice the greatest deviation from a fixed nominal surface: scaling all reduces the form."""
    seed: int = 1
    """For the noise of a supposed part."""
    _noise: list[Float] = field(default_factory=list, repr=False, compare=False)

    @property
    def one_sided(self) -> bool:
        """Return True: a range has an upper limit only."""
        return True

    def inside(self, low: float, high: float) -> float:
        """Return the probability of a true range below the limit, without help of noise.

        The measured range is at least the true one plus the errors of the two truly extreme
        deviations, so it is not further below than those.
        """
        return normal_probability((high - self.value) / self.sigma)

    def beyond(self, low: float, high: float) -> float:
        """Return the share of parts at the limit that would be measured with a smaller range.

        The supposed part is the measured one with all deviations beyond the limit clipped on both
        sides: among parts at the limit that look like the measured one, it has the most places from
        which noise can increase the range.
        """
        middle = 0.5 * float(self.deviations.max() + self.deviations.min())
        supposed = np.clip(self.deviations, middle - 0.5 * high, middle + 0.5 * high)
        return self._smaller(supposed)

    def _smaller(self, supposed: Float) -> float:
        """Return the share of measurements of a supposed part with a smaller result."""
        shown = supposed + self._errors()
        ranges = np.ptp(shown, axis=1)
        if self.free is not None:
            # The zone of the noisy deviations is minimised like the measured one. An upper bound:
            # no supposed part looks better than it would.
            upper = bounds_of_least(shown, self.free, _ZONE_STEPS)[1]
            ranges = np.minimum(ranges, 2.0 * upper)
        return float(np.mean(ranges <= self.value))

    def least(self, probability: float) -> float:
        """Return the lower confidence bound of the true value.

        `beyond` supposes the worst part: every place measured beyond the limit truly lies at it.
        Noise lifts the maximum of n values at one limit by about sigma sqrt(2 ln n), so this bound
        is lower than necessary: U of profiles in a frame had a coverage of 97.8 % instead of 95.4,
        99.4 % if form is twice the noise. A part with all deviations scaled by one factor looks
        like the measured one and has one place at its limit, as a real part. It still includes the
        noise of its own measurement, so U stays slightly conservative. Verdicts use `beyond`.
        """
        if not self.about_nominal or not self.value > 0.0:
            return bisect_least(
                self.value, lambda supposed: self.beyond(0.0, supposed), probability
            )
        shape = self.deviations / self.value
        return bisect_least(
            self.value, lambda supposed: self._smaller(supposed * shape), probability
        )

    def most(self, probability: float) -> float:
        """Return the upper confidence bound of the true value."""
        return self.value + self.sigma * normal_quantile(probability)

    def _errors(self) -> Float:
        most = 3000 if self.free is None else 500
        return _drawn(self._noise, self.covariance, most, self.seed)


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
        return _drawn(self._noise, self.covariance, 3000, self.seed)


def _drawn(kept: list[Float], covariance: Float, most: int, seed: int) -> Float:
    """Return cached draws of errors, (d, n); fewer draws for more errors."""
    if not kept:
        n = len(covariance)
        values, vectors = np.linalg.eigh(covariance)
        factor = vectors * np.sqrt(np.maximum(values, 0.0))
        draws = int(np.clip(100_000 // n, 500, most))
        kept.append(np.random.default_rng(seed).standard_normal((draws, n)) @ factor.T)
    return kept[0]
