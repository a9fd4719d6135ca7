"""Which calibration is in force, and whether it may be trusted: a chain of events on the disk.

Records are never changed. What happens to them - accepted, verified, put in doubt - is appended
to one chained file for each rig. The state of a calibration follows from its record and these
events alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from pathlib import Path
from typing import Any

import msgspec

from ocmm_core.calibration.records._event_folder import EventFolder, StoredEvent
from ocmm_core.calibration.records._evidence import KeptFile, record_file, session_files
from ocmm_core.calibration.records._records import CameraRecord, VerificationRecord
from ocmm_core.calibration.records._sealed import load_named, record_hash, save
from ocmm_core.errors import CalibrationError

THIS_COMPUTER = "this computer"
"""Who puts a history in doubt that was set back."""
DUE_BEFORE = timedelta(days=14)
"""A calibration that ends within this time is DUE."""
CLOCK_TOLERANCE = timedelta(seconds=60)
"""The computer's clock may stand so far before the last event; further back it is not believed."""


class State(StrEnum):
    """Whether a calibration may be trusted."""

    VALID = "VALID"
    DUE = "DUE"
    EXPIRED = "EXPIRED"
    SUSPECT = "SUSPECT"
    UNUSABLE = "UNUSABLE"
    """A file that it rests on is missing or not as it was written."""

    @property
    def usable(self) -> bool:
        """Return whether points may be taken with it."""
        return self in (State.VALID, State.DUE)


class EventKind(StrEnum):
    """What can happen to a calibration."""

    ACCEPTED = "accepted"
    PASSED = "verification passed"
    FAILED = "verification failed"
    SUSPECTED = "put in doubt"
    FALLEN = "artefact found wrong"
    """It, or the verification that is the evidence, rests on an artefact that was wrong."""
    RECALLED = "jobs recalled"
    """Jobs were computed anew; the evidence is what came out (`inspection.recall_record`)."""


class Event(StoredEvent, frozen=True, kw_only=True):
    """One line of the chain; see also `StoredEvent`.

    Attributes
    ----------
    kind
        An `EventKind`.
    calibration
        Hash of the record it is about.
    evidence
        Hash of the verification record, also of one that has fallen, or of the record of a recall;
        empty for other kinds.
    since_utc
        For a doubt: last time at which all was well; empty where that is not known. For an
        artefact: since when it is wrong.
    """

    kind: EventKind
    calibration: str
    evidence: str = ""
    since_utc: str = ""


@dataclass(frozen=True, slots=True)
class Standing:
    """The state of the calibration in force.

    Attributes
    ----------
    state
        See `State`.
    reason
        Why it is not VALID; empty where it is.
    remedy
        What to do about it.
    since_utc
        For SUSPECT: points taken after this time are in doubt. Empty otherwise.
    """

    state: State
    reason: str = ""
    remedy: str = ""
    since_utc: str = ""


class CalibrationStore(EventFolder[Event]):
    """The calibrations of one rig, in a folder of their own; one process writes at a time.

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

    _renewals = ("calibrate the cameras from known points and verify", "verify the calibration")

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, Event)

    def active(self) -> CameraRecord | None:
        """Return the record that was accepted last, or None before the first one.

        Raises
        ------
        CalibrationError
            It is missing or was changed.
        """
        digest = self.active_hash
        return None if digest is None else load_named(self._folder, digest, CameraRecord)

    @property
    def active_hash(self) -> str | None:
        """Return the hash of the record that was accepted last, or None."""
        accepted = [event for event in self.events if event.kind is EventKind.ACCEPTED]
        return accepted[-1].calibration if accepted else None

    def records(self) -> tuple[CameraRecord, ...]:
        """Return all accepted records, oldest first; raise CalibrationError for a changed one.

        Those that were lost, which the history says, are left out.
        """
        hashes = dict.fromkeys(
            event.calibration for event in self.events if event.kind is EventKind.ACCEPTED
        )
        kept = set(self.wanted())
        return tuple(
            load_named(self._folder, name, CameraRecord)
            for name in hashes
            if record_file(name) in kept
        )

    def verifications(self) -> tuple[VerificationRecord, ...]:
        """Return all verifications, oldest first, but lost ones; CalibrationError as `records`."""
        kept = set(self.wanted())
        return tuple(
            load_named(self._folder, event.evidence, VerificationRecord)
            for event in self.events
            if event.kind in (EventKind.PASSED, EventKind.FAILED)
            and record_file(event.evidence) in kept
        )

    def accept(
        self,
        record: CameraRecord,
        who: str,
        reason: str,
        now: datetime,
        session: Path | None = None,
    ) -> str:
        """Store a calibration, put it in force and return its hash.

        It is SUSPECT until a verification has passed. One from known points rests on nothing
        that was before: files of earlier ones that are lost are not asked for any more, and the
        event says which.

        Parameters
        ----------
        session
            The file of the session that it comes from.
        """
        lost = self._lost(0 if record.method == "known points" else 1)
        save(self._folder, record)
        digest = record_hash(record)
        self._append(EventKind.ACCEPTED, digest, who, reason, now, session=session, lost=lost)
        return digest

    def verify(
        self, record: VerificationRecord, now: datetime, session: Path | None = None
    ) -> None:
        """Store a verification of the calibration in force; it makes up for lost earlier ones.

        Parameters
        ----------
        session
            The file of the session that it comes from.

        Raises
        ------
        CalibrationError
            It is about another calibration, or rests on the data of that calibration.
        """
        active = self.active()
        if active is None or record.calibration != self.active_hash:
            raise CalibrationError(
                "verification.other",
                "This verification is not about the calibration in force.",
                "Verify the calibration in force.",
            )
        if record.data_sha256 == active.data_sha256:
            raise CalibrationError(
                "verification.data",
                "This verification rests on the data that the cameras were calibrated with.",
                "Take independent data.",
            )
        lost = self._lost(1)
        save(self._folder, record)
        kind = EventKind.PASSED if record.passed else EventKind.FAILED
        count = len(record.checks)
        reason = f"{count} check{'s' if count != 1 else ''} by the rule: {record.rule}"
        self._append(
            kind, record.calibration, record.made_by, reason, now,
            evidence=record_hash(record), session=session, lost=lost,
        )  # fmt: skip

    def suspect(self, who: str, reason: str, since: datetime | None, now: datetime) -> None:
        """Put the calibration in force in doubt, since a moment or since its last good check."""
        digest = self.active_hash
        if digest is not None:
            self._append(EventKind.SUSPECTED, digest, who, reason, now, since=since)

    def fall(
        self,
        calibration: str,
        evidence: str,
        *,
        who: str,
        reason: str,
        since: datetime,
        now: datetime,
    ) -> None:
        """Say that a calibration, or a verification of it, rests on an artefact that was wrong.

        Parameters
        ----------
        calibration
            Hash of the calibration.
        evidence
            Hash of its verification that falls; empty where it falls itself.
        since
            When the artefact was wrong.
        """
        self._append(
            EventKind.FALLEN, calibration, who, reason, now, evidence=evidence, since=since
        )

    def recalled(
        self, calibration: str, evidence: str, who: str, reason: str, now: datetime
    ) -> None:
        """Say that the jobs of a calibration were computed anew; ``evidence`` is what came out."""
        self._append(EventKind.RECALLED, calibration, who, reason, now, evidence=evidence)

    def standing(self, now: datetime) -> Standing:
        """Return whether the calibration in force may be trusted, with all its files read again.

        Raises
        ------
        CalibrationError
            There is none, or its record was changed.
        """
        record = self.active()
        if record is None:
            raise CalibrationError(
                "calibration.none", "The cameras were never calibrated.", "Calibrate the cameras."
            )
        return self.standing_of(record, now, thorough=True)

    def standing_of(self, record: CameraRecord, now: datetime, *, thorough: bool) -> Standing:
        """Return whether a calibration may be trusted, and whether what it rests on is whole.

        Parameters
        ----------
        record
            The one in force.
        thorough
            See `defect`.
        """
        return doubt_of_folder(self, thorough=thorough) or standing(record, self.events, now)

    def _files_of(self, event: Event) -> Sequence[KeptFile]:
        digest = event.calibration if event.kind is EventKind.ACCEPTED else event.evidence
        return (*([record_file(digest)] if digest else []), *event.files)

    def _renewed_by(self, event: Event) -> int:
        return 0 if event.kind is EventKind.ACCEPTED else 1

    def _is_about(self, event: Event, about: str | None) -> bool:
        return True

    def _doubts(self, reason: str, utc: str) -> Sequence[Event]:
        digest, last = self.active_hash, self.events[-1].utc
        return () if digest is None else (
            Event(
                utc=utc, sealed=True, kind=EventKind.SUSPECTED, calibration=digest,
                since_utc=last, who=THIS_COMPUTER, reason=reason,
            ),
        )  # fmt: skip

    def _append(
        self,
        kind: EventKind,
        calibration: str,
        who: str,
        reason: str,
        now: datetime,
        *,
        evidence: str = "",
        since: datetime | None = None,
        session: Path | None = None,
        lost: tuple[str, ...] = (),
    ) -> None:
        event = Event(
            utc=now.astimezone(UTC).isoformat(timespec="microseconds"),
            sealed=True,
            files=session_files(self._folder, session),
            lost=lost,
            kind=kind,
            calibration=calibration,
            evidence=evidence,
            since_utc="" if since is None else since.astimezone(UTC).isoformat(),
            who=who,
            reason=reason,
        )
        self._append_event(event)


def standing(record: CameraRecord, events: Sequence[Event], now: datetime) -> Standing:
    """Return the state of a calibration at a moment by its events alone."""
    fault = clock_fault(events[-1].utc, now) if events else None
    if fault is not None:
        return fault
    own = [event for event in events if event.calibration == record_hash(record)]
    fallen = [event for event in own if event.kind is EventKind.FALLEN and not event.evidence]
    if fallen:
        return Standing(
            State.SUSPECT, fallen[-1].reason, "Calibrate the cameras again.", record.made_utc
        )
    judged = [event for event in judgements(own) if event.kind is not EventKind.ACCEPTED]
    if not judged:
        return Standing(
            State.SUSPECT,
            "The calibration was not verified since it was made.",
            "Verify it with the length bar.",
            record.made_utc,
        )
    last = judged[-1]
    good = [event.utc for event in judged if event.kind is EventKind.PASSED]
    if last.kind is not EventKind.PASSED:
        return Standing(
            State.SUSPECT,
            "The last verification failed." if last.kind is EventKind.FAILED else last.reason,
            "Verify the calibration; if that fails, calibrate again.",
            last.since_utc or (good[-1] if good else record.made_utc),
        )
    if not last.sealed:
        return unsealed("verification", "Verify the calibration again.")
    until = datetime.fromisoformat(record.valid_until_utc)
    if now >= until:
        return Standing(
            State.EXPIRED,
            f"The calibration was valid until {until.date().isoformat()}.",
            "Calibrate the cameras.",
        )
    if now >= until - DUE_BEFORE:
        return Standing(
            State.DUE,
            f"The calibration ends on {until.date().isoformat()}.",
            "Calibrate the cameras before that day.",
        )
    return Standing(State.VALID)


def doubt_of_folder(
    folder: EventFolder[Any], about: str | None = None, *, thorough: bool
) -> Standing | None:
    """Return what is said where not all that a standing rests on is there; None where it is.

    Parameters
    ----------
    about, thorough
        See `EventFolder.defect`.
    """
    defect = folder.defect(about, thorough=thorough)
    if defect is not None:
        return Standing(State.UNUSABLE, defect.what, defect.remedy)
    exchanged = folder.exchanged
    if exchanged is not None:
        since = folder.events[-1].utc
        return Standing(State.SUSPECT, exchanged.what, exchanged.remedy, since)
    return None


def unsealed(what: str, remedy: str) -> Standing:
    """Return what is said where the event that counts has no seal."""
    return Standing(
        State.SUSPECT,
        f"The last {what} was stored by an earlier version of this program, which would not have "
        f"noticed if a later event had been removed.",
        remedy,
    )


def judgements(events: Sequence[Event]) -> list[Event]:
    """Return what says how calibrations stand, oldest first: put in force, passed, failed, doubted.

    A verification that passed by an artefact which was wrong is a doubt: nobody knows what it
    would have said.
    """
    void = {one.evidence: one for one in events if one.kind is EventKind.FALLEN and one.evidence}
    return [
        msgspec.structs.replace(one, kind=EventKind.SUSPECTED, reason=void[one.evidence].reason)
        if one.kind is EventKind.PASSED and one.evidence in void
        else one
        for one in events
        if one.kind not in (EventKind.FALLEN, EventKind.RECALLED)
    ]


def clock_fault(last_utc: str, now: datetime) -> Standing | None:
    """Return what is said where the clock stands before the last event; None where it does not."""
    if now >= datetime.fromisoformat(last_utc) - CLOCK_TOLERANCE:
        return None
    return Standing(
        State.EXPIRED,
        f"The clock of this computer stands before the last event ({last_utc[:16]}).",
        "Set the clock of the computer.",
    )
