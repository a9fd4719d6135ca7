"""Characteristics from measured features: value, and how it answers to every point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ocmm_core.alignment.rules import AnyAlignment, BoundAlignment, frame_name
from ocmm_core.errors import FitError
from ocmm_core.features.actual import ActualFeature
from ocmm_core.features.shapes import GEOMETRY_SIZE, Shape
from ocmm_core.geometry import Float
from ocmm_core.tolerances.characteristic import (
    COAXIAL,
    FORMS,
    ORIENTATIONS,
    PROFILES,
    RUNOUTS,
    SIZES,
    ZONES,
    Characteristic,
)
from ocmm_core.tolerances.evaluation import Evaluation
from ocmm_core.tolerances.form import form
from ocmm_core.tolerances.location import coaxiality, position
from ocmm_core.tolerances.measure import geometry_value
from ocmm_core.tolerances.orientation import orientation
from ocmm_core.tolerances.points import points_note
from ocmm_core.tolerances.profile import profile
from ocmm_core.tolerances.runout import runout
from ocmm_core.tolerances.size import associated_size, own_association, size_words
from ocmm_core.tolerances.symmetry import symmetry
from ocmm_core.tolerances.zone_frame import Frames, moved_geometry

_STEP = 1e-5
"""Step of the central differences over geometry: mm, and for directions a fraction of one."""

_SHORTEST_MM = 1e-3
"""A distance below it is bent within the step: differences would make it look certain."""
_FLATTEST_DEG = 0.01
"""The same for an angle near zero, straight or at the fold of an acute one."""

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
    return replace(found, note=f"{found.note} {note}".strip())


def involved_features(
    characteristic: Characteristic, alignment: AnyAlignment | None
) -> tuple[str, ...]:
    """Return the names of all features that the value rests on, each once."""
    names = dict.fromkeys((*characteristic.features, *characteristic.datums))
    if needs_part_frame(characteristic) and alignment is not None:
        names |= dict.fromkeys(alignment.features)
    return tuple(names)


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
    if kind not in ZONES:
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


def _frame_words(alignment: AnyAlignment) -> str:
    if isinstance(alignment, BoundAlignment):
        return alignment.frame
    return frame_name(alignment)


def _from_geometry(
    characteristic: Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
) -> Evaluation:
    """Return a size, distance, coordinate or angle, by central differences over the geometry."""
    geometries = {name: feature.fit.geometry for name, feature in actual.items()}
    shapes = {name: feature.fit.shape for name, feature in actual.items()}

    def value_of(moved: Mapping[str, Float]) -> float:
        return geometry_value(characteristic, moved, shapes, alignment)

    value = value_of(geometries)
    _refuse_folded(characteristic, value, shapes)
    gradient = np.zeros(next(iter(actual.values())).jacobian.shape[1])
    for name, feature in actual.items():
        slope = np.zeros(GEOMETRY_SIZE)
        for k in range(GEOMETRY_SIZE):
            if np.any(feature.jacobian[k]):
                ahead, behind = (
                    value_of(moved_geometry(geometries, name, k, step))
                    for step in (_STEP, -_STEP)
                )
                slope[k] = (ahead - behind) / (2.0 * _STEP)
        gradient += slope @ feature.jacobian
    in_part = needs_part_frame(characteristic) and alignment is not None
    words = _frame_words(alignment) if in_part and alignment is not None else ""
    return Evaluation(value, gradient, frame=words)


def _refuse_folded(
    characteristic: Characteristic, value: float, shapes: Mapping[str, Shape]
) -> None:
    """Raise FitError where a value is at a fold, so that differences would make it look certain."""
    if characteristic.kind == "distance" and value < _SHORTEST_MM:
        raise FitError(
            "characteristic.no_distance",
            f"The features of {characteristic.name} are in one place; a distance of zero has no "
            "uncertainty that could be stated.",
            "Tolerance the coordinates of the features instead.",
        )
    if characteristic.kind != "angle" or len(characteristic.features) == 1:
        return
    folds = [0.0, 180.0]
    if not all(shapes[name] is Shape.PLANE for name in characteristic.features):
        folds.append(90.0)
    if min(abs(value - fold) for fold in folds) < _FLATTEST_DEG:
        raise FitError(
            "characteristic.no_angle",
            f"The angle of {characteristic.name} has no sense at {value:.3f} degrees, and so no "
            "uncertainty that could be stated.",
            "Tolerance parallelism, perpendicularity or angularity instead.",
        )
