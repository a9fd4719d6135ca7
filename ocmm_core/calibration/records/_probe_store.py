"""History of a probe and its tips, and the status of the mounted tip.

Events (calibrated, qualified, checked, mounted, suspected) are appended to one chain file a probe.
The status of a tip follows from records and events alone, so it survives a crash.
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

from ocmm_core.calibration.records._events import TipEvent, TipEventKind, TipRecords, status_of_tip
from ocmm_core.calibration.records._probe_records import ProbeRecord, TipCheckRecord, TipRecord
from ocmm_core.calibration.records._record_store import THIS_COMPUTER, RecordStatus, RecordStore
from ocmm_core.calibration.records._records import Check
from ocmm_core.calibration.records._sealed import KeptFile, load_named, record_file, record_hash
from ocmm_core.calibration.records._usable import PRACTICE, is_practice
from ocmm_core.errors import CalibrationError, OcmmError

MONITOR = "monitor"
"""Author of automatic suspicions."""


_CHECK = 2
_RENEWALS = {TipEventKind.CALIBRATED: 0, TipEventKind.QUALIFIED: 1, TipEventKind.NOT_QUALIFIED: 1}
"""Index in `ProbeStore._renewals` that makes up for lost files of an event; default `_CHECK`."""


class ProbeStore(RecordStore[TipEvent]):
    """Records of a probe; one writer process, thread-safe; StorageError for a broken chain."""

    _renewals = (
        "calibrate the probe with this tip and qualify it",
        "qualify the tip",
        "run the quick tip check",
    )

    def __init__(self, folder: Path) -> None:
        self._identified = ("", "")
        super().__init__(folder, TipEvent)

    @property
    def tips(self) -> tuple[str, ...]:
        """Return the names of all calibrated tips, oldest first."""
        calibrated = (one.tip for one in self.events if one.kind is TipEventKind.CALIBRATED)
        return tuple(dict.fromkeys(calibrated))

    @property
    def mounted(self) -> str | None:
        """Return the name of the mounted tip, or None before the first."""
        placing = (TipEventKind.MOUNTED, TipEventKind.CALIBRATED)
        placed = (one.tip for one in reversed(self.events) if one.kind in placing)
        return next(placed, None)

    def active(self, tip: str) -> TipRecords | None:
        """Return a tip's records, None if uncalibrated; CalibrationError if lost or changed."""
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
        """Return calibrations of all tips, oldest first, no lost; CalibrationError if changed."""
        return self._loaded(self._named(TipEventKind.CALIBRATED), ProbeRecord)

    def qualifications(self) -> tuple[TipRecord, ...]:
        """Return all qualifications, also failed ones; lost ones and errors as `calibrations`."""
        return self._loaded(
            self._named(TipEventKind.QUALIFIED, TipEventKind.NOT_QUALIFIED), TipRecord
        )

    def checks(self) -> tuple[TipCheckRecord, ...]:
        """Return all quick checks, oldest first; lost ones and errors as `calibrations`."""
        return self._loaded(self._named(TipEventKind.PASSED, TipEventKind.FAILED), TipCheckRecord)

    def calibrate(
        self, record: ProbeRecord, who: str, reason: str, now: datetime, session: Path | None = None
    ) -> str:
        """Store a calibration, put it in force with its tip mounted; return its hash.

        SUSPECT until qualified. The event lists lost files of this tip, which are no longer
        required.
        """
        return self._keep(TipEventKind.CALIBRATED, record, who, reason, now, session)

    def qualify(self, record: TipRecord, now: datetime, session: Path | None = None) -> str:
        """Store a qualification, also a failed one, and return its hash.

        CalibrationError unless it belongs to the calibration in force of that tip.
        """
        self._require(record.tip, record.calibration)
        kind = TipEventKind.QUALIFIED if record.passed else TipEventKind.NOT_QUALIFIED
        return self._keep(kind, record, record.made_by, _said(record.checks), now, session)

    def check(self, record: TipCheckRecord, now: datetime, session: Path | None = None) -> str:
        """Store a quick check, also a failed one, and return its hash.

        CalibrationError unless it belongs to the records in force of that tip.
        """
        active = self._require(record.tip, record.calibration)
        if active.qualification is None or record.qualification != record_hash(
            active.qualification
        ):
            raise _other(record.tip)
        kind = TipEventKind.PASSED if record.passed else TipEventKind.FAILED
        return self._keep(kind, record, record.made_by, _said(record.checks), now, session)

    def mount(self, tip: str, who: str, now: datetime) -> None:
        """Record a mounted tip, to be checked; CalibrationError if never calibrated."""
        if tip not in self.tips:
            raise _never(tip)
        self._happened(now, who, "Mounted.", kind=TipEventKind.MOUNTED, tip=tip)

    def doubt(self, who: str, reason: str, since: datetime, now: datetime) -> None:
        """Mark the mounted tip SUSPECT since a moment, until it is checked."""
        tip = self.mounted
        if tip is not None:
            self._happened(now, who, reason, since=since, kind=TipEventKind.DOUBTED, tip=tip)

    def status(self, tip: str, now: datetime) -> RecordStatus:
        """Return a tip's status, all files re-read; CalibrationError if uncalibrated, changed."""
        active = self.active(tip)
        if active is None:
            raise _never(tip)
        return self.status_of(active, now, thorough=True)

    def status_of(self, active: TipRecords, now: datetime, *, thorough: bool) -> RecordStatus:
        """Return the status of a tip, including the integrity of its evidence."""
        doubt = self._doubt(now, active.calibration.tip, thorough=thorough)
        return doubt or self._judged(now, lambda at: status_of_tip(active, self.events, at))

    def _files_of(self, event: TipEvent) -> Sequence[KeptFile]:
        return (*([record_file(event.record)] if event.record else []), *event.files)

    def _is_about(self, event: TipEvent, about: str | None) -> bool:
        return about is None or event.tip == about

    def _identity_of_thing(self) -> str:
        calibrated = (
            one.record for one in reversed(self.events) if one.kind is TipEventKind.CALIBRATED
        )
        digest = next(calibrated, "")
        if digest and digest != self._identified[0]:
            self._identified = digest, ""
            with contextlib.suppress(OcmmError):
                record = load_named(self._folder, digest, ProbeRecord)
                practice = f"{PRACTICE} " if is_practice(record.made_by) else ""
                self._identified = digest, f"{practice}probe {record.probe_identity[:16]}"
        return self._identified[1] if digest else ""

    def _doubts(self, reason: str, utc: str) -> Sequence[TipEvent]:
        last = self.events[-1].utc
        return [
            TipEvent(
                utc=utc, kind=TipEventKind.DOUBTED, tip=tip, since_utc=last,
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
        return tuple(dict.fromkeys(one.record for one in self.events if one.kind in kinds))

    def _last(self, tip: str, kind: TipEventKind) -> str | None:
        found = (one.record for one in reversed(self.events) if one.tip == tip and one.kind is kind)
        return next(found, None)

    def _keep(
        self,
        kind: TipEventKind,
        record: ProbeRecord | TipRecord | TipCheckRecord,
        who: str,
        reason: str,
        now: datetime,
        session: Path | None,
    ) -> str:
        digest = record_hash(record)
        self._put(
            record, now, who, reason, renewal=_RENEWALS.get(kind, _CHECK), about=record.tip,
            session=session, kind=kind, tip=record.tip, record=digest,
        )  # fmt: skip
        return digest

    def _renewed_by(self, event: TipEvent) -> int:
        return _RENEWALS.get(event.kind, _CHECK)


def _said(checks: Sequence[Check]) -> str:
    """Return the number of checks and the one closest to, or farthest beyond, its limit."""
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
        f"This does not belong to the active calibration of tip '{tip}'.",
        "Repeat it with the active calibration.",
    )
