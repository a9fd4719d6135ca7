"""What can be said of the range, or of the greatest, of many deviations that all have noise.

Noise makes a range greater than it is, and the greatest of many sizes, too; the smallest it makes
smaller. By how much depends on how many of them truly lie near the extreme: the supposed part is
the measured one with what lies beyond cut off.
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
"""Steps towards the smallest zone of each draw of noise: within some percent of it."""

_REACH = 8.0
"""Standard uncertainties within which the bound of a rank is searched for."""


@dataclass(frozen=True, slots=True)
class Extent:
    """A range of deviations with normal errors: form, run-out, profile."""

    value: float
    sigma: float
    """Standard uncertainty of the difference of the deviations that make it."""
    deviations: Float
    """(n,) as measured; their range is the value."""
    covariance: Float
    """(n, n) of their errors."""
    free: Float | None = None
    """(n, k): how the deviations answer to what makes the zone smallest; None where it is not."""
    about_nominal: bool = False
    """The range is twice the greatest deviation from a nominal surface that nothing moves: then a
    part with less form is known, the same one with all its deviations smaller."""
    seed: int = 1
    """Of the noise that a supposed part is given."""
    _noise: list[Float] = field(default_factory=list, repr=False, compare=False)

    @property
    def one_sided(self) -> bool:
        """Return True: a range has an upper limit only."""
        return True

    def inside(self, low: float, high: float) -> float:
        """Return the probability that the true range is below the limit, noise not helping.

        The measured range is at least the true one plus the errors of the two truly extreme
        deviations, so it is not further below it than those.
        """
        return normal_probability((high - self.value) / self.sigma)

    def beyond(self, low: float, high: float) -> float:
        """Return the share of parts at the limit that would be measured with a smaller range.

        The supposed part is the measured one with everything beyond the limit cut off on both
        sides: no part at the limit that looks like the measured one has more places from which
        noise can make the range greater.
        """
        middle = 0.5 * float(self.deviations.max() + self.deviations.min())
        supposed = np.clip(self.deviations, middle - 0.5 * high, middle + 0.5 * high)
        return self._smaller(supposed)

    def _smaller(self, supposed: Float) -> float:
        """Return the share of measurements of a supposed part that would show less."""
        shown = supposed + self._errors()
        ranges = np.ptp(shown, axis=1)
        if self.free is not None:
            # What the noise shows is made smallest like what was measured. A bound from above: no
            # supposed part looks better than it would.
            upper = bounds_of_least(shown, self.free, _ZONE_STEPS)[1]
            ranges = np.minimum(ranges, 2.0 * upper)
        return float(np.mean(ranges <= self.value))

    def least(self, probability: float) -> float:
        """Return what the true value is not below, with this probability.

        Notes
        -----
        `beyond` supposes the worst part: every place that was measured beyond the limit truly lies
        at it. The greatest of many values at one limit is lifted by noise far above it, by
        sigma sqrt(2 ln n) for n of them, so this bound is lower than it need be: U of profiles in a
        frame held 97.8 % where 95.4 were meant, 99.4 % where form is twice the noise. A part
        whose deviations are all smaller by one factor looks like the measured one and has one place
        at its limit, as a real part has. It still holds the noise of its own measurement, and so
        more than it should: U stays a little on the safe side. Verdicts rest on `beyond`.
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
        """Return what the true value is not above, with this probability."""
        return self.value + self.sigma * normal_quantile(probability)

    def _errors(self) -> Float:
        most = 3000 if self.free is None else 500
        return _drawn(self._noise, self.covariance, most, self.seed)


@dataclass(frozen=True, slots=True)
class Rank:
    """The greatest of many sizes with normal errors, or the smallest."""

    value: float
    sigma: float
    """`value`, `sigma`: The size that has the rank, and its standard uncertainty."""
    sizes: Float
    """(m,) of which it is one."""
    covariance: Float
    """(m, m) of their errors."""
    greatest: bool
    """It is the greatest; else the smallest."""
    seed: int = 1
    """Of the noise that a supposed part is given."""
    _noise: list[Float] = field(default_factory=list, repr=False, compare=False)

    @property
    def one_sided(self) -> bool:
        """Return False: a size has two limits."""
        return False

    def inside(self, low: float, high: float) -> float:
        """Return how probable it is that the true value lies between the limits, noise not helping.

        Towards the side to which noise moves the value, a part at the limit would look as good as
        `_nearer` says; from the other side noise cannot help.
        """
        near, far = (low, high) if self.greatest else (high, low)
        sign = 1.0 if self.greatest else -1.0
        beyond_far = normal_probability(sign * (self.value - far) / self.sigma)
        return self._nearer(near) - beyond_far

    def beyond(self, low: float, high: float) -> float:
        """Return the probability that it lies beyond one of them, the more probable one."""
        near, far = (low, high) if self.greatest else (high, low)
        sign = 1.0 if self.greatest else -1.0
        return max(self._nearer(far), normal_probability(sign * (near - self.value) / self.sigma))

    def least(self, probability: float) -> float:
        """Return what the true value is not below, with this probability."""
        if self.greatest:
            return self._bound(probability)
        return self.value - self.sigma * normal_quantile(probability)

    def most(self, probability: float) -> float:
        """Return what the true value is not above, with this probability."""
        if not self.greatest:
            return self._bound(probability)
        return self.value + self.sigma * normal_quantile(probability)

    def _nearer(self, supposed: float) -> float:
        """Return the share of parts with this true value that would look less extreme."""
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
    """Return draws of errors, (d, n), the same each time: fewer where there are more of them."""
    if not kept:
        n = len(covariance)
        values, vectors = np.linalg.eigh(covariance)
        factor = vectors * np.sqrt(np.maximum(values, 0.0))
        draws = int(np.clip(100_000 // n, 500, most))
        kept.append(np.random.default_rng(seed).standard_normal((draws, n)) @ factor.T)
    return kept[0]
