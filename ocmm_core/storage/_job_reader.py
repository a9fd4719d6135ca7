"""All that is read of an open job file."""

from __future__ import annotations

import contextlib
import sqlite3
import threading
from collections.abc import Iterator
from pathlib import Path

from ocmm_core.errors import StorageError
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.part_model import PartModel
from ocmm_core.seals import KeyFolder
from ocmm_core.storage._audit import AuditedStep, find_faults, read_audit, read_links
from ocmm_core.storage._faults import FAULTS, storage_error
from ocmm_core.storage._guard import GuardedConnection, with_log
from ocmm_core.storage._job_seal import JobSeal, check_line, read_seal, remember_job
from ocmm_core.storage._job_steps import JobStep, read_steps
from ocmm_core.storage._rows import JobEvent, JobHead, JobReference
from ocmm_core.storage._tables import (
    Observed,
    next_number,
    stored_events,
    stored_observations,
    stored_part,
    stored_points,
    stored_reference,
    stored_times,
)

NAMED = "named"
"""Kind of the event with the name of the job; the first one counts."""


class JobReader:
    """Contents of an open job; for any thread: one lock guards the connection.

    A call waits at most for one commit of another thread (milliseconds; as long as the disk takes).
    """

    def __init__(self, path: Path, db: GuardedConnection, head: JobHead) -> None:
        self.path = path
        """Where the file is."""
        self.head = head
        """What the job says about itself."""
        self.left_out = db.left_out
        """What of the file is in no complete step, as a sentence; empty if there is nothing."""
        self._db: GuardedConnection | None = db
        self._lock = threading.Lock()
        self._name: str | None = None

    def content(self) -> bytes:
        """Return the bytes of the file with all that is stored, without a log."""
        with self._reading() as db:
            return with_log(db.serialize())

    @property
    def name(self) -> str:
        """Return the name that the job was given when it was made, whatever its file is called now.

        That of its file for jobs of earlier versions, which did not store it.
        """
        if self._name is None:
            with self._reading() as db:
                row = db.execute(
                    "SELECT text FROM event WHERE kind = ? ORDER BY id LIMIT 1", (NAMED,)
                ).fetchone()
            self._name = self.path.stem if row is None else str(row[0])
        return self._name

    def points(self) -> list[MeasuredPoint]:
        """Return the points that are not annulled, in the order in which they were taken.

        Raises
        ------
        StorageError
            An observation is not the one that was stored; `verify` says more.
        """
        with self._reading() as db:
            return stored_points(db, self.path, annulled=False)

    def observed(self) -> list[Observed]:
        """Return when each point was observed and stored, also annulled ones, by number.

        Much cheaper than `points`, which look at what was observed.

        Raises
        ------
        StorageError
            A time of one is none.
        """
        with self._reading() as db:
            return stored_observations(db, self.path)

    def annulled(self) -> list[tuple[MeasuredPoint, str]]:
        """Return the points that are annulled, and why each is; StorageError as `points`."""
        with self._reading() as db:
            points = stored_points(db, self.path, annulled=True)
            reasons = dict(db.execute("SELECT number, reason FROM annulment").fetchall())
        return [(point, reasons[point.number]) for point in points]

    def steps(self, after: int = 0, most: int = 256) -> list[JobStep]:
        """Return what became durable after audit row ``after``, oldest first: see `read_steps`."""
        with self._reading() as db:
            return read_steps(db, self.path, after, most)

    def reference(self) -> JobReference | None:
        """Return the reference body that the points are relative to, or None.

        Raises
        ------
        StorageError
            It is not the one that was stored; `verify` says more.
        """
        with self._reading() as db:
            return stored_reference(db, self.path)

    def part(self) -> PartModel | None:
        """Return the nominal part, or None; StorageError where it is not as it was stored."""
        with self._reading() as db:
            return stored_part(db, self.path)

    def taken_utc(self) -> dict[int, str]:
        """Return when each point was stored, also annulled ones: ISO 8601 text by number."""
        with self._reading() as db:
            return stored_times(db, self.path)

    def events(self) -> list[JobEvent]:
        """Return what happened, oldest first."""
        with self._reading() as db:
            return stored_events(db, self.path)

    def next_number(self) -> int:
        """Return the number of the next point; numbers of annulled points are not used again."""
        with self._reading() as db:
            return next_number(db)

    def verify(self, seal: JobSeal | None = None) -> list[str]:
        """Return one sentence for every fault of the file against its audit chain and signature.

        Parameters
        ----------
        seal
            Of this job as the computer judged it that asks; None: judged by the keys known here.
        """
        with self._reading() as db:
            return [*find_faults(db), *(seal or self._sealed(db)).doubts]

    def seal(self, keys: KeyFolder | None = None) -> JobSeal:
        """Return how far the job goes, and who signed it by the keys known here, or by others."""
        with self._reading() as db:
            return self._sealed(db, keys)

    def audited(self) -> list[AuditedStep]:
        """Return everything that was ever stored, oldest first."""
        with self._reading() as db:
            return read_audit(db)

    def links(self) -> dict[int, str]:
        """Return the hash of every row of the audit by its number: what a later copy goes on."""
        with self._reading() as db:
            return read_links(db)

    def check_line(self, line: str) -> str:
        """Return in a sentence what the line of a report proves; errors as `check_line`."""
        with self._reading() as db:
            return check_line(db, self.head.job_uuid, line, KeyFolder())

    def note_seen(self, place: Path, seal: JobSeal | None = None) -> None:
        """Let this station remember how far the job goes, where it lies at ``place``.

        Parameters
        ----------
        seal
            Of this job, where the caller has just asked for it.
        """
        seal = seal or self.seal()
        if not seal.doubts:
            remember_job(seal.job_uuid, seal.steps, seal.head, place)

    @contextlib.contextmanager
    def _reading(self) -> Iterator[GuardedConnection]:
        with self._lock:
            if self._db is None:
                raise StorageError(
                    "job.closed", f"{self.path}: the job is closed.", "Open the job again."
                )
            self._db.renew()
            try:
                yield self._db
            except FAULTS as error:
                raise storage_error(self.path, error) from error

    def _sealed(self, db: sqlite3.Connection, keys: KeyFolder | None = None) -> JobSeal:
        return read_seal(db, self.path, self.head.job_uuid, keys or KeyFolder())
