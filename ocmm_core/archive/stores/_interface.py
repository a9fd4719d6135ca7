"""The interface of an archive: what the rest of the program knows of it.

Rows are only ever added: a job that goes on is a new version, what becomes known later is a mark.
So a station needs no right to change anything, and what was stored stays.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from enum import Enum
from types import UnionType
from typing import Protocol

from ocmm_core.archive.records import Delivery, JobRecord, MarkRow, Sender

Cell = str | float | int | bytes | None
Row = tuple[Cell, ...]
Kind = type | UnionType
"""What a cell of an answer is."""

HEADS = "heads"
"""Kind of the findings with the signed ends of histories (`seals.signed_heads`)."""
CLOCK_TELL_S = 300.0
"""A clock that is off by more is told: a day's list would have jobs of another day."""


class Answer(Enum):
    """What became of a delivery."""

    STORED = "stored"
    KNOWN = "known"
    """It was there already: nothing was added but the number of the delivery."""


@dataclass(frozen=True, slots=True)
class Receipt:
    """The answer to a delivery."""

    answer: Answer
    """What became of it."""
    job: int
    """Number of the row."""
    clock_off_s: float
    """How far the clock of the sender is ahead of that of the archive."""


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
    received_utc: str
    """`utc`, `received_utc`: By the clock of who wrote it, and by that of the archive."""


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

    def heads(self, job_uuid: str, station: str) -> dict[int, str]:
        """Return the head of each sound version that a station sent of a job, by its steps."""

    def last_sequence(self, outbox: str) -> int:
        """Return the highest number of an outbox that arrived from this login; 0 for none."""

    def arrived(self, outbox: str, sequences: Sequence[int]) -> set[int]:
        """Return which of these numbers of an outbox arrived from this login."""

    def content(self, sha256: str) -> bytes:
        """Return a job file as it was stored; StorageError where it is not."""

    def record(self, job: int) -> JobRecord:
        """Return the rows of a job by its number."""

    def ask(self, sql: str, values: Mapping[str, Cell] | None = None, *kinds: Kind) -> Table:
        """Return the answer to SQL that names values as ``:name``; it can change nothing.

        Where kinds are given, each row has such cells; a server may say anything.
        """

    def now(self) -> datetime:
        """Return the time by the clock of the archive."""

    def add_finding(
        self, kind: str, subject: str, document: str, who: str, utc: str,
        marks: Sequence[MarkRow] = (),
    ) -> int:  # fmt: skip
        """Keep a document with its marks, all or nothing; return its number."""

    def findings(self, after: int = 0) -> list[Finding]:
        """Return documents with a higher number, oldest first."""

    def marks(self, after: int = 0) -> list[tuple[int, MarkRow]]:
        """Return marks with a higher number, oldest first, each with its number."""

    def admit(self, login: str, station: str) -> None:
        """Let a login of the server send as a station, from now on."""

    def replace_computer(self, station: str, sender: Sender) -> None:
        """Let another computer be this station from now on."""

    def close(self) -> None:
        """Let go; may be called twice."""
