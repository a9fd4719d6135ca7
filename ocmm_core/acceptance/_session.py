"""Engine of an acceptance test from plan to record, durable at every step.

Each line of a chain file is on disk before a method returns; a test resumes after a power cut.
Record files are signed, and recomputed from raw data; chain files (register, interim checks, test
steps) have authors and dates.
"""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from ocmm_core.acceptance import _session_state as log
from ocmm_core.acceptance._guards import EarlierUse, begin_findings, climate_reasons, require_usable
from ocmm_core.acceptance._interim import INTERIM, InterimCheck
from ocmm_core.acceptance._kinds import Retest, kind_of, plan_of, quantities_of, values_of
from ocmm_core.acceptance._placement import judge_point, judge_position
from ocmm_core.acceptance._register import REGISTER, ArtefactRegister
from ocmm_core.acceptance._result import AcceptanceRecord, AcceptanceVerdict, RoomAir
from ocmm_core.acceptance._session_state import SessionState
from ocmm_core.acceptance._situation import Stage, situation_of, wanted, worst_of
from ocmm_core.calibration.guided import SessionLog, Spots, from_spots, utc_text
from ocmm_core.calibration.probe_design import Temperature, check_temperature
from ocmm_core.calibration.records import SignedRecord, let_pass, load_signed, save
from ocmm_core.camera import Rig
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import CalibrationError, InputError
from ocmm_core.geometry import Float, triple
from ocmm_core.seals import SealState, Signed
from ocmm_core.tracking import ProbeBody, solve


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
            reason = state.reused(uv) or judge_point(self.state.situation(), position, tip)
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
            hint = judge_position(self.state.situation(), position)
            if hint:
                self._append(log.PositionRedone(utc=utc_text(now), position=position, reason=hint))
            return hint

    @property
    def notes(self) -> tuple[str, ...]:
        """Return advice not followed, and warnings."""
        return self.state.begun.notes

    def hint(self, tip_world: Float) -> str:
        """Return why a ball at rest would be refused now; empty if accepted."""
        with self._lock:
            position = self.state.current()
            return "" if position < 0 else judge_point(self.state.situation(), position, tip_world)

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
            positions = kind_of(self.stage).retest(self.state.situation())
            self._append(log.RetestBegun(utc=utc_text(now), positions=positions))
            return positions

    def open_end(self) -> str:
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

    @property
    def head(self) -> str:
        """Return the hash of the last line, the `AcceptanceRecord.chain_head` at the end."""
        return self.log.chain.links[-1]

    def _append(self, event: log.Event) -> None:
        self.log.append(event, self.state.fold)


_SAME_MM = 1e-9
_SAME_TIP_MM = 1e-6
"""Poses are iterated; processors differ by some picometres."""


def save_record(folder: Path, record: AcceptanceRecord) -> Path:
    """Write a signed record under its hash; raise CalibrationError on failure."""
    return save(folder, record, Signed.ACCEPTANCE)


def load_signed_record(path: Path) -> SignedRecord[AcceptanceRecord]:
    """Return a record with the state of its signature; errors as `load_signed`."""
    return load_signed(path, AcceptanceRecord, Signed.ACCEPTANCE)


def recompute(record: AcceptanceRecord) -> AcceptanceRecord:
    """Return a record with values, quantities and verdict recomputed."""
    stage = Stage(record.procedure, record.instrument, record.artefacts, record.seed)
    values = tuple(values_of(situation_of(stage, record.plan, record.observations, record.climate)))
    void = tuple(climate_reasons(stage, record.climate))
    verdict = worst_of([one.verdict for one in values if not one.superseded])
    return msgspec.structs.replace(
        record,
        values=values,
        quantities=quantities_of(values),
        void_reasons=void,
        verdict=AcceptanceVerdict.VOID if void else verdict,
    )


def differences(record: AcceptanceRecord, again: AcceptanceRecord) -> list[str]:
    """Return the differences between two records of one test, as sentences."""
    found = []
    if record.verdict is not again.verdict:
        found.append(f"The verdict is {record.verdict.value}, and {again.verdict.value} anew.")
    if len(record.values) != len(again.values):
        found.append(f"{len(record.values)} values are stored, and {len(again.values)} follow.")
    for one, other in zip(record.values, again.values, strict=False):
        if (one.key, one.quantity, one.verdict) != (other.key, other.quantity, other.verdict):
            found.append(f"{one.quantity} at '{one.position}' is judged otherwise.")
        off = max(
            abs(getattr(one, field) - getattr(other, field))
            for field in ("measured_mm", "certified_mm", "error_mm", "expanded_mm", "limit_mm")
        )
        if off > _SAME_MM:
            found.append(
                f"{one.quantity} at '{one.position}', {one.name}, differs by {off:.2e} mm."
            )
    return found


def recompute_tips(record: AcceptanceRecord, rig: Rig, body: ProbeBody) -> Iterator[str]:
    """Yield sentences on centres unlike their spots; CalibrationError for another rig."""
    if record.instrument.calibration and rig.identity != record.instrument.calibration:
        raise CalibrationError(
            "acceptance.other_rig",
            f"Rig '{rig.name}' does not use the calibration of this record.",
            "Give the calibration that was tested.",
        )
    for one in record.observations:
        if one.uv is None:
            continue
        tip = solve(from_spots(one.uv)[None], rig, body, one.sigma_px).tip_world[0]
        off = float(np.linalg.norm(tip - np.array(one.tip)))
        if not off <= _SAME_TIP_MM:
            yield (
                f"Point {one.item + 1} of '{record.plan[one.position].name}': the spots give "
                f"{triple(tip)}, {off:.2e} mm from what is stored."
            )


def chain_history(path: Path) -> tuple[Signed, SealState, tuple[tuple[str, str, str], ...]]:
    """Return kind, signature state and lines (UTC, author, text); errors as `ChainFile`."""
    if path.name == REGISTER:
        register = ArtefactRegister(path.parent)
        return Signed.ARTEFACTS, register.signer, register.changes
    if path.name == INTERIM:
        checks: ChainFile[Any] = ChainFile(
            path, InterimCheck, signed=Signed.INTERIM, remembered=True
        )
        rows = tuple(
            (one.utc, "", f"check of {one.artefact}: {1e3 * one.error_mm:+.1f} µm")
            for one in checks.items
        )
        return Signed.INTERIM, checks.signer, rows
    steps = ChainFile(path, log.Line, signed=Signed.TEST, remembered=True)
    begun = steps.items[0].event if steps.items else None
    who = begun.made_by if isinstance(begun, log.Begun) else ""
    return (
        Signed.TEST,
        steps.signer,
        tuple((one.event.utc, who, type(one.event).__name__) for one in steps.items),
    )
