"""Connections to job files: opened safely, or refused with one sentence.

Views, triggers and computed columns run code: the schema is compared word by word before.
Transactions are written until the disk of the job fails: then it is given up.
"""

from __future__ import annotations

import contextlib
import os
import sqlite3
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import TypeVar

from ocmm_core.documents import write_atomic, write_new
from ocmm_core.errors import StorageError
from ocmm_core.side_files import Trusted
from ocmm_core.storage import _audit as audit
from ocmm_core.storage import _faults as faults
from ocmm_core.storage import _guard as guard
from ocmm_core.storage._job_content import read_job, unreadable
from ocmm_core.storage._tables import stored_head

_SCHEMA = "SELECT type, name, tbl_name, sql FROM sqlite_master LIMIT ?"


def require_schema(db: sqlite3.Connection, path: Path) -> None:
    """Check the schema against its version; StorageError: different, or a newer file."""
    version = audit.require_known(db, path)
    if version < 1:
        raise faults.damaged(path, f"it has the file version {version}")
    expected = _expected(version)
    found = set(db.execute(_SCHEMA, (len(expected) + 1,)).fetchall())
    # A dropped trigger runs nothing. The audit reveals changes made without it.
    missing = {row for row in expected - found if row[0] != "trigger"}
    odd = sorted({str(row[1])[:60] for row in (found - expected) | missing})
    if odd:
        raise faults.damaged(
            path, f"its table definitions were changed: {', '.join(map(repr, odd))}"
        )


@cache
def _expected(version: int) -> frozenset[tuple[str, str, str, str]]:
    """Return the rows of the schema of a version, from its migrations."""
    with contextlib.closing(sqlite3.connect(":memory:")) as db:
        for step in audit.MIGRATIONS[:version]:
            step(db)
        return frozenset(db.execute(_SCHEMA, (-1,)).fetchall())


C = TypeVar("C", bound=sqlite3.Connection)

_WAIT_S = 1.0
"""s: maximum wait for another program to release the file."""

_FORMAT_VERSIONS = slice(18, 20)
"""Bytes of the head of an SQLite file."""
_MAGIC = b"SQLite format 3\0"


def make_file(path: Path, fill: Callable[[sqlite3.Connection], None]) -> None:
    """Make a job file by ``fill``, atomically; StorageError: it exists or is not writable."""

    def whole(db: sqlite3.Connection) -> None:
        audit.bring_up_to_date(db, path)
        db.execute("BEGIN")
        fill(db)
        db.execute("COMMIT")

    try:
        content = guard.database_content(whole)
    except faults.FAULTS as error:
        raise faults.storage_error(path, error) from error
    except UnicodeEncodeError as error:
        raise faults.bad_text(path, error) from error
    try:
        write_new(path, content)
    except FileExistsError as error:
        raise StorageError(
            "job.exists",
            f"{path}: this file already exists.",
            "Choose another name for the job; an existing file is never overwritten.",
        ) from error
    except OSError as error:
        raise faults.not_writable(path, error.strerror or str(error)) from error


def job_bytes(db: sqlite3.Connection) -> bytes:
    """Return the bytes of a job file from a connection in memory."""
    return guard.with_log(db.serialize())


def opened_bytes(content: bytes) -> sqlite3.Connection:
    """Return a connection in memory to a job file written by this program."""
    held = bytearray(content)
    held[_FORMAT_VERSIONS] = b"\1\1"
    db = sqlite3.connect(":memory:", isolation_level=None)
    db.deserialize(held)
    return db


@contextlib.contextmanager
def connection_to(path: Path) -> Iterator[guard.GuardedConnection]:
    """Yield a connection to a job file for writing, closed on errors.

    Raises StorageError if the file is missing, no job file, newer than this program, damaged,
    cannot be read or written, is in use by another program, or a file next to it is refused.
    """
    # As every reader sees it, before SQLite opens anything by name.
    content = read_job(path)
    if path.is_symlink():
        raise faults.not_writable(
            path, f"it is a link to {path.resolve()}; add to that file itself"
        )
    if not (os.access(path, os.W_OK) and os.access(path.parent, os.W_OK)):
        raise faults.not_writable(path, "the file or its folder is write-protected")
    if content.file[_FORMAT_VERSIONS] != b"\2\2":
        _mark_with_log(path, content.file)
    with _closing_on_error(path, _connect(path)) as db:
        _require_job(db, path)
        audit.backup_older(db, path)
        audit.bring_up_to_date(db, path)
        # Log content of a killed program or failed sync may only be in memory: now it is on the
        # disk, before anything is written after it.
        checkpoint(db)
        db.left_out = content.left_out
        yield db


def _mark_with_log(path: Path, content: bytes) -> None:
    """Convert a job without a log: SQLite would write a rollback journal, refused by readers."""
    with connection_in_memory(path, content) as checked, contextlib.closing(checked):
        stored_head(checked, path)
    try:
        write_atomic(path, guard.with_log(content))
    except OSError as error:
        raise faults.not_writable(path, error.strerror or str(error)) from error


@contextlib.contextmanager
def connection_in_memory(
    path: Path, content: bytes, *, whole: bool = True
) -> Iterator[guard.GuardedConnection]:
    """Yield a connection to the bytes of a job file without a log, closed on errors.

    `path`: Name for messages; no file is touched. `content`: Of this version or an earlier one,
    which is updated in memory. `whole`: Check all pages; else only those that a list reads, in the
    file's own version. Raises StorageError if it is not a job file, or damaged.
    """
    if not content.startswith(_MAGIC):
        raise faults.no_job(path)
    # A database in memory has no write-ahead log.
    held = content[: _FORMAT_VERSIONS.start] + b"\1\1" + content[_FORMAT_VERSIONS.stop :]
    db: guard.GuardedConnection = sqlite3.connect(
        ":memory:", factory=guard.GuardedConnection, isolation_level=None, check_same_thread=False
    )
    with _closing_on_error(path, db):
        db.deserialize(held)
        del held
        db.guard(None, len(content))
        db.execute("PRAGMA foreign_keys = ON")
        _require_job(db, path, whole=whole)
        if whole:
            audit.bring_up_to_date(db, path)
        yield db


def _require_job(db: sqlite3.Connection, path: Path, *, whole: bool = True) -> None:
    if int(db.execute("PRAGMA application_id").fetchone()[0]) != audit.APPLICATION_ID:
        raise faults.no_job(path)
    require_schema(db, path)
    fault = db.execute("PRAGMA quick_check(1)").fetchone()[0] if whole else "ok"
    if fault != "ok":
        raise faults.damaged(path, " ".join(fault.split()))


def checkpoint(db: sqlite3.Connection) -> bool:
    """Write the log into the file, not on a full disk; return if empty; sqlite3.Error: give up."""
    try:
        return bool(db.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()[0] == 0)
    except sqlite3.Error as error:
        if faults.primary_code(error) != sqlite3.SQLITE_FULL:
            raise
    return False


def _connect(path: Path) -> guard.GuardedConnection:
    try:
        db = guard.open_in_place(path, guard.GuardedConnection, Trusted.JOB, wait_s=_WAIT_S)
    except faults.FAULTS as error:
        raise faults.storage_error(path, error) from error
    except OSError as error:
        raise unreadable(path, error) from error
    with _closing_on_error(path, db):
        db.guard(path)
        db.execute("PRAGMA synchronous = FULL")
        # SQLite's automatic checkpoint would ignore a failed sync, and retry it.
        db.execute("PRAGMA wal_autocheckpoint = 0")
        db.execute("PRAGMA foreign_keys = ON")
    return db


@contextlib.contextmanager
def _closing_on_error(path: Path, db: C) -> Iterator[C]:
    try:
        yield db
    except faults.FAULTS as error:
        if faults.primary_code(error) == sqlite3.SQLITE_IOERR:
            guard.give_up(db)
        db.close()
        raise faults.storage_error(path, error) from error
    except UnicodeEncodeError as error:
        db.close()
        raise faults.bad_text(path, error) from error
    except BaseException:
        db.close()
        raise


_STEPS_A_CHECKPOINT = 256
"""Some 1,500 pages of the log, 6 MB, to be reread after a kill."""


class JobWriter:
    """Writer of one connection; its owner serialises threads."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.failed = False
        """The disk has failed: nothing is written or synced afterwards."""
        self.wrote_file = self.emptied_log = False
        """Whether the last transaction was followed by a checkpoint, and by a complete one."""
        self._steps = 0

    @contextlib.contextmanager
    def transaction(self, db: sqlite3.Connection) -> Iterator[None]:
        """Make the changes durable, or none; StorageError: disk failed before; sqlite3.Error."""
        if self.failed:
            raise faults.disk_failed(self._path)
        try:
            db.execute("BEGIN IMMEDIATE")
            yield
            db.execute("COMMIT")
        except BaseException as error:
            # After a failed sync the kernel may have dropped the pages: a retry could seem to
            # succeed. The job continues in another file instead.
            self._note(error)
            with contextlib.suppress(sqlite3.Error):
                db.execute("ROLLBACK")
            if isinstance(error, UnicodeEncodeError):
                raise faults.bad_text(self._path, error) from error
            raise
        self._steps += 1
        self.wrote_file = self._steps % _STEPS_A_CHECKPOINT == 0
        self.emptied_log = False
        if self.wrote_file:
            try:
                self.emptied_log = checkpoint(db)
            except sqlite3.Error as error:
                # This step is stored; the next one is refused.
                self._note(error)

    def close(self, db: sqlite3.Connection) -> None:
        """Close the connection; after a disk failure, without touching it again."""
        if self.failed:
            guard.give_up(db)
        else:
            db.close()

    def _note(self, error: BaseException) -> None:
        self.failed = self.failed or faults.primary_code(error) == sqlite3.SQLITE_IOERR
