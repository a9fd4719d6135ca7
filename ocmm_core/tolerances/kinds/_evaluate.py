"""Characteristics from measured features: value, and how it answers to every point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ocmm_core.alignment import AnyAlignment, may_be_taken_again, taken_again_by
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import GEOMETRY_SIZE, POINT, Shape
from ocmm_core.geometry import Float
from ocmm_core.tolerances.kinds._angle import angle_of_axes, angle_rule, needs_sense
from ocmm_core.tolerances.kinds._form import form
from ocmm_core.tolerances.kinds._location import coaxiality, position
from ocmm_core.tolerances.kinds._measure import XYZ, geometry_value
from ocmm_core.tolerances.kinds._orientation import orientation
from ocmm_core.tolerances.kinds._profile import profile
from ocmm_core.tolerances.kinds._runout import runout
from ocmm_core.tolerances.kinds._size import (
    associated_size,
    distance_of_faces,
    own_association,
    size_words,
)
from ocmm_core.tolerances.kinds._symmetry import symmetry
from ocmm_core.tolerances.zones import (
    COAXIAL,
    FORMS,
    ORIENTATIONS,
    PROFILES,
    RUNOUTS,
    SIZES,
    ZONES,
    Characteristic,
    Evaluation,
    Frames,
    ZoneFrame,
    moved_geometry,
    points_note,
)

_STEP = 1e-5
"""Step of the central differences over geometry: mm, and for directions a fraction of one."""

_SHORTEST_MM = 1e-3
"""A distance below it is bent within the step: differences would make it look certain."""

_NOTHING = 1e-6
"""Gradients below it are rounding: no point moves the value."""


def evaluate(
    characteristic: Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
    frames: Frames | None = None,
) -> Evaluation:
    """Return value and gradient of a characteristic.

    Parameters
    ----------
    actual
        Features as measured, by name; at least those of `involved_features`.
    alignment
        Rule of the part frame, bound to nominals where its kind needs them.
    frames
        Of all features of the job and that alignment, where several characteristics are evaluated.

    Raises
    ------
    FitError
        A feature is not measured, there is no part frame, or the features do not show the value:
        two in one place no distance, as few points as the shape needs no form, the origin of the
        part frame no coordinate.
    """
    names = involved_features(characteristic, alignment)
    for name in names:
        if name not in actual:
            raise FitError(
                "characteristic.not_measured",
                f"{characteristic.name} needs {name}, which is not measured.",
                f"Measure {name}.",
            )
    involved = {name: actual[name] for name in names}
    frames = frames or Frames(involved, alignment)
    found = _evaluated(characteristic, involved, alignment, frames)
    moving = found.gradient if found.component_gradients is None else found.component_gradients
    if float(np.abs(moving).max()) < _NOTHING:
        raise FitError(
            "characteristic.by_definition",
            f"{characteristic.name} is fixed by the part frame itself, whatever the part is like.",
            "Leave it out, or align to other features.",
        )
    note = points_note(characteristic, [actual[name] for name in characteristic.features])
    datums = taken_again(characteristic, actual, alignment)
    said = [found.note, note, _precedence_note(datums, actual)]
    if datums:
        said.append(frames.note_on(characteristic.datums))
    return replace(found, note=" ".join(part for part in said if part))


def _precedence_note(datums: Sequence[str], actual: Mapping[str, ActualFeature]) -> str:
    """Return how datums after the first were associated; empty where there are none."""
    if not datums:
        return ""
    words = dict.fromkeys(own_association(actual[name]) for name in datums)
    listed = " and ".join(datums)
    verb = "follow" if len(datums) > 1 else "follows"
    return f"{listed} {verb} the orientation of the datums before ({', '.join(words)})."


def involved_features(
    characteristic: Characteristic, alignment: AnyAlignment | None
) -> tuple[str, ...]:
    """Return the names of all features that the value rests on, each once."""
    names = dict.fromkeys((*characteristic.features, *characteristic.datums))
    in_part = needs_part_frame(characteristic) or needs_sense(characteristic, alignment)
    if in_part and alignment is not None:
        names |= dict.fromkeys(alignment.features)
    return tuple(names)


def taken_again(
    characteristic: Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
) -> tuple[str, ...]:
    """Return the datums that the value takes under the orientation of those before them."""
    if characteristic.datums:
        if characteristic.kind in ORIENTATIONS | PROFILES | {"position"}:
            return may_be_taken_again(characteristic.datums, actual)
        return ()
    return taken_again_by(alignment, actual) if needs_part_frame(characteristic) else ()


def needs_part_frame(characteristic: Characteristic) -> bool:
    """Return whether the value refers to the part frame of the plan's alignment."""
    match characteristic.kind:
        case "coordinate":
            return True
        case "distance":
            return characteristic.axis != ""
        case "position":
            return not characteristic.datums
    return False


def _evaluated(
    characteristic: Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
    frames: Frames,
) -> Evaluation:
    first = actual[characteristic.features[0]]
    kind = characteristic.kind
    own = own_association(first)
    if kind in SIZES and characteristic.association not in ("", own):
        return associated_size(characteristic, first)
    if kind == "distance" and characteristic.association:
        return distance_of_faces(characteristic, first, actual[characteristic.features[1]])
    if kind not in ZONES:
        if needs_part_frame(characteristic):
            found = _in_part(characteristic, actual, frames.aligned(characteristic.name))
        else:
            found = _from_geometry(characteristic, actual, alignment)
        return replace(found, association=size_words(own) if kind in SIZES else own)
    if kind in FORMS:
        return form(characteristic, first)
    if kind in ORIENTATIONS:
        found = orientation(characteristic, actual, frames)
    elif kind == "position":
        found = position(characteristic, actual, frames)
    elif kind in COAXIAL:
        found = coaxiality(characteristic, actual)
    elif kind == "symmetry":
        found = symmetry(characteristic, actual)
    elif kind in PROFILES:
        found = profile(characteristic, actual, frames)
    else:
        found = runout(characteristic, actual)
    points = kind in PROFILES | RUNOUTS or (
        first.fit.shape is Shape.PLANE and first.touches is not None
    )
    return replace(found, association="all points" if points else own)


def _in_part(
    characteristic: Characteristic, actual: Mapping[str, ActualFeature], frame: ZoneFrame
) -> Evaluation:
    """Return a coordinate, or the difference of two along an axis."""
    axis = XYZ.index(characteristic.axis)
    places, slopes = [], []
    for name in characteristic.features:
        feature = actual[name]
        point = frame.T_frame_from_world.apply(feature.fit.point)
        places.append(float(point[axis]))
        slopes.append(frame.point_derivative(point, feature.jacobian[POINT])[axis])
    if characteristic.kind == "coordinate":
        return Evaluation(places[0], slopes[0], frame=frame.words)
    between = places[1] - places[0]
    _refuse_folded(characteristic, abs(between))
    sign = -1.0 if between < 0.0 else 1.0
    return Evaluation(abs(between), sign * (slopes[1] - slopes[0]), frame=frame.words)


def _from_geometry(
    characteristic: Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
) -> Evaluation:
    """Return a size, distance or angle, by central differences over the geometry."""
    geometries = {name: feature.fit.geometry for name, feature in actual.items()}
    shapes = {name: feature.fit.shape for name, feature in actual.items()}

    rule = None
    if characteristic.kind == "angle" and len(characteristic.features) == 2:
        # Settled once: the differences then run through a right angle as through any other.
        rule = angle_rule(characteristic, geometries, shapes, alignment)
        found = angle_of_axes(characteristic, actual, rule)
        if found is not None:
            return found

    def value_of(moved: Mapping[str, Float]) -> float:
        if rule is None:
            return geometry_value(characteristic, moved, shapes, None)
        return rule.value(*(moved[name] for name in characteristic.features))

    value = value_of(geometries)
    _refuse_folded(characteristic, value)
    gradient = np.zeros(next(iter(actual.values())).jacobian.shape[1])
    for name in (*characteristic.features, *characteristic.datums):
        feature = actual[name]
        slope = np.zeros(GEOMETRY_SIZE)
        for k in range(GEOMETRY_SIZE):
            if np.any(feature.jacobian[k]):
                ahead, behind = (
                    value_of(moved_geometry(geometries, name, k, step)) for step in (_STEP, -_STEP)
                )
                slope[k] = (ahead - behind) / (2.0 * _STEP)
        gradient += slope @ feature.jacobian
    if rule is None:
        return Evaluation(value, gradient)
    first, second = (geometries[name] for name in characteristic.features)
    return Evaluation(value, gradient, note=rule.note(first, second))


def _refuse_folded(characteristic: Characteristic, value: float) -> None:
    """Raise FitError where a distance is at its fold, so that differences make it look certain."""
    if characteristic.kind == "distance" and value < _SHORTEST_MM:
        raise FitError(
            "characteristic.no_distance",
            f"The features of {characteristic.name} are in one place; a distance of zero has no "
            "uncertainty that could be stated.",
            "Tolerance the coordinates of the features instead.",
        )
