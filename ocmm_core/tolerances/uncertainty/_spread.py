"""From the evaluation of a characteristic to the distribution of its value.

Range, or the extreme, of many noisy deviations: noise increases a range and the maximum of many
sizes, and decreases the minimum. The amount depends on the number of deviations truly near the
extreme: the supposed part is the measured one with all beyond the limit cut off. The noise floor of
form results, the value of a perfect part, is printed and never subtracted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float
from ocmm_core.measuring import PointFactors, Rows
from ocmm_core.tolerances.kinds import spec_of
from ocmm_core.tolerances.uncertainty import _interval as interval
from ocmm_core.tolerances.uncertainty._first_order import (
    follow_features,
    growth,
    second_order,
    tilted,
)
from ocmm_core.tolerances.uncertainty._sampling import FormSample, widened
from ocmm_core.tolerances.zones import Characteristic, Evaluation, FormNoise

DRAWS = 100
"""Their ranges scatter by some 20 %: the mean is good to 2 %."""
MANY = 200
DRAWS_OF_MANY = 30
"""Ranges of many points scatter less."""
MOST = 400
"""Deviations of a range whose errors have a covariance; more are drawn block by block."""
SEED = 20
_STEPS = 40
_NOTHING = 1e-7
"""Relative effect of a parameter that counts as zero."""
_JITTER = 1e-9
"""Relative addition to the variances, as rounding may make the matrix indefinite."""


def noise_floor(noise: FormNoise, extent: Extent, seed: int = SEED) -> float:
    """Return the mean value, mm, of a perfect part by noise."""
    count = len(noise.deviations)
    if extent.draws is not None:
        draws = extent.draws[:DRAWS_OF_MANY, :count]
    else:
        errors = extent.covariance[:count, :count]
        greatest = float(np.maximum(np.diagonal(errors), 0.0).max())
        if not greatest > 0.0:
            return 0.0
        lower = np.linalg.cholesky(errors + 2.0 * _JITTER * greatest * np.eye(count))
        number = DRAWS if count < MANY else DRAWS_OF_MANY
        draws = np.random.default_rng(seed).standard_normal((number, count)) @ lower.T
    if noise.free.shape[1]:
        return 2.0 * float(least_greatest(draws, noise.free).mean())
    if noise.mirrored:
        return 2.0 * float(np.abs(draws).max(axis=1).mean())
    return float(np.ptp(draws, axis=1).mean())


def least_greatest(deviations: Float, free: Float) -> Float:
    """Return the minimised greatest amount (b,) of rows over ``free``, to two percent."""
    lower, upper = bounds_of_least(deviations, free, _STEPS)
    return 0.5 * (upper + np.minimum(lower, upper))


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
    k = basis.shape[1]
    squares = (basis[:, :, None] * basis[:, None]).reshape(len(basis), k * k)
    for _ in range(steps):
        normal = (weights @ squares).reshape(len(weights), k, k)
        normal += 1e-12 * np.eye(k) * np.max(weights, axis=1)[:, None, None]
        right = (weights * deviations) @ basis
        taken = np.linalg.solve(normal, right[:, :, None])[:, :, 0]
        left = np.abs(deviations - taken @ basis.T)
        upper = np.minimum(upper, left.max(axis=1))
        weights *= left
        lower = np.maximum(lower, np.sqrt(np.einsum("bn,bn->b", weights, left)))
        weights /= np.maximum(weights.sum(axis=1), 1e-300)[:, None]
    return lower, upper


_ZONE_STEPS = 12
"""Steps towards the smallest zone of each noise draw: within some percent of it."""


@dataclass(frozen=True, slots=True)
class Extent:
    """A range of deviations with normal errors: form, run-out, profile."""

    value: float
    sigma: float
    """Standard uncertainty of the difference of the extreme deviations."""
    deviations: Float
    """(n,): as measured; their range is the value."""
    covariance: Float
    """(n, n) of their errors; empty with `draws`."""
    draws: Float | None = None
    """(d, n) of their errors, mm, if they are many."""
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
        return interval.normal_probability((high - self.value) / self.sigma)

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
        noise of the measurement, so U stays slightly conservative. Verdicts use `beyond`.
        """
        if not self.about_nominal or not self.value > 0.0:
            return interval.bisect_least(
                self.value, lambda supposed: self.beyond(0.0, supposed), probability
            )
        shape = self.deviations / self.value
        return interval.bisect_least(
            self.value, lambda supposed: self._smaller(supposed * shape), probability
        )

    def most(self, probability: float) -> float:
        """Return the upper confidence bound of the true value."""
        return self.value + self.sigma * interval.normal_quantile(probability)

    def _errors(self) -> Float:
        if self.draws is not None:
            return self.draws
        most = 3000 if self.free is None else 500
        return interval.drawn_errors(self._noise, self.covariance, most, self.seed)


_FEW = 200
"""Above this number of deviations the minimum zone of noise is close to that of least squares."""


@dataclass(frozen=True, slots=True)
class Spreads:
    """Two statements about one value."""

    of_value: interval.Spread
    judged: interval.Spread
    """About the value less the bonus of a modifier, which is compared with the limit."""
    growth: float = 1.0
    """Factor by second order of both fits (`_first_order`); infinite: U refused, both of first."""

    @property
    def extent(self) -> Extent | None:
        """Return the spread of a range of deviations; None for other values."""
        return self.of_value if isinstance(self.of_value, Extent) else None


def spreads_of(
    characteristic: Characteristic,
    evaluation: Evaluation,
    actual: Mapping[str, ActualFeature],
    factors: PointFactors,
    samples: Sequence[FormSample],
) -> Spreads:
    """Return the spreads of a value; ``samples`` are those of `sampling.form_samples`."""
    every, samples = samples, contributing_samples(characteristic, actual, samples)
    gradients = gradients_of(evaluation, bonus=False)
    found = widened(gradients, factors, samples)
    grown = 1.0
    # A range or rank of single points involves the fits of its datums only.
    single = evaluation.noise is not None or evaluation.ranked is not None
    refitted = [
        item for name, item in actual.items() if not single or name not in characteristic.features
    ]
    follow = follow_features(gradients, refitted)
    if follow is not None:
        changes = second_order(gradients, factors, samples, found, follow)
        grown = growth(changes, found.degrees)
    if np.all(np.isfinite(found.covariance)):
        is_angle = spec_of(characteristic.kind).unit == "deg"
        grown = max(grown, tilted(gradients, actual, factors, every, found, is_angle=is_angle))
    scale = grown if np.isfinite(grown) else 1.0
    of_value = _spread(characteristic, evaluation, factors, scale**2 * found.covariance, False)
    if evaluation.bonus_gradient is None:
        return Spreads(of_value, of_value, grown)
    less = widened(gradients_of(evaluation, bonus=True), factors, samples)
    judged = _spread(characteristic, evaluation, factors, scale**2 * less.covariance, True)
    return Spreads(of_value, judged, grown)


def contributing_samples(
    characteristic: Characteristic,
    actual: Mapping[str, ActualFeature],
    samples: Sequence[FormSample],
) -> tuple[FormSample, ...]:
    """Return the samples that contribute uncertainty; excludes form that is the measurand."""
    own = set(characteristic.features) if of_own_form(characteristic, actual) else set()
    return tuple(sample for sample in samples if sample.feature not in own)


def of_own_form(characteristic: Characteristic, actual: Mapping[str, ActualFeature]) -> bool:
    """Return whether form is the measurand: zones of surface points, two-point sizes."""
    spec = spec_of(characteristic.kind)
    if spec.own_form or characteristic.association.startswith("two-point"):
        return True
    if not spec.one_sided:
        return False
    features = [actual[name] for name in characteristic.features if name in actual]
    return any(
        item.touches is not None and item.fit.shape in (Shape.PLANE, Shape.LINE)
        for item in features
    )


def gradients_of(evaluation: Evaluation, *, bonus: bool) -> Rows:
    """Return the gradients of the components of a value, k rows; k is often one."""
    less = evaluation.bonus_gradient if bonus else None
    components, gradients = evaluation.components, evaluation.component_gradients
    if components is None or gradients is None:
        row = evaluation.gradient if less is None else evaluation.gradient - less
        return row[None]
    if less is None:
        return gradients
    length = float(np.linalg.norm(components))
    # A zero vector has no direction in which the bonus reduces it; its bonus is certain then.
    along = components / length if length > 0.0 else np.zeros_like(components)
    return gradients - less.outer(along)


def _extent(value: float, sigma: float, noise: FormNoise, factors: PointFactors) -> Extent:
    deviations, rows, free = noise.deviations, noise.by_coordinates, noise.free
    errors, draws = np.zeros((0, 0)), None
    if len(rows) > MOST:
        count = int(np.clip(1_000_000 // len(rows), 200, 500))
        draws = factors.drawn_deviations(rows, np.random.default_rng(SEED), count)
    else:
        errors = factors.of_deviations(rows)
    if noise.mirrored:
        deviations, free = np.append(deviations, -deviations), np.vstack([free, -free])
        errors = np.block([[errors, -errors], [-errors, errors]])
        draws = None if draws is None else np.hstack([draws, -draws])
    held = noise.mirrored and free.shape[1] == 0
    some = free if free.shape[1] > 0 and len(free) <= _FEW else None
    return Extent(value, sigma, deviations, errors, draws, some, about_nominal=held)


def _spread(
    characteristic: Characteristic,
    evaluation: Evaluation,
    factors: PointFactors,
    found: Float,
    bonus: bool,
) -> interval.Spread:
    taken = evaluation.bonus if bonus else 0.0
    if evaluation.components is not None:
        vector, length = evaluation.components, float(np.linalg.norm(evaluation.components))
        if length > 0.0:
            vector = vector * (max(length - taken, 0.0) / length)
        return interval.Length(vector, found)
    # A variance that is negative or not finite gives NaN, which `decide` refuses.
    variance = float(found[0, 0])
    sigma = float(np.sqrt(variance)) if variance >= 0.0 else np.nan
    value = evaluation.value - taken
    if evaluation.noise is not None and np.isfinite(sigma):
        return _extent(value, sigma, evaluation.noise, factors)
    ranked = evaluation.ranked
    if ranked is not None and np.isfinite(sigma):
        errors = factors.covariance_of(ranked.gradients)
        return interval.Rank(value, sigma, ranked.sizes, errors, ranked.greatest)
    return interval.Normal(value, sigma, one_sided=spec_of(characteristic.kind).one_sided)
