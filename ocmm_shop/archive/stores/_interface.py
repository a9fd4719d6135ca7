"""Interface of an archive for the program: rows are only ever added.

A resumed job is a new version, a finding a mark: stations need no right to change. Keys of stations
are registered by proof of possession, regardless of rows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from enum import Enum
from pathlib import Path
from types import UnionType
from typing import Protocol

from ocmm_core.seals import KeptKeys, SealWord, Signature, Signed, judge_signature
from ocmm_shop.archive.records import Delivery, JobRecord, MarkRow, Sender, station_claim

Cell = str | float | int | bytes | None
Row = tuple[Cell, ...]
Kind = type | UnionType

HEADS = "heads"
"""Kind of the findings with the signed ends of histories (`seals.signed_heads`)."""
MALFORMED = "Altered in the archive: a value of this row does not fit its column."
CLOCK_TELL_S = 300.0
"""Larger clock differences are reported: a day's list would have jobs of another day."""


class Acknowledgement(Enum):
    """Result of a delivery."""

    STORED = "stored"
    KNOWN = "known"
    """Already present: only the number of the delivery was added."""


@dataclass(frozen=True, slots=True)
class Receipt:
    answer: Acknowledgement
    job: int
    clock_off_s: float
    """Lead of the sender's clock over the archive's."""


@dataclass(frozen=True, slots=True)
class Table:
    """Names of the columns, and rows."""

    columns: tuple[str, ...]
    rows: tuple[Row, ...]
    malformed: frozenset[int] = frozenset()
    """Indices of rows with a value that its column cannot have, replaced by a neutral one."""

    @property
    def sound(self) -> tuple[Row, ...]:
        """Return the rows that are not malformed."""
        return tuple(row for at, row in enumerate(self.rows) if at not in self.malformed)


@dataclass(frozen=True, slots=True)
class ArchivedDocument:
    """A document about archived jobs, such as that of a recall."""

    id: int
    kind: str
    subject: str
    document: str
    who: str
    utc: str
    received_utc: str
    """`utc`, `received_utc`: By the clocks of the author and of the archive."""


class Archive(Protocol):
    """Archive; one thread at a time; StorageError: unreachable; InputError: refused input."""

    place: str

    def put(self, delivery: Delivery) -> Receipt:
        """Store a job, once for any number of deliveries."""

    def put_all(self, deliveries: Sequence[Delivery]) -> list[Receipt]:
        """Store many, all or none."""

    def heads(self, job_uuid: str, station: str) -> dict[int, str]:
        """Return the head of each sound version of a job sent by a station, by its steps."""

    def last_sequence(self, outbox: str) -> int:
        """Return the highest number of an outbox that arrived from this login; 0 for none."""

    def arrived(self, outbox: str, sequences: Sequence[int]) -> set[int]:
        """Return which of these numbers of an outbox arrived from this login."""

    def content(self, sha256: str) -> bytes:
        """Return a stored job file; StorageError if missing."""

    def record(self, job: int) -> JobRecord:
        """Return the rows of a job by its number."""

    def query(self, sql: str, values: Mapping[str, Cell] | None = None, *kinds: Kind) -> Table:
        """Return the answer to read-only SQL, values ``:name``; cells are checked against kinds."""

    def now(self) -> datetime:
        """Return the time by the clock of the archive."""

    def add_finding(
        self, kind: str, subject: str, document: str, who: str, utc: str,
        marks: Sequence[MarkRow] = (),
    ) -> int:  # fmt: skip
        """Store a document with its marks in one transaction; return its number."""

    def findings(self, after: int = 0) -> list[ArchivedDocument]:
        """Return documents with a higher number, oldest first."""

    def marks(self, after: int = 0) -> list[tuple[int, MarkRow]]:
        """Return marks with a higher number, oldest first, each with its number."""

    def malformed(self) -> list[str]:
        """Return the values in all tables that their columns cannot have, as sentences."""

    def admit(self, login: str, station: str) -> None:
        """Authorise a login of the server to send as a station."""

    def replace_computer(self, station: str, sender: Sender) -> None:
        """Replace the computer of a station."""

    def close(self) -> None:
        """Close; may be called twice."""


def verifies(what: Signed, content: bytes, key: str, signature: str) -> bool:
    """Return whether a key signed this, trusted or not."""
    nobody = KeptKeys(Path("/nonexistent"))
    state = judge_signature(nobody, what, content, Signature(key, signature))
    return state.word is SealWord.UNKNOWN_KEY


def stations_by_key(archive: Archive) -> dict[str, set[str]]:
    """Return the stations that proved possession of a key, by key."""
    found: dict[str, set[str]] = {}
    rows = archive.query("SELECT station, key, proof FROM archive_station_key").rows
    for station, key, proof in rows:
        if verifies(Signed.STATION, station_claim(str(station)), str(key), str(proof)):
            found.setdefault(str(key), set()).add(str(station))
    return found
