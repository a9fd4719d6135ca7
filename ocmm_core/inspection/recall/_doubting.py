"""Jobs that are suspect because of their calibration, and the calibration to recalculate them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from ocmm_core.calibration.records import (
    CalibrationStore,
    CameraRecord,
    default_probe_folder,
    record_hash,
    store_folder,
)
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.inspection.archive import (
    CameraHistory,
    KnownOfJob,
    StoredDocuments,
    ask_tip,
    first_stored,
    is_known,
    known_alone,
    known_here,
    points_in_doubt,
)
from ocmm_core.inspection.recall._recall_job import DoubtedJob, Later
from ocmm_core.seals import KeptKeys
from ocmm_core.storage import JobFile


class Doubting:
    """Suspect jobs, by the histories of one folder. `now`: time of the query."""

    def __init__(self, calibrations: Path, probes: Path | None, now: datetime) -> None:
        self._calibrations, self._probes, self._now = calibrations, probes, now
        self._keys = KeptKeys()
        self._stores: dict[str, CalibrationStore] = {}
        self._laters: dict[tuple[str, str], Later] = {}

    def knows(self, rig: str, calibration: str) -> bool:
        try:
            return is_known(self._store(rig).events, calibration)
        except InputError:
            return False

    def of_file(self, path: Path) -> DoubtedJob | None:
        """Return a job with suspect points, or None; OcmmError if job or history is unreadable."""
        with JobFile.read(path) as job:
            return self._of(path, job, lambda store: known_here(
                job, path, self._probes, self._calibrations, store, self._keys
            ))  # fmt: skip

    def of_content(self, path: Path, content: bytes) -> DoubtedJob | None:
        """Return a job of any computer by the bytes of its file, called `path`; as `of_file`."""
        with JobFile.in_memory(path, content) as job:
            return self._of(path, job, lambda _: replace(
                known_alone(job, self._keys),
                tip=ask_tip(
                    StoredDocuments(path, job.head).probe_records(),
                    self._probes or default_probe_folder(),
                ),
            ))  # fmt: skip

    def _of(
        self, path: Path, job: JobFile, asked: Callable[[CalibrationStore], KnownOfJob]
    ) -> DoubtedJob | None:
        # Regardless of earlier releases: the last recall decides about all points.
        record = StoredDocuments(path, job.head).camera_record()
        if record is None:
            return None
        store, used = self._store(record.rig), job.head.rig_identity
        events = store.events
        if not is_known(events, used):
            # Silence would mean that it is not suspect.
            raise InputError(
                "recall.unknown",
                f"{path}: its calibration {used[:12]} is not in the history of rig "
                f"'{record.rig}' in {self._calibrations}, so it is unknown here whether it failed.",
                "Give the calibration folder it was measured with.",
            )
        observed = job.observed()
        doubts = points_in_doubt(events, used, first_stored(observed))
        why = doubts.open | doubts.failed
        counts = [one.number for one in observed if not one.annulled]
        in_doubt = {number: why[number] for number in counts if number in why}
        if not in_doubt:
            # A changed point is reported in any case; in a suspect job each is checked at
            # recalculation.
            job.points()
            job.annulled()
            return None
        key = record.rig, record_hash(record)
        if key not in self._laters:
            self._laters[key] = later_than(store, record, self._now)
        known = asked(store)
        # A mark of an earlier recall must not prevent this one.
        cameras = CameraHistory(unread=known.cameras.unread)
        known = replace(known, cameras=cameras, held=())
        return DoubtedJob(path, self._laters[key], in_doubt, known)

    def _store(self, rig: str) -> CalibrationStore:
        if rig not in self._stores:
            self._stores[rig] = CalibrationStore(store_folder(self._calibrations, rig))
        return self._stores[rig]


def later_than(store: CalibrationStore, record: CameraRecord, now: datetime) -> Later:
    """Return the calibration in force, if verified and of these cameras, or why none."""
    try:
        later = store.active()
        if later is None or store.active_hash == record_hash(record):
            return Later(None, why_not="No later calibration: calibrate and verify first.")
        status = store.status(now)
    except OcmmError as error:
        return Later(None, why_not=error.what)
    if not status.state.usable:
        return Later(
            None, why_not=f"The active calibration cannot be used: {status.reason} {status.remedy}"
        )
    if _cameras(later) != _cameras(record):
        return Later(None, why_not="The active calibration belongs to other cameras.")
    # Residual noise of a calibration beyond that of the rig is no sign of a change.
    scale = max(record.chi2_per_dof, later.chi2_per_dof, 1.0) ** 0.5
    return Later(later, record_hash(later), scale=scale)


def _cameras(record: CameraRecord) -> list[tuple[str, int]]:
    return [(one.name, one.serial) for one in record.cameras]
