"""Connections to files that may come from anywhere: what is read of them is bounded.

A job file is a program in a small way: views, triggers and generated columns run when it is read.
So nothing of its schema is trusted, and nothing in it may keep us longer than its size explains.
"""

from __future__ import annotations

import contextlib
import errno
import sqlite3
import stat
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from ocmm_core.side_files import SIDE_FILES, Trusted, refuse_side_files

C = TypeVar("C", bound=sqlite3.Connection)

LONGEST_VALUE = 32 << 20
"""Bytes of the longest value of a row; SQLite refuses a longer one before it makes room for it."""

LARGEST_FILE = SIDE_FILES[Trusted.JOB][0].most
"""Bytes of the largest file that is opened; a job of 100,000 points has a fifth of it."""

_LIMITS = {
    sqlite3.SQLITE_LIMIT_LENGTH: LONGEST_VALUE,
    sqlite3.SQLITE_LIMIT_SQL_LENGTH: 100_000,
    sqlite3.SQLITE_LIMIT_COLUMN: 100,
    sqlite3.SQLITE_LIMIT_EXPR_DEPTH: 100,
    sqlite3.SQLITE_LIMIT_COMPOUND_SELECT: 10,
    sqlite3.SQLITE_LIMIT_FUNCTION_ARG: 16,
    sqlite3.SQLITE_LIMIT_ATTACHED: 0,
    sqlite3.SQLITE_LIMIT_TRIGGER_DEPTH: 10,
    sqlite3.SQLITE_LIMIT_WORKER_THREADS: 0,
}
_DEFENCES = (
    # Views and triggers call no function that does anything, and a page is checked when it is read.
    "PRAGMA trusted_schema = OFF",
    "PRAGMA cell_size_check = ON",
    "PRAGMA mmap_size = 0",
)
_STEPS = 50_000
"""Steps of SQLite's machine between two looks at the clock: about a millisecond."""

BASE_S, _BYTES_A_SECOND = 3.0, 4 << 20
"""Processor time that a file may take; the largest jobs are read twenty times as fast."""


class GuardedConnection(sqlite3.Connection):
    """A connection that ends a statement which takes longer than the size of its file explains."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._path: Path | None = None
        self._size = 0
        self._until_s = 0.0
        self._on_close: Callable[[], None] = lambda: None
        self.inserts: list[tuple[str, tuple[object, ...]]] | None = None
        """The statements that inserted rows, with their values; None if not collected."""

    def on_close(self, then: Callable[[], None]) -> None:
        """Call ``then`` once, after the connection is closed."""
        self._on_close = then

    def close(self) -> None:
        """Close the connection; may be called twice."""
        super().close()
        self._on_close()
        self._on_close = lambda: None

    def execute(self, sql: str, parameters: Any = (), /) -> sqlite3.Cursor:
        """Execute a statement as `sqlite3.Connection`, and collect it if it inserts."""
        if self.inserts is not None and sql.startswith("INSERT"):
            self.inserts.append((sql, tuple(parameters)))
        return super().execute(sql, parameters)

    def guard(self, path: Path | None, size: int = 0) -> None:
        """Bound everything that is read of a file; before the first statement.

        Parameters
        ----------
        path
            Of the file; None where its bytes are in memory.
        size
            How many these are.
        """
        self._path, self._size = path, size
        for limit, most in _LIMITS.items():
            self.setlimit(limit, most)
        self.set_progress_handler(self._is_over, _STEPS)
        self.renew()
        harden(self)

    def renew(self) -> None:
        """Let the file take its time anew; whoever begins another reading or writing calls this."""
        try:
            size = self._size if self._path is None else self._path.stat().st_size
        except OSError:
            size = 0
        # Processor time of this thread: a slow disk or a busy computer is no fault of the file.
        self._until_s = time.thread_time() + BASE_S + size / _BYTES_A_SECOND

    def _is_over(self) -> bool:
        return time.thread_time() > self._until_s


def harden(db: sqlite3.Connection) -> None:
    """Let nothing in the schema of a file run, and check its pages; before the first statement."""
    # From Python 3.12 on; the schema is compared in any case.
    switch = getattr(db, "setconfig", None)
    defensive = getattr(sqlite3, "SQLITE_DBCONFIG_DEFENSIVE", None)
    if switch is not None and defensive is not None:
        switch(defensive, True)
    for defence in _DEFENCES:
        db.execute(defence)


def open_in_place(
    path: Path, factory: type[C], kind: Trusted, *, wait_s: float, read_only: bool = False
) -> C:
    """Open a database by its name, hardened, if nothing hostile lies next to it.

    Raises
    ------
    OSError
        As of `refuse_side_files`.
    sqlite3.Error
        It cannot be opened.
    """
    there = path.resolve()
    if not stat.S_ISREG(there.stat().st_mode):
        raise OSError(errno.EINVAL, "it is no file", str(path))
    refuse_side_files(there, kind)
    db: C = sqlite3.connect(
        f"{there.as_uri()}?mode={'ro' if read_only else 'rw'}", uri=True, factory=factory,
        timeout=wait_s, isolation_level=None, check_same_thread=False,
    )  # fmt: skip
    try:
        harden(db)
    except BaseException:
        db.close()
        raise
    return db


def database_content(fill: Callable[[sqlite3.Connection], None]) -> bytes:
    """Return the bytes of a new database with a write-ahead log that holds what ``fill`` stores.

    Made in memory: no rollback journal is ever made on a disk, so each one there is foreign.
    """
    with contextlib.closing(sqlite3.connect(":memory:", isolation_level=None)) as db:
        fill(db)
        return with_log(db.serialize())


def with_log(content: bytes) -> bytes:
    """Return the bytes of a database marked as one with a write-ahead log."""
    # A database in memory has none (SQLite, "Database File Format", 1.3.3).
    return content[:18] + b"\2\2" + content[20:]
