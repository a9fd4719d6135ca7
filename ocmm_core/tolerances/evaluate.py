"""Characteristics from measured features: value, and how it answers to every point."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ocmm_core.alignment.datums import DatumAlignment, frame_of
from ocmm_core.errors import FitError
from ocmm_core.features.actual import ActualFeature
from ocmm_core.features.shapes import GEOMETRY_SIZE, MINIMUM_POINTS
from ocmm_core.geometry import Float
from ocmm_core.tolerances.characteristic import Characteristic
from ocmm_core.tolerances.evaluation import Evaluation

_AXES = "xyz"
_STEP = 1e-5
"""Step of the central differences over geometry: mm, and for directions a fraction of one."""

_SHORTEST_MM = 1e-3
"""A distance below it is bent within the step: differences would make it look certain."""

_NOTHING = 1e-6
"""Gradients below it are rounding: no point moves the value."""


def characteristic_value(
    characteristic: Characteristic,
    geometries: Mapping[str, Float],
    alignment: DatumAlignment | None,
) -> float:
    """Return the value, mm, of a diameter, distance or coordinate.

    Parameters
    ----------
    geometries
        Geometry vectors (12,) by name (`features.shapes.Fit`), in one frame.
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
    if alignment is None:
        raise FitError(
            "characteristic.no_frame",
            f"{characteristic.name} needs a part frame, and the plan has no alignment.",
            "Add an alignment to the plan.",
        )
    T_part_from_world = frame_of(alignment, geometries)
    return float(T_part_from_world.apply(first[0:3])[_AXES.index(characteristic.axis)])


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
        A feature is not measured, there is no part frame, or the features do not show the value:
        two in one place no distance, as few points as the shape needs no form, the origin of the
        part frame no coordinate.
    """
    for name in involved_features(characteristic, alignment):
        if name not in actual:
            raise FitError(
                "characteristic.not_measured",
                f"{characteristic.name} needs {name}, which is not measured.",
                f"Measure {name}.",
            )
    if characteristic.kind == "form":
        return _form(actual[characteristic.features[0]])
    geometries = {name: feature.fit.geometry for name, feature in actual.items()}
    value = characteristic_value(characteristic, geometries, alignment)
    if characteristic.kind == "distance" and value < _SHORTEST_MM:
        raise FitError(
            "characteristic.no_distance",
            f"The features of {characteristic.name} are in one place; a distance of zero has no "
            "uncertainty that could be stated.",
            "Tolerance the coordinates of the features instead.",
        )
    gradient = np.zeros(next(iter(actual.values())).jacobian.shape[1])
    for name in involved_features(characteristic, alignment):
        slope = _slope(characteristic, geometries, alignment, name)
        gradient += slope @ actual[name].jacobian
    if float(np.abs(gradient).max()) < _NOTHING:
        raise FitError(
            "characteristic.by_definition",
            f"{characteristic.name} is fixed by the part frame itself, whatever the part is like.",
            "Leave it out, or align to other features.",
        )
    return Evaluation(value, gradient)


def _form(feature: ActualFeature) -> Evaluation:
    residuals = feature.fit.residuals
    minimum = MINIMUM_POINTS[feature.fit.shape]
    if len(residuals) <= minimum:
        # The element passes through all of them; zero would look like a perfect part.
        raise FitError(
            "characteristic.no_form",
            f"{feature.nominal.name} has {len(residuals)} points; a "
            f"{feature.fit.shape.value.lower()} shows a form from {minimum + 1} points on.",
            "Take more points.",
        )
    high, low = int(np.argmax(residuals)), int(np.argmin(residuals))
    by_residual = feature.residual_jacobian
    return Evaluation(feature.fit.form, by_residual[high] - by_residual[low])


def involved_features(
    characteristic: Characteristic, alignment: DatumAlignment | None
) -> tuple[str, ...]:
    """Return the names of all features that the value rests on, each once."""
    names = dict.fromkeys(characteristic.features)
    if characteristic.kind == "coordinate" and alignment is not None:
        names |= dict.fromkeys(alignment.features)
    return tuple(names)


def _distance(first: Float, second: Float) -> float:
    """Return the distance of two elements, never negative.

    Where one of them is a plane, along its normal to the point of the other; between two planes
    along the second one's normal at the first one's centroid; else between the centres.
    """
    if _is_plane(second):
        return abs(float((first[0:3] - second[0:3]) @ second[3:6]))
    if _is_plane(first):
        return abs(float((second[0:3] - first[0:3]) @ first[3:6]))
    return float(np.linalg.norm(first[0:3] - second[0:3]))


def _is_plane(geometry: Float) -> bool:
    """Return whether an element that a distance may name is a plane: a direction, no radius."""
    return bool(np.any(geometry[3:6]) and geometry[6] == 0.0)


def _slope(
    characteristic: Characteristic,
    geometries: dict[str, Float],
    alignment: DatumAlignment | None,
    name: str,
) -> Float:
    """Return d(value) / d(geometry of one feature), (12,)."""
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
