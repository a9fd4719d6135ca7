"""The interface of an archive, and everything that both stores do alike.

Rows are only ever added: a job that goes on is a new version, what becomes known later is a mark.
So a station needs no right to change anything, and what was stored stays.
"""

from __future__ import annotations

import hashlib
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from datetime import datetime
from enum import Enum
from types import TracebackType
from typing import Protocol

from ocmm_core.archive._faults import damaged_file, name_taken, sequence_taken
from ocmm_core.archive._rows import (
    Delivery,
    JobRecord,
    JobRow,
    MarkRow,
    ResultRow,
    Sender,
    UseRow,
    check_delivery,
    check_mark,
)
from ocmm_core.errors import InputError, StorageError

Cell = str | float | int | bytes | None
Row = tuple[Cell, ...]

CLOCK_TELL_S = 300.0
"""A clock that is off by more is told: a day's list would have jobs of another day."""


class Answer(Enum):
    """What became of a delivery."""

    STORED = "stored"
    KNOWN = "known"
    """It was there already: nothing was added but the number of the delivery."""


@dataclass(frozen=True, slots=True)
class Receipt:
    """The answer to a delivery.

    Attributes
    ----------
    answer
        What became of it.
    job
        Number of the row.
    clock_off_s
        How far the clock of the sender is ahead of that of the archive.
    """

    answer: Answer
    job: int
    clock_off_s: float


@dataclass(frozen=True, slots=True)
class Table:
    """Answer to a question: names of the columns, and rows."""

    columns: tuple[str, ...]
    rows: tuple[Row, ...]


@dataclass(frozen=True, slots=True)
class Finding:
    """A document about archived jobs, such as that of a recall."""

    id: int
    kind: str
    subject: str
    document: str
    who: str
    utc: str


class Archive(Protocol):
    """What the rest of the program knows of an archive; one thread at a time uses it.

    All methods raise StorageError where the archive cannot be reached, read or written, and
    InputError where it refuses what it is given.
    """

    place: str

    def put(self, delivery: Delivery) -> Receipt:
        """Keep a job, once, however often it is delivered."""

    def put_all(self, deliveries: Sequence[Delivery]) -> list[Receipt]:
        """Keep many, all or none."""

    def heads(self, job_uuid: str) -> dict[int, str]:
        """Return the head of each sound version of a job by its number of steps."""

    def last_sequence(self, outbox: str) -> int:
        """Return the highest number of an outbox that arrived; 0 for none."""

    def arrived(self, outbox: str, sequences: Sequence[int]) -> set[int]:
        """Return which of these numbers of an outbox arrived."""

    def content(self, sha256: str) -> bytes:
        """Return a job file as it was stored; StorageError where it is not."""

    def record(self, job: int) -> JobRecord:
        """Return the rows of a job by its number."""

    def ask(self, sql: str, values: Mapping[str, Cell] | None = None) -> Table:
        """Return the answer to SQL that names values as ``:name``; it can change nothing."""

    def add_finding(
        self, kind: str, subject: str, document: str, who: str, utc: str,
        marks: Sequence[MarkRow] = (),
    ) -> int:  # fmt: skip
        """Keep a document with its marks, all or nothing; return its number."""

    def findings(self, after: int = 0) -> list[Finding]:
        """Return documents with a higher number, oldest first."""

    def marks(self, after: int = 0) -> list[tuple[int, MarkRow]]:
        """Return marks with a higher number, oldest first, each with its number."""

    def replace_computer(self, station: str, sender: Sender) -> None:
        """Let another computer be this station from now on."""

    def close(self) -> None:
        """Let go; may be called twice."""


_JOB_FIELDS = JobRow.__struct_fields__
_RESULT_FIELDS = ResultRow.__struct_fields__


def _insert(table: str, fields: Sequence[str], more: str = "") -> str:
    # Names are those of our own classes, never of a message.
    named = ", ".join(f":{field}" for field in fields)
    return f"INSERT INTO {table} ({', '.join(fields)}) VALUES ({named}) {more}".strip()  # noqa: S608


_ADD_JOB = _insert("job", (*_JOB_FIELDS, "sound"), "RETURNING id")
_ADD_RESULT = _insert("result", ("job", "part", "created_utc", *_RESULT_FIELDS))
_ADD_USE = _insert("used", ("job", "kind", "identity", "name", "created_utc"))
_ADD_FILE = _insert("file", ("sha256", "size", "content"), "ON CONFLICT DO NOTHING")
_ADD_DELIVERY = _insert("delivery", ("outbox", "sequence", "job", "sha256", "sent_utc"))
_ADD_STATION = _insert("station", ("name", "machine", "host"), "ON CONFLICT DO NOTHING")
_ADD_SENDER = _insert(
    "sender", ("outbox", "station", "machine", "username"), "ON CONFLICT DO NOTHING"
)
_MARK_FIELDS = MarkRow.__struct_fields__
_ADD_MARK = _insert("mark", _MARK_FIELDS)
_ADD_FINDING = _insert("finding", ("kind", "subject", "document", "who", "utc"), "RETURNING id")
_OF_DELIVERY = "SELECT job, sha256 FROM delivery WHERE outbox = :outbox AND sequence = :sequence"
_OF_VERSION = (
    "SELECT id FROM job WHERE job_uuid = :job_uuid AND steps = :steps AND head = :head"
    " AND sound = :sound"
)
_COLUMNS = ", ".join(_JOB_FIELDS)
_OF_JOB = f"SELECT {_COLUMNS} FROM job WHERE id = :id"  # noqa: S608 - names of our own class


class SqlArchive(ABC):
    """An archive in SQL; a store says how it is reached.

    Attributes
    ----------
    place
        What people call it; without a password.
    """

    place: str

    @abstractmethod
    def _run(self, sql: str, values: Mapping[str, Cell] | None = None) -> Table:
        """Carry out a statement that names values as ``:name``; raises what the store raises."""

    @abstractmethod
    def _run_many(self, sql: str, values: Sequence[Mapping[str, Cell]]) -> None:
        """Carry out a statement for each of them."""

    @abstractmethod
    def _transaction(self) -> AbstractContextManager[None]:
        """Open a transaction that is undone where the body raises; errors become sentences."""

    @abstractmethod
    def _reading(self) -> AbstractContextManager[None]:
        """Open a transaction in which nothing can be written."""

    @abstractmethod
    def _now(self) -> datetime:
        """Return the time by the clock of the store."""

    @abstractmethod
    def close(self) -> None:
        """Let go; may be called twice."""

    def put(self, delivery: Delivery) -> Receipt:
        """Keep a job, once, however often it is delivered: see `Archive`."""
        return self.put_all([delivery])[0]

    def put_all(self, deliveries: Sequence[Delivery]) -> list[Receipt]:
        """Keep many, all or none: see `Archive`."""
        for delivery in deliveries:
            check_delivery(delivery)
            if hashlib.sha256(delivery.content).hexdigest() != delivery.record.job.sha256:
                raise InputError(
                    "archive.row",
                    "The archive cannot keep this job: its file is not the one that its rows are "
                    "about.",
                    "Send it again.",
                )
        with self._transaction():
            now = self._now()
            return [self._put(delivery, now) for delivery in deliveries]

    def _put(self, delivery: Delivery, now: datetime) -> Receipt:
        sender, job = delivery.sender, delivery.record.job
        number: dict[str, Cell] = {"outbox": sender.outbox, "sequence": delivery.sequence}
        off = (datetime.fromisoformat(delivery.sent_utc) - now).total_seconds()
        found = self._run(_OF_DELIVERY, number).rows
        if found:
            if found[0][1] != job.sha256:
                raise sequence_taken(sender.outbox, delivery.sequence)
            return Receipt(Answer.KNOWN, _whole(found[0][0]), off)
        self._admit(sender)
        # A file that was altered without its head is a version of its own: it must be seen.
        version: dict[str, Cell] = {
            "job_uuid": job.job_uuid, "steps": job.steps, "head": job.head,
            "sound": int(not job.fault),
        }  # fmt: skip
        there = self._run(_OF_VERSION, version).rows
        if there:
            row, answer = _whole(there[0][0]), Answer.KNOWN
        else:
            row, answer = self._add(delivery), Answer.STORED
        self._run(
            _ADD_DELIVERY, {**number, "job": row, "sha256": job.sha256,
                            "sent_utc": delivery.sent_utc},
        )  # fmt: skip
        return Receipt(answer, row, off)

    def _admit(self, sender: Sender) -> None:
        """Let a sender in; StorageError where another computer has its name.

        A name belongs to the computer that used it first. One of an archive that was made from job
        files belongs to nobody yet.
        """
        name: dict[str, Cell] = {"name": sender.station}
        claim = (
            "SELECT coalesce(nullif(s.machine, ''), (SELECT x.machine FROM sender x"
            " WHERE x.station = s.name AND x.machine <> '' ORDER BY x.since_utc LIMIT 1), ''),"
            " s.host, s.since_utc FROM station s WHERE s.name = :name"
        )
        found = self._run(claim, name).rows
        if not found:
            self._run(_ADD_STATION, {**name, "machine": sender.machine, "host": sender.host})
            found = self._run(claim, name).rows
        machine, host, since = found[0]
        if machine not in ("", sender.machine):
            raise name_taken(sender.station, str(host), str(since))
        self._run(
            _ADD_SENDER,
            {
                "outbox": sender.outbox, "station": sender.station, "machine": sender.machine,
                "username": sender.user,
            },
        )  # fmt: skip

    def _add(self, delivery: Delivery) -> int:
        record = delivery.record
        job = record.job
        self._run(_ADD_FILE, {"sha256": job.sha256, "size": job.size, "content": delivery.content})
        values: dict[str, Cell] = {field: getattr(job, field) for field in _JOB_FIELDS}
        values |= {"complete": int(job.complete), "simulated": int(job.simulated)}
        values["sound"] = int(not job.fault)
        number = _whole(self._run(_ADD_JOB, values).rows[0][0])
        both: dict[str, Cell] = {"job": number, "created_utc": job.created_utc}
        self._run_many(
            _ADD_RESULT,
            [
                {**both, "part": job.part, **{f: getattr(row, f) for f in _RESULT_FIELDS}}
                for row in record.results
            ],
        )
        self._run_many(
            _ADD_USE,
            [
                {**both, "kind": use.kind, "identity": use.identity, "name": use.name}
                for use in record.uses
            ],
        )
        return number

    def heads(self, job_uuid: str) -> dict[int, str]:
        """Return the head of each version of a job: see `Archive`."""
        table = self.ask(
            "SELECT steps, head FROM job WHERE job_uuid = :job_uuid AND sound = 1 ORDER BY id DESC",
            {"job_uuid": job_uuid},
        )
        return {_whole(steps): str(head) for steps, head in table.rows}

    def last_sequence(self, outbox: str) -> int:
        """Return the highest number of an outbox that arrived: see `Archive`."""
        table = self.ask(
            "SELECT coalesce(max(sequence), 0) FROM delivery WHERE outbox = :outbox",
            {"outbox": outbox},
        )
        return _whole(table.rows[0][0])

    def arrived(self, outbox: str, sequences: Sequence[int]) -> set[int]:
        """Return which numbers of an outbox arrived: see `Archive`."""
        if not sequences:
            return set()
        table = self.ask(
            "SELECT sequence FROM delivery WHERE outbox = :outbox"
            " AND sequence BETWEEN :least AND :most",
            {"outbox": outbox, "least": min(sequences), "most": max(sequences)},
        )
        return {_whole(row[0]) for row in table.rows} & set(sequences)

    def content(self, sha256: str) -> bytes:
        """Return a job file as it was stored: see `Archive`."""
        rows = self.ask("SELECT content FROM file WHERE sha256 = :sha256", {"sha256": sha256}).rows
        if not rows:
            raise StorageError(
                "archive.no_file",
                f"{self.place}: there is no job file {sha256[:12]}.",
                "Check its SHA-256; ocmm archive verify names what is missing.",
            )
        content = rows[0][0]
        if not isinstance(content, bytes) or hashlib.sha256(content).hexdigest() != sha256:
            raise damaged_file(sha256)
        return content

    def record(self, job: int) -> JobRecord:
        """Return the rows of a job by its number: see `Archive`."""
        found = self.ask(_OF_JOB, {"id": job}).rows
        if not found:
            raise StorageError(
                "archive.no_job", f"{self.place}: there is no job {job}.", "Ask for another one."
            )
        fields = dict(zip(_JOB_FIELDS, found[0], strict=True))
        fields |= {name: bool(fields[name]) for name in ("complete", "simulated")}
        results = self.ask(
            "SELECT position, characteristic, kind, unit, nominal, low, high, value, uncertainty,"
            " verdict, why_not FROM result WHERE job = :id ORDER BY position",
            {"id": job},
        )
        uses = self.ask(
            "SELECT kind, identity, name FROM used WHERE job = :id ORDER BY kind, identity",
            {"id": job},
        )
        return JobRecord(
            job=JobRow(**fields),  # type: ignore[arg-type] # the columns are its fields
            results=tuple(
                ResultRow(**dict(zip(_RESULT_FIELDS, row, strict=True)))  # type: ignore[arg-type]
                for row in results.rows
            ),
            uses=tuple(
                UseRow(**dict(zip(("kind", "identity", "name"), row, strict=True)))  # type: ignore[arg-type]
                for row in uses.rows
            ),
        )

    def ask(self, sql: str, values: Mapping[str, Cell] | None = None) -> Table:
        """Return the answer of a question: see `Archive`."""
        with self._reading():
            return self._run(sql, values)

    def add_finding(
        self, kind: str, subject: str, document: str, who: str, utc: str,
        marks: Sequence[MarkRow] = (),
    ) -> int:  # fmt: skip
        """Keep a document with its marks: see `Archive`."""
        for mark in marks:
            check_mark(mark)
        with self._transaction():
            fields: dict[str, Cell] = {
                "kind": kind, "subject": subject, "document": document, "who": who, "utc": utc,
            }  # fmt: skip
            number = _whole(self._run(_ADD_FINDING, fields).rows[0][0])
            self._run_many(
                _ADD_MARK,
                [
                    {field: getattr(mark, field) for field in _MARK_FIELDS}
                    | {"holds": int(mark.holds), "finding": number}
                    for mark in marks
                ],
            )
        return number

    def findings(self, after: int = 0) -> list[Finding]:
        """Return documents with a higher number: see `Archive`."""
        table = self.ask(
            "SELECT id, kind, subject, document, who, utc FROM finding WHERE id > :after"
            " ORDER BY id",
            {"after": after},
        )
        return [Finding(_whole(row[0]), *(str(cell) for cell in row[1:])) for row in table.rows]

    def marks(self, after: int = 0) -> list[tuple[int, MarkRow]]:
        """Return marks with a higher number: see `Archive`."""
        table = self.ask(
            "SELECT id, job_uuid, kind, holds, why, who, utc, finding FROM mark WHERE id > :after"
            " ORDER BY id",
            {"after": after},
        )
        return [
            (
                _whole(number),
                MarkRow(
                    job_uuid=str(job), kind=str(kind), holds=bool(holds), why=str(why),
                    who=str(who), utc=str(utc), finding=_whole(finding),
                ),
            )
            for number, job, kind, holds, why, who, utc, finding in table.rows
        ]  # fmt: skip

    def replace_computer(self, station: str, sender: Sender) -> None:
        """Let another computer be this station from now on: see `Archive`."""
        with self._transaction():
            self._run(
                "UPDATE station SET machine = :machine, host = :host WHERE name = :name",
                {"machine": sender.machine, "host": sender.host, "name": station},
            )

    @abstractmethod
    def give_roles(self, statements: Sequence[str]) -> None:
        """Carry out the statements that make roles; a store without users has none to make."""

    def __enter__(self) -> SqlArchive:
        """Return the archive."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Let go."""
        self.close()


def _whole(cell: Cell) -> int:
    if not isinstance(cell, int):
        raise StorageError(
            "archive.foreign", "A number in the archive is none.", "Restore it from a backup."
        )
    return cell
