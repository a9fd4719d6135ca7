"""Head, events and number of points of a job file, read in place where nobody writes to it.

A file that was closed has no log beside it and is read as it is (SQLite, ``immutable``): no lock is
taken and nothing is written, so it may lie where nobody can write. What does not change while it is
looked at was not being written. SQLite itself opens it: were it opened and closed beside SQLite,
the locks that this same process may hold on it would be gone.
"""

from __future__ import annotations

import contextlib
import sqlite3
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.storage._checks import event_fault
from ocmm_core.storage._connection import require_size
from ocmm_core.storage._faults import FAULTS, damaged, no_job, storage_error
from ocmm_core.storage._guard import guarded_connection
from ocmm_core.storage._migrations import APPLICATION_ID
from ocmm_core.storage._rows import JobEvent, JobHead
from ocmm_core.storage._schema import require_schema
from ocmm_core.storage._tables import stored_head

_SETTLED_NS = 1_000_000_000
"""A file that was written more recently may be written again before its time of change differs."""


@dataclass(frozen=True, slots=True)
class JobSummary:
    """What is seen of a job at a glance."""

    head: JobHead
    """What the job says about itself."""
    events: tuple[JobEvent, ...]
    """What happened, oldest first."""
    n_points: int
    """How many points count."""


def read_summary(path: Path) -> JobSummary | None:
    """Return what is seen of a closed job file; None where somebody may be writing to it.

    Its audit and its pages are not looked at: it is only for lists.

    Raises
    ------
    StorageError
        The file is no job file, newer than this program, damaged or cannot be read.
    """
    before = settled_trace(path)
    if before is None:
        return None
    found = _read(path)
    return found if settled_trace(path) == before else None


def settled_trace(path: Path) -> tuple[int, int, int] | None:
    """Return what would change if somebody wrote; None while somebody may."""
    beside = [path.with_name(f"{path.name}{end}") for end in ("-wal", "-journal")]
    try:
        found = path.stat()
        if any(one.exists() for one in beside):
            return None
    except OSError:
        return None
    # A clock that was set back says nothing about when the file was written.
    if not 0 <= found.st_mtime_ns <= time.time_ns() - _SETTLED_NS:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino


def _read(path: Path) -> JobSummary:
    require_size(path)
    try:
        with contextlib.closing(guarded_connection(path, "ro&immutable=1")) as db:
            if int(db.execute("PRAGMA application_id").fetchone()[0]) != APPLICATION_ID:
                raise no_job(path)
            require_schema(db, path)
            head = stored_head(db, path)
            events = tuple(_events(db, path))
            # Counted by steps that can be ended; the count of a whole table cannot.
            (n_points,) = db.execute(
                "SELECT (SELECT count(*) FROM observation WHERE number > 0)"
                " - (SELECT count(*) FROM annulment WHERE number > 0)"
            ).fetchone()
    except FAULTS as error:
        raise storage_error(path, error) from error
    return JobSummary(head, events, n_points)


def _events(db: sqlite3.Connection, path: Path) -> Iterator[JobEvent]:
    """Yield what happened; StorageError where a row is none, or there is more than the file holds.

    Its pages are not looked at here, and one that stands in for many would give no end of rows.
    """
    left = path.stat().st_size
    for row in db.execute("SELECT id, time_utc, kind, text FROM event ORDER BY id"):
        fault = event_fault(row)
        if fault:
            raise damaged(path, fault)
        _, time_utc, kind, text = row
        left -= len(time_utc) + len(kind) + len(text)
        if left < 0:
            raise damaged(path, "it has more events than it has room for")
        yield JobEvent(time_utc, kind, text)
