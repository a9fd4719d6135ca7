"""Datum precedence: association under the orientation of preceding datums.

ISO 5459: the primary datum is associated freely, the secondary one with the direction left by the
primary, the tertiary one with that of both. Positions of points on a face out of square only
determine its rotation about the primary's normal.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.alignment import _rules as rules
from ocmm_core.alignment._datum_frame import DatumFrame, datum_frame, frames_of_datums
from ocmm_core.alignment._datums import frame_of
from ocmm_core.alignment._freedom import SAME_DIRECTION, angle_about
from ocmm_core.alignment._residuals import frame_jacobian
from ocmm_core.features.measured import (
    ActualFeature,
    Instead,
    Orientation,
    can_be_oriented,
    geometries_of,
    oriented_feature,
)
from ocmm_core.features.shapes import DIRECTION, Shape
from ocmm_core.geometry import Float, RigidTransform, crossed, rotation_from_vector, unit

SEEN_MM = 0.02
"""Rotation of a datum over its own points, mm at their ends, from which it is reported."""


@dataclass(frozen=True, slots=True)
class ConstrainedAssociation:
    """Features with re-associated datums."""

    features: Mapping[str, ActualFeature]
    turned: Mapping[str, float]
    """mm, by name of the datum: additional rotation over its points, from end to end, compared with
    the datum fitted alone. For a face out of square it depends on the touched places."""

    @property
    def geometries(self) -> Mapping[str, Float]:
        """Return the geometry vectors (12,) of the features."""
        return geometries_of(self.features)

    @property
    def note(self) -> str:
        """Return advice on tilted datums, or empty text."""
        said = [
            f"{name} leans: fitted under the preceding datums, it rotates by {by:.3f} mm over "
            "its points more than alone. This depends on where it was probed: spread its points "
            "evenly over the face."
            for name, by in self.turned.items()
            if by > SEEN_MM
        ]
        return " ".join(said)


def part_frame(rule: rules.AnyAlignment, features: Mapping[str, ActualFeature]) -> RigidTransform:
    """Return the motion from the world to the part frame; see `datums.frame_of`."""
    held = refit_under_precedence(rule, features)
    return frame_of(rule, held.geometries, held.features)


def refit_under_precedence(
    rule: rules.AnyAlignment, actual: Mapping[str, ActualFeature]
) -> ConstrainedAssociation:
    """Return the features as used by a part frame: later datums re-associated in precedence.

    All else is as measured. FitError: a datum is not measured, or does not determine the frame.
    """
    if not isinstance(rule, rules.BoundAlignment):
        return ConstrainedAssociation(actual, {})
    datums, others = datums_in_precedence(rule.rule)
    if any(name not in actual for name in datums) or len(datums) < 2:
        return ConstrainedAssociation(actual, {})
    again, _ = in_precedence(datums, actual, rule.shapes, rule.nominals, rule.choice)
    # A centre that is also aligned alone stays as measured.
    kept = {name: actual[name] for name in others if name in actual}
    return ConstrainedAssociation(Instead(kept, again.features), again.turned)


def datums_refit_by(
    rule: rules.AnyAlignment | None, actual: Mapping[str, ActualFeature]
) -> tuple[str, ...]:
    """Return the datums of a part frame re-associated by `refit_under_precedence`."""
    if not isinstance(rule, rules.BoundAlignment):
        return ()
    return may_be_refit(datums_in_precedence(rule.rule)[0], actual)


def may_be_refit(datums: Sequence[str], actual: Mapping[str, ActualFeature]) -> tuple[str, ...]:
    """Return the datums after the first with a direction and points of their own."""
    return tuple(name for name in datums[1:] if name in actual and can_be_oriented(actual[name]))


def in_precedence(
    datums: Sequence[str],
    actual: Mapping[str, ActualFeature],
    shapes: Mapping[str, Shape],
    nominals: Mapping[str, Float],
    choice: int | None = None,
) -> tuple[ConstrainedAssociation, DatumFrame]:
    """Return all features with datums in precedence, and the frame of the datums.

    Constructed datums, points and balls stay unchanged; so do the direction across of a slot, and
    datums after one without a direction. `datums`: names, primary first. `shapes`, `nominals`,
    `choice`: see `datum_frame.datum_frame`. FitError as `datum_frame.datum_frame`, or a datum is
    not determined under the constraint.
    """
    again: dict[str, ActualFeature] = {}
    found = Instead(again, actual)
    taken = may_be_refit(datums, actual)
    turned: dict[str, float] = {}
    frame = datum_frame(datums, geometries_of(found), shapes, nominals, choice)
    for place, name in enumerate(datums):
        if name not in taken:
            continue
        orientation = _orientation(datums, place, found, shapes, nominals, frame)
        if orientation is not None:
            again[name] = oriented_feature(actual[name], orientation)
            turned[name] = _turned(actual[name], orientation, again[name].fit.direction)
            frame = datum_frame(datums, geometries_of(found), shapes, nominals, frame.choice)
    return ConstrainedAssociation(found, turned), frame


def _orientation(
    datums: Sequence[str],
    place: int,
    found: Mapping[str, ActualFeature],
    shapes: Mapping[str, Shape],
    nominals: Mapping[str, Float],
    whole: DatumFrame,
) -> Orientation | None:
    """Return the orientation left to a datum; None without a constraint."""
    before = datums[:place]
    T_frame_from_world = whole.T_frame_from_world
    frames = frames_of_datums(before, geometries_of(found), shapes, nominals)
    held = _like(frames, T_frame_from_world)
    turn = held.free.turn
    if len(turn) == 3:
        return None
    rule = rules.BoundAlignment(
        rules.DatumReferenceFrame(datums=tuple(before)), shapes, nominals, choice=held.choice
    )
    back = held.T_frame_from_world.rotation.T
    jacobian = frame_jacobian(rule, found, held.T_frame_from_world)
    # The frame turns over the part: a direction of the frame turns the other way in the world.
    by_coordinates = -back @ jacobian[:3]
    name = datums[place]
    nominal = unit(nominals[name][DIRECTION])
    measured = found[name].fit.direction
    if not len(turn):
        return Orientation(_nearer(back @ nominal, measured), None, by_coordinates)
    axis = back @ turn[0]
    if float(np.linalg.norm(crossed(turn[0], nominal))) < SAME_DIRECTION:
        return Orientation(_nearer(back @ nominal, measured), None, by_coordinates)
    meant = _nearer(T_frame_from_world.rotation.T @ nominal, measured)
    direction = rotation_from_vector(angle_about(axis, meant, measured) * axis) @ meant
    return Orientation(direction, axis, by_coordinates)


def _like(frames: Sequence[DatumFrame], T_frame_from_world: RigidTransform) -> DatumFrame:

    def off(frame: DatumFrame) -> float:
        turned = frame.T_frame_from_world.rotation - T_frame_from_world.rotation
        held = frame.free.turn if len(frame.free.turn) == 1 else np.eye(3)
        return float(np.linalg.norm(held @ turned))

    return min(frames, key=off)


def _turned(feature: ActualFeature, orientation: Orientation, direction: Float) -> float:
    """Return the rotation of a datum from its fit alone, mm at the ends of its points."""
    if orientation.about is None or feature.touches is None:
        return 0.0
    angle = abs(angle_about(orientation.about, orientation.direction, direction))
    tips = feature.touches.tips
    square = tips - np.outer(tips @ orientation.about, orientation.about)
    return angle * float(np.linalg.norm(np.ptp(square, axis=0)))


def _nearer(direction: Float, measured: Float) -> Float:
    return direction if float(direction @ measured) >= 0.0 else -direction


def datums_in_precedence(rule: rules.Alignment) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the datums in precedence of a rule, and other features used unchanged."""
    match rule:
        case rules.PlaneAxisPoint() | rules.DatumReferenceFrame():
            return rule.features, ()
        case rules.BestFit() if rule.start is not None:
            return datums_in_precedence(rule.start)[0], rule.points
        case rules.ReferencePoints() if rule.start is not None:
            names = tuple(item.feature for item in rule.conditions)
            return datums_in_precedence(rule.start)[0], names
    return (), ()
