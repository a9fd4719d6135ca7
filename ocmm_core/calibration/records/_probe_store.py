"""What happened to a probe and its tips, and whether the mounted tip may be trusted.

Records are never changed. What happens - calibrated, qualified, checked, mounted, put in doubt -
is appended to one chained file for each probe. The standing of a tip follows from its records and
these events alone, so that it is the same after a crash.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path

from ocmm_core.calibration.records._event_folder import EventFolder, StoredEvent
from ocmm_core.calibration.records._evidence import KeptFile, record_file, session_files
from ocmm_core.calibration.records._history import (
    DUE_BEFORE,
    THIS_COMPUTER,
    Standing,
    State,
    clock_fault,
    doubt_of_folder,
    unsealed,
)
from ocmm_core.calibration.records._probe_records import ProbeRecord, TipCheckRecord, TipRecord
from ocmm_core.calibration.records._records import Check
from ocmm_core.calibration.records._sealed import load_named, record_hash, save
from ocmm_core.errors import CalibrationError

MONITOR = "monitor"
"""Who puts a tip in doubt where no person does."""


class TipEventKind(StrEnum):
    """What can happen to a tip."""

    CALIBRATED = "probe calibrated"
    QUALIFIED = "tip qualified"
    NOT_QUALIFIED = "qualification failed"
    PASSED = "tip check passed"
    FAILED = "tip check failed"
    MOUNTED = "tip mounted"
    DOUBTED = "put in doubt"


class TipEvent(StoredEvent, frozen=True, kw_only=True):
    """One line of the chain; see also `StoredEvent`.

    Attributes
    ----------
    kind
        A `TipEventKind`.
    tip
        Name of the tip it is about.
    record
        Hash of the record that belongs to it; empty where there is none.
    since_utc
        For a doubt: last time at which all was well; empty otherwise.
    """

    kind: TipEventKind
    tip: str
    record: str = ""
    since_utc: str = ""


@dataclass(frozen=True, slots=True)
class TipRecords:
    """What is in force for a tip.

    Attributes
    ----------
    calibration
        Accepted last for it.
    qualification
        The last one that passed with this calibration; None where there is none.
    """

    calibration: ProbeRecord
    qualification: TipRecord | None


class ProbeStore(EventFolder[TipEvent]):
    """The records of one probe, in a folder of their own; one process writes at a time.

    Its methods may be called from any thread.

    Parameters
    ----------
    folder
        Made at the first write.

    Raises
    ------
    StorageError
        The chain of events is broken.
    """

    _renewals = (
        "calibrate the probe with this tip and qualify it",
        "qualify the tip",
        "make the quick tip check",
    )

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, TipEvent)

    @property
    def tips(self) -> tuple[str, ...]:
        """Return the names of all tips that were ever calibrated, oldest first."""
        calibrated = (one.tip for one in self.events if one.kind is TipEventKind.CALIBRATED)
        return tuple(dict.fromkeys(calibrated))

    @property
    def mounted(self) -> str | None:
        """Return the name of the tip that is on the probe, or None before the first one."""
        placing = (TipEventKind.MOUNTED, TipEventKind.CALIBRATED)
        placed = [one.tip for one in self.events if one.kind in placing]
        return placed[-1] if placed else None

    def active(self, tip: str) -> TipRecords | None:
        """Return what is in force for a tip, or None where it was never calibrated.

        Raises
        ------
        CalibrationError
            A record is missing or was changed.
        """
        digest = self.active_hash(tip)
        if digest is None:
            return None
        calibration = load_named(self._folder, digest, ProbeRecord)
        qualified = self._last(tip, TipEventKind.QUALIFIED)
        qualification = (
            None if qualified is None else load_named(self._folder, qualified, TipRecord)
        )
        if qualification is not None and qualification.calibration != digest:
            qualification = None
        return TipRecords(calibration, qualification)

    def active_hash(self, tip: str) -> str | None:
        """Return the hash of the calibration in force for a tip, or None."""
        return self._last(tip, TipEventKind.CALIBRATED)

    def calibrations(self) -> tuple[ProbeRecord, ...]:
        """Return the calibrations of all tips, oldest first; CalibrationError for a changed one.

        Those that were lost, which the history says, are left out.
        """
        return tuple(
            load_named(self._folder, name, ProbeRecord)
            for name in self._named(TipEventKind.CALIBRATED)
        )

    def qualifications(self) -> tuple[TipRecord, ...]:
        """Return all qualifications, also failed ones; lost ones and errors as `calibrations`."""
        return tuple(
            load_named(self._folder, name, TipRecord)
            for name in self._named(TipEventKind.QUALIFIED, TipEventKind.NOT_QUALIFIED)
        )

    def checks(self) -> tuple[TipCheckRecord, ...]:
        """Return all quick checks, oldest first; lost ones and errors as `calibrations`."""
        return tuple(
            load_named(self._folder, name, TipCheckRecord)
            for name in self._named(TipEventKind.PASSED, TipEventKind.FAILED)
        )

    def calibrate(
        self,
        record: ProbeRecord,
        who: str,
        reason: str,
        now: datetime,
        session: Path | None = None,
    ) -> str:
        """Store a calibration, put it in force with its tip mounted, and return its hash.

        The tip is SUSPECT until it is qualified. Files of earlier events of this tip that are lost
        are not asked for any more, and the event says which.

        Parameters
        ----------
        session
            The file of the session that it comes from.
        """
        lost = self._lost(0, record.tip)
        return self._put(TipEventKind.CALIBRATED, record, who, reason, now, session, lost)

    def qualify(self, record: TipRecord, now: datetime, session: Path | None = None) -> str:
        """Store a qualification, also one that failed, and return its hash.

        Parameters
        ----------
        session
            The file of the session that it comes from.

        Raises
        ------
        CalibrationError
            It is not about the calibration in force of that tip.
        """
        self._require(record.tip, record.calibration)
        kind = TipEventKind.QUALIFIED if record.passed else TipEventKind.NOT_QUALIFIED
        said, lost = _said(record.checks), self._lost(1, record.tip)
        return self._put(kind, record, record.made_by, said, now, session, lost)

    def check(self, record: TipCheckRecord, now: datetime, session: Path | None = None) -> str:
        """Store a quick check, also one that failed, and return its hash.

        Parameters
        ----------
        session
            The file of the session that it comes from.

        Raises
        ------
        CalibrationError
            It is not about what is in force of that tip.
        """
        active = self._require(record.tip, record.calibration)
        if active.qualification is None or record.qualification != record_hash(
            active.qualification
        ):
            raise _other(record.tip)
        kind = TipEventKind.PASSED if record.passed else TipEventKind.FAILED
        said, lost = _said(record.checks), self._lost(2, record.tip)
        return self._put(kind, record, record.made_by, said, now, session, lost)

    def mount(self, tip: str, who: str, now: datetime) -> None:
        """Say that another tip, or the same one again, was screwed on; it must be checked.

        Raises
        ------
        CalibrationError
            It was never calibrated.
        """
        if tip not in self.tips:
            raise _never(tip)
        self._append(TipEventKind.MOUNTED, tip, who, "Mounted.", now)

    def doubt(self, who: str, reason: str, since: datetime, now: datetime) -> None:
        """Put the mounted tip in doubt, for all points since a moment, until it is checked."""
        tip = self.mounted
        if tip is not None:
            self._append(TipEventKind.DOUBTED, tip, who, reason, now, since=since)

    def standing(self, tip: str, now: datetime) -> Standing:
        """Return whether a tip may be trusted, with all its files read again.

        Raises
        ------
        CalibrationError
            It was never calibrated, or a record was changed.
        """
        active = self.active(tip)
        if active is None:
            raise _never(tip)
        return self.standing_of(active, now, thorough=True)

    def standing_of(self, active: TipRecords, now: datetime, *, thorough: bool) -> Standing:
        """Return whether a tip may be trusted, and whether what it rests on is whole.

        Parameters
        ----------
        active
            What is in force for it.
        thorough
            See `defect`.
        """
        doubt = doubt_of_folder(self, active.calibration.tip, thorough=thorough)
        return doubt or standing_of_tip(active, self.events, now)

    def _files_of(self, event: TipEvent) -> Sequence[KeptFile]:
        return (*([record_file(event.record)] if event.record else []), *event.files)

    def _is_about(self, event: TipEvent, about: str | None) -> bool:
        return about is None or event.tip == about

    def _doubts(self, reason: str, utc: str) -> Sequence[TipEvent]:
        last = self.events[-1].utc
        return [
            TipEvent(
                utc=utc, sealed=True, kind=TipEventKind.DOUBTED, tip=tip, since_utc=last,
                who=THIS_COMPUTER, reason=reason,
            )
            for tip in self.tips
        ]  # fmt: skip

    def _require(self, tip: str, calibration: str) -> TipRecords:
        active = self.active(tip)
        if active is None:
            raise _never(tip)
        if record_hash(active.calibration) != calibration:
            raise _other(tip)
        return active

    def _named(self, *kinds: TipEventKind) -> tuple[str, ...]:
        kept = set(self.wanted())
        named = dict.fromkeys(one.record for one in self.events if one.kind in kinds)
        return tuple(one for one in named if record_file(one) in kept)

    def _last(self, tip: str, kind: TipEventKind) -> str | None:
        found = [one.record for one in self.events if one.tip == tip and one.kind is kind]
        return found[-1] if found else None

    def _put(
        self,
        kind: TipEventKind,
        record: ProbeRecord | TipRecord | TipCheckRecord,
        who: str,
        reason: str,
        now: datetime,
        session: Path | None,
        lost: tuple[str, ...],
    ) -> str:
        save(self._folder, record)
        digest = record_hash(record)
        self._append(kind, record.tip, who, reason, now, record=digest, session=session, lost=lost)
        return digest

    def _renewed_by(self, event: TipEvent) -> int:
        return {
            TipEventKind.CALIBRATED: 0,
            TipEventKind.QUALIFIED: 1,
            TipEventKind.NOT_QUALIFIED: 1,
        }.get(event.kind, 2)

    def _append(
        self,
        kind: TipEventKind,
        tip: str,
        who: str,
        reason: str,
        now: datetime,
        *,
        record: str = "",
        since: datetime | None = None,
        session: Path | None = None,
        lost: tuple[str, ...] = (),
    ) -> None:
        event = TipEvent(
            utc=now.astimezone(UTC).isoformat(timespec="microseconds"),
            sealed=True,
            files=session_files(self._folder, session),
            lost=lost,
            kind=kind,
            tip=tip,
            record=record,
            since_utc="" if since is None else since.astimezone(UTC).isoformat(),
            who=who,
            reason=reason,
        )
        self._append_event(event)


def standing_of_tip(active: TipRecords, events: Sequence[TipEvent], now: datetime) -> Standing:
    """Return the state of a tip at a moment by its events alone."""
    calibration, qualification = active.calibration, active.qualification
    tip = calibration.tip
    fault = clock_fault(events[-1].utc, now) if events else None
    if fault is not None:
        return fault
    if qualification is None:
        return Standing(
            State.SUSPECT,
            f"Tip '{tip}' was not qualified since the probe was calibrated.",
            "Qualify the tip on the sphere.",
            calibration.made_utc,
        )
    last = [one for one in events if one.tip == tip][-1]
    if last.kind not in (TipEventKind.QUALIFIED, TipEventKind.PASSED):
        why = {
            TipEventKind.MOUNTED: f"Tip '{tip}' was mounted and not checked since.",
            TipEventKind.FAILED: f"The last check of tip '{tip}' failed.",
            TipEventKind.NOT_QUALIFIED: f"The last qualification of tip '{tip}' failed.",
        }.get(last.kind, last.reason)
        return Standing(
            State.SUSPECT,
            why,
            "Make the quick tip check: one minute. If it fails, qualify the tip or calibrate the "
            "probe.",
            last.since_utc or _last_good(events, tip, calibration.made_utc),
        )
    if not last.sealed:
        return unsealed("check", "Make the quick tip check: one minute.")
    ends = (
        (calibration.valid_until_utc, "calibration", "Calibrate the probe"),
        (qualification.valid_until_utc, "qualification of the tip", "Qualify the tip"),
    )
    until, name, remedy = min(ends)
    end = datetime.fromisoformat(until)
    if now >= end:
        return Standing(
            State.EXPIRED, f"The {name} was valid until {end.date().isoformat()}.", f"{remedy}."
        )
    made = datetime.fromisoformat(
        calibration.made_utc if name == "calibration" else qualification.made_utc
    )
    # What holds for days only would always be due two weeks before its end.
    if now >= end - min(DUE_BEFORE, (end - made) / 5):
        return Standing(
            State.DUE,
            f"The {name} ends on {end.date().isoformat()}.",
            f"{remedy} before that day.",
        )
    return Standing(State.VALID)


def _last_good(events: Sequence[TipEvent], tip: str, otherwise: str) -> str:
    good = (TipEventKind.QUALIFIED, TipEventKind.PASSED)
    found = [one.utc for one in events if one.tip == tip and one.kind in good]
    return found[-1] if found else otherwise


def _said(checks: Sequence[Check]) -> str:
    """Return how many checks there were, and which one came nearest to its limit or beyond."""
    count = f"{len(checks)} check{'s' if len(checks) != 1 else ''}"
    if not checks:
        return f"{count}."
    worst = max(checks, key=lambda one: abs(one.error_mm) / one.limit_mm)
    share = abs(worst.error_mm) / worst.limit_mm
    where = "farthest beyond" if share > 1.0 else "nearest to"
    return f"{count}; {where} its limit: {worst.name}, {100 * share:.0f} % of it."


def _never(tip: str) -> CalibrationError:
    return CalibrationError(
        "probe_record.none",
        f"The probe was never calibrated with tip '{tip}'.",
        "Calibrate the probe with this tip.",
    )


def _other(tip: str) -> CalibrationError:
    return CalibrationError(
        "probe_record.replaced",
        f"This is not about the calibration in force of tip '{tip}'.",
        "Repeat it with the calibration in force.",
    )
