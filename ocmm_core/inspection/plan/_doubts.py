"""What speaks against a plan that can be measured, found from its nominals before any touch."""

from __future__ import annotations

from ocmm_core.alignment import Relocation, SavedFrame, frame_of
from ocmm_core.errors import FitError
from ocmm_core.features.measured import FitThrough, nominal_geometries
from ocmm_core.inspection.plan._plan import Plan


def nominal_doubts(plan: Plan) -> tuple[str, ...]:
    """Return why a part that is just as drawn would not give all results, in sentences."""
    return tuple(filter(None, (_construction_doubt(plan), _frame_doubt(plan))))


def _construction_doubt(plan: Plan) -> str:
    known = nominal_geometries(plan.features, plan.constructions)
    # What is touched is not nominal: an element through all points may have no nominal.
    missing = [
        item.name
        for item in plan.constructions
        if item.name not in known
        and not (isinstance(item, FitThrough) and item.through == "points")
    ]
    if not missing:
        return ""
    return (
        f"The nominals do not define {', '.join(missing)}: its features are parallel, "
        "coincident, or themselves undefined."
    )


def _frame_doubt(plan: Plan) -> str:
    """Return why the frame cannot be found; a saved frame and a relocation rest on other places."""
    bound = plan.bound_alignment
    if bound is None or isinstance(bound.rule, Relocation | SavedFrame):
        return ""
    try:
        frame_of(bound, bound.nominals)
    except FitError as error:
        return f"Even a nominal part could not be aligned: {error.what} {error.remedy}"
    return ""
