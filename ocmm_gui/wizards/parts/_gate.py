"""Line below a page: why Next is closed, or the next action."""

from __future__ import annotations

from ocmm_core.calibration.guided import ProcedureDecision, ProcedureView
from ocmm_gui.kit import Mark, said, tr
from ocmm_gui.wizards.parts._shown import Seen


def gate_words(seen: Seen, accepted: str, *, going_on: bool) -> tuple[str, Mark]:
    """Return the sentence with its mark; ``accepted``: consequence; ``going_on``: automatically."""
    base = seen.view.base
    gate = base.step.gate
    if base.decision is not ProcedureDecision.OPEN and not is_unstored(base):
        ended = (
            accepted if base.decision is ProcedureDecision.ACCEPTED else tr("Nothing was changed.")
        )
        return tr("{ended} Press Esc to leave.").format(ended=ended), Mark.GOOD
    if base.current == len(base.steps) - 1:
        if base.error is not None and seen.view.outcome is None:
            return tr("No result to accept; see the reason and remedy above."), Mark.DOUBT
        if seen.view.outcome is None:
            return tr("Nothing to accept yet: calculate the result first."), Mark.DOUBT
        return said(gate.remedy), Mark.ACTIVE
    if gate.open:
        return tr("Complete: continuing.") if going_on else tr(
            "Next is ready: press Return."
        ), Mark.GOOD
    return tr("Next is locked: {reason} {remedy}").format(
        reason=said(gate.reason), remedy=said(gate.remedy)
    ), Mark.DOUBT


def is_unstored(base: ProcedureView) -> bool:
    """Return whether the program ended between acceptance and storing."""
    return base.decision is ProcedureDecision.ACCEPTED and not base.stored
