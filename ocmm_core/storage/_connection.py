"""Connections to job files: opened with one sentence for whatever is the matter, or not at all."""

from __future__ import annotations

import contextlib
import os
import sqlite3
import stat
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

from ocmm_core.documents import write_new
from ocmm_core.errors import StorageError
from ocmm_core.storage._faults import (
    FAULTS,
    bad_text,
    damaged,
    no_job,
    not_writable,
    primary_code,
    storage_error,
)
from ocmm_core.storage._guard import LARGEST_FILE, GuardedConnection, guarded_connection
from ocmm_core.storage._migrations import APPLICATION_ID, MIGRATIONS, bring_up_to_date
from ocmm_core.storage._schema import require_schema

C = TypeVar("C", bound=sqlite3.Connection)

_WAIT_S = 1.0
"""How long an open waits for another program to let go of the file."""

_FORMAT_VERSIONS, _USER_VERSION = slice(18, 20), slice(60, 64)
"""Bytes of the head of an SQLite file."""
_MAGIC = b"SQLite format 3\0"


def make_file(path: Path, fill: Callable[[sqlite3.Connection], None]) -> None:
    """Make a job file that holds what ``fill`` stores; from its first moment it is a whole one.

    Raises
    ------
    StorageError
        There is such a file already, or it cannot be written; nothing is left behind then.
    """
    with contextlib.closing(sqlite3.connect(":memory:", isolation_level=None)) as db:
        with _closing_on_error(path, db):
            bring_up_to_date(db, path, read_only=False)
            db.execute("BEGIN")
            fill(db)
            db.execute("COMMIT")
        content = job_bytes(db)
    try:
        write_new(path, content)
    except FileExistsError as error:
        raise StorageError(
            "job.exists",
            f"{path}: this file already exists.",
            "Choose another name for the job; an existing file is never overwritten.",
        ) from error
    except OSError as error:
        raise not_writable(path, error.strerror or str(error)) from error


def job_bytes(db: sqlite3.Connection) -> bytes:
    """Return the bytes of a job file with what a connection in memory holds."""
    content = bytearray(db.serialize())
    # Of a file with a write-ahead log (SQLite, "Database File Format", 1.3.3); a database in
    # memory has none.
    content[_FORMAT_VERSIONS] = b"\2\2"
    return bytes(content)


def opened_bytes(content: bytes) -> sqlite3.Connection:
    """Return a connection in memory to the bytes of a job file that this program has written."""
    held = bytearray(content)
    held[_FORMAT_VERSIONS] = b"\1\1"
    db = sqlite3.connect(":memory:", isolation_level=None)
    db.deserialize(held)
    return db


@contextlib.contextmanager
def connection_to(path: Path, *, read_only: bool) -> Iterator[GuardedConnection]:
    """Give the connection to a job file that is there, closed again where the body fails.

    Raises
    ------
    StorageError
        The file is missing, no job file, newer than this program, damaged, cannot be read or
        written, or is in use by another program.
    """
    if not path.is_file():
        raise StorageError(
            "job.missing", f"{path}: file not found.", "Check the name and the folder."
        )
    require_size(path)
    mode = "rw"
    if not read_only and not (os.access(path, os.W_OK) and os.access(path.parent, os.W_OK)):
        raise not_writable(path, "the file or its folder is write-protected")
    if read_only and not os.access(path.parent, os.W_OK):
        # SQLite needs a writable folder even to read a WAL. A finished file has none and can
        # be read as it is, e.g. from an archive that nobody can write to.
        mode = "ro" if path.with_name(f"{path.name}-wal").exists() else "ro&immutable=1"
    with _closing_on_error(path, _connect(path, mode, alone=not read_only)) as db:
        _require_job(db, path, read_only=read_only)
        if not read_only:
            # Only files of version 1 may be without a log.
            db.execute("PRAGMA journal_mode = WAL").fetchall()
            # What a killed program or a failed sync left in the log may only be in memory: from
            # here on it is on the disk, before anything is written behind it.
            checkpoint(db)
        yield db


@contextlib.contextmanager
def connection_in_memory(path: Path, content: bytes) -> Iterator[GuardedConnection]:
    """Give a connection to the bytes of a job file without a log, closed where the body fails.

    Parameters
    ----------
    path
        What it is called; no file is touched.
    content
        Of this program's version (`is_current`).

    Raises
    ------
    StorageError
        It is no job file, or damaged.
    """
    held = bytearray(content)
    # A database in memory has no write-ahead log, see `make_file`.
    held[_FORMAT_VERSIONS] = b"\1\1"
    db: GuardedConnection = sqlite3.connect(
        ":memory:", factory=GuardedConnection, isolation_level=None, check_same_thread=False
    )
    with _closing_on_error(path, db):
        db.deserialize(held)
        db.guard(None, len(held))
        db.execute("PRAGMA foreign_keys = ON")
        _require_job(db, path, read_only=True)
        yield db


def is_current(content: bytes) -> bool:
    """Return whether bytes say that they are an SQLite file of the version of this program.

    Others are brought up to date as files.
    """
    version = int.from_bytes(content[_USER_VERSION], "big")
    return content[: len(_MAGIC)] == _MAGIC and version == len(MIGRATIONS)


def _require_job(db: sqlite3.Connection, path: Path, *, read_only: bool) -> None:
    """Raise StorageError where what is open is no whole job; an older one is brought up to date."""
    if int(db.execute("PRAGMA application_id").fetchone()[0]) != APPLICATION_ID:
        raise no_job(path)
    require_schema(db, path)
    bring_up_to_date(db, path, read_only=read_only)
    fault = db.execute("PRAGMA quick_check(1)").fetchone()[0]
    if fault != "ok":
        raise damaged(path, " ".join(fault.split()))


def checkpoint(db: sqlite3.Connection) -> bool:
    """Write the write-ahead log into the file; without room for it, the log stays as it is.

    Returns
    -------
    done
        The log is empty.

    Raises
    ------
    sqlite3.Error
        The disk failed: the connection must be given up.
    """
    try:
        return bool(db.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()[0] == 0)
    except sqlite3.Error as error:
        if primary_code(error) != sqlite3.SQLITE_FULL:
            raise
    return False


def give_up(db: sqlite3.Connection) -> None:
    """Close a connection whose disk failed without writing or syncing anything any more.

    A close takes the log into the file and syncs both. A sync that failed may seem to succeed when
    it is tried again, because the system has dropped the pages meanwhile; then the log, which has
    everything, would be deleted. Without ``synchronous`` nothing is synced, and an interrupt
    ends the taking in before its first page, so that the log stays.
    """
    with contextlib.suppress(sqlite3.Error):
        db.execute("PRAGMA synchronous = OFF")
    db.interrupt()
    db.close()


def require_size(path: Path) -> None:
    """Raise StorageError where ``path`` is no file, or larger than any job."""
    try:
        found = path.stat()
    except OSError as error:
        raise not_writable(path, error.strerror or str(error)) from error
    if not stat.S_ISREG(found.st_mode):
        # A pipe would be waited for.
        raise no_job(path)
    size = found.st_size
    if size > LARGEST_FILE:
        raise damaged(path, f"{size >> 20} MB are more than any job has")


def _connect(path: Path, mode: str, *, alone: bool) -> GuardedConnection:
    try:
        db = guarded_connection(
            path, mode, timeout=_WAIT_S, isolation_level=None, check_same_thread=False
        )
    except FAULTS as error:
        raise storage_error(path, error) from error
    with _closing_on_error(path, db):
        db.execute("PRAGMA locking_mode = EXCLUSIVE" if alone else "PRAGMA query_only = ON")
        db.execute("PRAGMA synchronous = FULL")
        # By itself SQLite would tell nobody of a sync that fails there, and try it again.
        db.execute("PRAGMA wal_autocheckpoint = 0")
        db.execute("PRAGMA foreign_keys = ON")
    return db


@contextlib.contextmanager
def _closing_on_error(path: Path, db: C) -> Iterator[C]:
    try:
        yield db
    except FAULTS as error:
        if primary_code(error) == sqlite3.SQLITE_IOERR:
            give_up(db)
        db.close()
        raise storage_error(path, error) from error
    except UnicodeEncodeError as error:
        db.close()
        raise bad_text(path, error) from error
    except BaseException:
        db.close()
        raise
