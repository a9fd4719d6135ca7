"""All characteristics of a plan at once: value, uncertainty, verdict, or why there is none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from ocmm_core.alignment.rules import AnyAlignment
from ocmm_core.errors import FitError, OcmmError
from ocmm_core.features.actual import ActualFeature
from ocmm_core.geometry import Float
from ocmm_core.tolerances.characteristic import FORMS, Characteristic
from ocmm_core.tolerances.decision import Rule, make_result, not_measured
from ocmm_core.tolerances.evaluate import evaluate, involved_features
from ocmm_core.tolerances.interval import normal_probability
from ocmm_core.tolerances.result import CharacteristicResult
from ocmm_core.tolerances.sampling import FormSample, form_samples
from ocmm_core.tolerances.spread import spreads_of


def evaluate_all(
    characteristics: Sequence[Characteristic],
    alignment: AnyAlignment | None,
    actual: Mapping[str, ActualFeature | FitError],
    covariance: Float | None,
    rule: Rule,
) -> tuple[CharacteristicResult, ...]:
    """Return a result for every characteristic, in their order.

    Parameters
    ----------
    characteristics, alignment, rule
        As the plan says.
    actual
        Features as measured, or why they are not (`features.actual.actual_features`).
    covariance
        (3 N + 1, 3 N + 1), mm^2: of all N ball centres and the tip radius, in the order of the
        jacobians. Without it nothing is stated: a value without uncertainty is no result.
    """
    samples = () if covariance is None else form_samples(actual, covariance)
    return tuple(
        _evaluated(characteristic, alignment, actual, covariance, samples, rule)
        for characteristic in characteristics
    )


def _evaluated(
    characteristic: Characteristic,
    alignment: AnyAlignment | None,
    actual: Mapping[str, ActualFeature | FitError],
    covariance: Float | None,
    samples: Sequence[FormSample],
    rule: Rule,
) -> CharacteristicResult:
    measured: dict[str, ActualFeature] = {}
    for name in involved_features(characteristic, alignment):
        feature = actual.get(name)
        if isinstance(feature, ActualFeature):
            measured[name] = feature
        elif isinstance(feature, FitError):
            return not_measured(characteristic, feature.what)
    if covariance is None:
        return not_measured(
            characteristic, "No uncertainty: the covariance of the points is unknown."
        )
    try:
        evaluation = evaluate(characteristic, measured, alignment)
        spreads = spreads_of(characteristic, evaluation, measured, covariance, samples)
        result = make_result(characteristic, evaluation, spreads, rule)
    except OcmmError as error:
        return not_measured(characteristic, error.what)
    return _with_notes(result, characteristic, measured, covariance)


def _with_notes(
    result: CharacteristicResult,
    characteristic: Characteristic,
    measured: Mapping[str, ActualFeature],
    covariance: Float,
) -> CharacteristicResult:
    value, uncertainty = result.measured, result.uncertainty
    if characteristic.kind in FORMS:
        floor = form_floor(measured[characteristic.features[0]], covariance)
        said = f"A perfect form would show {floor:.4f} mm from the noise of the points."
        return replace(result, floor=floor, note=f"{result.note} {said}".strip())
    if value is None or uncertainty is None:
        return result
    if characteristic.kind == "distance" and value < uncertainty:
        said = "The distance is smaller than its uncertainty."
        return replace(result, note=f"{result.note} {said}".strip())
    return result


def form_floor(feature: ActualFeature, covariance: Float) -> float:
    """Return the form, mm, that the noise of the points alone lets a perfect feature show.

    It is the expected range of as many normal variables as there are points, with the mean
    variance of the residuals: what the points have in common and what the fit absorbs is not in
    it.

    Parameters
    ----------
    feature
        With n points.
    covariance
        (3 N + 1, 3 N + 1), mm^2.
    """
    by_points = feature.residual_jacobian
    variances = np.einsum("ij,jk,ik->i", by_points, covariance, by_points, optimize=True)
    return expected_range(len(by_points)) * float(np.sqrt(max(float(variances.mean()), 0.0)))


@lru_cache(maxsize=256)
def expected_range(count: int) -> float:
    """Return the expected range of ``count`` independent standard normal variables.

    The integral of 1 - F^n - (1 - F)^n over all z (L. Tippett, Biometrika 17, 1925); 2.326 for 5.
    """
    z = np.linspace(-8.0, 8.0, 1601)
    below = np.array([normal_probability(float(value)) for value in z])
    density = 1.0 - below**count - (1.0 - below) ** count
    return float(np.sum(density) * (z[1] - z[0]))
