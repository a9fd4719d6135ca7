"""Versions of the job file as numbered migrations.

Step n takes version n - 1 (0: empty) to n, each after a backup in a separate transaction.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from pathlib import Path

from ocmm_core.documents import write_atomic
from ocmm_core.errors import StorageError
from ocmm_core.storage._audit import AUDITED

APPLICATION_ID = 0x4F434D4D
"""``OCMM`` in the head of the SQLite file."""

Step = Callable[[sqlite3.Connection], None]

_TABLES = (
    """CREATE TABLE head (
        id INTEGER PRIMARY KEY CHECK (id = 1),
        job_uuid TEXT NOT NULL, created_utc TEXT NOT NULL, software_version TEXT NOT NULL,
        operator TEXT NOT NULL, part TEXT NOT NULL, serial TEXT NOT NULL,
        plan_text TEXT NOT NULL, plan_sha256 TEXT NOT NULL,
        rig_text TEXT NOT NULL, rig_sha256 TEXT NOT NULL,
        probe_text TEXT NOT NULL, probe_sha256 TEXT NOT NULL) STRICT""",
    # Arrays are little-endian float64, row by row. Their shapes: tip_world and direction (3),
    # covariance and rotation (3, 3), spots by spots_shape ("cameras,leds,2").
    """CREATE TABLE observation (
        number INTEGER PRIMARY KEY CHECK (number > 0),
        feature TEXT NOT NULL, time_s REAL NOT NULL,
        first_frame INTEGER NOT NULL, last_frame INTEGER NOT NULL, n_frames INTEGER NOT NULL,
        tip_world BLOB NOT NULL CHECK (length(tip_world) = 24),
        random_covariance BLOB NOT NULL CHECK (length(random_covariance) = 72),
        direction BLOB NOT NULL CHECK (length(direction) = 24),
        tip_radius REAL NOT NULL,
        rotation_world_from_probe BLOB NOT NULL CHECK (length(rotation_world_from_probe) = 72),
        spots_shape TEXT NOT NULL, spots BLOB NOT NULL,
        chi2_per_dof REAL NOT NULL, approach TEXT NOT NULL) STRICT""",
    """CREATE TABLE annulment (
        number INTEGER PRIMARY KEY REFERENCES observation (number),
        time_utc TEXT NOT NULL, reason TEXT NOT NULL) STRICT""",
    """CREATE TABLE event (
        id INTEGER PRIMARY KEY, time_utc TEXT NOT NULL,
        kind TEXT NOT NULL, text TEXT NOT NULL) STRICT""",
    """CREATE TABLE audit (
        sequence INTEGER PRIMARY KEY, time_utc TEXT NOT NULL,
        subject TEXT NOT NULL, key INTEGER NOT NULL, content_sha256 TEXT NOT NULL,
        previous TEXT NOT NULL, hash TEXT NOT NULL) STRICT""",
)

_REFERENCE_TABLES = (
    # Mean spots of its first pose, little-endian float64; shape "cameras,leds,2".
    """CREATE TABLE reference (
        id INTEGER PRIMARY KEY CHECK (id = 1),
        text TEXT NOT NULL, sha256 TEXT NOT NULL,
        spots_shape TEXT NOT NULL, spots BLOB NOT NULL, n_frames INTEGER NOT NULL) STRICT""",
    """CREATE TABLE reference_observation (
        number INTEGER PRIMARY KEY REFERENCES observation (number),
        spots_shape TEXT NOT NULL, spots BLOB NOT NULL) STRICT""",
)


# The public key and the signature are Base64.
_SEAL_TABLE = """CREATE TABLE seal (
        sequence INTEGER PRIMARY KEY REFERENCES audit (sequence),
        key TEXT NOT NULL, signature TEXT NOT NULL) STRICT"""


# The nominal part in the form of `ocmm_core.part_model`.
_PART_TABLE = """CREATE TABLE part (
        id INTEGER PRIMARY KEY CHECK (id = 1),
        source_name TEXT NOT NULL, source_sha256 TEXT NOT NULL,
        content BLOB NOT NULL) STRICT"""


def _version_1(db: sqlite3.Connection) -> None:
    """Make the tables of an empty file and forbid to change or remove any row."""
    db.execute(f"PRAGMA application_id = {APPLICATION_ID}")
    for statement in _TABLES:
        db.execute(statement)
    for table in ("head", "observation", "annulment", "event"):
        _forbid_change(db, table, AUDITED[table][0])
    _forbid_change(db, "audit", "sequence")


def _version_2(db: sqlite3.Connection) -> None:
    """Add the reference body: the document, its first pose, and its spots for every point."""
    for statement in _REFERENCE_TABLES:
        db.execute(statement)
    for table in ("reference", "reference_observation"):
        _forbid_change(db, table, AUDITED[table][0])


def _version_3(db: sqlite3.Connection) -> None:
    """Add the signatures of the station on rows of the audit (`_job_seal`)."""
    db.execute(_SEAL_TABLE)
    _forbid_change(db, "seal", "sequence")


def _version_4(db: sqlite3.Connection) -> None:
    """Add the nominal part, so that a job shows it without the CAD model."""
    db.execute(_PART_TABLE)
    _forbid_change(db, "part", AUDITED["part"][0])


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


MIGRATIONS: tuple[Step, ...] = (_version_1, _version_2, _version_3, _version_4)


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
