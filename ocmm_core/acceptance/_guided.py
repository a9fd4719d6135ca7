"""Acceptance test as a guided procedure, from frames to stored verdict.

Window and scripts drive it like a calibration (`calibration.guided`). Every point is one line of
the session file before `take` returns; the current page is not stored, so a resumed test starts
after its points. Recorded points stay: `drop` is refused.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TypeAlias

from ocmm_core.acceptance._guided_view import (
    AcceptanceOutcome,
    GuidedAcceptanceView,
    GuidedKind,
    latest_values,
    steps_of,
)
from ocmm_core.acceptance._interim import InterimChart
from ocmm_core.acceptance._kinds import quantities_of
from ocmm_core.acceptance._recompute import save_record
from ocmm_core.acceptance._result import AcceptanceRecord, AcceptanceVerdict
from ocmm_core.acceptance._session import AcceptanceSession
from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.guided import (
    PLACE_DONE,
    STILL_FRAMES,
    Average,
    Live,
    ProbeSpotAverager,
    ProcedureDecision,
    ProcedureView,
    handle_axis,
    require_fresh_temperature,
    to_spots,
)
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.records import Finding
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError, StorageError
from ocmm_core.geometry import Float, unit
from ocmm_core.tracking import ProbeBody, solve

Charted: TypeAlias = Callable[[AcceptanceRecord, datetime], InterimChart]
_PREPARE, _MEASURE, _RESULT = range(3)
_APART_MM, _TURN_RAD = 1.5, 0.15
"""Minimum movement of the ball, or turn of the probe, since the previous point."""
_TORN = "A point was being written when the program stopped; it is not there. All others are."
_ANEW = "The position is measured again: {hint}"


class AcceptanceProcedure:
    """A test to its verdict; thread-safe. `charted`: charts an interim check before it counts."""

    def __init__(
        self,
        session: AcceptanceSession,
        rig: Rig,
        body: ProbeBody,
        records: Path,
        temperature: Temperature,
        charted: Charted | None = None,
    ) -> None:
        self._charted = charted
        self._session, self._rig, self._body, self._records = session, rig, body, records
        self._temperature = temperature
        self._read_at: datetime | None = None
        self._lock = threading.RLock()
        self._axis = handle_axis(body)
        self._probe = self._averager()
        self._live = Live()
        self._ready: tuple[Average, Float, Float] | None = None
        self._hint = self._lost = ""
        self._error: Finding | None = None
        self._outcome: AcceptanceOutcome | None = None
        self._test = session.view
        self._step = _MEASURE if any(self._test.done) else _PREPARE
        if self._test.finished:
            self._step = _RESULT

    @property
    def session(self) -> AcceptanceSession:
        return self._session

    @property
    def base(self) -> ProcedureView:
        """Return the part of the snapshot common to all procedures."""
        return self.view.base

    @property
    def view(self) -> GuidedAcceptanceView:
        with self._lock:
            test, begun = self._test, self._session.state.begun
            stored = test.finished and self._outcome is not None and self._outcome.file is not None
            decision = ProcedureDecision.OPEN
            if test.finished:
                decision = ProcedureDecision.ACCEPTED
            elif test.abandoned:
                decision = ProcedureDecision.KEPT
            base = ProcedureView(
                kind=GuidedKind.ACCEPTANCE, session=self._session.path,
                rig=begun.instrument.rig, begun_utc=begun.utc, who=begun.made_by,
                steps=steps_of(test), current=self._step, live=self._live, decision=decision,
                stored=stored, error=self._error, torn=_TORN if self._session.torn else "",
            )  # fmt: skip
            return GuidedAcceptanceView(
                base=base, test=test, stage=self._session.stage, notes=begun.notes,
                latest=latest_values(test), hint=self._hint,
                temperature_c=self._temperature.celsius,                outcome=self._outcome,
            )  # fmt: skip

    # Frames and points.

    def watch(self, block: FrameBlock) -> None:
        """Process frames; never records a point on its own."""
        with self._lock:
            if self._lost or self._step != _MEASURE or self._test.current < 0:
                return
            self._probe.feed(block)
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
            self._live = live

    def require_name(self) -> None:
        """Raise StorageError if the file is lost; see `procedure.Procedure.require_name`."""
        try:
            self._session.require_name()
        except StorageError as error:
            with self._lock:
                self._lost, self._ready = error.what, None
                self._live = replace(self._live, ready=False, hint=error.what)
            raise

    def take(self, now: datetime) -> None:
        """Record the probe position as the next point; CalibrationError, or StorageError."""
        with self._lock:
            if self._ready is None:
                raise CalibrationError(
                    "session.not_ready", self._live.hint or "Nothing to take.", "Hold still there."
                )
            average, tip, handle = self._ready
            require_fresh_temperature(self._read_at, now)
            if self._session.needs_temperature():
                self._session.note_temperature(self._temperature, now)
            self._outcome = None
            try:
                hint = self._session.take(
                    tip, now, handle=handle, uv=to_spots(average.uv), sigma_px=average.sigma_px
                )
            except CalibrationError as error:
                self._hint = error.what
                raise
            finally:
                self._ready = None
                self._test = self._session.view
            self._hint = _ANEW.format(hint=hint) if hint else ""
            self._probe.taken(average)
            self._live = replace(self._live, ready=False, hint=PLACE_DONE)

    @property
    def ready(self) -> bool:
        """Return whether `take` would record a point now."""
        return self._ready is not None

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
            self._temperature, self._read_at = temperature, now
            self._test = self._session.view

    def record_temperature(self, now: datetime, sensors_c: Sequence[float | None]) -> None:
        """Ignore the sensors, which heat up; the room temperature was typed at the start."""
        self._read_at = self._read_at or now

    def advance(self, now: datetime) -> None:
        """Enter the next step; raise CalibrationError if its gate is closed."""
        del now
        with self._lock:
            gate = steps_of(self._test)[self._step].gate
            if not gate.open:
                raise CalibrationError("acceptance.gate", gate.reason, gate.remedy)
            self._step += 1
            self._probe, self._live, self._ready = self._averager(), Live(), None

    def back(self, now: datetime) -> None:
        """Return to the previous step; points are kept."""
        del now
        with self._lock:
            self._step = max(self._step - 1, _PREPARE)

    def compute(self, elsewhere: object = None) -> None:
        """Compute the verdict for storing; raise CalibrationError if incomplete."""
        del elsewhere
        with self._lock:
            missing = "" if self._test.finished else self._session.open_end()
            if missing:
                remedy = "Begin a new test whose plan reaches it."
                if self._test.current >= 0:
                    remedy = "Take them first."
                self._error = Finding("acceptance.open_end", missing, remedy, refuses=True)
                raise CalibrationError("acceptance.open_end", missing, remedy)
            self._error = None
            test = self._test
            self._outcome = AcceptanceOutcome(
                verdict=test.verdict or AcceptanceVerdict.VOID, values=test.values,
                quantities=quantities_of(test.values), void_reasons=test.void_reasons,
                retests_left=test.retests_left,
            )  # fmt: skip

    def retest(self, now: datetime) -> None:
        """Start the permitted retest and return to measuring; CalibrationError if none is."""
        with self._lock:
            self._session.retest(now)
            self._test = self._session.view
            self._outcome, self._error, self._hint = None, None, ""
            self._step = _MEASURE

    def accept(self, now: datetime, reason: str) -> None:
        """Store the verdict, whatever it is; may be repeated after an interruption."""
        with self._lock:
            if not self._test.finished:
                record = self._session.finish(now, self._temperature, reason)
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

    def _averager(self) -> ProbeSpotAverager:
        return ProbeSpotAverager(
            self._rig, self._body, STILL_FRAMES, resting=True, distance_mm=_APART_MM,
            turn_rad=_TURN_RAD,
        )  # fmt: skip
