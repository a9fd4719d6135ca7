"""Head, events and number of points of a job file, for lists."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.storage._connection import connection_in_memory
from ocmm_core.storage._faults import damaged
from ocmm_core.storage._job_content import read_job
from ocmm_core.storage._rows import JobEvent, JobHead, event_fault
from ocmm_core.storage._tables import stored_head


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
        head = stored_head(db, path)
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
