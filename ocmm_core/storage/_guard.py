"""Connections to untrusted files, with bounded reading.

Views, triggers and generated columns run: no trusted schema, time limited by size. POSIX drops all
locks on a file with any descriptor: a database file that this process has open is read through the
holder's descriptor.
"""

from __future__ import annotations

import contextlib
import errno
import os
import sqlite3
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from ocmm_core.host import HOST
from ocmm_core.side_files import LARGEST_JOB, SIDE_FILES, Trusted, open_guarded, refuse_side_files
from ocmm_core.storage._faults import FAULTS


@dataclass(slots=True)
class _Holding:
    descriptors: list[int] = field(default_factory=list)
    users: int = 0


class HeldFiles:
    """Descriptors of the files held by this process, by device and inode."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._held: dict[tuple[int, int], _Holding] = {}

    def hold(self, path: Path, most: int) -> tuple[tuple[int, int], int]:
        """Keep a descriptor until `let_go`; return its key and it. Raises as `open_guarded`."""
        with self._lock:
            descriptor = open_guarded(path, follow=False, most=most)
            key = _key(descriptor)
            holding = self._held.setdefault(key, _Holding())
            holding.descriptors.append(descriptor)
            holding.users += 1
            return key, descriptor

    def let_go(self, key: tuple[int, int]) -> None:
        """End a `hold`, after the connection is closed."""
        with self._lock:
            holding = self._held[key]
            holding.users -= 1
            if not holding.users:
                del self._held[key]
                for descriptor in holding.descriptors:
                    os.close(descriptor)

    @contextlib.contextmanager
    def reading(self, path: Path) -> Iterator[int]:
        """Yield a descriptor for reading a job file; OSError of `open_guarded`."""
        with self._lock:
            looked = path.stat()
            holding = self._held.get((looked.st_dev, looked.st_ino))
            if holding is not None:
                yield holding.descriptors[0]
                return
            descriptor = open_guarded(path, most=LARGEST_JOB)
            try:
                yield descriptor
            finally:
                replaced = self._held.get(_key(descriptor))
                if replaced is None:
                    os.close(descriptor)
                else:
                    # The name was given to a held job meanwhile: closing would drop its locks.
                    replaced.descriptors.append(descriptor)


HELD = HeldFiles()
"""Per process, like POSIX locks."""


def _key(descriptor: int) -> tuple[int, int]:
    state = os.fstat(descriptor)
    return state.st_dev, state.st_ino


C = TypeVar("C", bound="HeldConnection")

LONGEST_VALUE = 32 << 20
"""Bytes of the longest value of a row; SQLite refuses longer ones before allocation."""

LARGEST_FILE = SIDE_FILES[Trusted.JOB][0].most
"""Bytes of the largest accepted file; a job of 100,000 points has a fifth of it."""

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
    # Views and triggers call no function with side effects, and pages are checked when read.
    "PRAGMA trusted_schema = OFF",
    "PRAGMA cell_size_check = ON",
    "PRAGMA mmap_size = 0",
)
_STEPS = 50_000
"""Steps of SQLite's machine between two checks of the clock: about a millisecond."""

_RESERVED_BYTE = 0x40000001
"""Of SQLite's locks (SQLite, "Database File Format", 1.2, and ``os.h``)."""

BASE_S, _BYTES_A_SECOND = 3.0, 4 << 20
"""CPU time allowed for a file; the largest jobs are read twenty times as fast."""


class HeldConnection(sqlite3.Connection):
    """A connection whose file is held until it is closed (`open_in_place`)."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._on_close: Callable[[], None] = lambda: None

    def on_close(self, then: Callable[[], None]) -> None:
        """Call ``then`` once, after the connection is closed."""
        self._on_close = then

    def close(self) -> None:
        """Close the connection; may be called twice."""
        super().close()
        self._on_close()
        self._on_close = lambda: None


class GuardedConnection(HeldConnection):
    """A connection that ends statements which take longer than the size of its file explains."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._path: Path | None = None
        self._size = 0
        self._until_s = 0.0
        self.inserts: list[tuple[str, tuple[object, ...]]] | None = None
        """Executed INSERT statements with their values; None if not collected."""
        self.left_out = ""
        """Log bytes outside complete steps at opening, as a sentence."""

    def execute(self, sql: str, parameters: Any = (), /) -> sqlite3.Cursor:
        """Execute a statement as `sqlite3.Connection`, and collect it if it inserts."""
        if self.inserts is not None and sql.startswith("INSERT"):
            self.inserts.append((sql, tuple(parameters)))
        return super().execute(sql, parameters)

    def guard(self, path: Path | None, size: int = 0) -> None:
        """Limit reading before the first statement; `path` None: `size` bytes in memory."""
        self._path, self._size = path, size
        for limit, most in _LIMITS.items():
            self.setlimit(limit, most)
        self.set_progress_handler(lambda: time.thread_time() > self._until_s, _STEPS)
        self.renew()
        harden(self)

    def renew(self) -> None:
        """Restart the time limit; call it before each reading or writing."""
        try:
            size = self._size if self._path is None else self._path.stat().st_size
        except OSError:
            size = 0
        # CPU time of this thread: a slow disk or a busy computer is not a fault of the file.
        self._until_s = time.thread_time() + BASE_S + size / _BYTES_A_SECOND


def harden(db: sqlite3.Connection) -> None:
    """Disable code in the schema, and check pages; before the first statement."""
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
    """Open a database by its name, hardened, if nothing hostile is next to it.

    SQLite ignores a rollback journal while another descriptor holds the reserved lock, as this
    process does during the first read. Names are checked again before writing. OSError as
    `refuse_side_files`, or if it is no file or too large; sqlite3.Error if it cannot be opened.
    """
    there = path.resolve()
    refuse_side_files(there, kind)
    key, descriptor = HELD.hold(there, SIDE_FILES[kind][0].most)
    db: C | None = None
    try:
        with HOST.sharing_byte(descriptor, _RESERVED_BYTE):
            db = sqlite3.connect(
                f"{there.as_uri()}?mode={'ro' if read_only else 'rw'}", uri=True, factory=factory,
                timeout=wait_s, isolation_level=None, check_same_thread=False,
            )  # fmt: skip
            harden(db)
            if kind is Trusted.JOB:
                db.execute("PRAGMA locking_mode = EXCLUSIVE")
            db.execute("PRAGMA schema_version").fetchone()
        refuse_side_files(there, kind)
        if kind is Trusted.JOB and db.execute("PRAGMA journal_mode").fetchone()[0] != "wal":
            raise OSError(errno.EPERM, "another program has just changed it", str(path))
    except BaseException:
        if db is not None:
            give_up(db)
        HELD.let_go(key)
        raise
    db.on_close(lambda: HELD.let_go(key))
    return db


def give_up(db: sqlite3.Connection) -> None:
    """Close a connection without further writes or syncs, e.g. if its disk failed.

    A normal close checkpoints, and deletes the log if a repeated sync seems to succeed. Without
    ``synchronous`` nothing is synced, and an interrupt ends the checkpoint before its first page.
    """
    with contextlib.suppress(*FAULTS):
        db.execute("PRAGMA synchronous = OFF")
    db.interrupt()
    db.close()


def database_content(fill: Callable[[sqlite3.Connection], None]) -> bytes:
    """Return a new WAL database filled by ``fill``, made in memory: no rollback journal."""
    with contextlib.closing(sqlite3.connect(":memory:", isolation_level=None)) as db:
        fill(db)
        return with_log(db.serialize())


def with_log(content: bytes) -> bytes:
    """Return the bytes of a database marked as one with a write-ahead log."""
    # A database in memory has none (SQLite, "Database File Format", 1.3.3).
    return content[:18] + b"\2\2" + content[20:]
