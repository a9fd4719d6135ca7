"""Assignment of a touch: the active feature, the one of a script, or the touched one.

The side of the material is the one of the plan, or the inspector's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import msgspec
import numpy as np

from ocmm_core.errors import MeasuringError
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float, RigidTransform, unit
from ocmm_core.inspection.evaluation import (
    EvaluationCache,
    Progress,
    SessionOptions,
    nearness,
    place_of_nominals,
)
from ocmm_core.inspection.plan import Plan, step_fault
from ocmm_core.inspection.session._step_log import JobLedger
from ocmm_core.inspection.session._touch_filter import (
    MOST_SLANT_DEG,
    SEARCH_MM,
    Contact,
    TouchAssignment,
    TouchFilter,
    touched_feature,
)
from ocmm_core.measuring import METHODS, MeasuredPoint, Refusal, RefusalCode, StablePoint, Touch


def method_of(plan: Plan, progress: Progress, name: str) -> str:
    """Return the current method of a feature; KeyError if unknown."""
    return methods_of(plan, progress)[name]


def methods_of(plan: Plan, progress: Progress) -> dict[str, str]:
    """Return the current method of every feature of the plan."""
    chosen = progress.methods
    return {
        item.name: chosen.get(item.name) or item.compensation or plan.compensation
        for item in plan.features
    }


def awaits_pull(plan: Plan, progress: Progress) -> bool:
    """Return whether the ball may be followed during its retract at the next touch."""
    names = [progress.active] if progress.active else []
    if progress.probing == "any":
        names = [n for n in progress.names if n not in progress.done | progress.skipped]
    methods = methods_of(plan, progress)
    return any(methods[name] == "pulled" for name in names)


def chosen_methods(plan: Plan, progress: Progress, method: str, name: str) -> dict[str, str]:
    """Return the choices after a change for one feature, or (`name` empty) for all that allow it.

    MeasuringError if not one of `measuring.compensation.METHODS`, or unsuitable for the shape.
    """
    if method not in METHODS:
        raise MeasuringError(
            "session.method",
            f"{method!r} is not a method for finding the probe side.",
            f"Choose one of: {', '.join(METHODS)}.",
        )
    chosen = dict(progress.methods)
    for feature in plan.features:
        if name and feature.name != name:
            continue
        fault = step_fault(msgspec.structs.replace(feature, compensation=method), method)
        if fault is None:
            chosen[feature.name] = method
        elif name:
            raise MeasuringError(
                "session.method",
                f"The compensation of {name} {fault[1]}.",
                "Choose another method.",
            )
    return chosen


_PLANE_POINTS = 3
_AGREED = 0.7
"""Least length of the mean of unit directions that agree, such as 45° off each."""


def wrong_face(
    plan: Plan,
    name: str,
    contact: Contact,
    T_nominal_from_world: RigidTransform | None,
    points: Sequence[MeasuredPoint],
) -> Refusal | None:
    """Return why a touch was not on the face of a feature; None if it may have been.

    ``T_nominal_from_world``: None before it is known; ``points`` of the job, that count.
    """
    feature, ways = plan.feature(name), contact.ways_world
    if not ways:
        return None
    slant, what = 0.0, ""
    if T_nominal_from_world is not None:
        ball = T_nominal_from_world.apply(contact.tip_world)
        near = nearness(feature, ball, contact.radius)
        if near.gap <= SEARCH_MM and np.any(near.normal):
            normal = T_nominal_from_world.rotation.T @ near.normal
            slant = min(_angle(way, normal) for way in ways)
            what = f"The touch came from {slant:.0f}° off the normal of {name}: another face."
    else:
        found = [(slant, what)]
        own = [point for point in points if point.feature == name]
        mean = np.mean([point.direction for point in own], axis=0) if own else np.zeros(3)
        # Points from opposite sides say nothing about the face.
        if feature.shape is Shape.PLANE and np.linalg.norm(mean) > _AGREED:
            off = min(_angle(way, unit(mean)) for way in ways)
            found.append((off, f"The touch came from {off:.0f}° off the earlier points of {name}."))
        for other in plan.features:
            normal_world = _plane_normal(other, points) if other.name != name else None
            if normal_world is not None:
                off = min(_least_slant(way, feature, other, normal_world) for way in ways)
                found.append(
                    (
                        off,
                        f"The touch came from {off:.0f}° off the face of {name}, by the measured "
                        f"{other.name}.",
                    )
                )
        slant, what = max(found)
    if slant <= MOST_SLANT_DEG:
        return None
    return Refusal(
        RefusalCode.WRONG_FACE,
        what,
        f"Touch {name} square to its surface. If its earlier points are wrong, undo them first.",
        contact.time_s,
    )


def _angle(first: Float, second: Float) -> float:
    return float(np.degrees(np.arccos(np.clip(first @ second, -1.0, 1.0))))


def _plane_normal(feature: NominalFeature, points: Sequence[MeasuredPoint]) -> Float | None:
    """Return the normal of a plane that has points, (3,), world; None if they do not fix it."""
    if feature.shape is not Shape.PLANE:
        return None
    own = [point for point in points if point.feature == feature.name]
    if len(own) < _PLANE_POINTS:
        return None
    tips = np.array([point.tip_world for point in own])
    _, sizes, axes = np.linalg.svd(tips - tips.mean(axis=0))
    mean = np.mean([point.direction for point in own], axis=0)
    # Two walls taken as one plane, points in a row, or from opposite sides fix nothing.
    if sizes[2] > 0.1 * sizes[1] or sizes[1] < 0.1 * sizes[0] or np.linalg.norm(mean) <= _AGREED:
        return None
    return np.asarray(axes[2] * np.sign(axes[2] @ mean))


def _least_slant(
    way: Float, feature: NominalFeature, plane: NominalFeature, normal_world: Float
) -> float:
    """Return the least angle, degrees, of a way off the normals of a feature, by one known plane.

    The normals form a cone about the feature's direction; turned about the normal of the plane it
    covers an interval of angles to that normal.
    """
    if not np.any(feature.direction):
        return 0.0
    match feature.shape:
        case Shape.PLANE | Shape.POINT:
            opening = 0.0
        case Shape.SPHERE | Shape.TORUS:
            return 0.0
        case _:
            half = 0.5 * feature.angle_deg
            opening = 90.0 + (half if feature.side == "outer" else -half)
    tilt = _angle(unit(np.array(feature.direction)), unit(np.array(plane.direction)))
    low, high = abs(tilt - opening), min(tilt + opening, 360.0 - tilt - opening)
    seen = _angle(way, normal_world)
    return max(low - seen, seen - high, 0.0)


@dataclass(frozen=True, slots=True)
class NominalPlace:
    """Pose of the nominals from the points of the datums."""

    plan: Plan
    points: Sequence[MeasuredPoint]
    options: SessionOptions
    cache: EvaluationCache = field(default_factory=EvaluationCache)

    def find(self) -> RigidTransform | None:
        """Return the motion from the world to their frame; None while datums are not measured."""
        return place_of_nominals(self.plan, self.points, self.options, self.cache)


class TouchAssigner:
    """Assign a touch to a feature and pass it on; second of three steps. `radius` in mm."""

    def __init__(
        self, ledger: JobLedger, radius: float, options: SessionOptions, acceptance: TouchFilter
    ) -> None:
        self._ledger, self._radius, self._options = ledger, radius, options
        self._acceptance = acceptance

    def assign_touch(
        self, touch: Touch, stable: StablePoint, ways: tuple[Float, ...], wanted: str | None
    ) -> MeasuredPoint | Refusal:
        """Return the point from a touch, or why it gives none.

        `ways`: approach and retract, unit (3,), world, if known. `wanted`: feature of a script.
        """
        meant = self.assign(stable.tip_world, ways, stable.time_s, wanted)
        if isinstance(meant, Refusal):
            return meant
        return self._acceptance.filter(touch, stable, meant)

    def assign(
        self, tip_world: Float, ways: tuple[Float, ...], time_s: float, wanted: str | None
    ) -> TouchAssignment | Refusal:
        """Return the feature of a ball (3,), mm, in contact, or why it is ambiguous."""
        ledger, progress = self._ledger, self._ledger.progress
        return assign_touch(
            ledger.plan,
            progress,
            Contact(tip_world, ways, self._radius, time_s),
            self.nominals,
            wanted=wanted,
            selected=ledger.selected if ledger.selected == progress.active else "",
        )

    @property
    def nominals(self) -> NominalPlace:
        """Return the pose of the nominals by the present points."""
        ledger = self._ledger
        return NominalPlace(ledger.plan, ledger.points.counting, self._options, ledger.cache)


def assign_touch(
    plan: Plan,
    progress: Progress,
    contact: Contact,
    nominals: NominalPlace,
    *,
    wanted: str | None,
    selected: str,
) -> TouchAssignment | Refusal:
    """Return the feature of a touch and the method of its side, or why it is ambiguous.

    `nominals`: evaluated on demand. `wanted`: feature of a script. `selected`: by the inspector for
    this touch, or empty.
    """
    if wanted is not None and wanted not in progress.names:
        return Refusal(
            RefusalCode.NO_FEATURE,
            f"The touch was intended for {wanted}, which is not in the plan.",
            "Touch a feature of the plan.",
            contact.time_s,
        )
    name = progress.active if wanted is None else wanted
    place = None
    if progress.probing == "any":
        place = nominals.find()
    if place is not None:
        found = touched_feature(plan, place, contact, progress, selected)
        if isinstance(found, Refusal):
            return found
        if found in progress.done and found != progress.active:
            return Refusal(
                RefusalCode.NO_FEATURE,
                f"{found} has all its points.",
                "Touch another feature. To add points, select this one and reopen it.",
                contact.time_s,
            )
        name = found
    if not name:
        return TouchAssignment("", "approach")
    method, normal = method_of(plan, progress, name), None
    place = place or nominals.find()
    fault = wrong_face(plan, name, contact, place, nominals.points)
    if fault is not None:
        return fault
    if method == "nominal":
        normal = None if place is None else _normal(plan, name, place, contact)
    return TouchAssignment(name, method, normal)


def _normal(
    plan: Plan, name: str, T_nominal_from_world: RigidTransform, contact: Contact
) -> Float | None:
    """Return the normal of the nominal surface at a ball, world; None far from it."""
    ball = T_nominal_from_world.apply(contact.tip_world)
    near = nearness(plan.feature(name), ball, contact.radius)
    return T_nominal_from_world.rotation.T @ near.normal if near.gap <= SEARCH_MM else None
