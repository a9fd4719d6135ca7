"""Checks of the alignment in a plan, and its preview before acceptance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.alignment import _rules as rules
from ocmm_core.alignment._datums import datums_of, frame_of, nominal_frame, settled
from ocmm_core.alignment._frame_document import is_covariance
from ocmm_core.alignment._precedence import refit_under_precedence
from ocmm_core.alignment._residuals import Residual, brought_together, frame_jacobian, residuals_of
from ocmm_core.errors import FitError, OcmmError
from ocmm_core.features.measured import AXIAL, CENTRED, LONG, ActualFeature, geometries_of
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float, RigidTransform, skew
from ocmm_core.measuring import COVERAGE_FACTOR, PointFactors, Rows
from ocmm_core.part_model import face_fault

CONDITIONS = 6
LEAST_POINTS = 3
LEAST_ON_MODEL = 7
"""One more than a part has motions."""
LEAST_FIXED = 1e-9

Fault = tuple[str, str]
"""Faulty field, and the fault."""


def alignment_fault(
    rule: rules.Alignment, shapes: Mapping[str, Shape], field: str = "alignment"
) -> Fault | None:
    """Return field and fault of an impossible alignment, else None; ``shapes``: of all features."""
    match rule:
        case rules.DatumAlignment():
            return _three_two_one(rule, shapes, field)
        case rules.PlaneAxisPoint():
            return (
                _need(shapes, f"{field}.plane", rule.plane, (Shape.PLANE,))
                or _need(shapes, f"{field}.axis", rule.axis, AXIAL)
                or _need(shapes, f"{field}.point", rule.point, CENTRED)
                or _once(f"{field}.point", rule.features)
            )
        case rules.DatumReferenceFrame():
            if not 1 <= len(rule.datums) <= 3:
                return f"{field}.datums", f"names {len(rule.datums)}, but one to three are needed"
            return _known(shapes, f"{field}.datums", rule.datums, tuple(Shape))
        case rules.BestFit():
            return _best_fit(rule, shapes, field)
        case rules.ModelBestFit():
            return _model_best_fit(rule, shapes, field)
        case rules.ReferencePoints():
            return _reference_points(rule, shapes, field)
        case rules.SavedFrame():
            return _rigid(rule, field)
        case rules.Relocation():
            if not rule.limit > 0.0:
                return f"{field}.limit", f"is {rule.limit:g}, but must be greater than zero"
            return _points(shapes, f"{field}.control", rule.features)


def _three_two_one(
    rule: rules.DatumAlignment, shapes: Mapping[str, Shape], field: str
) -> Fault | None:
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


def _best_fit(rule: rules.BestFit, shapes: Mapping[str, Shape], field: str) -> Fault | None:
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


def _model_best_fit(
    rule: rules.ModelBestFit, shapes: Mapping[str, Shape], field: str
) -> Fault | None:
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
    rule: rules.ReferencePoints, shapes: Mapping[str, Shape], field: str
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


def _rigid(rule: rules.SavedFrame, field: str) -> Fault | None:
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
    return (field, "names one feature twice") if len(set(names)) < len(names) else None


def _need(
    shapes: Mapping[str, Shape], field: str, name: str, wanted: Sequence[Shape]
) -> Fault | None:
    if name not in shapes:
        return field, f"names {name!r}, which is not a feature of the plan"
    if shapes[name] not in wanted:
        words = ", ".join(shape.value.lower() for shape in wanted)
        return field, f"names {name!r}, but needs one of: {words}"
    return None


_SEEN_MM = 1e-3
"""Residuals printed as zero are insignificant."""


@dataclass(frozen=True, slots=True)
class AlignmentReport:
    """Preview of an alignment."""

    frame: str
    T_part_from_world: RigidTransform | None
    """None without a frame; ``advice`` then has the reason."""
    T_nominal_from_world: RigidTransform | None
    """To the frame of the nominals."""
    residuals: tuple[Residual, ...]
    """Of all measured features with a nominal, those that define the frame first."""
    free: tuple[str, ...]
    """Remaining degrees of freedom, in words."""
    origin_uncertainty: Float | None
    turn_uncertainty: Float | None
    """`origin_uncertainty`, `turn_uncertainty`: (3,), mm and rad, k = 2: along, about the axes."""
    advice: tuple[str, ...]

    @property
    def can_be_accepted(self) -> bool:
        """Return whether there is a frame."""
        return self.T_part_from_world is not None


def preview_alignment(
    bound: rules.BoundAlignment,
    actual: Mapping[str, ActualFeature | FitError],
    factors: PointFactors | None = None,
) -> AlignmentReport:
    """Return the preview of an alignment; ``bound``: `inspection.plan.Plan.bound_alignment`."""
    measured = {k: v for k, v in actual.items() if isinstance(v, ActualFeature)}
    geometries = geometries_of(measured)
    try:
        for name in bound.features:
            reason = actual.get(name)
            if isinstance(reason, FitError):
                raise reason
        bound = settled(bound, geometries)
        held = refit_under_precedence(bound, measured)
        T_part_from_world = frame_of(bound, held.geometries, held.features)
        T_nominal_from_part = _to_nominals(bound)
        jacobian = frame_jacobian(bound, held.features, T_part_from_world)
    except OcmmError as error:
        said = (f"{error.what} {error.remedy}",)
        return AlignmentReport(bound.frame, None, None, (), (), None, None, said)
    T_nominal_from_world = T_nominal_from_part.compose(T_part_from_world)
    residuals = residuals_of(
        bound, measured, T_nominal_from_world, _turned(jacobian, T_nominal_from_part), factors
    )
    free = _free(bound, geometries)
    spread = None if factors is None or not len(bound.features) else _spread(jacobian, factors)
    return AlignmentReport(
        frame=bound.frame,
        T_part_from_world=T_part_from_world,
        T_nominal_from_world=T_nominal_from_world,
        residuals=residuals,
        free=free,
        origin_uncertainty=None if spread is None else spread[3:],
        turn_uncertainty=None if spread is None else spread[:3],
        advice=(*([held.note] if held.note else []), *_advice(bound, measured, residuals, free)),
    )


def report_lines(report: AlignmentReport) -> list[str]:
    """Return the report as lines of text, with a table of the residuals."""
    lines = [f"Frame: {report.frame}"]
    if report.T_part_from_world is not None:
        lines.append("Open degrees of freedom: " + (", ".join(report.free) or "none"))
    if report.origin_uncertainty is not None and report.turn_uncertainty is not None:
        shifts = " ".join(f"{value:.4f}" for value in report.origin_uncertainty)
        turns = " ".join(f"{value:.4f}" for value in np.degrees(report.turn_uncertainty))
        lines.append(f"U (k=2) of the origin x y z: {shifts} mm; of turns: {turns} deg")
    if report.residuals:
        heads = " ".join(f"{word:>8}" for word in ("dx", "dy", "dz", "off"))
        lines.append(f"{'feature':<20} {heads} {'U':>7} {'deg':>7}")
    for item in report.residuals:
        x, y, z = item.offset
        sure = "" if item.distance_uncertainty is None else f"{item.distance_uncertainty:.4f}"
        name = item.feature if item.aligned else f"({item.feature})"
        lines.append(
            f"{name:<20} {x:8.4f} {y:8.4f} {z:8.4f} {item.distance:8.4f} {sure:>7} "
            f"{np.degrees(item.angle):7.3f}"
        )
    return lines + list(report.advice)


def _to_nominals(bound: rules.BoundAlignment) -> RigidTransform:
    try:
        return nominal_frame(bound).inverse()
    except FitError as error:
        raise FitError(
            error.code, f"Nominals cannot be compared: {error.what}", error.remedy
        ) from error


def _turned(jacobian: Rows, T_nominal_from_part: RigidTransform) -> Rows:
    """Return the small motions of the part frame as those of the nominals' frame."""
    rotation, translation = T_nominal_from_part.rotation, T_nominal_from_part.translation
    turns = rotation @ jacobian[:3]
    return Rows.stacked([turns, rotation @ jacobian[3:] + skew(translation) @ turns])


def _spread(jacobian: Rows, factors: PointFactors) -> Float:
    variances = np.diagonal(factors.covariance_of(jacobian))
    return COVERAGE_FACTOR * np.sqrt(np.maximum(variances, 0.0))


def _free(bound: rules.BoundAlignment, geometries: Mapping[str, Float]) -> tuple[str, ...]:
    rule = bound.rule
    if isinstance(rule, (rules.BestFit, rules.ReferencePoints)) and rule.start is not None:
        bound = replace(bound, rule=rule.start)
        held = isinstance(rule, rules.ReferencePoints) or not rule.locked
        return () if held else _free(bound, geometries)
    if isinstance(rule, (rules.PlaneAxisPoint, rules.DatumReferenceFrame)):
        return datums_of(rule, geometries, bound).free.names()
    return ()


def _advice(
    bound: rules.BoundAlignment,
    measured: Mapping[str, ActualFeature],
    residuals: tuple[Residual, ...],
    free: tuple[str, ...],
) -> tuple[str, ...]:
    rule, said = bound.rule, []
    if free:
        said.append(
            f"Not constrained by the datums: {', '.join(free)}. Results that depend on it are "
            "meaningless: add a datum, or tolerance only what does not depend on it."
        )
    aligned = [item for item in residuals if item.aligned]
    # Flat features lie where they were probed along their axis.
    found = ((name, measured[name]) for name in brought_together(rule))
    deep = [name for name, one in found if one.raw is not None and one.fit.shape.spec.is_flat]
    if deep:
        said.append(
            f"{', '.join(deep)}: the depth of a circle or slot is where it was probed. Unless "
            "intended, construct its projection onto a face and align to that."
        )
    count = {rules.BestFit: 3, rules.Relocation: 3}.get(type(rule))
    if count is not None and len(rule.features) <= count:
        said.append("Three points hardly check each other: take a fourth.")
    if isinstance(rule, rules.ReferencePoints) and len(residuals) == len(aligned):
        said.append("Nothing checks the six conditions: measure one more feature and review it.")
    if isinstance(rule, rules.SavedFrame):
        said.append(
            "The frame is used as saved: only features with known positions show whether the "
            "part is still there."
        )
    worst = max(residuals, key=lambda item: item.distance, default=None)
    if worst is not None:
        sure = worst.distance_uncertainty
        doubt = "" if sure is None else f", U {sure:.3f} mm"
        beyond = worst.distance > (_SEEN_MM if sure is None else sure)
        said.append(
            f"Largest residual: {worst.feature} {worst.distance:.3f} mm{doubt}."
            + (" Re-probe it if the part should be better." if beyond else "")
        )
    return tuple(said)
