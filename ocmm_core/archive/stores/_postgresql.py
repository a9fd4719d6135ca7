"""An archive on a PostgreSQL server, for a shop of many stations; needs the extra `shop`.

All tables are in the schema ``ocmm``. A station only adds rows; rights are those of `_roles`. The
connection is made anew for each errand that found it broken; nothing waits longer than its limits.
"""

from __future__ import annotations

import contextlib
import importlib.util
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from datetime import datetime
from typing import TYPE_CHECKING, Any

from ocmm_core import __version__
from ocmm_core.archive.stores._address import PostgresAddress
from ocmm_core.archive.stores._faults import (
    foreign,
    newer,
    not_set_up,
    older,
    postgresql_fault,
    silent_server,
)
from ocmm_core.archive.stores._interface import Cell, Table
from ocmm_core.archive.stores._patience import Patience
from ocmm_core.archive.stores._schema import POSTGRESQL, VERSION, statements
from ocmm_core.archive.stores._store import SqlArchive
from ocmm_core.errors import InputError, OcmmError, StorageError

if TYPE_CHECKING:
    import psycopg

SCHEMA = "ocmm"
_NAMED = re.compile(r"(?<![:\w]):([a-z_][a-z0-9_]*)")
_GRACE_S = 5.0
"""How much longer than the server itself a station waits for an answer."""
_LOCK = 0x4F434D41
"""Number of the advisory lock under which an archive is set up (it is "OCMA")."""


def require_psycopg() -> None:
    """Raise InputError where the extra `shop` is not installed."""
    if importlib.util.find_spec("psycopg") is None:
        raise InputError(
            "archive.shop",
            "An archive on a server needs psycopg, which is not installed.",
            "Install the extra `shop` (docs/shop.md).",
        )


class PostgresArchive(SqlArchive):
    """An archive on a server.

    Parameters
    ----------
    address
        Where it is, and how it is reached.
    set_up
        Make the tables where there are none, and bring them up to date; by the owner alone.
    read_only
        Nothing can be added, by this connection.

    Raises
    ------
    InputError
        The extra `shop` is not installed.
    StorageError
        The server cannot be reached, does not let us in, or has no archive of this version.
    """

    def __init__(
        self, address: PostgresAddress, *, set_up: bool = False, read_only: bool = False
    ) -> None:
        require_psycopg()
        self.place = address.shown
        self._read_only = read_only
        self._db: psycopg.Connection[tuple[Any, ...]] | None = None
        self._patience: Patience | None = None
        import psycopg
        from psycopg import conninfo

        try:
            self._db = psycopg.connect(
                conninfo.make_conninfo("", **address.parameters()),
                autocommit=True,
                application_name="ocmm",
                client_encoding="UTF8",
                options=(
                    f"-c search_path={SCHEMA},pg_temp -c statement_timeout={address.limit_ms} "
                    f"-c lock_timeout={address.limit_ms} "
                    f"-c idle_in_transaction_session_timeout={2 * address.limit_ms}"
                ),
            )
            # The server ends a statement first, and says why; this is for one that says nothing.
            self._patience = Patience(self._db.fileno(), address.limit_ms / 1000.0 + _GRACE_S)
            self._db.read_only = read_only or None
            self._check_version(set_up=set_up)
        except psycopg.Error as error:
            fault = self._fault(error)
            self.close()
            raise fault from error
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close the connection; may be called twice."""
        if self._patience is not None:
            self._patience.close()
            self._patience = None
        if self._db is not None:
            with contextlib.suppress(Exception):
                self._db.close()
            self._db = None

    @property
    def encrypted(self) -> bool:
        """Return whether the connection is encrypted."""
        return bool(self._open().pgconn.ssl_in_use)

    def give_roles(self, statements: Sequence[str]) -> None:
        """Make the three roles, all or none."""
        with self._transaction():
            for statement in statements:
                self._run(statement)

    def _check_version(self, *, set_up: bool) -> None:
        if set_up:
            self._bring_up_to_date()
            return
        version = self._version()
        if version == 0:
            raise not_set_up(self.place)
        if version > VERSION:
            raise newer(self.place, version, VERSION)
        if version < VERSION:
            raise older(self.place, version, VERSION)

    def _version(self) -> int:
        there = self._run("SELECT to_regclass('ocmm.migration') IS NOT NULL").rows[0][0]
        if not there:
            return 0
        return int(str(self._run("SELECT coalesce(max(version), 0) FROM migration").rows[0][0]))

    def _bring_up_to_date(self) -> None:
        with self._transaction():
            self._run("SELECT pg_advisory_xact_lock(:lock)", {"lock": _LOCK})
            version = self._version()
            if version > VERSION:
                raise newer(self.place, version, VERSION)
            if version == 0:
                odd = self._run(
                    "SELECT count(*) FROM pg_class c JOIN pg_namespace n ON n.oid = c.relnamespace"
                    " WHERE n.nspname = 'ocmm'"
                ).rows[0][0]
                if odd:
                    raise foreign(self.place)
                self._run(f"CREATE SCHEMA IF NOT EXISTS {SCHEMA}")
            for step in range(version, VERSION):
                for statement in statements(step, POSTGRESQL):
                    self._run(statement)
                self._run(
                    "INSERT INTO migration (version, program) VALUES (:version, :program)",
                    {"version": step + 1, "program": __version__},
                )

    def _open(self) -> psycopg.Connection[tuple[Any, ...]]:
        if self._db is None:
            raise StorageError(
                "archive.closed", f"{self.place}: the archive is closed.", "Open it again."
            )
        return self._db

    def _run(self, sql: str, values: Mapping[str, Cell] | None = None) -> Table:
        text = _NAMED.sub(r"%(\1)s", sql) if values else sql
        # Statements are ours or typed by the person who asks; values never become part of them.
        with self._waiting():
            cursor = self._open().execute(text.encode(), values or None)
            columns = tuple(one.name for one in cursor.description or ())
            return Table(columns, tuple(cursor.fetchall()) if cursor.description else ())

    def _run_many(self, sql: str, values: Sequence[Mapping[str, Cell]]) -> None:
        if values:
            with self._waiting(), self._open().cursor() as cursor:
                cursor.executemany(_NAMED.sub(r"%(\1)s", sql).encode(), values)

    @contextlib.contextmanager
    def _transaction(self) -> Iterator[None]:
        import psycopg

        try:
            with self._begun():
                yield
        except (psycopg.Error, UnicodeError) as error:
            raise self._fault(error) from error

    @contextlib.contextmanager
    def _reading(self) -> Iterator[None]:
        import psycopg

        try:
            with self._begun():
                self._run("SET TRANSACTION READ ONLY")
                yield
        except (psycopg.Error, UnicodeError) as error:
            raise self._fault(error) from error

    @contextlib.contextmanager
    def _begun(self) -> Iterator[None]:
        """Open a transaction; its beginning and its end are waited for like any statement."""
        block = self._open().transaction()
        with self._waiting():
            block.__enter__()
        try:
            yield
        except BaseException:
            with self._waiting():
                block.__exit__(*sys.exc_info())
            raise
        with self._waiting():
            block.__exit__(None, None, None)

    def _waiting(self) -> AbstractContextManager[object]:
        return contextlib.nullcontext() if self._patience is None else self._patience

    def _fault(self, error: Exception) -> OcmmError:
        if self._patience is not None and self._patience.ran_out:
            return silent_server(self.place)
        return postgresql_fault(self.place, error)

    def _now(self) -> datetime:
        found = self._run("SELECT clock_timestamp()").rows[0][0]
        assert isinstance(found, datetime)  # noqa: S101 - the type of that function
        return found
