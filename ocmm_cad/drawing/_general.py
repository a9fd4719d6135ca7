"""General tolerances of linear dimensions by a note on the drawing (ISO 2768-1)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import msgspec

from ocmm_core.documents import Document, load_document, resource
from ocmm_core.errors import InputError

_SCHEMA = "ocmm.general-tolerances/1"
Letter = Literal["f", "m", "c", "v"]
CLASSES: dict[str, Letter] = {f"iso2768-{letter}": letter for letter in ("f", "m", "c", "v")}
"""Accepted words."""


class ToleranceStep(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Deviations of nominal sizes up to ``to``, mm; zero if undefined."""

    to: float
    f: float
    m: float
    c: float
    v: float


class ToleranceTable(Document, frozen=True, kw_only=True, rename={"start": "from"}):
    name: str
    source: str
    """`name`, `source`: The standard, and the place in it."""
    start: float
    """mm: the smallest nominal size."""
    steps: list[ToleranceStep]


@dataclass(frozen=True, slots=True)
class General:
    """General tolerance requested by a note."""

    words: str
    """As on the drawing: ``ISO 2768-m``."""
    _letter: Letter
    _table: ToleranceTable

    def deviation(self, nominal: float) -> float | None:
        """Return the symmetric deviation of a size, mm; None beyond the table."""
        if nominal < self._table.start:
            return None
        for step in self._table.steps:
            if nominal <= step.to:
                found: float = getattr(step, self._letter)
                return found or None
        return None


def general_of(asked: str) -> General | None:
    """Return the general tolerance of a word, None if empty; InputError if unknown."""
    if not asked:
        return None
    letter = CLASSES.get(asked.lower())
    if letter is None:
        raise InputError(
            "plan.general",
            f"{asked!r} is no general tolerance.",
            f"Choose one of {', '.join(CLASSES)}, or none.",
        )
    table = load_document(resource("general_tolerances", "iso2768_1.toml"), ToleranceTable, _SCHEMA)
    return General(f"ISO 2768-{letter}", letter, table)
