"""The audit chain of a job file: one hash-linked row for everything that was ever stored.

Each row holds the SHA-256 of what was stored and of the row before it, so that a row that was
changed, removed or slipped in shows up in `find_faults`. This reveals accidental and casual
change. Somebody who owns the file can still compute a whole new chain, or cut off its end: against
that only a copy of the last hash outside the file helps.
"""

from __future__ import annotations

import hashlib
import sqlite3
import struct
from collections.abc import Sequence
from datetime import UTC, datetime

Value = int | float | str | bytes
"""What a column can hold; nothing is ever NULL."""

AUDITED: dict[str, tuple[str, ...]] = {
    "head": (
        "id", "job_uuid", "created_utc", "software_version", "operator", "part", "serial",
        "plan_text", "plan_sha256", "rig_text", "rig_sha256", "probe_text", "probe_sha256",
    ),
    "observation": (
        "number", "feature", "time_s", "first_frame", "last_frame", "n_frames", "tip_world",
        "random_covariance", "direction", "tip_radius", "rotation_world_from_probe",
        "spots_shape", "spots", "chi2_per_dof", "approach",
    ),
    "annulment": ("number", "time_utc", "reason"),
    "event": ("id", "time_utc", "kind", "text"),
    "reference": ("id", "text", "sha256", "spots_shape", "spots", "n_frames"),
    "reference_observation": ("number", "spots_shape", "spots"),
}  # fmt: skip
"""The insert-only tables and the columns that their digests cover; the first one is the key."""

_FIRST_LINK = "0" * 64
_ENCODING = {int: b"i", float: b"f", str: b"s", bytes: b"b"}


def now_utc() -> str:
    """Return the present time as ISO 8601 text, UTC, microseconds."""
    return datetime.now(UTC).isoformat(timespec="microseconds")


def digest_row(values: Sequence[Value]) -> str:
    """Return the SHA-256 of a row; type and length of every value are part of it."""
    state = hashlib.sha256()
    for value in values:
        if isinstance(value, bytes):
            content = value
        elif isinstance(value, str):
            content = value.encode("utf-8")
        elif isinstance(value, float):
            content = struct.pack("<d", value)
        else:
            content = struct.pack("<q", value)
        state.update(_ENCODING[type(value)] + struct.pack("<Q", len(content)) + content)
    return state.hexdigest()


def insert_audited(db: sqlite3.Connection, table: str, values: Sequence[Value]) -> None:
    """Insert a row into one of the `AUDITED` tables, and its link into the chain.

    The caller holds a transaction, so that both are stored or none. The first value is the
    integer key of the row.
    """
    columns = AUDITED[table]
    marks = ",".join("?" * len(columns))
    statement = f"INSERT INTO {table} ({','.join(columns)}) VALUES ({marks})"  # noqa: S608 - constants of this module
    db.execute(statement, tuple(values))
    last = db.execute("SELECT sequence, hash FROM audit ORDER BY sequence DESC LIMIT 1").fetchone()
    sequence, previous = (last[0] + 1, last[1]) if last else (1, _FIRST_LINK)
    link = (sequence, now_utc(), table, values[0], digest_row(values), previous)
    db.execute("INSERT INTO audit VALUES (?, ?, ?, ?, ?, ?, ?)", (*link, digest_row(link)))


def find_faults(db: sqlite3.Connection) -> list[str]:
    """Return one sentence for everything in the file that does not agree with the chain."""
    faults: list[str] = []
    recorded: dict[tuple[str, int], str] = {}
    expected, previous = 1, _FIRST_LINK
    for *link, own_hash in db.execute("SELECT * FROM audit ORDER BY sequence"):
        sequence, _, table, key, content, linked = link
        if sequence != expected:
            faults.append(f"The audit jumps from row {expected - 1} to row {sequence}.")
        if linked != previous:
            faults.append(f"Audit row {sequence} does not follow from the row before it.")
        if own_hash != digest_row(link):
            faults.append(f"Audit row {sequence} was changed.")
        if (table, key) in recorded:
            faults.append(f"Audit row {sequence} records {table} {key} a second time.")
        recorded[(table, key)] = content
        expected, previous = sequence + 1, own_hash
    for table, columns in AUDITED.items():
        statement = f"SELECT {','.join(columns)} FROM {table} ORDER BY 1"  # noqa: S608 - constants of this module
        for row in db.execute(statement):
            content = recorded.pop((table, row[0]), None)
            if content is None:
                faults.append(f"The {table} {row[0]} is not in the audit.")
            elif content != digest_row(row):
                faults.append(f"The {table} {row[0]} was changed after it was stored.")
    faults += [f"The {table} {key} of the audit is missing." for table, key in recorded]
    return faults
