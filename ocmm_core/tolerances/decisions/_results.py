"""Results of all characteristics of a plan: value, uncertainty, verdict, or reason."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Protocol

from ocmm_core.alignment import AnyAlignment, unknown_frame
from ocmm_core.errors import FitError, OcmmError
from ocmm_core.features.measured import ActualFeature, measured_of
from ocmm_core.measuring import PointFactors
from ocmm_core.tolerances.decisions import _decision as decision
from ocmm_core.tolerances.decisions._verdict import CharacteristicResult
from ocmm_core.tolerances.kinds import evaluate, involved_features, needs_part_frame, spec_of
from ocmm_core.tolerances.uncertainty import (
    NOT_DETERMINED,
    WHAT_TO_DO,
    FormSample,
    Spreads,
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
    rule: decision.Rule,
) -> tuple[CharacteristicResult, ...]:
    """Return a result for every characteristic, in order.

    ``factors`` are the uncertainty of all N ball centres and the tip radius, in the order of the
    jacobians. None gives no results, as a value without uncertainty is none.
    """
    if factors is None:
        why = "No uncertainty: the covariance of the points is unknown."
        return tuple(
            decision.not_measured(item, _missing(item, alignment, actual) or why)
            for item in characteristics
        )
    known = _Known(actual, factors)
    frames = Frames(measured_of(actual), alignment)
    return tuple(evaluate_one(item, alignment, known, frames, rule) for item in characteristics)


class FeatureLookup(Protocol):
    """Access to the features of a job by name and by point."""

    @property
    def actual(self) -> Mapping[str, ActualFeature | FitError]:
        """Return the measured features, or errors."""
        ...

    def touching(self, places: Sequence[int]) -> Collection[str]:
        """Return the names of the features with touches at these places."""
        ...

    def factors(self, names: Collection[str]) -> PointFactors:
        """Return the uncertainty of the points of these features, or of more."""
        ...

    def sample(self, name: str) -> FormSample | None:
        """Return the form estimate of a feature, or None."""
        ...


class _Known:
    """All features of a job, and the uncertainty of all its points."""

    def __init__(
        self, actual: Mapping[str, ActualFeature | FitError], factors: PointFactors
    ) -> None:
        self.actual = actual
        self._factors = factors
        self._samples = {sample.feature: sample for sample in form_samples(actual, factors)}
        self._touched = {
            place: name
            for name, feature in measured_of(actual).items()
            if feature.touches is not None
            for place in feature.touches.places
        }

    def touching(self, places: Sequence[int]) -> set[str]:
        return {self._touched[place] for place in places if place in self._touched}

    def factors(self, names: Collection[str]) -> PointFactors:
        return self._factors

    def sample(self, name: str) -> FormSample | None:
        return self._samples.get(name)


def _missing(
    characteristic: Characteristic,
    alignment: AnyAlignment | None,
    actual: Mapping[str, ActualFeature | FitError],
) -> str:
    """Return why a feature of a value is missing, or empty text."""
    for name in involved_features(characteristic, alignment):
        feature = actual.get(name)
        if isinstance(feature, FitError):
            return feature.what
    return ""


def evaluate_one(
    characteristic: Characteristic,
    alignment: AnyAlignment | None,
    known: FeatureLookup,
    frames: Frames,
    rule: decision.Rule,
) -> CharacteristicResult:
    """Return the result of one characteristic; queries ``known`` only for its inputs."""
    missing = _missing(characteristic, alignment, known.actual)
    if missing:
        return decision.not_measured(characteristic, missing)
    try:
        measured = measured_of(known.actual)
        evaluation = evaluate(characteristic, measured, alignment, frames)
        names = dict.fromkeys(
            (*characteristic.features, *sorted(known.touching(evaluation.places)))
        )
        factors = known.factors(names)
        samples = [found for name in names if (found := known.sample(name)) is not None]
        below = {name: measured[name] for name in names if name in measured}
        spreads = spreads_of(characteristic, evaluation, below, factors, samples)
        if not math.isfinite(spreads.growth):
            why = f"{NOT_DETERMINED} {WHAT_TO_DO}"
            return decision.without_uncertainty(characteristic, evaluation, why)
        result = decision.make_result(characteristic, evaluation, spreads, rule)
    except OcmmError as error:
        return decision.not_measured(characteristic, error.what)
    unknown = unknown_frame(alignment)
    if unknown and needs_part_frame(characteristic):
        result = decision.not_proven(result, unknown)
    if result.measured is not None:
        result = replace(result, seen=evaluation.seen)
    return _with_notes(result, characteristic, evaluation, spreads)


def _with_notes(
    result: CharacteristicResult,
    characteristic: Characteristic,
    evaluation: Evaluation,
    spreads: Spreads,
) -> CharacteristicResult:
    value, uncertainty = result.measured, result.uncertainty
    if evaluation.noise is not None and spreads.extent is not None:
        floor = noise_floor(evaluation.noise, spreads.extent)
        said = f"Noise floor: {floor:.4f} mm on a perfect part."
        return replace(result, floor=floor, note=f"{result.note} {said}".strip())
    if value is None or uncertainty is None:
        return result
    said = spec_of(characteristic.kind).below_u
    if said and value < uncertainty:
        return replace(result, note=f"{result.note} {said}".strip())
    return result
