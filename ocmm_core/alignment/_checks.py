"""Checks of the alignment in a plan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ocmm_core.alignment._frame_document import is_covariance
from ocmm_core.alignment._rules import (
    Alignment,
    BestFit,
    DatumAlignment,
    DatumReferenceFrame,
    ModelBestFit,
    PlaneAxisPoint,
    ReferencePoints,
    Relocation,
    SavedFrame,
)
from ocmm_core.features.measured import AXIAL, CENTRED, LONG
from ocmm_core.features.shapes import Shape
from ocmm_core.part_model import face_fault

CONDITIONS = 6
LEAST_POINTS = 3
LEAST_ON_MODEL = 7
"""One more than a part has motions."""
LEAST_FIXED = 1e-9

Fault = tuple[str, str]
"""Faulty field, and the fault."""


def alignment_fault(
    rule: Alignment, shapes: Mapping[str, Shape], field: str = "alignment"
) -> Fault | None:
    """Return field and fault of an impossible alignment, else None; ``shapes``: of all features."""
    match rule:
        case DatumAlignment():
            return _three_two_one(rule, shapes, field)
        case PlaneAxisPoint():
            return (
                _need(shapes, f"{field}.plane", rule.plane, (Shape.PLANE,))
                or _need(shapes, f"{field}.axis", rule.axis, AXIAL)
                or _need(shapes, f"{field}.point", rule.point, CENTRED)
                or _once(f"{field}.point", rule.features)
            )
        case DatumReferenceFrame():
            if not 1 <= len(rule.datums) <= 3:
                return f"{field}.datums", f"names {len(rule.datums)}, but one to three are needed"
            return _known(shapes, f"{field}.datums", rule.datums, tuple(Shape))
        case BestFit():
            return _best_fit(rule, shapes, field)
        case ModelBestFit():
            return _model_best_fit(rule, shapes, field)
        case ReferencePoints():
            return _reference_points(rule, shapes, field)
        case SavedFrame():
            return _rigid(rule, field)
        case Relocation():
            if not rule.limit > 0.0:
                return f"{field}.limit", f"is {rule.limit:g}, but must be greater than zero"
            return _points(shapes, f"{field}.control", rule.features)


def _three_two_one(rule: DatumAlignment, shapes: Mapping[str, Shape], field: str) -> Fault | None:
    wrong = _need(shapes, f"{field}.primary", rule.primary, (Shape.PLANE, *LONG))
    if wrong:
        return wrong
    match len(rule.secondary):
        case 1:
            wrong = _need(shapes, f"{field}.secondary", rule.secondary[0], (Shape.PLANE, *LONG))
        case 2:
            wrong = _known(shapes, f"{field}.secondary", rule.secondary, CENTRED)
        case count:
            return f"{field}.secondary", f"names {count} features, but one or two are needed"
    wrong = wrong or _need(shapes, f"{field}.origin", rule.origin, CENTRED)
    if rule.towards:
        if len(rule.secondary) == 2:
            return f"{field}.towards", "is given, but two centres already define x"
        wrong = wrong or _need(shapes, f"{field}.towards", rule.towards, CENTRED)
    if rule.primary_axis[-1] == rule.secondary_axis[-1]:
        return f"{field}.secondary_axis", "is the axis that the primary gives"
    return wrong


def _best_fit(rule: BestFit, shapes: Mapping[str, Shape], field: str) -> Fault | None:
    if rule.weights and len(rule.weights) != len(rule.points):
        return (
            f"{field}.weights",
            f"has {len(rule.weights)} numbers, but there are {len(rule.points)} points",
        )
    if any(not weight > 0.0 for weight in rule.weights):
        return f"{field}.weights", "holds a number that is not greater than zero"
    if rule.locked and rule.start is None:
        return f"{field}.start", "is missing: it fixes the locked motions"
    if rule.start is not None:
        wrong = alignment_fault(rule.start, shapes, f"{field}.start")
        if wrong:
            return wrong
    if rule.locked:
        return _known(shapes, f"{field}.points", rule.points, CENTRED)
    return _points(shapes, f"{field}.points", rule.points)


def _model_best_fit(rule: ModelBestFit, shapes: Mapping[str, Shape], field: str) -> Fault | None:
    if not rule.faces:
        return f"{field}.faces", "names no face of the model"
    for place, face in enumerate(rule.faces):
        if fault := face_fault(face):
            return f"{field}.faces[{place}]", f"is no face of a model: {fault}"
    if len(rule.points) < LEAST_ON_MODEL:
        count = len(rule.points)
        return f"{field}.points", f"names {count}, but at least {LEAST_ON_MODEL} are needed"
    return _known(shapes, f"{field}.points", rule.points, (Shape.POINT,))


def _reference_points(
    rule: ReferencePoints, shapes: Mapping[str, Shape], field: str
) -> Fault | None:
    if len(rule.conditions) != CONDITIONS:
        return (
            f"{field}.conditions",
            f"has {len(rule.conditions)}, but exactly six constrain a part",
        )
    for index, item in enumerate(rule.conditions):
        at = f"{field}.conditions[{index}]"
        wrong = _need(shapes, f"{at}.feature", item.feature, CENTRED)
        if wrong:
            return wrong
        if sum(value * value for value in item.direction) < LEAST_FIXED:
            return f"{at}.direction", "is a zero vector"
    if rule.start is not None:
        return alignment_fault(rule.start, shapes, f"{field}.start")
    names = tuple(dict.fromkeys(item.feature for item in rule.conditions))
    if len(names) < LEAST_POINTS:
        return f"{field}.start", "is missing: fewer than three points give no starting position"
    return None


def _rigid(rule: SavedFrame, field: str) -> Fault | None:
    rotation = np.array(rule.rotation)
    if np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-9 or np.linalg.det(rotation) < 0.0:
        return f"{field}.rotation", "is not a rotation"
    if not rule.covariance:
        return None
    if any(len(row) != len(rule.covariance) for row in rule.covariance):
        return f"{field}.covariance", "has rows of unequal length"
    if not is_covariance(np.array(rule.covariance)):
        return f"{field}.covariance", "is not a covariance of rotation and translation"
    return None


def _points(shapes: Mapping[str, Shape], field: str, names: Sequence[str]) -> Fault | None:
    if len(names) < LEAST_POINTS:
        return field, f"names {len(names)}, but at least three are needed"
    return _known(shapes, field, names, CENTRED)


def _known(
    shapes: Mapping[str, Shape], field: str, names: Sequence[str], wanted: Sequence[Shape]
) -> Fault | None:
    if not names:
        return field, "names nothing"
    for name in names:
        wrong = _need(shapes, field, name, wanted)
        if wrong:
            return wrong
    return _once(field, names)


def _once(field: str, names: Sequence[str]) -> Fault | None:
    if len(set(names)) < len(names):
        return field, "names one feature twice"
    return None


def _need(
    shapes: Mapping[str, Shape], field: str, name: str, wanted: Sequence[Shape]
) -> Fault | None:
    if name not in shapes:
        return field, f"names {name!r}, which is not a feature of the plan"
    if shapes[name] not in wanted:
        words = ", ".join(shape.value.lower() for shape in wanted)
        return field, f"names {name!r}, but needs one of: {words}"
    return None
