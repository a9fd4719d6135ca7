"""The line below a page: why Next is closed, or what there is to do."""

from __future__ import annotations

from ocmm_core.calibration.guided import ProcedureDecision, ProcedureView
from ocmm_gui.kit import Mark
from ocmm_gui.wizards.parts._shown import Seen


def gate_words(seen: Seen, accepted: str, *, going_on: bool) -> tuple[str, Mark]:
    """Return the sentence with its mark.

    Parameters
    ----------
    seen
        The snapshot.
    accepted
        What is so after the result was accepted.
    going_on
        The next step is entered by itself.
    """
    base = seen.view.base
    gate = base.step.gate
    if base.decision is not ProcedureDecision.OPEN and not is_unstored(base):
        ended = accepted if base.decision is ProcedureDecision.ACCEPTED else "Nothing was changed."
        return f"{ended} Press Esc to leave.", Mark.GOOD
    if base.current == len(base.steps) - 1:
        if base.error is not None and seen.view.outcome is None:
            return "No result to accept; see the reason and remedy above.", Mark.DOUBT
        if seen.view.outcome is None:
            return "Nothing to accept yet: calculate the result first.", Mark.DOUBT
        return gate.remedy, Mark.ACTIVE
    if gate.open:
        return "Complete: continuing." if going_on else "Next is ready: press Return.", Mark.GOOD
    return f"Next is locked: {gate.reason} {gate.remedy}", Mark.DOUBT


def is_unstored(base: ProcedureView) -> bool:
    """Return whether a result was accepted, but the program ended before it was in the store."""
    return base.decision is ProcedureDecision.ACCEPTED and not base.stored
