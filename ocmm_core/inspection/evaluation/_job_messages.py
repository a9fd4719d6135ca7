"""What stands on every page, sheet and file of a job before anything else, in words.

States say what a job must not be taken for: a real part, proven data, a complete measurement. They
come from the job itself (`JobView.simulated`, `JobView.camera_doubts`, `JobView.part_verdict`), so
that nothing can say less than another.
"""

from __future__ import annotations

from ocmm_core.fieldbus.described import UNPROVEN_CAMERAS as _UNPROVEN
from ocmm_core.inspection.evaluation._view import JobView

SIMULATED = "SIMULATED"
UNPROVEN_CAMERAS = _UNPROVEN
"""Cameras that a file describes, and that cannot prove all that ours do."""

INCOMPLETE = "INCOMPLETE"
PARTIAL_PLAN = "PARTIAL PLAN"
"""The model, document or table of the plan asks for more than the plan contains."""
NO_REAL_PART = "No real part was measured."
SIMULATED_LINE = "SIMULATED: No real part was measured."
"""Whole, for catalogues translate sentences; a test holds it to the two above."""


def job_states(view: JobView) -> tuple[str, ...]:
    """Return the states of a job, the one that matters most first; empty for a real, whole one."""
    states = (
        (SIMULATED, view.simulated),
        (UNPROVEN_CAMERAS, bool(view.camera_doubts)),
        (INCOMPLETE, not view.part_verdict.complete),
        (PARTIAL_PLAN, view.part_verdict.is_partial),
    )
    return tuple(word for word, holds in states if holds)


def state_lines(view: JobView) -> tuple[str, ...]:
    """Return a line for every state, e.g. ``SIMULATED: No real part was measured.``."""
    missing = ", ".join(view.part_verdict.missing)
    lines = {
        SIMULATED: SIMULATED_LINE,
        UNPROVEN_CAMERAS: f"{UNPROVEN_CAMERAS}: {' '.join(view.camera_doubts)}",
        INCOMPLETE: f"{INCOMPLETE}: Missing: {missing}.",
        PARTIAL_PLAN: f"{PARTIAL_PLAN}: {view.part_verdict.requirement_words}.",
    }
    return tuple(lines[state] for state in job_states(view))


def part_line(view: JobView) -> str:
    """Return the verdict on the part with its reasons, or its counts where it has none."""
    part = view.part_verdict
    if part.lines[0] != part.headline:
        return "; ".join(part.lines)
    beside = "; ".join(part.reasons) or part.summary.counted
    between = "; " if part.is_partial else ": "
    return f"{part.headline}{between}{beside}" if beside else part.headline
