"""All characteristics of a plan at once: value, uncertainty, verdict, or why there is none."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from ocmm_core.alignment import AnyAlignment, unknown_frame
from ocmm_core.errors import FitError, OcmmError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.measuring import PointFactors
from ocmm_core.tolerances.decisions._decision import (
    Rule,
    make_result,
    not_measured,
    not_proven,
    without_uncertainty,
)
from ocmm_core.tolerances.decisions._result import CharacteristicResult
from ocmm_core.tolerances.kinds import evaluate, involved_features, needs_part_frame, spec_of
from ocmm_core.tolerances.uncertainty import (
    NOT_DETERMINED,
    WHAT_TO_DO,
    FormSample,
    form_samples,
    noise_floor,
    spreads_of,
)
from ocmm_core.tolerances.zones import Characteristic, Evaluation, Frames


def evaluate_all(
    characteristics: Sequence[Characteristic],
    alignment: AnyAlignment | None,
    actual: Mapping[str, ActualFeature | FitError],
    factors: PointFactors | None,
    rule: Rule,
) -> tuple[CharacteristicResult, ...]:
    """Return a result for every characteristic, in their order.

    Parameters
    ----------
    characteristics, alignment, rule
        As the plan says.
    actual
        Features as measured, or why they are not (`features.actual.actual_features`).
    factors
        Uncertainty of all N ball centres and the tip radius, in the order of the jacobians.
        Without it nothing is stated: a value without uncertainty is no result.
    """
    samples = () if factors is None else form_samples(actual, factors)
    measured = {
        name: feature for name, feature in actual.items() if isinstance(feature, ActualFeature)
    }
    frames = Frames(measured, alignment)
    known = _Known(measured, samples)
    return tuple(
        _evaluated(characteristic, alignment, actual, known, frames, factors, rule)
        for characteristic in characteristics
    )


class _Known:
    """Features that are measured and what they show of their form, found by their points."""

    def __init__(
        self, measured: Mapping[str, ActualFeature], samples: Sequence[FormSample]
    ) -> None:
        self.measured = measured
        self._samples = {sample.feature: sample for sample in samples}
        self._touched = {
            place: name
            for name, feature in measured.items()
            if feature.touches is not None
            for place in feature.touches.places
        }

    def under(
        self, characteristic: Characteristic, evaluation: Evaluation
    ) -> tuple[dict[str, ActualFeature], list[FormSample]]:
        """Return the features that a value is about or rests on, and what they show of form."""
        rows = [evaluation.gradient, evaluation.component_gradients, evaluation.bonus_gradient]
        places = {place for row in rows if row is not None for place in row.places.tolist()}
        names = dict.fromkeys(characteristic.features)
        names |= dict.fromkeys(sorted({self._touched[p] for p in places if p in self._touched}))
        samples = [self._samples[name] for name in names if name in self._samples]
        return {k: self.measured[k] for k in names if k in self.measured}, samples


def _evaluated(
    characteristic: Characteristic,
    alignment: AnyAlignment | None,
    actual: Mapping[str, ActualFeature | FitError],
    known: _Known,
    frames: Frames,
    factors: PointFactors | None,
    rule: Rule,
) -> CharacteristicResult:
    for name in involved_features(characteristic, alignment):
        feature = actual.get(name)
        if isinstance(feature, FitError):
            return not_measured(characteristic, feature.what)
    if factors is None:
        return not_measured(
            characteristic, "No uncertainty: the covariance of the points is unknown."
        )
    try:
        evaluation = evaluate(characteristic, known.measured, alignment, frames)
        below, samples = known.under(characteristic, evaluation)
        spreads = spreads_of(characteristic, evaluation, below, factors, samples)
        if not math.isfinite(spreads.growth):
            why = f"{NOT_DETERMINED} {WHAT_TO_DO}"
            return without_uncertainty(characteristic, evaluation, why)
        result = make_result(characteristic, evaluation, spreads, rule)
    except OcmmError as error:
        return not_measured(characteristic, error.what)
    unknown = unknown_frame(alignment)
    if unknown and needs_part_frame(characteristic):
        result = not_proven(result, unknown)
    return _with_notes(result, characteristic, evaluation, factors)


def _with_notes(
    result: CharacteristicResult,
    characteristic: Characteristic,
    evaluation: Evaluation,
    factors: PointFactors,
) -> CharacteristicResult:
    value, uncertainty = result.measured, result.uncertainty
    if evaluation.noise is not None:
        floor = noise_floor(evaluation.noise, factors)
        said = f"Noise floor: {floor:.4f} mm on a perfect part."
        return replace(result, floor=floor, note=f"{result.note} {said}".strip())
    if value is None or uncertainty is None:
        return result
    said = spec_of(characteristic.kind).below_u
    if said and value < uncertainty:
        return replace(result, note=f"{result.note} {said}".strip())
    return result
