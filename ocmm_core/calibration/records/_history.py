"""Store of the calibrations of a rig: the one in force and its status.

Events (accepted, verified, suspected) are appended to one chain file a rig; the status follows from
record and events alone.
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

from ocmm_core.calibration.records._events import Event, EventKind, last_good, status
from ocmm_core.calibration.records._record_store import THIS_COMPUTER, RecordStatus, RecordStore
from ocmm_core.calibration.records._records import CameraRecord, VerificationRecord
from ocmm_core.calibration.records._sealed import KeptFile, load_named, record_file, record_hash
from ocmm_core.calibration.records._usable import PRACTICE, is_practice
from ocmm_core.errors import CalibrationError, OcmmError


class CalibrationStore(RecordStore[Event]):
    """Calibrations of a rig; one writer process, thread-safe; StorageError for a broken chain."""

    _renewals = (
        "calibrate again (cameras: from known points) and verify", "verify the calibration",
    )  # fmt: skip

    def __init__(self, folder: Path) -> None:
        self._identified = ("", "")
        super().__init__(folder, Event)

    def active(self) -> CameraRecord | None:
        """Return the latest accepted record; CalibrationError if missing or changed."""
        digest = self.active_hash
        return None if digest is None else load_named(self._folder, digest, CameraRecord)

    @property
    def active_hash(self) -> str | None:
        # Search from the end; many events may follow.
        accepted = (one for one in reversed(self.events) if one.kind is EventKind.ACCEPTED)
        return next((event.calibration for event in accepted), None)

    def records(self) -> tuple[CameraRecord, ...]:
        """Return accepted records, oldest first, no lost ones; CalibrationError if changed."""
        hashes = dict.fromkeys(
            event.calibration for event in self.events if event.kind is EventKind.ACCEPTED
        )
        return self._loaded(hashes, CameraRecord)

    def verifications(self) -> tuple[VerificationRecord, ...]:
        """Return all verifications, oldest first, but lost ones; CalibrationError as `records`."""
        judged = (EventKind.PASSED, EventKind.FAILED)
        hashes = [event.evidence for event in self.events if event.kind in judged]
        return self._loaded(hashes, VerificationRecord)

    def accept(
        self,
        record: CameraRecord,
        who: str,
        reason: str,
        now: datetime,
        session: Path | None = None,
    ) -> str:
        """Store a calibration, put it in force and return its hash.

        SUSPECT until a verification passes. Only a relocation depends on earlier ones: else the
        event lists lost files, which are no longer required.
        """
        digest = record_hash(record)
        self._put(
            record, now, who, reason, renewal=1 if record.method == "relocation" else 0,
            session=session, kind=EventKind.ACCEPTED, calibration=digest,
        )  # fmt: skip
        return digest

    def verify(
        self, record: VerificationRecord, now: datetime, session: Path | None = None
    ) -> None:
        """Store a verification of the calibration in force; replaces lost earlier ones.

        CalibrationError if it is of another calibration, or uses the data of that calibration.
        """
        active = self.active()
        if active is None or record.calibration != self.active_hash:
            raise CalibrationError(
                "verification.other",
                "This verification does not belong to the active calibration.",
                "Verify the active calibration.",
            )
        if record.data_sha256 == active.data_sha256:
            raise CalibrationError(
                "verification.data",
                "This verification uses the data of the calibration itself.",
                "Take independent data.",
            )
        kind = EventKind.PASSED if record.passed else EventKind.FAILED
        count = len(record.checks)
        reason = f"{count} check{'s' if count != 1 else ''} by the rule: {record.rule}"
        seen = datetime.fromisoformat(record.made_utc) if record.passed else None
        self._put(
            record, now, record.made_by, reason, renewal=1, session=session, since=seen,
            kind=kind, calibration=record.calibration, evidence=record_hash(record),
        )  # fmt: skip

    @property
    def last_good_utc(self) -> str:
        """Return the last observation of a good verification of the calibration in force, or ''."""
        return last_good([one for one in self.events if one.calibration == self.active_hash])

    def suspect(self, who: str, reason: str, since: datetime | None, now: datetime) -> None:
        """Mark the calibration in force SUSPECT, since a moment or its last good check."""
        digest = self.active_hash
        if digest is not None:
            self._happened(
                now, who, reason, since=since, kind=EventKind.SUSPECTED, calibration=digest
            )

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
        """Record that a calibration or its verification rests on a faulty artefact.

        ``evidence``: hash of the affected verification, empty for the calibration itself; faulty
        from ``since`` on.
        """
        self._happened(
            now, who, reason, since=since,
            kind=EventKind.FALLEN, calibration=calibration, evidence=evidence,
        )  # fmt: skip

    def recalled(
        self, calibration: str, evidence: str, who: str, reason: str, now: datetime
    ) -> None:
        """Record that the jobs of a calibration were recomputed, with the hash of the result."""
        self._happened(
            now, who, reason,
            kind=EventKind.RECALLED, calibration=calibration, evidence=evidence,
        )  # fmt: skip

    def status(self, now: datetime) -> RecordStatus:
        """Return the status, all files re-read; CalibrationError without an intact calibration."""
        record = self.active()
        if record is None:
            raise CalibrationError(
                "calibration.none", "The cameras were never calibrated.", "Calibrate the cameras."
            )
        return self.status_of(record, now, thorough=True)

    def status_of(self, record: CameraRecord, now: datetime, *, thorough: bool) -> RecordStatus:
        """Return the status of a calibration, including the integrity of its evidence."""
        return self._doubt(now, thorough=thorough) or self._judged(
            now, lambda at: status(record, self.events, at)
        )

    def _files_of(self, event: Event) -> Sequence[KeptFile]:
        digest = event.calibration if event.kind is EventKind.ACCEPTED else event.evidence
        return (*([record_file(digest)] if digest else []), *event.files)

    def _renewed_by(self, event: Event) -> int:
        return 0 if event.kind is EventKind.ACCEPTED else 1

    def _is_about(self, event: Event, about: str | None) -> bool:
        return True

    def _identity_of_thing(self) -> str:
        digest = self.active_hash
        if digest is not None and digest != self._identified[0]:
            self._identified = digest, ""
            with contextlib.suppress(OcmmError):
                record = load_named(self._folder, digest, CameraRecord)
                serials = ", ".join(sorted(str(camera.serial) for camera in record.cameras))
                practice = f"{PRACTICE} " if is_practice(record.made_by) else ""
                self._identified = digest, f"{practice}cameras {serials}"
        return "" if digest is None else self._identified[1]

    def _doubts(self, reason: str, utc: str) -> Sequence[Event]:
        digest, last = self.active_hash, self.events[-1].utc
        return () if digest is None else (
            Event(
                utc=utc, kind=EventKind.SUSPECTED, calibration=digest,
                since_utc=last, who=THIS_COMPUTER, reason=reason,
            ),
        )  # fmt: skip
