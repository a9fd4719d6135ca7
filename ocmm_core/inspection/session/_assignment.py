"""Assignment of a touch: the active feature, the one of a script, or the touched one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.inspection.evaluation import (
    EvaluationCache,
    Progress,
    SessionOptions,
    nearness,
    place_of_nominals,
)
from ocmm_core.inspection.plan import Plan
from ocmm_core.inspection.session._acceptance import Acceptance, TouchAssignment
from ocmm_core.inspection.session._any_order import SEARCH_MM, Contact, touched_feature
from ocmm_core.inspection.session._facing import wrong_face
from ocmm_core.inspection.session._ledger import JobLedger
from ocmm_core.inspection.session._side_choice import method_of
from ocmm_core.measuring import MeasuredPoint, Refusal, RefusalCode, StablePoint, Touch


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
        self, ledger: JobLedger, radius: float, options: SessionOptions, acceptance: Acceptance
    ) -> None:
        self._ledger, self._radius, self._options = ledger, radius, options
        self._acceptance = acceptance

    def take(
        self, touch: Touch, stable: StablePoint, ways: tuple[Float, ...], wanted: str | None
    ) -> MeasuredPoint | Refusal:
        """Return the point from a touch, or why it gives none.

        `ways`: unit vectors (3,), world, of approach and retract, if known. `wanted`: feature of a
        script; None for a person's touch.
        """
        ledger, progress = self._ledger, self._ledger.progress
        meant = assign_touch(
            ledger.plan,
            progress,
            Contact(stable.tip_world, ways, self._radius, stable.time_s),
            NominalPlace(ledger.plan, ledger.points.counting, self._options, ledger.cache),
            wanted=wanted,
            selected=ledger.selected if ledger.selected == progress.active else "",
        )
        if isinstance(meant, Refusal):
            return meant
        return self._acceptance.take(touch, stable, meant)


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

    `nominals`: only evaluated if needed. `wanted`: feature of a script; None for a person's touch.
    `selected`: feature selected by the inspector for this touch, or empty.
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
