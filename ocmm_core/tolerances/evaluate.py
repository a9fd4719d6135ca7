"""Characteristics from measured features: value, and how it answers to every point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.alignment.datums import DatumAlignment, part_frame
from ocmm_core.errors import FitError
from ocmm_core.features.actual import ActualFeature
from ocmm_core.features.shapes import GEOMETRY_SIZE
from ocmm_core.geometry import Float
from ocmm_core.tolerances.characteristic import Characteristic
from ocmm_core.tolerances.decision import Rule, make_result, not_measured
from ocmm_core.tolerances.result import CharacteristicResult

_AXES = "xyz"
_STEP = 1e-5
"""Step of the central differences over geometry: mm, and for directions a fraction of one."""


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Value of a characteristic, mm, and its gradient (3 N + 1,) by all points and the ball."""

    value: float
    gradient: Float


def characteristic_value(
    characteristic: Characteristic,
    geometries: Mapping[str, Float],
    alignment: DatumAlignment | None,
) -> float:
    """Return the value, mm, of a diameter, distance or coordinate.

    Parameters
    ----------
    geometries
        Geometry vectors (7,) by name (`features.shapes.Fit`), in one frame.
    alignment
        Rule of the part frame; only coordinates need it.

    Raises
    ------
    FitError
        There is no part frame.
    KeyError
        A feature of the characteristic is not among the geometries.
    """
    first = geometries[characteristic.features[0]]
    if characteristic.kind == "diameter":
        return 2.0 * float(first[6])
    if characteristic.kind == "distance":
        return _distance(first, geometries[characteristic.features[1]])
    if characteristic.kind == "coordinate" and alignment is not None:
        T_part_from_world = part_frame(alignment, geometries)
        return float(T_part_from_world.apply(first[0:3])[_AXES.index(characteristic.axis)])
    raise ValueError(characteristic.kind)


def evaluate(
    characteristic: Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: DatumAlignment | None,
) -> Evaluation:
    """Return value and gradient of a characteristic.

    Geometry is differentiated by central differences, and chained with the jacobians of the
    features. Form is the range of the residuals; its gradient is that of the two extreme points
    and says how certain that range is, not how much of it noise has made.

    Raises
    ------
    FitError
        There is no part frame.
    KeyError
        A feature is not measured.
    """
    if characteristic.kind == "form":
        feature = actual[characteristic.features[0]]
        residuals = feature.fit.residuals
        high, low = int(np.argmax(residuals)), int(np.argmin(residuals))
        by_residual = feature.residual_jacobian
        return Evaluation(feature.fit.form, by_residual[high] - by_residual[low])
    geometries = {name: feature.fit.geometry for name, feature in actual.items()}
    value = characteristic_value(characteristic, geometries, alignment)
    gradient = np.zeros(next(iter(actual.values())).jacobian.shape[1])
    names = dict.fromkeys(characteristic.features)
    if characteristic.kind == "coordinate" and alignment is not None:
        names |= dict.fromkeys(alignment.features)
    for name in names:
        slope = _slope(characteristic, geometries, alignment, name)
        gradient += slope @ actual[name].jacobian
    return Evaluation(value, gradient)


def evaluate_all(
    characteristics: Sequence[Characteristic],
    alignment: DatumAlignment | None,
    actual: Mapping[str, ActualFeature | FitError],
    covariance: Float,
    rule: Rule,
) -> tuple[CharacteristicResult, ...]:
    """Return the results of all characteristics.

    Parameters
    ----------
    actual
        `features.actual.actual_features` of the job.
    covariance
        (3 N + 1, 3 N + 1), mm^2, of all points and the ball's radius, in the order of the
        features' jacobians.
    rule
        Decision rule.
    """
    return tuple(_result(item, alignment, actual, covariance, rule) for item in characteristics)


def _result(
    characteristic: Characteristic,
    alignment: DatumAlignment | None,
    actual: Mapping[str, ActualFeature | FitError],
    covariance: Float,
    rule: Rule,
) -> CharacteristicResult:
    for name in characteristic.features:
        feature = actual[name]
        if isinstance(feature, FitError):
            return not_measured(characteristic, feature.what)
    measured = {name: item for name, item in actual.items() if isinstance(item, ActualFeature)}
    try:
        found = evaluate(characteristic, measured, alignment)
    except FitError as error:
        return not_measured(characteristic, error.what)
    variance = float(found.gradient @ covariance @ found.gradient)
    note = ""
    if characteristic.kind == "form":
        feature = measured[characteristic.features[0]]
        floor = _noise_floor(feature, covariance)
        note = f"a perfect feature would read about {floor:.3f} mm by the noise of the points alone"
        if len(feature.fit.residuals) <= _determined_by(feature):
            return not_measured(characteristic, "form needs more points than the shape is made of")
    return make_result(characteristic, found.value, float(np.sqrt(max(variance, 0.0))), rule, note)


def _distance(first: Float, second: Float) -> float:
    """Return the distance of two elements.

    To a plane or line along its normal or square to it; between two planes at the centroid of the
    first; else between the centres.
    """
    between = first[0:3] - second[0:3]
    direction = second[3:6]
    raise NotImplementedError(between, direction)


def _slope(
    characteristic: Characteristic,
    geometries: dict[str, Float],
    alignment: DatumAlignment | None,
    name: str,
) -> Float:
    """Return d(value) / d(geometry of one feature), (7,)."""
    slope = np.zeros(GEOMETRY_SIZE)
    for k in range(GEOMETRY_SIZE):
        values = []
        for sign in (1.0, -1.0):
            moved = geometries[name].copy()
            moved[k] += sign * _STEP
            values.append(
                characteristic_value(characteristic, {**geometries, name: moved}, alignment)
            )
        slope[k] = (values[0] - values[1]) / (2.0 * _STEP)
    return slope
