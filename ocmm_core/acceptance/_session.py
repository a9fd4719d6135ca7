"""Engine of an acceptance test from plan to record, durable at every step.

Each line of a chain file is on disk before a method returns; a test resumes after a power cut.
"""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.acceptance import _session_state as log
from ocmm_core.acceptance._guards import EarlierUse, begin_findings, require_usable
from ocmm_core.acceptance._kinds import Retest, kind_of, plan_of
from ocmm_core.acceptance._placement import judge_point, judge_position
from ocmm_core.acceptance._result import AcceptanceRecord, RoomAir
from ocmm_core.acceptance._session_state import SessionState
from ocmm_core.acceptance._situation import Situation, Stage, wanted
from ocmm_core.calibration.guided import SessionLog, Spots, utc_text
from ocmm_core.calibration.probe_design import Temperature, check_temperature
from ocmm_core.calibration.records import let_pass
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import CalibrationError, InputError
from ocmm_core.geometry import Float, triple
from ocmm_core.seals import Signed


class AcceptanceSession:
    """One test, from `start` or `resume`; thread-safe."""

    def __init__(self, chain: ChainFile[log.Line]) -> None:
        self.log = SessionLog(chain, log.Line)
        self._lock = self.log.lock
        first = chain.items[0].event if chain.items else None
        if not isinstance(first, log.Begun):
            raise CalibrationError(
                "acceptance.session",
                f"{chain.path}: this is no session of an acceptance test.",
                "Choose another file, or begin a new test.",
            )
        self.state = SessionState(first)
        self.log.replay(self.state.fold)

    @classmethod
    def start(
        cls,
        path: Path,
        stage: Stage,
        procedure_sha256: str,
        now: datetime,
        *,
        temperature: Temperature,
        who: str,
        place: str = "",
        customer: str = "",
        condition: str = "as found",
        earlier: EarlierUse | None = None,
        air: RoomAir | None = None,
    ) -> AcceptanceSession:
        """Start a test in a new file; warnings go into its notes.

        `air`: humidity and pressure; None if not measured. CalibrationError: an artefact is
        missing, expired, too coarse, unsuitable for the volume, or was used for the calibration; or
        the calibration may not be used. InputError: the file exists.
        """
        if path.exists():
            raise InputError(
                "acceptance.exists", f"{path}: the file exists.", "Resume it, or give another name."
            )
        plan, notes = plan_of(stage)
        before = earlier or EarlierUse()
        found = begin_findings(stage, now, temperature, before)
        let_pass(found, force=True)
        begun = log.Begun(
            utc=utc_text(now), procedure=stage.procedure, procedure_sha256=procedure_sha256,
            instrument=stage.instrument, artefacts=stage.artefacts, made_by=who, place=place,
            customer=customer, condition=condition, seed=stage.seed, plan=plan,
            notes=notes + tuple(one.what for one in found if not one.refuses),
            reserved=before.spots, air=air if air is not None and air.lines else msgspec.UNSET,
        )  # fmt: skip
        chain = ChainFile(path, log.Line, signed=Signed.TEST, remembered=True)
        chain.append(log.Line(begun))
        session = cls(chain)
        session.note_temperature(temperature, now)
        return session

    @classmethod
    def resume(cls, path: Path) -> AcceptanceSession:
        """Continue the test of a file; StorageError if altered or not trusted."""
        chain = ChainFile(path, log.Line, signed=Signed.TEST, remembered=True)
        chain.require_signed("Start a new test: its record would vouch for these points.")
        return cls(chain)

    @property
    def path(self) -> Path:
        return self.log.path

    def note_temperature(self, temperature: Temperature, now: datetime) -> None:
        """Log the temperature, which ends the previous and starts the next interval."""
        check_temperature("room", temperature)
        celsius, u_k = temperature.celsius, 2.0 * temperature.sigma_k
        with self._lock:
            self.state.require_open()
            state, utc = self.state, utc_text(now)
            current, before = state.current(), state.last_touched()
            if before >= 0 and before != current:
                name = state.plan[before].name
                self._append(
                    log.ClimateNoted(utc=utc, position=name, when="end", celsius=celsius, u_k=u_k)
                )
            if current >= 0:
                when = "end" if state.taken[current] else "begin"
                name = state.plan[current].name
                self._append(
                    log.ClimateNoted(utc=utc, position=name, when=when, celsius=celsius, u_k=u_k)
                )

    def record_point(
        self,
        tip_world: Float,
        now: datetime,
        *,
        handle: Float | None = None,
        uv: Spots | None = None,
        sigma_px: float = 0.0,
    ) -> str:
        """Record the next point; return why to repeat the position, or ""; CalibrationError."""
        with self._lock:
            self.state.require_open()
            state = self.state
            position = state.require_next()
            plan, tip = state.plan[position], np.asarray(tip_world, dtype=np.float64)
            require_usable(tip)
            reason = state.reused(uv) or judge_point(self.situation(), position, tip)
            if reason:
                self._append(log.PointRefused(utc=utc_text(now), position=position, reason=reason))
                raise CalibrationError(
                    "acceptance.refused", reason, "Take the point again where it belongs."
                )
            item, held = state.next_item(position), None if handle is None else triple(handle)
            taken = log.PointTaken(
                utc=utc_text(now), position=position, item=item, tip=triple(tip), handle=held,
                uv=uv, sigma_px=sigma_px,
            )  # fmt: skip
            self._append(taken)
            if len(state.taken[position]) < wanted(plan):
                return ""
            hint = judge_position(self.situation(), position)
            if hint:
                self._append(log.PositionRedone(utc=utc_text(now), position=position, reason=hint))
            return hint

    @property
    def notes(self) -> tuple[str, ...]:
        """Return advice not followed, and warnings."""
        return self.state.begun.notes

    @property
    def current(self) -> int:
        """Return the position of the next points; -1 if complete."""
        with self._lock:
            return self.state.current()

    def hint(self, tip_world: Float) -> str:
        """Return why a ball at rest would be refused now; empty if accepted."""
        with self._lock:
            position = self.state.current()
            return "" if position < 0 else judge_point(self.situation(), position, tip_world)

    def retest(self, now: datetime) -> Retest:
        """Start a retest, and return what is repeated; CalibrationError if not allowed."""
        with self._lock:
            self.state.require_open()
            self.state.require_complete()
            allowed = self.stage.procedure.retests_allowed
            if self.state.retests >= allowed:
                raise CalibrationError(
                    "acceptance.retests",
                    f"{self.state.retests} of {allowed} retests were made.",
                    "Finish the test with this result.",
                )
            positions = kind_of(self.stage).retest(self.situation())
            self._append(log.RetestBegun(utc=utc_text(now), positions=positions))
            return positions

    def open_end(self) -> str:
        """Return what the verdict still requires, in one sentence; empty if nothing."""
        with self._lock:
            return self.state.open_end()

    def finish(self, now: datetime, temperature: Temperature, remark: str = "") -> AcceptanceRecord:
        """Give the verdict and return the record; CalibrationError if incomplete."""
        with self._lock:
            self.state.require_open()
            self.state.require_complete()
            missing = self.open_end()
            if missing:
                raise CalibrationError(
                    "acceptance.open_end", missing, "Begin a new test whose plan reaches it."
                )
            self.note_temperature(temperature, now)
            verdict = self.state.verdict()
            self._append(log.Finished(utc=utc_text(now), verdict=verdict, remark=remark))
            return self.record()

    def abandon(self, now: datetime, reason: str) -> None:
        """End the test without a verdict; its file stays and is closed."""
        with self._lock:
            self.state.require_open()
            self._append(log.Abandoned(utc=utc_text(now), reason=reason))

    def record(self) -> AcceptanceRecord:
        """Return the record of a finished test; raise CalibrationError if unfinished."""
        with self._lock:
            return self.state.record(self.log.chain.links[0][:12], self.head)

    @property
    def stage(self) -> Stage:
        return self.state.stage

    @property
    def view(self) -> log.AcceptanceView:
        with self._lock:
            return self.state.view()

    def situation(self) -> Situation:
        return self.state.situation()

    def needs_temperature(self) -> bool:
        """Return whether the temperature is required before the next point."""
        return self.state.needs_temperature()

    @property
    def head(self) -> str:
        """Return the hash of the last line, the `AcceptanceRecord.chain_head` at the end."""
        return self.log.chain.links[-1]

    def _append(self, event: log.Event) -> None:
        self.log.append(event, self.state.fold)
