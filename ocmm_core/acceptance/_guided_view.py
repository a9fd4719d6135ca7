"""What is shown of a guided acceptance test: steps, snapshot, and the words of its verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np

from ocmm_core.acceptance._events import AcceptanceView
from ocmm_core.acceptance._interim import InterimChart, InterimWord
from ocmm_core.acceptance._result import (
    AcceptanceRecord,
    JudgedValue,
    QuantityResult,
    UsedArtefact,
    Verdict,
)
from ocmm_core.acceptance._situation import Stage
from ocmm_core.calibration.guided import OPEN, Gate, ProcedureView, Step

_WORDS = {
    Verdict.PASS: "PASSED",
    Verdict.FAIL: "FAILED",
    Verdict.LEANING_IN: "NOT DECIDED",
    Verdict.LEANING_OUT: "NOT DECIDED",
    Verdict.VOID: "VOID",
}
_MEANINGS = {
    Verdict.PASS: "Every error is within its limit by the decision rule.",
    Verdict.FAIL: "An error is beyond its limit. Store the verdict, find the cause, and calibrate.",
    Verdict.LEANING_IN: (
        "An error is within its limit by less than the uncertainty of the test: conformity is not "
        "proven. Use a better artefact."
    ),
    Verdict.LEANING_OUT: (
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
    """What a snapshot is of; its session files are named by the procedure."""

    ACCEPTANCE = "acceptance"


@dataclass(frozen=True, slots=True)
class AcceptanceOutcome:
    """The verdict as it would be stored, or as it was."""

    verdict: Verdict
    values: tuple[JudgedValue, ...]
    quantities: tuple[QuantityResult, ...]
    """`values`, `quantities`: As in `AcceptanceRecord`."""
    void_reasons: tuple[str, ...]
    """Why it shows nothing; empty where it does."""
    retests_left: int
    """How many are allowed still."""
    record: AcceptanceRecord | None = None
    """Once it is stored; None before."""
    file: Path | None = None
    chart: InterimChart | None = None
    """Of the interim checks with this one; None where it is none."""

    @property
    def word(self) -> str:
        """Return the verdict in a word or two, to be shown in large type."""
        return _WORDS[self.verdict]

    @property
    def sentence(self) -> str:
        """Return what the verdict means, and what to do."""
        if self.verdict is Verdict.VOID:
            return " ".join((*self.void_reasons, "The test shows nothing: do it again."))
        if self.chart is not None:
            last = self.chart.points[-1]
            said = _CHARTED[last.word]
            return f"{last.reason} {said}".strip()
        again = _AGAIN if self.retests_left and self.verdict is not Verdict.PASS else ""
        return f"{_MEANINGS[self.verdict]} {again}".strip()


@dataclass(frozen=True, slots=True)
class GuidedAcceptanceView:
    """The snapshot of a test that is shown."""

    base: ProcedureView
    test: AcceptanceView
    """Plan, what was taken, values."""
    stage: Stage
    """Procedure, instrument, artefacts."""
    notes: tuple[str, ...]
    """What of the advice could not be followed, and what only warned."""
    latest: tuple[JudgedValue, ...]
    """Values of the position that was completed last; empty before the first."""
    hint: str
    """Why that position is measured again, or what was refused last; empty where nothing was."""
    temperature_c: float
    outcome: AcceptanceOutcome | None
    """None before it was computed."""

    def artefact(self) -> UsedArtefact | None:
        """Return the artefact of the current position; None where none is needed."""
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
    """Return the values of the position that was completed last."""
    complete = [
        one.name
        for one, done in zip(test.positions, test.done, strict=True)
        if done == len(one.points_world) * one.repeats
    ]
    if not complete:
        return ()
    return tuple(one for one in test.values if one.position == complete[-1])


def worst_value(values: Sequence[JudgedValue]) -> int:
    """Return the index of the value that is nearest to its limit or farthest beyond it."""
    shares = [abs(one.error_mm) / one.limit_mm for one in values]
    return int(np.argmax(shares))
