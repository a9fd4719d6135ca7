"""Archive in a file of SQLite: the default, for one computer and all its users; opens any archive.

One program writes, others read (write-ahead log); acknowledged rows are on the disk.
"""

from __future__ import annotations

import contextlib
import functools
import os
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path

import platformdirs

from ocmm_core import __version__
from ocmm_core.documents import write_new
from ocmm_core.errors import StorageError
from ocmm_core.seals import KnownEnd, recall, remember
from ocmm_core.side_files import Trusted
from ocmm_core.storage import HeldConnection, database_content, open_in_place
from ocmm_shop.archive.stores._address import check_address, is_server, parse_server
from ocmm_shop.archive.stores._faults import foreign, newer, sqlite_fault
from ocmm_shop.archive.stores._interface import Cell, Table
from ocmm_shop.archive.stores._postgresql import PostgresArchive
from ocmm_shop.archive.stores._schema import (
    APPLICATION_ID,
    SQLITE,
    VERSION,
    columns_of,
    made_in_memory,
    statements,
)
from ocmm_shop.archive.stores._store import Archive

_WAIT_S = 5.0
_VIEWS = "SELECT type, name, sql FROM sqlite_master WHERE type IN ('view', 'trigger')"


@functools.cache
def _own_views() -> frozenset[tuple[str, str, str]]:
    """Return type, name and SQL of the views and triggers that this version makes."""
    with contextlib.closing(made_in_memory()) as made:
        return frozenset(made.execute(_VIEWS))


class SqliteArchive(Archive):
    """An archive in a file.

    `path`: created if missing, and updated. `read_only`: nothing can be added. StorageError: no
    archive, of a later version, or it cannot be read or written.
    """

    _who = "'local'"

    def __init__(self, path: Path, *, read_only: bool = False) -> None:
        self.place = str(path)
        self._read_only = read_only
        self._db: sqlite3.Connection | None = None
        try:
            if not read_only:
                path.parent.mkdir(parents=True, exist_ok=True)
                if not os.path.lexists(path):
                    with contextlib.suppress(FileExistsError):
                        write_new(path, database_content(_make_pages))
            self._db = open_in_place(
                path, HeldConnection, Trusted.DATABASE, wait_s=_WAIT_S, read_only=read_only
            )
            self._prepare()
        except sqlite3.Error as error:
            self.close()
            raise sqlite_fault(self.place, error) from error
        except OSError as error:
            self.close()
            raise StorageError(
                "archive.rights",
                f"{error.filename or self.place}: the archive cannot be opened ({error.strerror}).",
                "Move that file away if this program did not make it, or choose another archive: "
                "ocmm settings set archive.address.",
            ) from error
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        if self._db is not None:
            self._db.close()
            self._db = None

    def give_roles(self, statements: Sequence[str]) -> None:
        """Do nothing: rights of the file system decide."""

    def _prepare(self) -> None:
        db = self._open()
        # Other programs can store any bytes: one such row must not make all unreadable.
        db.text_factory = functools.partial(str, encoding="utf-8", errors="replace")
        db.execute("PRAGMA foreign_keys = ON")
        if self._read_only:
            db.execute("PRAGMA query_only = ON")
        else:
            # No effect on files of this program; others are converted once.
            db.execute("PRAGMA journal_mode = WAL").fetchall()
            db.execute("PRAGMA synchronous = FULL")
        application, version = self._state()
        if version > VERSION and application == APPLICATION_ID:
            raise newer(self.place, version, VERSION)
        if application == APPLICATION_ID and version == VERSION:
            self._require_views(db)
            return
        if application == APPLICATION_ID and self._read_only:
            # An earlier version is updated; this connection then sees the new tables.
            SqliteArchive(Path(self.place)).close()
            return
        empty = not db.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
        if (application != APPLICATION_ID and not (application == 0 and empty)) or self._read_only:
            raise foreign(self.place)
        self._bring_up_to_date()

    def _require_views(self, db: sqlite3.Connection) -> None:
        """Refuse an archive with other views or triggers: they would hide jobs or change rows."""
        wanted = _own_views()
        found = set(db.execute(_VIEWS))
        changed = {one for one in wanted ^ found if one in wanted or one[0] == "trigger"}
        if changed:
            names = ", ".join(sorted({name for _, name, _ in changed}))
            raise StorageError(
                "archive.changed",
                f"{self.place}: another program has changed views or triggers ({names}).",
                "Restore the archive from a backup, or move it away and start a new one, which "
                "gets the jobs in the outbox again: ocmm archive set-up.",
            )

    def _state(self) -> tuple[int, int]:
        db = self._open()
        return (
            int(db.execute("PRAGMA application_id").fetchone()[0]),
            int(db.execute("PRAGMA user_version").fetchone()[0]),
        )

    def _bring_up_to_date(self) -> None:
        db = self._open()
        # Referenced tables are rebuilt.
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

    def malformed(self) -> list[str]:
        """Return values of another type than their column, as sentences."""
        found: list[str] = []
        for table, name, kind, empty in columns_of("table"):
            odd = self.query(
                f"SELECT rowid, typeof({name}) FROM {table} WHERE typeof({name}) <> :kind"  # noqa: S608 - names of ours
                f" AND NOT (:empty AND {name} IS NULL)",
                {"kind": kind.lower(), "empty": empty},
            )
            found += [
                f"Altered in the archive: {name} of row {row!s} of table {table} has the type "
                f"{other!s}."
                for row, other in odd.rows
            ]
        return found

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
        """Do nothing: triggers of SQLite run immediately."""

    def _now(self) -> datetime:
        return datetime.now(UTC)


def _make_pages(db: sqlite3.Connection) -> None:
    """Write the header of a new database, which it lacks without tables."""
    db.execute("CREATE TABLE head (id INTEGER)")
    db.execute("DROP TABLE head")


def default_archive() -> Path:
    return platformdirs.user_data_path("ocmm") / "archive.sqlite"


def open_archive(
    address: str = "",
    *,
    password: Path | None = None,
    set_up: bool = False,
    read_only: bool = False,
) -> Archive:
    """Return an open archive, a context manager.

    `address`: ``postgresql://USER@SERVER/DATABASE``, a file, or empty for that of this user.
    `password`: file with that of a server; None: by libpq. `set_up`: create or update the tables of
    a server, or replace a lost file. `read_only`: nothing can be added. InputError: unusable
    address, or the extra `shop` is missing; StorageError: unreachable, lost, or of a later version.
    """
    check_address(address)
    if is_server(address):
        return PostgresArchive(parse_server(address, password), set_up=set_up, read_only=read_only)
    path = Path(address).expanduser() if address else default_archive()
    memory = KnownEnd(name=f"archive {path.absolute()}", count=1, link="")
    if not os.path.lexists(path) and not set_up and recall(memory.name) is not None:
        raise StorageError(
            "archive.lost",
            f"{path}: the archive that this station has used is missing.",
            "Put the file back, or restore it from a backup. If there is none, start a new one, "
            "which gets the jobs in the outbox again: ocmm archive set-up.",
        )
    if read_only and not path.exists():
        raise StorageError(
            "archive.missing",
            f"{path}: there is no archive yet.",
            "Hand over the first job: ocmm archive send.",
        )
    opened = SqliteArchive(path, read_only=read_only)
    remember(memory, sync=False)
    return opened
