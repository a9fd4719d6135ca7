"""Acceptance test as a guided procedure, from frames to stored verdict.

Window and scripts drive it like a calibration (`calibration.guided`). Every point is one line of
the session file before `record_point` returns; the current page is not stored, so a resumed test
starts after its points. Recorded points stay: `drop` is refused.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import TypeAlias

import numpy as np

from ocmm_core.acceptance._interim import InterimChart, InterimWord
from ocmm_core.acceptance._kinds import Retest, quantities_of
from ocmm_core.acceptance._result import (
    AcceptanceRecord,
    AcceptanceVerdict,
    JudgedValue,
    QuantityResult,
    UsedArtefact,
)
from ocmm_core.acceptance._session import AcceptanceSession, save_record
from ocmm_core.acceptance._session_state import AcceptanceView
from ocmm_core.acceptance._situation import Stage
from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration import guided
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, unit
from ocmm_core.tracking import ProbeBody, solve

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

    base: guided.ProcedureView
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


def steps_of(test: AcceptanceView) -> tuple[guided.Step, ...]:
    """Return the steps of a test with their gates."""
    done = sum(test.done)
    wanted = sum(len(one.points_world) * one.repeats for one in test.positions)
    left = wanted - done
    points = "1 point" if left == 1 else f"{left} points"
    gate = guided.OPEN if not left else guided.Gate(False, f"{points} to go.", "Take them.")
    return (
        guided.Step(
            "prepare", "Prepare",
            "Place the artefact where it is held without play. Check what is fixed for this "
            "test, then continue.",
            guided.OPEN,
        ),
        guided.Step("measure", "Measure", test.instruction, gate, done, wanted),
        guided.Step(
            "result", "Verdict", "Every error against its limit. Store the verdict.",
            guided.Gate(False, "The verdict is not stored.", "Store the verdict (A)."),
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
    return int(np.argmax([abs(one.error_mm) / one.limit_mm for one in values]))


Charted: TypeAlias = Callable[[AcceptanceRecord, datetime], InterimChart]
_PREPARE, _MEASURE, _RESULT = range(3)
_APART_MM, _TURN_RAD = 1.5, 0.15
"""Minimum movement of the ball, or turn of the probe, since the previous point."""
_ANEW = "The position is measured again: {hint}"


class AcceptanceProcedure(guided.Procedure):
    """A test to its verdict; thread-safe.

    `thermometer` is read when a temperature is due; None: the latest noted one counts. `charted`:
    charts an interim check before it counts.
    """

    kind = GuidedKind.ACCEPTANCE
    _outcome: AcceptanceOutcome | None
    gate_code = "acceptance.gate"
    torn = "A point was being written when the program stopped; it is not there. All others are."

    def __init__(
        self,
        session: AcceptanceSession,
        rig: Rig,
        body: ProbeBody,
        records: Path,
        temperature: Temperature,
        charted: Charted | None = None,
        thermometer: Callable[[], Temperature] | None = None,
    ) -> None:
        super().__init__(session.log)
        self._charted, self._has_thermometer = charted, thermometer is not None
        self._session, self._rig, self._body, self._records = session, rig, body, records
        self._temperature = temperature
        self._room = thermometer or (lambda: self._temperature)
        self._temperature_utc: datetime | None = None
        self._axis = guided.handle_axis(body)
        self._probe = self._averager()
        self._at_rest = guided.Live()
        self._ready: tuple[guided.Average, Float, Float] | None = None
        self._hint = ""
        self._test = session.view
        self._step = _MEASURE if any(self._test.done) else _PREPARE
        if self._test.finished:
            self._step = _RESULT

    @property
    def session(self) -> AcceptanceSession:
        return self._session

    @property
    def view(self) -> GuidedAcceptanceView:
        with self._lock:
            return GuidedAcceptanceView(
                base=self.base, test=self._test, stage=self._session.stage,
                notes=self._session.notes, latest=latest_values(self._test), hint=self._hint,
                temperature_c=self._temperature.celsius, outcome=self._outcome,
            )  # fmt: skip

    @property
    def _started(self) -> tuple[str, str, str]:
        begun = self._session.state.begun
        return begun.instrument.rig, begun.utc, begun.made_by

    @property
    def _current(self) -> int:
        return self._step

    @property
    def _ended_as(self) -> guided.ProcedureDecision:
        if self._test.finished:
            return guided.ProcedureDecision.ACCEPTED
        return (
            guided.ProcedureDecision.KEPT if self._test.abandoned else guided.ProcedureDecision.OPEN
        )

    def _is_stored(self) -> bool:
        outcome = self._outcome
        return self._test.finished and outcome is not None and outcome.file is not None

    def _steps_now(self) -> tuple[guided.Step, ...]:
        return steps_of(self._test)

    def _live(self) -> guided.Live:
        return self._at_rest

    def _read_at(self) -> datetime | None:
        return None if self._has_thermometer else self._temperature_utc

    # Frames and points.

    def watch(self, block: FrameBlock) -> None:
        """Process frames; never records a point on its own."""
        with self._lock:
            if self._log.lost or self._step != _MEASURE or self._test.current < 0:
                return
            self._probe.push(block)
            live = self._probe.live()
            self._ready = None
            if live.ready:
                average = self._probe.average()
                pose = solve(average.uv[None], self._rig, self._body, average.sigma_px)
                tip = pose.tip_world[0]
                why = self._session.hint(tip)
                if why:
                    live = replace(live, ready=False, hint=why)
                else:
                    handle = unit(pose.rotation_world_from_probe[0] @ self._axis)
                    self._ready = average, tip, handle
            self._at_rest = live

    def _store_observation(self, now: datetime) -> None:
        assert self._ready is not None  # noqa: S101 - as Live.ready states
        average, tip, handle = self._ready
        if self._session.state.needs_temperature():
            self._session.note_temperature(self._room(), now)
        self._outdate()
        try:
            hint = self._session.record_point(
                tip, now, handle=handle, uv=guided.to_spots(average.uv), sigma_px=average.sigma_px
            )
        except CalibrationError as error:
            self._hint = error.what
            raise
        finally:
            self._ready, self._at_rest = None, replace(self._at_rest, ready=False)
            self._test = self._session.view
        self._hint = _ANEW.format(hint=hint) if hint else ""
        self._probe.taken(average)
        self._at_rest = replace(self._at_rest, hint=guided.PLACE_DONE)

    @property
    def ready(self) -> bool:
        """Return whether `record` would store a point now."""
        return self._ready is not None and not self._log.lost

    def drop(self, now: datetime) -> None:
        """Refuse: accepted points are never replaced."""
        del now
        raise CalibrationError(
            "acceptance.kept",
            "A point of an acceptance test is not taken back.",
            "Finish the position; a wrongly placed one is measured again by itself.",
        )

    def set_temperature(self, celsius: float, now: datetime) -> None:
        """Log the room temperature and use it from now on; raise InputError if wrong."""
        self.note_temperature(now, replace(self._temperature, celsius=celsius))

    def note_temperature(self, now: datetime, temperature: Temperature) -> None:
        """Log a reading of a thermometer and use it from now on."""
        with self._lock:
            self._session.note_temperature(temperature, now)
            self._temperature, self._temperature_utc = temperature, now
            self._test = self._session.view

    def record_temperature(self, now: datetime, sensors_c: Sequence[float | None]) -> None:
        """Ignore the sensors, which heat up; the room temperature was typed at the start."""
        self._temperature_utc = self._temperature_utc or now

    def _not_ready(self, hint: str) -> CalibrationError:
        return CalibrationError(
            "session.not_ready", hint or "Nothing to take.", "Hold still there."
        )

    def _enter(self, step: int, now: datetime) -> None:
        """Show a page, which is not part of the file; points are kept."""
        if step > self._step:
            self._probe, self._at_rest, self._ready = self._averager(), guided.Live(), None
        self._step = step

    def _calculation(self) -> Callable[[], AcceptanceOutcome]:
        return self._verdict

    def _verdict(self) -> AcceptanceOutcome:
        test = self._test
        missing = "" if test.finished else self._session.open_end()
        if missing:
            remedy = "Begin a new test whose plan reaches it."
            if test.current >= 0:
                remedy = "Take them first."
            raise CalibrationError("acceptance.open_end", missing, remedy)
        return AcceptanceOutcome(
            verdict=test.verdict or AcceptanceVerdict.VOID, values=test.values,
            quantities=quantities_of(test.values), void_reasons=test.void_reasons,
            retests_left=test.retests_left,
        )  # fmt: skip

    def retest(self, now: datetime) -> Retest:
        """Start the permitted retest, and return what is measured again; CalibrationError: none."""
        with self._lock:
            positions = self._session.retest(now)
            self._test = self._session.view
            self._outdate()
            self._hint, self._step = "", _MEASURE
            return positions

    def accept(self, now: datetime, reason: str) -> None:
        """Store the verdict, whatever it is; may be repeated after an interruption."""
        with self._lock:
            if not self._test.finished:
                record = self._session.finish(now, self._room(), reason)
                self._test = self._session.view
            else:
                record = self._session.record()
            chart = None if self._charted is None else self._charted(record, now)
            self._error = None
            self._outcome = AcceptanceOutcome(
                verdict=record.verdict, values=record.values, quantities=record.quantities,
                void_reasons=record.void_reasons, retests_left=self._test.retests_left,
                record=record, file=save_record(self._records, record), chart=chart,
            )  # fmt: skip

    def keep(self, now: datetime, reason: str) -> None:
        """End the test without a verdict; its file stays."""
        with self._lock:
            self._session.abandon(now, reason)
            self._test = self._session.view

    def _averager(self) -> guided.ProbeSpotAverager:
        return guided.ProbeSpotAverager(
            self._rig, self._body, guided.STILL_FRAMES, resting=True, distance_mm=_APART_MM,
            turn_rad=_TURN_RAD,
        )  # fmt: skip
