"""Values in and out of an archive: cells, tables, receipts and documents."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from types import UnionType

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
