"""Record of a recall: verdicts that change, hold or cannot be known, and the evidence.

Sealed (`calibration.sealed`) and named in its calibration's chain of events: decisions cannot be
altered, or applied to other points. Job files are never written.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Sequence
from enum import StrEnum
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.calibration.records import CalibrationStore, Event, EventKind, load_named
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage import JobFile

SCHEMA = "ocmm.recall/1"


class Outcome(StrEnum):
    """Outcome of a verdict, and so of a job."""

    HOLDS = "HOLDS"
    CHANGES = "CHANGES"
    UNKNOWN = "CANNOT BE KNOWN"


class RecalledValue(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A value as stated before or now."""

    value: float | None
    expanded: float | None
    """`value`, `expanded`: mm or the unit of the characteristic, and U (95 %), or None."""
    verdict: str
    """Without regard to the suspicion of the recall."""


class RecalledCharacteristic(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    name: str
    before: RecalledValue
    after: RecalledValue | None
    """`before`, `after`: By the job's calibration; by the one its spots support; or None."""
    outcome: Outcome
    reason: str
    """`outcome`, `reason`: And why, in a sentence."""
    released: bool
    """The value stated by the job may be used as it is."""


class RecalledJob(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True
):
    path: str
    sha256: str
    """`path`, `sha256`: The file, and the hash of its content when it was read."""
    job_uuid: str
    part: str
    serial: str
    created_utc: str
    rig: str
    calibration: str
    """`rig`, `calibration`: Name of the rig, and hash of the calibration of the job."""
    in_doubt: tuple[int, ...]
    """Numbers of the points that are suspect by the history."""
    why: tuple[str, ...]
    later: str
    """Hash of the later calibration used; empty if there was none."""
    judgement: str
    """Conclusion from the spots, in a sentence."""
    characteristics: tuple[RecalledCharacteristic, ...]
    """In the order of the plan."""
    released: tuple[int, ...]
    """Numbers of the points that count again."""
    points_sha256: str
    """Of those points (`points_digest`)."""
    simulated: bool = False
    """From a virtual rig: no real part was measured. Not written if false, so that recalls of
    earlier versions, which lack it, keep their hash."""
    name: str = ""
    """Name of the job in its file; empty if the file has that name, and in earlier versions."""

    @property
    def label(self) -> str:
        """Return the name of the job, with that of its file if it differs."""
        file = Path(self.path)
        return f"{self.name} ({file.name})" if self.name else file.stem

    @property
    def outcome(self) -> Outcome:
        """Return the outcome of the job: CHANGES if any verdict does, HOLDS if all hold."""
        found = {one.outcome for one in self.characteristics}
        if Outcome.CHANGES in found:
            return Outcome.CHANGES
        return Outcome.HOLDS if found == {Outcome.HOLDS} else Outcome.UNKNOWN


class RecallRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    schema: str
    made_utc: str
    made_by: str
    software: str
    """`made_utc`, `made_by`, `software`: Time, name (empty: undecided trial) and version."""
    folders: tuple[str, ...]
    looked_at: int
    """Number of opened job files."""
    jobs: tuple[RecalledJob, ...]
    unread: tuple[str, ...]
    """Files that could not be judged, a sentence each."""

    def count(self, outcome: Outcome) -> int:
        return sum(job.outcome is outcome for job in self.jobs)

    def count_verdicts(self, outcome: Outcome) -> int:
        """Return how many characteristics have an outcome."""
        return sum(one.outcome is outcome for job in self.jobs for one in job.characteristics)


def points_digest(points: Sequence[MeasuredPoint], numbers: Collection[int]) -> str:
    """Return the SHA-256 of the existing observations with these numbers."""
    state = hashlib.sha256()
    for point in sorted(points, key=lambda point: point.number):
        if point.number in numbers:
            state.update(f"{point.number} {point.feature} {point.time_s!r} ".encode())
            for array in (point.spots, point.tip_world, point.direction):
                state.update(np.ascontiguousarray(array, dtype="<f8").tobytes())
    return state.hexdigest()


def points_released(store: CalibrationStore, calibration: str, job: JobFile) -> frozenset[int]:
    """Return the points of a job released by the last recall about it.

    `calibration`: hash of the record of the points. CalibrationError if that of a recall is missing
    or was changed.
    """
    events = store.events
    for at in range(len(events) - 1, -1, -1):
        event = events[at]
        if event.kind is not EventKind.RECALLED or event.calibration != calibration:
            continue
        record = load_named(store.folder, event.evidence, RecallRecord)
        for found in record.jobs:
            if found.job_uuid == job.head.job_uuid and found.calibration == calibration:
                if _is_overtaken(events[at + 1 :], found):
                    return frozenset()
                same = points_digest(job.points(), found.released) == found.points_sha256
                return frozenset(found.released if same else ())
    return frozenset()


def _is_overtaken(since: Sequence[Event], job: RecalledJob) -> bool:
    against = (EventKind.FAILED, EventKind.SUSPECTED, EventKind.FALLEN)
    return any(
        (one.calibration == job.calibration and one.kind in against)
        or (one.calibration == job.later and one.kind is EventKind.FALLEN)
        for one in since
    )
