"""Archive on a PostgreSQL server, for a shop of many stations; needs the extra `shop`.

All tables are in the schema ``ocmm``. A station only adds rows; rights are those of `_roles`.
Broken connections are reopened at the next call; no wait exceeds its limits.
"""

from __future__ import annotations

import contextlib
import importlib.util
import re
import socket
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from datetime import date, datetime, timedelta
from datetime import time as clock_time
from decimal import Decimal
from enum import Enum
from typing import TYPE_CHECKING, Any, Self
from uuid import UUID

from ocmm_core import __version__
from ocmm_core.errors import InputError, OcmmError, StorageError
from ocmm_core.host import HOST
from ocmm_core.plugins import install_line
from ocmm_shop.archive.stores import _faults as faults
from ocmm_shop.archive.stores._address import PostgresAddress
from ocmm_shop.archive.stores._interface import Cell, Table
from ocmm_shop.archive.stores._reader import time_of, whole_of
from ocmm_shop.archive.stores._schema import POSTGRESQL, VERSION, statements
from ocmm_shop.archive.stores._store import Archive

if TYPE_CHECKING:
    import psycopg


_LOOK_S = 0.1
"""Interval of the supervision of an answer, s; most are there sooner."""


class GaveUp(Enum):
    SILENT = "silent"
    FLOODED = "flooded"


class Patience:
    """Shut a connection after a wait (``with``) over `limit_s`, or growth by `limit_bytes`."""

    def __init__(self, descriptor: int, limit_s: float, limit_bytes: int) -> None:
        self.gave_up: GaveUp | None = None
        self._limit_s, self._limit_bytes = limit_s, limit_bytes
        self._until, self._had = 0.0, -1
        # Own descriptor: that of the connection may be reused by then.
        self._socket = socket.socket(fileno=socket.dup(descriptor))
        self._changed = threading.Condition()
        self._waits = self._ended = False
        self._thread = threading.Thread(target=self._watch, name="patience", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Close; may be called twice."""
        with self._changed:
            self._ended = True
            self._changed.notify()
        self._thread.join()
        self._socket.close()

    def __enter__(self) -> Self:
        with self._changed:
            self._waits = True
            self._until, self._had = time.monotonic() + self._limit_s, -1
            self._changed.notify()
        return self

    def __exit__(self, *_: object) -> None:
        with self._changed:
            self._waits = False
            self._changed.notify()

    def _watch(self) -> None:
        with self._changed:
            while not self._ended:
                if not self._waits:
                    self._changed.wait()
                    continue
                left = self._until - time.monotonic()
                if not self._changed.wait(max(min(left, _LOOK_S), 0.0)) and self._waits:
                    self._poll()

    def _poll(self) -> None:
        has = HOST.resident_bytes()
        self._had = has if self._had < 0 else self._had
        if has - self._had > self._limit_bytes:
            self.gave_up = GaveUp.FLOODED
        elif time.monotonic() >= self._until:
            self.gave_up = GaveUp.SILENT
        else:
            return
        self._waits = False
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)


SCHEMA = "ocmm"
_CELLS = (str, int, float, bytes, bool)
_NAMED = re.compile(r"(?<![:\w]):([a-z_][a-z0-9_]*)")
_GRACE_S = 5.0
"""Time that a station waits for an answer beyond the server's own limit, s."""
_ANSWER_BYTES = 2 << 30
"""Growth of this process by one answer: the largest job file takes less than half."""
_ROWS = 2000
_ODD = (ValueError, TypeError, ArithmeticError, LookupError, NotImplementedError, MemoryError)
"""Raised by psycopg, in addition to its own, for malformed values."""
_LOCK = 0x4F434D41
"""Number of the advisory lock for the creation of an archive ("OCMA")."""


def require_psycopg() -> None:
    """Raise InputError if the extra `shop` is not installed."""
    if importlib.util.find_spec("psycopg") is None:
        raise InputError(
            "archive.shop",
            "An archive on a server needs psycopg, which is not installed.",
            f"Install it: {install_line('shop')}.",
        )


class PostgresArchive(Archive):
    """An archive on a server.

    `set_up`: create or update the tables, as owner. `read_only`: nothing can be added. InputError
    without the extra `shop`; StorageError: no server, no access, or no archive of this version.
    """

    _who = "SESSION_USER"

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
            # The server ends a statement first, with a reason; this is for a silent one.
            self._patience = Patience(
                self._db.fileno(), address.limit_ms / 1000.0 + _GRACE_S, _ANSWER_BYTES
            )
            self._db.read_only = read_only or None
            self._check_version(set_up=set_up)
        except (psycopg.Error, *_ODD) as error:
            fault = self._fault(error)
            self.close()
            raise fault from error
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        if self._patience is not None:
            self._patience.close()
            self._patience = None
        if self._db is not None:
            with contextlib.suppress(Exception):
                self._db.close()
            self._db = None

    @property
    def encrypted(self) -> bool:
        return bool(self._open().pgconn.ssl_in_use)

    def give_roles(self, statements: Sequence[str]) -> None:
        """Create the three roles, all or none."""
        with self._transaction():
            for statement in statements:
                self._run(statement)

    def _check_version(self, *, set_up: bool) -> None:
        if set_up:
            self._bring_up_to_date()
            return
        version = self._version()
        if version == 0:
            raise StorageError(
                "archive.not_set_up",
                f"{self.place}: there is no archive in this database.",
                "Whoever owns the database sets it up: ocmm archive set-up.",
            )
        if version > VERSION:
            raise faults.newer(self.place, version, VERSION)
        if version < VERSION:
            raise faults.older(self.place, version, VERSION)

    def _version(self) -> int:
        if not self._one("SELECT to_regclass('ocmm.migration') IS NOT NULL", {}, int)[0]:
            return 0
        (version,) = self._one("SELECT coalesce(max(version), 0) FROM migration", {}, int)
        return whole_of(version)

    def _bring_up_to_date(self) -> None:
        with self._transaction():
            if self._version():
                # Not the advisory lock: every login may hold that, but this one only those who may
                # change rows.
                self._run("LOCK TABLE migration IN SHARE ROW EXCLUSIVE MODE")
            else:
                self._run("SELECT pg_advisory_xact_lock(:lock)", {"lock": _LOCK})
            version = self._version()
            if version > VERSION:
                raise faults.newer(self.place, version, VERSION)
            if version == 0:
                odd = self._run(
                    "SELECT count(*) FROM pg_class c JOIN pg_namespace n ON n.oid = c.relnamespace"
                    " WHERE n.nspname = 'ocmm'"
                ).rows[0][0]
                if odd:
                    raise faults.foreign(self.place)
                self._run(f"CREATE SCHEMA IF NOT EXISTS {SCHEMA}")
            for step in range(version, VERSION):
                for statement in statements(step, POSTGRESQL):
                    self._run(statement)
                self._run(
                    "INSERT INTO migration (version, program) VALUES (:version, :program)",
                    {"version": step + 1, "program": __version__},
                )
                self._filled(step + 1)

    def _open(self) -> psycopg.Connection[tuple[Any, ...]]:
        if self._db is None:
            raise StorageError(
                "archive.closed", f"{self.place}: the archive is closed.", "Open it again."
            )
        return self._db

    def _run(
        self, sql: str, values: Mapping[str, Cell] | None = None, *, alone: bool = False
    ) -> Table:
        text = _NAMED.sub(r"%(\1)s", sql) if values else sql
        # Statements are ours or typed by the user; values never become part of them.
        with self._waiting(), self._open().cursor() as cursor:
            # Binary answers use the protocol for single statements: a COMMIT before another
            # statement would end the read-only transaction.
            cursor.execute(text.encode(), values or None, binary=alone or None)
            if not cursor.description:
                return Table((), ())
            columns = tuple(one.name for one in cursor.description)
            rows: list[tuple[Cell, ...]] = []
            while some := cursor.fetchmany(_ROWS):
                rows += map(self._cells, some)
                if self._patience is not None and self._patience.gave_up is not None:
                    raise self._fault(MemoryError())
            return Table(columns, tuple(rows))

    def _ask(self, sql: str, values: Mapping[str, Cell] | None) -> Table:
        return self._run(sql, values, alone=True)

    def _cells(self, row: tuple[Any, ...]) -> tuple[Cell, ...]:
        """Return a row with sums of integers as integers."""
        if all(cell is None or type(cell) in _CELLS for cell in row):
            return row
        found = [self._plain(cell) for cell in row]
        for cell in found:
            if cell is not None and not isinstance(cell, _CELLS):
                raise faults.not_understood(self.place, f"a {type(cell).__name__}")
        return tuple(found)

    def _plain(self, cell: Any) -> Any:
        if isinstance(cell, Decimal):
            return self._whole(cell)
        if isinstance(cell, date | clock_time):
            return cell.isoformat()
        return str(cell) if isinstance(cell, timedelta | UUID) else cell

    def _whole(self, number: Decimal) -> int:
        if not number.is_finite() or number != number.to_integral_value():
            raise faults.not_understood(self.place, "a sum that is no whole number")
        return int(number)

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
        except (psycopg.Error, *_ODD) as error:
            raise self._fault(error) from error

    @contextlib.contextmanager
    def _reading(self) -> Iterator[None]:
        import psycopg

        try:
            with self._begun():
                self._run("SET TRANSACTION READ ONLY")
                yield
        except (psycopg.Error, *_ODD) as error:
            raise self._fault(error) from error

    @contextlib.contextmanager
    def _begun(self) -> Iterator[None]:
        """Open a transaction, with limits on the waits at its start and end."""
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
        gave_up = None if self._patience is None else self._patience.gave_up
        if gave_up is GaveUp.SILENT:
            return faults.slow(self.place, "it took the connection and does not come to an end")
        if gave_up is GaveUp.FLOODED or isinstance(error, MemoryError):
            return faults.endless_answer(self.place, _ANSWER_BYTES)
        return faults.postgresql_fault(self.place, error)

    def _settle(self) -> None:
        # Run deferred triggers before the check.
        self._run("SET CONSTRAINTS ALL IMMEDIATE")

    def _now(self) -> datetime:
        (text,) = self._one(f"SELECT {POSTGRESQL.now}", {}, str)
        return time_of(self.place, text)
