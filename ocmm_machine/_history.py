"""Register of a machine: every change of an offset, signed, chained and undoable.

Each line states all values before and after it, so that files of corrections have absolute values:
loading one twice changes nothing more.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import datetime
from typing import Literal

import msgspec

from ocmm_machine._document import CorrectionDocument
from ocmm_machine._facts import PartFacts


class CorrectionLine(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One change of a machine's offsets."""

    utc: str
    who: str
    software: str
    what: Literal["corrected", "undone", "stated"]
    """By a job; back to the values before; or read by a person from the control."""
    document: str
    """SHA-256 of the document of corrections."""
    before: dict[str, float]
    after: dict[str, float]
    """`before`, `after`: values of all offsets of the document, mm or degrees."""
    expanded: dict[str, float] = {}
    """U of the changes."""
    job: str = ""
    serial: str = ""
    jobs: tuple[str, ...] = ()
    serials: tuple[str, ...] = ()
    """`job`, `serial`: the source. `jobs`, `serials`: all parts used, by UUID and number."""
    characteristics: tuple[str, ...] = ()
    undoes: int = 0
    """Number of the line that is undone, from 1 on."""
    reason: str = ""

    @property
    def changed(self) -> list[str]:
        """Return the names of the changed offsets."""
        return [one for one, value in self.after.items() if value != self.before.get(one)]


def values_in_force(
    document: CorrectionDocument, lines: Sequence[CorrectionLine]
) -> dict[str, float]:
    """Return the values of all offsets after these lines."""
    values = {one.name: one.present for one in document.offset}
    for line in lines:
        values |= {name: value for name, value in line.after.items() if name in values}
    return values


def count_since(
    document: CorrectionDocument, parts: Sequence[PartFacts], lines: Sequence[CorrectionLine]
) -> Iterator[PartFacts]:
    """Yield the parts that were cut with the values in force now, oldest first."""
    times = [datetime.fromisoformat(line.utc) for line in lines]
    now = values_in_force(document, lines)
    seen: dict[int, int] = {}
    for part in parts:
        before = sum(time <= part.created for time in times)
        seen[before] = seen.get(before, 0) + 1
        dead = document.dead_parts if before else 0
        if seen[before] > dead and values_in_force(document, lines[:before]) == now:
            yield part
