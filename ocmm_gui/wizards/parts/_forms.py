"""What is filled in before a session of a wizard begins."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_core.tables import TableReader
from ocmm_gui.kit import later


@dataclass(frozen=True, slots=True)
class Field:
    """One thing to be filled in before a session begins."""

    key: str
    """Stable name."""
    label: str
    tip: str
    """`label`, `tip`: For people."""
    proposal: str = ""
    """What stands there at first."""
    choices: tuple[tuple[str, str], ...] = ()
    """Values with their words, where only these are possible; the first one is proposed."""
    table: TableReader | None = None
    """Reader of the table that the field names; the import page shows it before the start."""
    only_with: tuple[str, str] = ("", "")
    """Key and value of the choice that needs the table."""


WHO = Field("who", later("Done by"), later("Your name, for the record"))
TEMPERATURE = Field(
    "temperature", later("Temperature, °C"), later("Of the room; empty if not measured"), ""
)
