"""An archive in a file of SQLite: the default, for one computer and all its users.

Several programs may have it open: one writes, the others read (write-ahead log). What is
acknowledged is on the disk (``synchronous=FULL``).
"""

from __future__ import annotations

import contextlib
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path

from ocmm_core import __version__
from ocmm_core.archive.stores._faults import foreign, newer, sqlite_fault
from ocmm_core.archive.stores._interface import Cell, Table
from ocmm_core.archive.stores._schema import APPLICATION_ID, SQLITE, VERSION, statements
from ocmm_core.archive.stores._store import SqlArchive
from ocmm_core.errors import StorageError

_WAIT_S = 5.0


class SqliteArchive(SqlArchive):
    """An archive in a file.

    Parameters
    ----------
    path
        Of the file; it is made where there is none, and brought up to date.
    read_only
        Nothing can be added, by this connection.

    Raises
    ------
    StorageError
        It is no archive, of a later version, or cannot be read or written.
    """

    _who = "'local'"

    def __init__(self, path: Path, *, read_only: bool = False) -> None:
        self.place = str(path)
        self._read_only = read_only
        self._db: sqlite3.Connection | None = None
        try:
            if not read_only:
                path.parent.mkdir(parents=True, exist_ok=True)
            mode = "ro" if read_only else "rwc"
            self._db = sqlite3.connect(
                f"{path.resolve().as_uri()}?mode={mode}", uri=True, timeout=_WAIT_S,
                isolation_level=None, check_same_thread=False,
            )  # fmt: skip
            self._prepare()
        except sqlite3.Error as error:
            self.close()
            raise sqlite_fault(self.place, error) from error
        except OSError as error:
            self.close()
            raise StorageError(
                "archive.rights",
                f"{self.place}: the folder cannot be made ({error.strerror}).",
                "Choose another file: ocmm settings set archive.address.",
            ) from error
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close the file; may be called twice."""
        if self._db is not None:
            self._db.close()
            self._db = None

    def give_roles(self, statements: Sequence[str]) -> None:
        """Do nothing: who may open the file may write it, by the rights of the system."""

    def _prepare(self) -> None:
        db = self._open()
        # A file from elsewhere must run nothing of its own: views of ours use plain functions only.
        db.execute("PRAGMA trusted_schema = OFF")
        db.execute("PRAGMA foreign_keys = ON")
        if self._read_only:
            db.execute("PRAGMA query_only = ON")
        else:
            db.execute("PRAGMA journal_mode = WAL").fetchall()
            db.execute("PRAGMA synchronous = FULL")
        application, version = self._state()
        if version > VERSION and application == APPLICATION_ID:
            raise newer(self.place, version, VERSION)
        if application == APPLICATION_ID and version == VERSION:
            return
        if application == APPLICATION_ID and self._read_only:
            # One of an earlier version; this connection sees the new tables then.
            SqliteArchive(Path(self.place)).close()
            return
        empty = not db.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
        if (application != APPLICATION_ID and not (application == 0 and empty)) or self._read_only:
            raise foreign(self.place)
        self._bring_up_to_date()

    def _state(self) -> tuple[int, int]:
        db = self._open()
        return (
            int(db.execute("PRAGMA application_id").fetchone()[0]),
            int(db.execute("PRAGMA user_version").fetchone()[0]),
        )

    def _bring_up_to_date(self) -> None:
        db = self._open()
        # Tables that others refer to are made again.
        db.execute("PRAGMA foreign_keys = OFF")
        with self._transaction():
            # Another program may have done so while we waited.
            _, version = self._state()
            for step in range(version, VERSION):
                for statement in statements(step, SQLITE):
                    db.execute(statement)
                db.execute(
                    "INSERT INTO migration (version, program) VALUES (?, ?)",
                    (step + 1, __version__),
                )
                self._filled(step + 1)
            db.execute(f"PRAGMA application_id = {APPLICATION_ID}")
            db.execute(f"PRAGMA user_version = {VERSION}")
        db.execute("PRAGMA foreign_keys = ON")

    def _open(self) -> sqlite3.Connection:
        if self._db is None:
            raise StorageError(
                "archive.closed", f"{self.place}: the archive is closed.", "Open it again."
            )
        return self._db

    def _run(self, sql: str, values: Mapping[str, Cell] | None = None) -> Table:
        cursor = self._open().execute(sql, values or {})
        columns = tuple(str(one[0]) for one in cursor.description or ())
        return Table(columns, tuple(cursor.fetchall()))

    def _run_many(self, sql: str, values: Sequence[Mapping[str, Cell]]) -> None:
        self._open().executemany(sql, values)

    @contextlib.contextmanager
    def _transaction(self) -> Iterator[None]:
        db = self._open()
        try:
            db.execute("BEGIN IMMEDIATE")
            try:
                yield
                db.execute("COMMIT")
            except BaseException:
                with contextlib.suppress(sqlite3.Error):
                    db.execute("ROLLBACK")
                raise
        except (sqlite3.Error, UnicodeError, OverflowError) as error:
            if not isinstance(error, sqlite3.Error):
                error = sqlite3.IntegrityError(str(error))
                error.sqlite_errorcode = sqlite3.SQLITE_CONSTRAINT
            raise sqlite_fault(self.place, error) from error

    @contextlib.contextmanager
    def _reading(self) -> Iterator[None]:
        db = self._open()
        try:
            db.execute("PRAGMA query_only = ON")
            try:
                yield
            finally:
                if not self._read_only:
                    db.execute("PRAGMA query_only = OFF")
        except sqlite3.Error as error:
            raise sqlite_fault(self.place, error) from error

    def _settle(self) -> None:
        """Do nothing: a trigger of SQLite runs at once."""

    def _now(self) -> datetime:
        return datetime.now(UTC)
