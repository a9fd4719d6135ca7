"""What a touch is meant for: the active feature, the one that a script says, or the touched one."""

from __future__ import annotations

from collections.abc import Callable

from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.inspection.evaluation import Progress, nearness
from ocmm_core.inspection.plan import Plan
from ocmm_core.inspection.session._acceptance import Meant
from ocmm_core.inspection.session._any_order import SEARCH_MM, Contact, touched_feature
from ocmm_core.inspection.session._side_choice import method_of
from ocmm_core.measuring import Refusal, RefusalCode


def meant_for(
    plan: Plan,
    progress: Progress,
    contact: Contact,
    aligned: Callable[[], RigidTransform | None],
    *,
    wanted: str | None,
    selected: str,
) -> Meant | Refusal:
    """Return the feature that gets a touch and how its side is found, or why that is not clear.

    Parameters
    ----------
    contact
        The ball at rest.
    aligned
        Returns the motion from the world to the frame of the nominals, or None while datums are not
        measured; only asked where that matters.
    wanted
        Feature that a script means; None where a person touches.
    selected
        Feature that the inspector selected for this touch; empty where none was.
    """
    if wanted is not None and wanted not in progress.names:
        return Refusal(
            RefusalCode.NO_FEATURE,
            f"The touch was meant for {wanted}, which the plan does not have.",
            "Touch a feature of the plan.",
            contact.time_s,
        )
    name = progress.active if wanted is None else wanted
    place = None
    if progress.probing == "any":
        place = aligned()
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
        return Meant("", "approach")
    method, normal = method_of(plan, progress, name), None
    if method == "nominal":
        place = place or aligned()
        normal = None if place is None else _normal(plan, name, place, contact)
    return Meant(name, method, normal)


def _normal(
    plan: Plan, name: str, T_nominal_from_world: RigidTransform, contact: Contact
) -> Float | None:
    """Return the normal of the nominal surface at a ball, world; None far from it."""
    ball = T_nominal_from_world.apply(contact.tip_world)
    near = nearness(plan.feature(name), ball, contact.radius)
    return T_nominal_from_world.rotation.T @ near.normal if near.gap <= SEARCH_MM else None
