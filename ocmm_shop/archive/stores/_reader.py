"""Read methods, and statements that add and find rows, the same for both stores."""

from __future__ import annotations

import contextlib
import hashlib
import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from datetime import UTC, datetime
from typing import Self

import msgspec

from ocmm_core.errors import StorageError
from ocmm_shop.archive import records
from ocmm_shop.archive.stores._faults import not_understood
from ocmm_shop.archive.stores._interface import ArchivedDocument, Cell, Kind, Row, Table
from ocmm_shop.archive.stores._schema import column_kinds

JOB_FIELDS = records.JobRow.__struct_fields__
RESULT_FIELDS = records.ResultRow.__struct_fields__
USE_FIELDS = records.UseRow.__struct_fields__


def _insert(table: str, fields: Sequence[str], more: str = "") -> str:
    # Names are those of our own classes, never from a message.
    named = ", ".join(f":{field}" for field in fields)
    return f"INSERT INTO {table} ({', '.join(fields)}) VALUES ({named}) {more}".strip()  # noqa: S608


ADD_JOB = _insert("job", (*JOB_FIELDS, "sound"), "RETURNING id")
ADD_RESULT = _insert("result", ("job", "part", "created_utc", *RESULT_FIELDS))
ADD_USE = _insert("used", ("job", "kind", "identity", "name", "created_utc"))
ADD_FILE = _insert("file", ("sha256", "size", "content"), "ON CONFLICT DO NOTHING")
ADD_DELIVERY = _insert("delivery", ("outbox", "sequence", "job", "sha256", "sent_utc", "signature"))
ADD_STATION = _insert("station", ("name", "machine", "host"), "ON CONFLICT DO NOTHING")
ADD_SENDER = _insert(
    "sender", ("outbox", "station", "machine", "username"), "ON CONFLICT DO NOTHING"
)
ADD_STATION_KEY = _insert("station_key", ("station", "key", "proof"), "ON CONFLICT DO NOTHING")
ADD_STATION_LOGIN = _insert("station_login", ("login", "station"), "ON CONFLICT DO NOTHING")
MARK_FIELDS = records.MarkRow.__struct_fields__
ADD_MARK = _insert("mark", MARK_FIELDS)
ADD_FINDING = _insert("finding", ("kind", "subject", "document", "who", "utc"), "RETURNING id")
OF_DELIVERY = (
    "SELECT job, sha256 FROM delivery WHERE outbox = :outbox AND role = {who}"
    " AND sequence = :sequence"
)
"""Numbers of an outbox are per login: another one cannot use them up."""
OF_VERSION = (
    "SELECT id FROM job WHERE job_uuid = :job_uuid AND steps = :steps AND head = :head"
    " AND sound = :sound AND station = :station"
)
KEPT = (
    "SELECT d.sha256, f.sha256 = j.sha256 FROM delivery d JOIN job j ON j.id = d.job"
    " JOIN file f ON f.sha256 = j.sha256 WHERE d.outbox = :outbox AND d.role = {who}"
    " AND d.sequence = :sequence"
)
RESULTS_SHOWN = (
    "SELECT position, characteristic, kind, unit, nominal, low, high, value, uncertainty"
    " FROM archived_result WHERE job_id = :id ORDER BY position"
)
USES_SHOWN = (
    "SELECT used_kind, identity, name FROM archived_use WHERE job_id = :id"
    " ORDER BY used_kind, identity"
)
"""From the views, because a station may read no more."""
_COLUMNS = ", ".join(JOB_FIELDS)
OF_JOB = f"SELECT {_COLUMNS} FROM job WHERE id = :id"  # noqa: S608 - names of our own class


_NEUTRAL: Mapping[str, Cell] = {
    "TEXT": "", "INTEGER": 0, "BLOB": b"", "REAL": None, "TIME": "1970-01-01T00:00:00.000+00:00",
}  # fmt: skip


def _fits(cell: Cell, kind: str) -> bool:
    """Return whether a column of a kind (`column_kinds`, empty: unknown) can have this value."""
    if isinstance(cell, float):
        return kind in ("REAL", "") and math.isfinite(cell)
    if kind == "TIME" and isinstance(cell, str):
        with contextlib.suppress(ValueError):
            return 1 < datetime.fromisoformat(cell).year < datetime.max.year
        return False
    return not kind or (kind == "REAL" and cell is None) or type(cell) is type(_NEUTRAL[kind])


def _neutral(table: Table) -> Table:
    """Return a table with neutral values in place of those that its columns cannot have.

    Files of SQLite accept any type in any column, both stores any text as a time and any float.
    """
    bad: dict[int, list[Cell]] = {}
    for column, name in enumerate(table.columns):
        kind = column_kinds().get(name, "")
        simple = type(_NEUTRAL[kind]) if kind in ("TEXT", "INTEGER", "BLOB") else None
        for at, row in enumerate(table.rows):
            if type(row[column]) is not simple and not _fits(row[column], kind):
                bad.setdefault(at, list(row))[column] = _NEUTRAL.get(kind)
    if not bad:
        return table
    rows = tuple(tuple(bad.get(at, row)) for at, row in enumerate(table.rows))
    return Table(table.columns, rows, frozenset(bad))


class SqlReader(ABC):
    """Read an archive in SQL."""

    place: str
    """Display name without password."""
    _who: str
    """SQL of the login, as in column ``role``."""

    @abstractmethod
    def _run(self, sql: str, values: Mapping[str, Cell] | None = None) -> Table:
        """Execute a statement with values as ``:name``; raises the store's errors."""

    @abstractmethod
    def _reading(self) -> AbstractContextManager[None]:
        """Open a read-only transaction."""

    @abstractmethod
    def close(self) -> None:
        """Close; may be called twice."""

    @abstractmethod
    def _now(self) -> datetime:
        """Return the time by the clock of the store."""

    def now(self) -> datetime:
        """Return the time by the clock of the archive."""
        with self._reading():
            return self._now()

    def heads(self, job_uuid: str, station: str) -> dict[int, str]:
        """Return the head of each sound version of a job sent by a station, by its steps."""
        table = self.query(
            "SELECT steps, head FROM job WHERE job_uuid = :job_uuid AND station = :station"
            " AND sound = 1 ORDER BY id DESC",
            {"job_uuid": job_uuid, "station": station}, int, str,
        )  # fmt: skip
        return {whole_of(steps): str(head) for steps, head in table.sound}

    def last_sequence(self, outbox: str) -> int:
        """Return the highest number of an outbox that arrived from this login; 0 for none."""
        with self._reading():
            (last,) = self._one(
                "SELECT coalesce(max(CAST(sequence AS bigint)), 0) FROM delivery"  # noqa: S608
                f" WHERE outbox = :outbox AND sequence <= :most AND role = {self._who}",
                {"outbox": outbox, "most": records.MOST_WHOLE}, int,
            )  # fmt: skip
        return whole_of(last)

    def arrived(self, outbox: str, sequences: Sequence[int]) -> set[int]:
        """Return which of these numbers of an outbox arrived from this login."""
        if not sequences:
            return set()
        table = self.query(
            f"SELECT sequence FROM delivery WHERE outbox = :outbox AND role = {self._who}"  # noqa: S608
            " AND sequence BETWEEN :least AND :most",
            {"outbox": outbox, "least": min(sequences), "most": max(sequences)}, int,
        )  # fmt: skip
        return {whole_of(row[0]) for row in table.rows} & set(sequences)

    def content(self, sha256: str) -> bytes:
        rows = self.query(
            "SELECT content FROM file WHERE sha256 = :sha256", {"sha256": sha256}
        ).rows
        if not rows:
            raise StorageError(
                "archive.no_file",
                f"{self.place}: there is no job file {sha256[:12]}.",
                "Check its SHA-256; ocmm archive verify names what is missing.",
            )
        content = rows[0][0]
        if not isinstance(content, bytes) or hashlib.sha256(content).hexdigest() != sha256:
            raise StorageError(
                "archive.altered",
                f"Job file {sha256[:12]} in the archive is not as it was stored.",
                "Restore it from a backup, or send it again from its station.",
            )
        return content

    def record(self, job: int) -> records.JobRecord:
        """Return the rows of a job by its number."""
        jobs = self.query(OF_JOB, {"id": job})
        if not jobs.rows:
            raise StorageError(
                "archive.no_job", f"{self.place}: there is no job {job}.", "Ask for another one."
            )
        results = self.query(
            f"SELECT {', '.join(RESULT_FIELDS)} FROM result WHERE job = :id ORDER BY position",  # noqa: S608 - names of our own class
            {"id": job},
        )
        uses = self.query(
            "SELECT kind, identity, name FROM used WHERE job = :id ORDER BY kind, identity",
            {"id": job},
        )
        if any(table.malformed for table in (jobs, results, uses)):
            raise not_understood(self.place, f"a value of another type in job {job}")
        try:
            fields = dict(zip(JOB_FIELDS, jobs.rows[0], strict=True))
            fields |= {name: bool(fields[name]) for name in ("complete", "simulated")}
            return msgspec.convert(
                {
                    "job": fields,
                    "results": [dict(zip(RESULT_FIELDS, row, strict=True)) for row in results.rows],
                    "uses": [dict(zip(USE_FIELDS, row, strict=True)) for row in uses.rows],
                },
                records.JobRecord,
            )
        except (msgspec.ValidationError, ValueError) as error:
            raise not_understood(self.place, str(error)) from error

    def query(self, sql: str, values: Mapping[str, Cell] | None = None, *kinds: Kind) -> Table:
        with self._reading():
            table = self._ask(sql, values)
        return self._table(table, kinds) if kinds else _neutral(table)

    def _ask(self, sql: str, values: Mapping[str, Cell] | None) -> Table:
        """Run one statement of a user, who must not end the transaction by a second one."""
        return self._run(sql, values)

    def _table(self, table: Table, kinds: Sequence[Kind]) -> Table:
        table = _neutral(table)
        for row in table.rows:
            if len(row) != len(kinds) or not all(map(isinstance, row, kinds)):
                shown = ", ".join(type(cell).__name__ for cell in row[:20])
                raise not_understood(self.place, f"a row of {shown or 'nothing'}")
        return table

    def _one(self, sql: str, values: Mapping[str, Cell], *kinds: Kind) -> Row:
        rows = self._table(self._run(sql, values), kinds).rows
        if len(rows) != 1:
            raise not_understood(self.place, f"{len(rows)} rows where there is one")
        return rows[0]

    def findings(self, after: int = 0) -> list[ArchivedDocument]:
        """Return documents with a higher number, oldest first."""
        table = self.query(
            "SELECT id, kind, subject, document, who, utc, received_utc FROM finding"
            " WHERE id > :after ORDER BY id",
            {"after": after}, int, *(str,) * 6,
        )  # fmt: skip
        return [
            ArchivedDocument(whole_of(row[0]), *(str(cell) for cell in row[1:]))
            for row in table.sound
        ]

    def marks(self, after: int = 0) -> list[tuple[int, records.MarkRow]]:
        """Return marks with a higher number, oldest first, each with its number."""
        table = self.query(
            "SELECT id, job_uuid, kind, holds, why, who, utc, finding FROM mark WHERE id > :after"
            " ORDER BY id",
            {"after": after}, int, str, str, int, str, str, str, int,
        )  # fmt: skip
        return [
            (
                whole_of(number),
                records.MarkRow(
                    job_uuid=str(job), kind=str(kind), holds=bool(holds) or at in table.malformed,
                    why=_line(why), who=_line(who), utc=_line(utc), finding=whole_of(finding),
                ),
            )
            for at, (number, job, kind, holds, why, who, utc, finding) in enumerate(table.rows)
        ]  # fmt: skip

    def malformed(self) -> list[str]:
        """Return none: a server checks the types of its columns."""
        return []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def whole_of(cell: Cell) -> int:
    """Return a count; StorageError if malformed."""
    if not isinstance(cell, int):
        raise StorageError(
            "archive.foreign", "A number in the archive is none.", "Restore it from a backup."
        )
    return cell


def _line(cell: Cell) -> str:
    """Return untrusted text for display; a mark holds in any case."""
    return records.shown_text(str(cell), " ")


def time_of(place: str, cell: Cell) -> datetime:
    """Return a time with its zone; StorageError if malformed."""
    try:
        return datetime.fromisoformat(str(cell)).astimezone(UTC)
    except (ValueError, OverflowError) as error:
        raise not_understood(place, str(error)) from error
