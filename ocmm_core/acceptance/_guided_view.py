"""View of a guided acceptance test: steps, snapshot, and verdict texts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np

from ocmm_core.acceptance._interim import InterimChart, InterimWord
from ocmm_core.acceptance._result import (
    AcceptanceRecord,
    AcceptanceVerdict,
    JudgedValue,
    QuantityResult,
    UsedArtefact,
)
from ocmm_core.acceptance._session_state import AcceptanceView
from ocmm_core.acceptance._situation import Stage
from ocmm_core.calibration.guided import OPEN, Gate, ProcedureView, Step

_WORDS = {
    AcceptanceVerdict.PASS: "PASSED",
    AcceptanceVerdict.FAIL: "FAILED",
    AcceptanceVerdict.LEANING_IN: "NOT DECIDED",
    AcceptanceVerdict.LEANING_OUT: "NOT DECIDED",
    AcceptanceVerdict.VOID: "VOID",
}
_MEANINGS = {
    AcceptanceVerdict.PASS: "Every error is within its limit by the decision rule.",
    AcceptanceVerdict.FAIL: (
        "An error is beyond its limit. Store the verdict, find the cause, and calibrate."
    ),
    AcceptanceVerdict.LEANING_IN: (
        "An error is within its limit by less than the uncertainty of the test: conformity is not "
        "proven. Use a better artefact."
    ),
    AcceptanceVerdict.LEANING_OUT: (
        "An error is beyond its limit by less than the uncertainty of the test: nothing is proven. "
        "Use a better artefact."
    ),
}
_CHARTED = {
    InterimWord.LEARNING: "The chart learns from this check.",
    InterimWord.GOOD: "The system is as it was.",
    InterimWord.REPEAT: "Repeat the check now.",
    InterimWord.STOP: (
        "STOP: points since the last good check are held back in every job until a verification "
        "passes."
    ),
}
_AGAIN = "What the procedure allows to repeat, N measures again; both results stay in the record."


class GuidedKind(StrEnum):
    """Kind of a snapshot; session files are named by the procedure."""

    ACCEPTANCE = "acceptance"


@dataclass(frozen=True, slots=True)
class AcceptanceOutcome:
    """Computed or stored verdict."""

    verdict: AcceptanceVerdict
    values: tuple[JudgedValue, ...]
    quantities: tuple[QuantityResult, ...]
    void_reasons: tuple[str, ...]
    """Why the result is void; empty if valid."""
    retests_left: int
    record: AcceptanceRecord | None = None
    file: Path | None = None
    chart: InterimChart | None = None
    """Chart of the interim checks including this one; None for other tests."""

    @property
    def word(self) -> str:
        """Return the verdict in one or two words, for large type."""
        return _WORDS[self.verdict]

    @property
    def sentence(self) -> str:
        """Return meaning and consequence of the verdict."""
        if self.verdict is AcceptanceVerdict.VOID:
            return " ".join((*self.void_reasons, "The test shows nothing: do it again."))
        if self.chart is not None:
            last = self.chart.points[-1]
            said = _CHARTED[last.word]
            return f"{last.reason} {said}".strip()
        again = _AGAIN if self.retests_left and self.verdict is not AcceptanceVerdict.PASS else ""
        return f"{_MEANINGS[self.verdict]} {again}".strip()


@dataclass(frozen=True, slots=True)
class GuidedAcceptanceView:
    """Snapshot of a test for display."""

    base: ProcedureView
    test: AcceptanceView
    """Plan, recorded points, values."""
    stage: Stage
    notes: tuple[str, ...]
    """Advice not followed, and warnings."""
    latest: tuple[JudgedValue, ...]
    """Values of the last completed position; empty before the first."""
    hint: str
    """Why that position is repeated, or the last refusal; empty if none."""
    temperature_c: float
    outcome: AcceptanceOutcome | None

    def artefact(self) -> UsedArtefact | None:
        """Return the artefact of the current position, or None."""
        current = self.test.current
        if current < 0:
            return None
        role = self.test.positions[current].role
        return next((one for one in self.stage.artefacts if one.role == role), None)


def steps_of(test: AcceptanceView) -> tuple[Step, ...]:
    """Return the steps of a test with their gates."""
    done = sum(test.done)
    wanted = sum(len(one.points_world) * one.repeats for one in test.positions)
    left = wanted - done
    points = "1 point" if left == 1 else f"{left} points"
    gate = OPEN if not left else Gate(False, f"{points} to go.", "Take them.")
    return (
        Step(
            "prepare", "Prepare",
            "Place the artefact where it is held without play. Check what is fixed for this "
            "test, then continue.",
            OPEN,
        ),
        Step("measure", "Measure", test.instruction, gate, done, wanted),
        Step(
            "result", "Verdict", "Every error against its limit. Store the verdict.",
            Gate(False, "The verdict is not stored.", "Store the verdict (A)."),
        ),
    )  # fmt: skip


def latest_values(test: AcceptanceView) -> tuple[JudgedValue, ...]:
    """Return the values of the last completed position."""
    complete = [
        one.name
        for one, done in zip(test.positions, test.done, strict=True)
        if done == len(one.points_world) * one.repeats
    ]
    if not complete:
        return ()
    return tuple(one for one in test.values if one.position == complete[-1])


def worst_value(values: Sequence[JudgedValue]) -> int:
    """Return the index of the value nearest to its limit or farthest beyond it."""
    shares = [abs(one.error_mm) / one.limit_mm for one in values]
    return int(np.argmax(shares))
