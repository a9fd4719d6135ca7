"""Read unaltered rows of a job file, insert them within a transaction of the caller."""

from __future__ import annotations

import sqlite3
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

from ocmm_core.errors import InputError, StorageError
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.part_model import PartModel, model_from_bytes, model_to_bytes
from ocmm_core.storage import _audit as audit
from ocmm_core.storage._faults import damaged
from ocmm_core.storage._rows import (
    JobEvent,
    JobHead,
    JobReference,
    beside_fault,
    event_fault,
    head_fault,
    head_from_row,
    point_fault,
    point_from_row,
    reference_fault,
    reference_from_row,
    reference_row_from_point,
    row_from_point,
    row_from_reference,
    spots_from,
    stamp_fault,
)

CLOCK = "clock"
"""Kind of the event that reports that the clock of the computer was set back."""
_CLOCK_TOLERANCE = timedelta(seconds=60)
"""Corrections of a clock are smaller; smaller steps back are not reported."""
_POINT_COLUMNS = ",".join(audit.AUDITED["observation"])
_OBSERVED = (int, float, int, int)


@dataclass(frozen=True, slots=True)
class Observed:
    """Time of a point by its frames, and ISO 8601 time of storage; ``annulled`` is 0 or 1."""

    number: int
    time_s: float
    first_frame: int
    last_frame: int
    stored_utc: str
    annulled: int


def stored_head(db: sqlite3.Connection, path: Path) -> JobHead:
    """Return the head; StorageError if missing."""
    statement = f"SELECT {','.join(audit.AUDITED['head'])} FROM head"  # noqa: S608 - constants
    row = db.execute(statement).fetchone()
    if row is None:
        raise damaged(path, "it has no head")
    fault = head_fault(row)
    if fault:
        raise damaged(path, fault)
    return head_from_row(row)


def stored_events(db: sqlite3.Connection, path: Path) -> list[JobEvent]:
    """Return the events, oldest first; StorageError if a row is invalid."""
    rows = db.execute("SELECT id, time_utc, kind, text FROM event ORDER BY id").fetchall()
    fault = next(filter(None, map(event_fault, rows)), "")
    if fault:
        raise damaged(path, fault)
    return [JobEvent(*row[1:]) for row in rows]


def stored_times(db: sqlite3.Connection, path: Path) -> dict[int, str]:
    """Return the ISO 8601 storage times of all points by number, also of annulled ones."""
    rows = db.execute(
        "SELECT key, time_utc FROM audit WHERE subject = 'observation' ORDER BY key"
    ).fetchall()
    fault = next(filter(None, (stamp_fault("point", *row) for row in rows)), "")
    if fault:
        raise damaged(path, fault)
    return {int(number): text for number, text in rows}


def stored_points(db: sqlite3.Connection, path: Path, *, annulled: bool) -> list[MeasuredPoint]:
    """Return the annulled or the other points, oldest first; StorageError if altered."""
    # The plus sign keeps SQLite from reading the whole audit for each annulled point.
    among = f"+number {'IN' if annulled else 'NOT IN'} (SELECT number FROM annulment)"  # noqa: S608 - constants
    rows = db.execute(
        f"SELECT {_POINT_COLUMNS}, content_sha256 FROM observation "  # noqa: S608 - constants
        "LEFT JOIN audit ON subject = 'observation' AND key = number "
        f"WHERE {among} ORDER BY number"
    ).fetchall()
    beside = db.execute(
        "SELECT number, spots_shape, spots, content_sha256 FROM reference_observation "  # noqa: S608 - constants
        "LEFT JOIN audit ON subject = 'reference_observation' AND key = number "
        f"WHERE {among}"
    ).fetchall()
    for *row, content in (*rows, *beside):
        if audit.digest_row(row) != content:
            raise damaged(path, f"point {row[0]} was changed after it was stored")
    fault = point_fault(rows) or beside_fault(beside)
    if fault:
        raise damaged(path, fault)
    spots = {number: spots_from(shape, blob) for number, shape, blob, _ in beside}
    points = [point_from_row(row) for *row, _ in rows]
    if not spots:
        return points
    return [replace(point, reference_spots=spots.get(point.number)) for point in points]


def stored_observations(db: sqlite3.Connection, path: Path) -> list[Observed]:
    """Return the times of all points by number, unchecked (see `stored_points`)."""
    rows = db.execute(
        "SELECT number, observation.time_s, first_frame, last_frame, audit.time_utc,"
        " number IN (SELECT number FROM annulment) FROM observation"
        " LEFT JOIN audit ON subject = 'observation' AND key = number ORDER BY number"
    ).fetchall()
    for row in rows:
        if tuple(map(type, row[:4])) != _OBSERVED:
            raise damaged(path, f"point {row[0]} was changed after it was stored")
        fault = stamp_fault("point", row[0], row[4])
        if fault:
            raise damaged(path, fault)
    return [Observed(*row) for row in rows]


def insert_point(db: sqlite3.Connection, path: Path, point: MeasuredPoint) -> None:
    """Store a point; StorageError where its number is not new or a value is not finite."""
    expected = next_number(db)
    if point.number < expected:
        raise StorageError(
            "job.number",
            f"{path}: point number {point.number} comes after number {expected - 1}.",
            "Take the point again; every point needs a new number.",
        )
    row, beside = row_from_point(point), reference_row_from_point(point)
    audit.insert_audited(db, "observation", row)
    if beside is not None:
        audit.insert_audited(db, "reference_observation", beside)
    # Rolls back the transaction of the caller: a row that could not be read again is not stored.
    fault = point_fault([row]) or (beside_fault([beside]) if beside is not None else "")
    if fault:
        raise StorageError("job.point", f"{path}: {fault}.", "Take the point again.")


def insert_annulment(db: sqlite3.Connection, path: Path, number: int, reason: str) -> None:
    """Annul a point; StorageError if it is unknown or annulled already."""
    known = db.execute(
        "SELECT (SELECT count(*) FROM observation WHERE number = ?1),"
        " (SELECT count(*) FROM annulment WHERE number = ?1)",
        (int(number),),
    ).fetchone()
    if known != (1, 0):
        fault = "is already annulled" if known[0] else "is not in the job"
        raise StorageError(
            "job.annulled", f"{path}: point {number} {fault}.", "Choose another point."
        )
    audit.insert_audited(db, "annulment", (int(number), audit.step_utc(db), reason))


def insert_event(db: sqlite3.Connection, kind: str, text: str) -> None:
    number = db.execute("SELECT coalesce(max(id), 0) + 1 FROM event").fetchone()[0]
    audit.insert_audited(db, "event", (number, audit.step_utc(db), kind, text))


def note_clock(db: sqlite3.Connection) -> None:
    """Store an event if the clock was set back since the last step; once for each time."""
    last, now = audit.last_step_utc(db), audit.now_utc()
    if not last or datetime.fromisoformat(last) - datetime.fromisoformat(now) <= _CLOCK_TOLERANCE:
        return
    told = db.execute("SELECT 1 FROM event WHERE kind = ? AND time_utc = ?", (CLOCK, last))
    if told.fetchone() is None:
        insert_event(
            db,
            CLOCK,
            f"The clock of this computer says {now[:19]}, which is before the last step of the job "
            f"({last[:19]} UTC). Until it is past that again, steps have the time of that one.",
        )


def next_number(db: sqlite3.Connection) -> int:
    """Return the number of the next point; those of annulled points are not used again."""
    return int(db.execute("SELECT coalesce(max(number), 0) + 1 FROM observation").fetchone()[0])


def insert_reference(db: sqlite3.Connection, path: Path, reference: JobReference) -> None:
    """Store the reference body; StorageError if the job has one already."""
    if db.execute("SELECT count(*) FROM reference").fetchone()[0]:
        raise StorageError(
            "job.reference",
            f"{path}: the job already has a reference body.",
            "Start a new job for another one.",
        )
    audit.insert_audited(db, "reference", row_from_reference(reference))


def stored_reference(db: sqlite3.Connection, path: Path) -> JobReference | None:
    """Return the reference body or None; StorageError if it was altered."""
    stored = _only_row(db, path, "reference", "the reference body was changed after it was stored")
    if stored is None:
        return None
    fault = reference_fault(stored)
    if fault:
        raise damaged(path, fault)
    return reference_from_row(stored)


def _only_row(db: sqlite3.Connection, path: Path, table: str, changed: str) -> list[Any] | None:
    """Return the single row of a table or None; StorageError, as ``changed``, if altered."""
    row = db.execute(
        f"SELECT {','.join(audit.AUDITED[table])}, content_sha256 FROM {table} "  # noqa: S608 - constants
        f"LEFT JOIN audit ON subject = '{table}' AND key = id"
    ).fetchone()
    if row is None:
        return None
    *stored, content = row
    if audit.digest_row(stored) != content:
        raise damaged(path, changed)
    return list(stored)


def insert_part(db: sqlite3.Connection, path: Path, part: PartModel) -> None:
    """Store the nominal part; StorageError if the job has one already."""
    if db.execute("SELECT count(*) FROM part").fetchone()[0]:
        raise StorageError(
            "job.part", f"{path}: the job already has a part.", "Start a new job for another one."
        )
    row = (1, part.source_name, part.source_sha256, model_to_bytes(part))
    audit.insert_audited(db, "part", row)


def stored_part(db: sqlite3.Connection, path: Path) -> PartModel | None:
    """Return the nominal part or None; StorageError if it was altered."""
    stored = _only_row(db, path, "part", "the part was changed after it was stored")
    if stored is None:
        return None
    try:
        part = model_from_bytes(stored[3], str(path))
    except InputError as error:
        raise StorageError("job.part", error.what, "Restore the job from a good copy.") from error
    if (part.source_name, part.source_sha256) != (stored[1], stored[2]):
        raise damaged(path, "the part in it says that it is of another model")
    return part
