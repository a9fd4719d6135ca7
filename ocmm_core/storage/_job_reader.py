"""Contents of an open job file, points and annulments in the order in which they became durable.

For lists: its head, events and number of points alone.
"""

from __future__ import annotations

import contextlib
import sqlite3
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from ocmm_core.errors import StorageError
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.part_model import PartModel
from ocmm_core.seals import KeyFolder, KnownEnd
from ocmm_core.storage import _audit as audit
from ocmm_core.storage import _tables as tables
from ocmm_core.storage._connection import connection_in_memory
from ocmm_core.storage._faults import FAULTS, damaged, storage_error
from ocmm_core.storage._guard import GuardedConnection, with_log
from ocmm_core.storage._job_content import read_job
from ocmm_core.storage._job_seal import JobSeal, check_line, read_seal, recalled_end, remember_job
from ocmm_core.storage._rows import (
    JobEvent,
    JobHead,
    JobReference,
    event_fault,
    point_fault,
    point_from_row,
)

_COLUMNS = ",".join(audit.AUDITED["observation"])


@dataclass(frozen=True, slots=True)
class JobStep:
    """A point that was stored, or one that was annulled."""

    sequence: int
    """Row of the audit."""
    number: int
    point: MeasuredPoint | None
    """As stored, without the spots of a reference body; None for an annulment."""


def read_steps(db: sqlite3.Connection, path: Path, after: int, most: int) -> list[JobStep]:
    """Return the first ``most`` points and annulments after a row of the audit, oldest first.

    Its cost is that of the returned steps, for any length of the job: followers continue from their
    last row. Raises StorageError if a point differs from the stored one.
    """
    rows = db.execute(
        "SELECT sequence, subject, key, content_sha256 FROM audit "
        "WHERE sequence > ? AND subject IN ('observation', 'annulment') "
        "ORDER BY sequence LIMIT ?",
        (after, most),
    ).fetchall()
    stored = [key for _, subject, key, _ in rows if subject == "observation"]
    if not stored:
        return [JobStep(sequence, key, None) for sequence, _, key, _ in rows]
    observed = db.execute(
        f"SELECT {_COLUMNS} FROM observation WHERE number BETWEEN ? AND ?",  # noqa: S608 - constants
        (stored[0], stored[-1]),
    )
    points = {row[0]: row for row in observed}
    for key, content in ((key, text) for _, subject, key, text in rows if subject == "observation"):
        if key not in points or audit.digest_row(points[key]) != content:
            raise damaged(path, f"point {key} was changed after it was stored")
    fault = point_fault([points[key] for key in stored])
    if fault:
        raise damaged(path, fault)
    return [
        JobStep(sequence, key, point_from_row(points[key]) if subject == "observation" else None)
        for sequence, subject, key, _ in rows
    ]


NAMED = "named"
"""Event with the name of the job; the first one counts."""


class JobReader:
    """Reads an open job file. Thread-safe: one lock guards the connection.

    A call waits at most for one commit of another thread (milliseconds; as long as the disk takes).
    """

    def __init__(self, path: Path, db: GuardedConnection, head: JobHead) -> None:
        self.path = path
        self.head = head
        self.left_out = db.left_out
        """Content outside complete steps, as a sentence; empty if none."""
        self._db: GuardedConnection | None = db
        self._lock = threading.Lock()
        self._name: str | None = None
        self.known_end: Callable[[], KnownEnd | None] = partial(recalled_end, head.job_uuid)
        """Return the end in the station's memory by which the job is judged."""

    def content(self) -> bytes:
        """Return the bytes of the file with all that is stored, without a log."""
        with self._reading() as db:
            return with_log(db.serialize())

    @property
    def name(self) -> str:
        """Return the original name of the job; of jobs without one, that of the file."""
        if self._name is None:
            with self._reading() as db:
                row = db.execute(
                    "SELECT text FROM event WHERE kind = ? ORDER BY id LIMIT 1", (NAMED,)
                ).fetchone()
            self._name = self.path.stem if row is None else str(row[0])
        return self._name

    def points(self) -> list[MeasuredPoint]:
        """Return valid points in order; StorageError: an observation differs, see `verify`."""
        with self._reading() as db:
            return tables.stored_points(db, self.path, annulled=False)

    def observed(self) -> list[tables.Observed]:
        """Return times of observation and storage of each point, also annulled ones, by number.

        Much cheaper than `points`, which check the observations. StorageError: a time is invalid.
        """
        with self._reading() as db:
            return tables.stored_observations(db, self.path)

    def annulled(self) -> list[tuple[MeasuredPoint, str]]:
        """Return the annulled points with reasons; StorageError as `points`."""
        with self._reading() as db:
            points = tables.stored_points(db, self.path, annulled=True)
            reasons = dict(db.execute("SELECT number, reason FROM annulment").fetchall())
        return [(point, reasons[point.number]) for point in points]

    def steps(self, after: int = 0, most: int = 256) -> list[JobStep]:
        """Return the durable steps after audit row ``after``, oldest first: see `read_steps`."""
        with self._reading() as db:
            return read_steps(db, self.path, after, most)

    def reference(self) -> JobReference | None:
        """Return the reference body, or None; StorageError if it differs from the stored one."""
        with self._reading() as db:
            return tables.stored_reference(db, self.path)

    def part(self) -> PartModel | None:
        """Return the nominal part, or None; StorageError if it was changed."""
        with self._reading() as db:
            return tables.stored_part(db, self.path)

    def taken_utc(self) -> dict[int, str]:
        """Return the storage time of each point, also annulled ones: ISO 8601 text by number."""
        with self._reading() as db:
            return tables.stored_times(db, self.path)

    def events(self) -> list[JobEvent]:
        """Return the events, oldest first."""
        with self._reading() as db:
            return tables.stored_events(db, self.path)

    def next_number(self) -> int:
        """Return the number of the next point; numbers of annulled points are not reused."""
        with self._reading() as db:
            return tables.next_number(db)

    def verify(self, seal: JobSeal | None = None) -> list[str]:
        """Return faults against audit chain and signature; `seal`: judged elsewhere, or None."""
        with self._reading() as db:
            return [*audit.find_faults(db), *(seal or self._sealed(db)).doubts]

    def seal(self, keys: KeyFolder | None = None) -> JobSeal:
        """Return the end of the job, and its signer by the trusted keys, or by ``keys``."""
        with self._reading() as db:
            return self._sealed(db, keys)

    def audited(self) -> list[audit.AuditedStep]:
        """Return all stored steps, oldest first."""
        with self._reading() as db:
            return audit.read_audit(db)

    def links(self) -> dict[int, str]:
        """Return the hash of every row of the audit by its number, which a later copy continues."""
        with self._reading() as db:
            return audit.read_links(db)

    def check_line(self, line: str) -> str:
        """Return the evidence of the line of a report, in a sentence; errors as `check_line`."""
        with self._reading() as db:
            return check_line(db, self.head.job_uuid, line, KeyFolder())

    def note_seen(self, place: Path, seal: JobSeal | None = None) -> None:
        """Store the end of the job at ``place`` in the station's memory if it is no earlier one."""
        seal = seal or self.seal()
        known = None if seal.doubts else recalled_end(seal.job_uuid)
        if not seal.doubts and (known is None or known.count <= seal.steps):
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
        return read_seal(db, self.path, self.head.job_uuid, keys or KeyFolder(), self.known_end)


@dataclass(frozen=True, slots=True)
class JobSummary:
    head: JobHead
    events: tuple[JobEvent, ...]
    """Oldest first."""
    n_points: int


def read_summary(path: Path) -> JobSummary:
    """Return the summary of a job, unchecked; StorageError as `read_job`, newer, or damaged."""
    content = read_job(path).file
    with connection_in_memory(path, content, whole=False) as db:
        head = tables.stored_head(db, path)
        events = tuple(_events(db, path, len(content)))
        # Counted in interruptible steps; the count of a whole table is not.
        (n_points,) = db.execute(
            "SELECT (SELECT count(*) FROM observation WHERE number > 0)"
            " - (SELECT count(*) FROM annulment WHERE number > 0)"
        ).fetchone()
        db.close()
    return JobSummary(head, events, n_points)


def _events(db: sqlite3.Connection, path: Path, left: int) -> Iterator[JobEvent]:
    """Yield events; StorageError if invalid, or over ``left`` bytes (cyclic pages never end)."""
    for row in db.execute("SELECT id, time_utc, kind, text FROM event ORDER BY id"):
        fault = event_fault(row)
        if fault:
            raise damaged(path, fault)
        _, time_utc, kind, text = row
        left -= len(time_utc) + len(kind) + len(text)
        if left < 0:
            raise damaged(path, "it has more events than it has room for")
        yield JobEvent(time_utc, kind, text)
