"""Connections to job files: opened with one sentence for whatever is the matter, or not at all."""

from __future__ import annotations

import contextlib
import os
import sqlite3
from collections.abc import Iterator
from pathlib import Path

from ocmm_core.errors import StorageError
from ocmm_core.storage._faults import bad_text, damaged, no_job, not_writable, storage_error
from ocmm_core.storage._migrations import APPLICATION_ID, bring_up_to_date

_WAIT_S = 1.0
"""How long an open waits for another program to let go of the file."""


@contextlib.contextmanager
def new_connection(path: Path) -> Iterator[sqlite3.Connection]:
    """Make an empty job file and give its connection, closed again where the body fails.

    Raises
    ------
    StorageError
        There is such a file already, or it cannot be written; nothing is left behind then, nor
        where the body fails.
    """
    try:
        path.open("xb").close()
    except FileExistsError as error:
        raise StorageError(
            "job.exists",
            f"{path}: this file already exists.",
            "Choose another name for the job; an existing file is never overwritten.",
        ) from error
    except OSError as error:
        raise not_writable(path, error.strerror or str(error)) from error
    try:
        with _closing_on_error(path, _connect(path, "rw", alone=True)) as db:
            db.execute("PRAGMA journal_mode = WAL")
            bring_up_to_date(db, path, read_only=False)
            yield db
    except BaseException:
        for name in (path.name, f"{path.name}-wal", f"{path.name}-journal"):
            path.with_name(name).unlink(missing_ok=True)
        raise


@contextlib.contextmanager
def connection_to(path: Path, *, read_only: bool) -> Iterator[sqlite3.Connection]:
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
    mode = "rw"
    if not read_only and not (os.access(path, os.W_OK) and os.access(path.parent, os.W_OK)):
        raise not_writable(path, "the file or its folder is write-protected")
    if read_only and not os.access(path.parent, os.W_OK):
        # SQLite needs a writable folder even to read a WAL. A finished file has none and can
        # be read as it is, e.g. from an archive that nobody can write to.
        mode = "ro" if path.with_name(f"{path.name}-wal").exists() else "ro&immutable=1"
    with _closing_on_error(path, _connect(path, mode, alone=not read_only)) as db:
        if int(db.execute("PRAGMA application_id").fetchone()[0]) != APPLICATION_ID:
            raise no_job(path)
        bring_up_to_date(db, path, read_only=read_only)
        fault = db.execute("PRAGMA quick_check(1)").fetchone()[0]
        if fault != "ok":
            raise damaged(path, " ".join(fault.split()))
        yield db


def _connect(path: Path, mode: str, *, alone: bool) -> sqlite3.Connection:
    address = f"{path.resolve().as_uri()}?mode={mode}"
    try:
        db = sqlite3.connect(
            address, uri=True, timeout=_WAIT_S, isolation_level=None, check_same_thread=False
        )
    except sqlite3.Error as error:
        raise storage_error(path, error) from error
    with _closing_on_error(path, db):
        db.execute("PRAGMA locking_mode = EXCLUSIVE" if alone else "PRAGMA query_only = ON")
        db.execute("PRAGMA synchronous = FULL")
        db.execute("PRAGMA foreign_keys = ON")
    return db


@contextlib.contextmanager
def _closing_on_error(path: Path, db: sqlite3.Connection) -> Iterator[sqlite3.Connection]:
    try:
        yield db
    except sqlite3.Error as error:
        db.close()
        raise storage_error(path, error) from error
    except UnicodeEncodeError as error:
        db.close()
        raise bad_text(path, error) from error
    except BaseException:
        db.close()
        raise
