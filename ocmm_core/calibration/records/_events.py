"""Events of calibrations and tips, and the status that follows from them; reads no file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum

import msgspec

from ocmm_core.calibration.records._event_folder import StoredEvent
from ocmm_core.calibration.records._probe_records import ProbeRecord, TipRecord
from ocmm_core.calibration.records._record_store import (
    DUE_BEFORE,
    RecordStatus,
    State,
    clock_fault,
    unsealed,
    within_term,
)
from ocmm_core.calibration.records._records import CameraRecord
from ocmm_core.calibration.records._sealed import record_hash


class EventKind(StrEnum):
    ACCEPTED = "accepted"
    PASSED = "verification passed"
    FAILED = "verification failed"
    SUSPECTED = "put in doubt"
    FALLEN = "artefact found wrong"
    """The calibration, or the verification given as evidence, rests on a faulty artefact."""
    RECALLED = "jobs recalled"
    """Jobs were recomputed; the evidence is the result (`inspection.finished`)."""


class Event(StoredEvent, frozen=True, kw_only=True):
    """One line of the chain; see also `StoredEvent`."""

    kind: EventKind
    calibration: str
    evidence: str = ""
    """Hash of the verification (also a fallen one) or recall record; otherwise empty."""
    since_utc: str = ""
    """For a suspicion: last time without a fault, empty if unknown. For an artefact: start of the
    fault. For a passed verification: its last observation, empty in earlier versions."""


class TipEventKind(StrEnum):
    CALIBRATED = "probe calibrated"
    QUALIFIED = "tip qualified"
    NOT_QUALIFIED = "qualification failed"
    PASSED = "tip check passed"
    FAILED = "tip check failed"
    MOUNTED = "tip mounted"
    DOUBTED = "put in doubt"


class TipEvent(StoredEvent, frozen=True, kw_only=True):
    """One line of the chain; see also `StoredEvent`."""

    kind: TipEventKind
    tip: str
    record: str = ""
    """Hash of the associated record, or empty."""
    since_utc: str = ""
    """For a suspicion: last time without a fault; otherwise empty."""


@dataclass(frozen=True, slots=True)
class TipRecords:
    """Records in force for a tip."""

    calibration: ProbeRecord
    """Latest accepted."""
    qualification: TipRecord | None
    """Latest that passed with this calibration, or None."""

    @property
    def due_utc(self) -> str:
        """Return the expiry of the records, ISO 8601 text."""
        ends = [self.calibration.valid_until_utc]
        if self.qualification is not None:
            ends.append(self.qualification.valid_until_utc)
        return min(ends, key=datetime.fromisoformat)


def status(record: CameraRecord, events: Sequence[Event], now: datetime) -> RecordStatus:
    """Return the state of a calibration at a moment by its events alone."""
    fault = clock_fault(events[-1].utc, now) if events else None
    if fault is not None:
        return fault
    own = [event for event in events if event.calibration == record_hash(record)]
    fallen = [event for event in own if event.kind is EventKind.FALLEN and not event.evidence]
    if fallen:
        again = "Calibrate the cameras again."
        if record.method == "tracker":
            again = "Calibrate the tracker again."
        return RecordStatus(State.SUSPECT, fallen[-1].reason, again, record.made_utc)
    judged = [event for event in judgements(own) if event.kind is not EventKind.ACCEPTED]
    if not judged:
        return RecordStatus(
            State.SUSPECT,
            "The calibration has not been verified yet.",
            "Verify it with the length bar.",
            record.made_utc,
        )
    last = judged[-1]
    if last.kind is not EventKind.PASSED:
        return RecordStatus(
            State.SUSPECT,
            "The last verification failed." if last.kind is EventKind.FAILED else last.reason,
            "Verify the calibration; if that fails, calibrate again.",
            last.since_utc or last_good(own) or record.made_utc,
        )
    if not last.sealed:
        return unsealed("verification", "Verify the calibration again.")
    until = datetime.fromisoformat(record.valid_until_utc)
    renewal = "Calibrate the cameras" if record.method != "tracker" else "Calibrate the tracker"
    return within_term("calibration", until, DUE_BEFORE, renewal, now)


def last_good(events: Sequence[Event]) -> str:
    """Return when the last good verification was observed, not stored; empty without one."""
    good = [one for one in judgements(events) if one.kind is EventKind.PASSED]
    return (good[-1].since_utc or good[-1].utc) if good else ""


def judgements(events: Sequence[Event]) -> list[Event]:
    """Return the deciding events, oldest first; passed with a faulty artefact is a suspicion."""
    void = {one.evidence: one for one in events if one.kind is EventKind.FALLEN and one.evidence}
    return [
        msgspec.structs.replace(
            one, kind=EventKind.SUSPECTED, since_utc="", reason=void[one.evidence].reason
        )
        if one.kind is EventKind.PASSED and one.evidence in void
        else one
        for one in events
        if one.kind not in (EventKind.FALLEN, EventKind.RECALLED)
    ]


def status_of_tip(active: TipRecords, events: Sequence[TipEvent], now: datetime) -> RecordStatus:
    """Return the state of a tip at a moment by its events alone."""
    calibration, qualification = active.calibration, active.qualification
    tip = calibration.tip
    fault = clock_fault(events[-1].utc, now) if events else None
    if fault is not None:
        return fault
    if qualification is None:
        return RecordStatus(
            State.SUSPECT,
            f"Tip '{tip}' has not been qualified since the probe was calibrated.",
            "Qualify the tip on the sphere.",
            calibration.made_utc,
        )
    last = [one for one in events if one.tip == tip][-1]
    if last.kind not in (TipEventKind.QUALIFIED, TipEventKind.PASSED):
        why = {
            TipEventKind.MOUNTED: f"Tip '{tip}' was mounted and has not been checked since.",
            TipEventKind.FAILED: f"The last check of tip '{tip}' failed.",
            TipEventKind.NOT_QUALIFIED: f"The last qualification of tip '{tip}' failed.",
        }.get(last.kind, last.reason)
        return RecordStatus(
            State.SUSPECT,
            why,
            "Run the quick tip check (one minute). If it fails, qualify the tip or calibrate "
            "the probe.",
            last.since_utc or _last_good(events, tip, calibration.made_utc),
        )
    if not last.sealed:
        return unsealed("check", "Run the quick tip check (one minute).")
    ends = (
        (calibration.valid_until_utc, "calibration", "Calibrate the probe"),
        (qualification.valid_until_utc, "qualification of the tip", "Qualify the tip"),
    )
    until, name, remedy = min(ends)
    end = datetime.fromisoformat(until)
    made = datetime.fromisoformat(
        calibration.made_utc if name == "calibration" else qualification.made_utc
    )
    # A term of only days would otherwise always be DUE.
    return within_term(name, end, min(DUE_BEFORE, (end - made) / 5), remedy, now)


def _last_good(events: Sequence[TipEvent], tip: str, otherwise: str) -> str:
    good = (TipEventKind.QUALIFIED, TipEventKind.PASSED)
    found = [one.utc for one in events if one.tip == tip and one.kind in good]
    return found[-1] if found else otherwise
