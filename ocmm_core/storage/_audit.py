"""Audit chain of a job file, and its versions as numbered migrations.

The chain has one hash-linked row for everything that was ever stored.

Each row holds the SHA-256 of the stored row and of the previous audit row: `find_faults` detects
changed, removed or inserted rows, but no new or truncated chain; see `_job_seal`.

Migration n takes version n - 1 (0: empty) to n, each after a backup in a separate transaction.
"""

from __future__ import annotations

import hashlib
import sqlite3
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from ocmm_core.documents import sql_statements, write_atomic
from ocmm_core.errors import StorageError

Value = int | float | str | bytes
"""Value of a column; never NULL."""

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
    "part": ("id", "source_name", "source_sha256", "content"),
}  # fmt: skip
"""Insert-only tables and the columns of their digests; the first one is the key."""

_FIRST_LINK = "0" * 64
_LENGTH, _FLOAT, _INT = struct.Struct("<Q"), struct.Struct("<d"), struct.Struct("<q")
_ENCODING = {int: b"i", float: b"f", str: b"s", bytes: b"b"}


def now_utc() -> str:
    """Return the current time as ISO 8601 text, UTC, microseconds."""
    return datetime.now(UTC).isoformat(timespec="microseconds")


def step_utc(db: sqlite3.Connection) -> str:
    """Return the time of the next step: now, or that of the last step if the clock is behind it.

    Times of a job never run backwards; a clock set back is an event (`note_clock`).
    """
    return max(now_utc(), last_step_utc(db))


def last_step_utc(db: sqlite3.Connection) -> str:
    """Return when the last step was stored; empty if none or invalid."""
    row = db.execute("SELECT time_utc FROM audit ORDER BY sequence DESC LIMIT 1").fetchone()
    text = "" if row is None else row[0]
    try:
        # Texts of this form compare as their times do.
        same = datetime.fromisoformat(text).isoformat(timespec="microseconds") == text
        return text if same and text.endswith("+00:00") else ""
    except (TypeError, ValueError):
        return ""


def digest_row(values: Sequence[Value]) -> str:
    """Return the SHA-256 of a row with types and lengths; empty if a value is NULL."""
    if None in values:
        return ""
    parts: list[bytes] = []
    for value in values:
        if isinstance(value, bytes):
            content = value
        elif isinstance(value, str):
            content = value.encode("utf-8")
        elif isinstance(value, float):
            content = _FLOAT.pack(value)
        else:
            content = _INT.pack(value)
        parts += (_ENCODING[type(value)], _LENGTH.pack(len(content)), content)
    return hashlib.sha256(b"".join(parts)).hexdigest()


def insert_audited(db: sqlite3.Connection, table: str, values: Sequence[Value]) -> None:
    """Insert a row, key first, into an `AUDITED` table and the chain, in a transaction."""
    columns = AUDITED[table]
    marks = ",".join("?" * len(columns))
    statement = f"INSERT INTO {table} ({','.join(columns)}) VALUES ({marks})"  # noqa: S608 - constants of this module
    db.execute(statement, tuple(values))
    last = db.execute("SELECT sequence, hash FROM audit ORDER BY sequence DESC LIMIT 1").fetchone()
    sequence, previous = (last[0] + 1, last[1]) if last else (1, _FIRST_LINK)
    link = (sequence, step_utc(db), table, values[0], digest_row(values), previous)
    db.execute("INSERT INTO audit VALUES (?, ?, ?, ?, ?, ?, ?)", (*link, digest_row(link)))


@dataclass(frozen=True, slots=True)
class AuditedStep:
    """A row of the audit: number, time (ISO 8601), table, and key there."""

    sequence: int
    time_utc: str
    subject: str
    key: int


def read_audit(db: sqlite3.Connection) -> list[AuditedStep]:
    rows = db.execute("SELECT sequence, time_utc, subject, key FROM audit ORDER BY sequence")
    return [AuditedStep(*row) for row in rows]


def read_links(db: sqlite3.Connection) -> dict[int, str]:
    return {
        int(number): str(link)
        for number, link in db.execute("SELECT sequence, hash FROM audit ORDER BY sequence")
    }


def find_faults(db: sqlite3.Connection) -> list[str]:
    """Return the disagreements of the file with the chain, a sentence each."""
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


APPLICATION_ID = 0x4F434D4D
"""``OCMM`` in the head of the SQLite file."""

Step = Callable[[sqlite3.Connection], None]


def _make_tables(number: int, db: sqlite3.Connection) -> None:
    """Make the tables of a version and forbid to change or remove any row."""
    if number == 1:
        db.execute(f"PRAGMA application_id = {APPLICATION_ID}")
    for statement in sql_statements("job", str(number)):
        db.execute(statement)
        table = statement.split()[2]
        _forbid_change(db, table, AUDITED[table][0] if table in AUDITED else "sequence")


def _forbid_change(db: sqlite3.Connection, table: str, key: str) -> None:
    for action in ("UPDATE", "DELETE"):
        db.execute(
            f"CREATE TRIGGER {table}_no_{action.lower()} BEFORE {action} ON {table} "
            f"BEGIN SELECT RAISE(ABORT, 'rows of {table} are never changed'); END"
        )
    # INSERT OR REPLACE would remove the old row without the trigger above.
    db.execute(
        f"CREATE TRIGGER {table}_no_replace BEFORE INSERT ON {table} "  # noqa: S608 - constants
        f"WHEN EXISTS (SELECT 1 FROM {table} WHERE {key} = NEW.{key}) "
        f"BEGIN SELECT RAISE(ABORT, 'rows of {table} are never changed'); END"
    )


MIGRATIONS: tuple[Step, ...] = tuple(partial(_make_tables, number) for number in range(1, 5))
"""Version 1: points and audit; 2: reference body; 3: signatures (`_job_seal`); 4: nominal part."""


def require_known(db: sqlite3.Connection, path: Path, steps: tuple[Step, ...] = MIGRATIONS) -> int:
    """Return the version of the file; StorageError if it is newer than this program."""
    version = int(db.execute("PRAGMA user_version").fetchone()[0])
    if version > len(steps):
        raise StorageError(
            "job.newer",
            f"{path}: the job has file version {version}, but this program supports versions up "
            f"to {len(steps)}.",
            "Open it with the program version that wrote it, or update this one.",
        )
    return version


def backup_older(db: sqlite3.Connection, path: Path, steps: tuple[Step, ...] = MIGRATIONS) -> None:
    """Copy an older file to ``<name>.v<version>.bak``; StorageError: newer, not writable."""
    version = require_known(db, path, steps)
    if version == len(steps):
        return
    backup = path.with_name(f"{path.name}.v{version}.bak")
    try:
        write_atomic(backup, db.serialize())
    except OSError as error:
        raise StorageError(
            "job.backup",
            f"{backup}: the backup before the update cannot be written ({error.strerror}).",
            "Free space in that folder, or copy the job to a writable folder.",
        ) from error


def bring_up_to_date(
    db: sqlite3.Connection, path: Path, steps: tuple[Step, ...] = MIGRATIONS
) -> None:
    """Migrate the file ``path``, open as ``db``, to the version of this program.

    StorageError if newer, unchanged; sqlite3.Error if a step failed, at the version before it.
    """
    version = require_known(db, path, steps)
    for number, step in enumerate(steps[version:], start=version + 1):
        db.execute("BEGIN IMMEDIATE")
        try:
            step(db)
            db.execute(f"PRAGMA user_version = {number}")
            db.execute("COMMIT")
        finally:
            if db.in_transaction:
                db.execute("ROLLBACK")
