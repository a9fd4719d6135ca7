"""From the evaluation of a characteristic to the distribution of its value."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float
from ocmm_core.measuring import PointFactors, Rows
from ocmm_core.tolerances.kinds import spec_of
from ocmm_core.tolerances.uncertainty._extent import Extent, Rank
from ocmm_core.tolerances.uncertainty._first_order import follow_features, growth, tilted
from ocmm_core.tolerances.uncertainty._interval import Length, Normal, Spread
from ocmm_core.tolerances.uncertainty._sampling import FormSample, widened
from ocmm_core.tolerances.zones import Characteristic, Evaluation

_FEW = 200
"""Above this number of deviations the minimum zone of noise is close to that of least squares."""


@dataclass(frozen=True, slots=True)
class Spreads:
    """Two statements about one value."""

    of_value: Spread
    judged: Spread
    """About the value less the bonus of a modifier, which is compared with the limit."""
    growth: float = 1.0
    """Factor by second order of both fits (`_first_order`); infinite: U refused, both of first."""

    @property
    def errors(self) -> Float | None:
        """Return the covariance, mm^2, of the deviations whose range the value is; or None."""
        return self.of_value.covariance if isinstance(self.of_value, Extent) else None


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
        grown = growth(gradients, factors, samples, found, follow)
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
    if spec.own_form:
        return True
    if characteristic.association.startswith("two-point"):
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


def _spread(
    characteristic: Characteristic,
    evaluation: Evaluation,
    factors: PointFactors,
    found: Float,
    bonus: bool,
) -> Spread:
    taken = evaluation.bonus if bonus else 0.0
    if evaluation.components is not None:
        vector, length = evaluation.components, float(np.linalg.norm(evaluation.components))
        if length > 0.0:
            vector = vector * (max(length - taken, 0.0) / length)
        return Length(vector, found)
    # A variance that is negative or not finite gives NaN, which `decide` refuses.
    variance = float(found[0, 0])
    sigma = float(np.sqrt(variance)) if variance >= 0.0 else np.nan
    value = evaluation.value - taken
    if evaluation.noise is not None and np.isfinite(sigma):
        noise = evaluation.noise
        errors = factors.of(noise.by_coordinates)
        free = noise.free if noise.free.shape[1] > 0 and len(noise.free) <= _FEW else None
        held = noise.mirrored and noise.free.shape[1] == 0
        return Extent(value, sigma, noise.deviations, errors, free, about_nominal=held)
    ranked = evaluation.ranked
    if ranked is not None and np.isfinite(sigma):
        errors = factors.of(ranked.gradients)
        return Rank(value, sigma, ranked.sizes, errors, ranked.greatest)
    return Normal(value, sigma, one_sided=spec_of(characteristic.kind).one_sided)
