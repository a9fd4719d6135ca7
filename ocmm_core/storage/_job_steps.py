"""Points and annulments of a job file in the order in which they became durable."""

from __future__ import annotations

import sqlite3
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage._audit import AUDITED, digest_row
from ocmm_core.storage._checks import point_fault
from ocmm_core.storage._faults import damaged
from ocmm_core.storage._rows import point_from_row

_COLUMNS = ",".join(AUDITED["observation"])


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
        if key not in points or digest_row(points[key]) != content:
            raise damaged(path, f"point {key} was changed after it was stored")
    fault = point_fault([points[key] for key in stored])
    if fault:
        raise damaged(path, fault)
    return [
        JobStep(sequence, key, point_from_row(points[key]) if subject == "observation" else None)
        for sequence, subject, key, _ in rows
    ]
