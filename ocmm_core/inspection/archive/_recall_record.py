"""The document of a recall: which verdicts change, hold or cannot be known, and what it rests on.

It is a sealed record (`calibration.sealed`) in the store of the calibration that it is about, and
the chain of events of that calibration names it: nobody can change what was decided, or take it for
a decision about other points. Job files are never written to.
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
    """What a recall found of a verdict, and so of a job."""

    HOLDS = "HOLDS"
    CHANGES = "CHANGES"
    UNKNOWN = "CANNOT BE KNOWN"


class RecalledValue(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A value as it was stated, or as it is stated now."""

    value: float | None
    expanded: float | None
    """`value`, `expanded`: mm or in the unit of the characteristic, and U (95 %); None where there
    is none."""
    verdict: str
    """Without regard to the doubt that the recall is about."""


class RecalledCharacteristic(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What became of one characteristic."""

    name: str
    before: RecalledValue
    after: RecalledValue | None
    """`before`, `after`: By the calibration of the job, and by what its spots speak for; ``after``
    is None where that is not known."""
    outcome: Outcome
    reason: str
    """`outcome`, `reason`: And why, in a sentence."""
    released: bool
    """The value that the job states may be used as it is."""


class RecalledJob(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True
):
    """What became of one job."""

    path: str
    sha256: str
    """`path`, `sha256`: The file, and the hash of its content when it was read."""
    job_uuid: str
    part: str
    serial: str
    created_utc: str
    """`job_uuid`, `part`, `serial`, `created_utc`: Of its head."""
    rig: str
    calibration: str
    """`rig`, `calibration`: What it was measured with, and the hash of that record."""
    in_doubt: tuple[int, ...]
    """Numbers of the points that the history puts in doubt."""
    why: tuple[str, ...]
    """What put them in doubt, a sentence each."""
    later: str
    """Hash of the calibration that it was computed with; empty where there was none to use."""
    judgement: str
    """What the spots speak for, in a sentence."""
    characteristics: tuple[RecalledCharacteristic, ...]
    """In the order of the plan."""
    released: tuple[int, ...]
    """Numbers of the points that count again."""
    points_sha256: str
    """Of those points (`points_digest`)."""
    simulated: bool = False
    """Its points come from a virtual rig: no real part was measured. Not written where it is not
    so, because recalls of earlier versions, which lack it, keep their hash by that."""
    name: str = ""
    """Name of the job in its file; empty if the file has that name, and in earlier versions."""

    @property
    def label(self) -> str:
        """Return the name of the job, with that of its file if it differs."""
        file = Path(self.path)
        return f"{self.name} ({file.name})" if self.name else file.stem

    @property
    def outcome(self) -> Outcome:
        """Return that of the job: CHANGES where any verdict does, HOLDS where all hold."""
        found = {one.outcome for one in self.characteristics}
        if Outcome.CHANGES in found:
            return Outcome.CHANGES
        return Outcome.HOLDS if found == {Outcome.HOLDS} else Outcome.UNKNOWN


class RecallRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One recall."""

    schema: str
    """`SCHEMA`."""
    made_utc: str
    made_by: str
    software: str
    """`made_utc`, `made_by`, `software`: When, by whom (empty for a trial, which decides nothing)
    and with which version."""
    folders: tuple[str, ...]
    """Where jobs were looked for."""
    looked_at: int
    """How many job files were opened."""
    jobs: tuple[RecalledJob, ...]
    """Those that are touched."""
    unread: tuple[str, ...]
    """Files that could not be judged, a sentence each."""

    def count(self, outcome: Outcome) -> int:
        """Return how many jobs came out so."""
        return sum(job.outcome is outcome for job in self.jobs)

    def count_verdicts(self, outcome: Outcome) -> int:
        """Return how many characteristics came out so."""
        return sum(one.outcome is outcome for job in self.jobs for one in job.characteristics)


def points_digest(points: Sequence[MeasuredPoint], numbers: Collection[int]) -> str:
    """Return the SHA-256 of the observations with these numbers, as far as they are there."""
    state = hashlib.sha256()
    for point in sorted(points, key=lambda point: point.number):
        if point.number in numbers:
            state.update(f"{point.number} {point.feature} {point.time_s!r} ".encode())
            for array in (point.spots, point.tip_world, point.direction):
                state.update(np.ascontiguousarray(array, dtype="<f8").tobytes())
    return state.hexdigest()


def points_released(store: CalibrationStore, calibration: str, job: JobFile) -> frozenset[int]:
    """Return the points of a job that the last recall about it has released.

    Parameters
    ----------
    calibration
        Hash of the record that the points were taken with.

    Raises
    ------
    CalibrationError
        The record of a recall is missing or was changed.
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
    """Return whether something became known after a recall that it did not reckon with."""
    against = (EventKind.FAILED, EventKind.SUSPECTED, EventKind.FALLEN)
    return any(
        (one.calibration == job.calibration and one.kind in against)
        or (one.calibration == job.later and one.kind is EventKind.FALLEN)
        for one in since
    )
