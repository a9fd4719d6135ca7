"""Headlines of a job, from itself: simulated, unproven cameras, incomplete; all outputs agree.

Also the limits of a result in words.
"""

from __future__ import annotations

from collections.abc import Callable

from ocmm_core.fieldbus.described import UNPROVEN_CAMERAS as _UNPROVEN
from ocmm_core.inspection.evaluation._view import JobView
from ocmm_core.tolerances.decisions import CharacteristicResult
from ocmm_core.tolerances.kinds import spec_of

SIMULATED = "SIMULATED"
UNPROVEN_CAMERAS = _UNPROVEN
"""Cameras described by a file, which cannot prove all that ours do."""

NOISY = "NOISY"
NOISY_LINE = "NOISY: Spots scatter more than stated."

INCOMPLETE = "INCOMPLETE"
PARTIAL_PLAN = "PARTIAL PLAN"
"""The source of the plan has more requirements than the plan."""
NO_REAL_PART = "No real part was measured."
SIMULATED_LINE = "SIMULATED: No real part was measured."
"""A literal, to translate the whole sentence; a test compares it with the two above."""


def job_states(view: JobView) -> tuple[str, ...]:
    """Return the states of a job, the most important first; empty for a real, complete one."""
    states = (
        (SIMULATED, view.simulated),
        (UNPROVEN_CAMERAS, bool(view.camera_doubts)),
        (NOISY, bool(view.noise)),
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
        NOISY: " ".join((NOISY_LINE, *view.noise)),
        INCOMPLETE: f"{INCOMPLETE}: Missing: {missing}.",
        PARTIAL_PLAN: f"{PARTIAL_PLAN}: {view.part_verdict.requirement_words}.",
    }
    return tuple(lines[state] for state in job_states(view))


def part_line(view: JobView) -> str:
    """Return the verdict on the part with its reasons, or its counts without a verdict."""
    part = view.part_verdict
    if part.lines[0] != part.headline:
        return "; ".join(part.lines)
    beside = "; ".join(part.reasons) or part.summary.counted
    between = "; " if part.is_partial else ": "
    return f"{part.headline}{between}{beside}" if beside else part.headline


def limit_words(result: CharacteristicResult, signed: Callable[[float], str]) -> str:
    """Return the limits of the deviation, only one for a zone; ``signed`` writes one with sign."""
    upper = signed(result.upper)
    if spec_of(result.kind).one_sided and result.lower <= 0.0:
        return f"≤ {upper.lstrip('+')}"
    if result.lower == -result.upper:
        return f"±{upper.lstrip('+')}"
    return f"{signed(result.lower)} {upper}"
