from __future__ import annotations

from dataclasses import dataclass

from ocmm_core.tables import TableReader
from ocmm_gui.kit import later


@dataclass(frozen=True, slots=True)
class Field:
    key: str
    label: str
    tip: str
    proposal: str = ""
    choices: tuple[tuple[str, str], ...] = ()
    """Permitted values with their texts; the first is proposed."""
    table: TableReader | None = None
    """Reader of the table that the field names; the import page shows it before the start."""
    only_with: tuple[str, str] = ("", "")
    """Key and value of the choice that needs the table."""


WHO = Field("who", later("Done by"), later("Your name, for the record"))
TEMPERATURE = Field(
    "temperature",
    later("Temperature, °C"),
    later("Of the room; empty: the thermometer is read"),
    "",
)
THERMOMETER = Field(
    "thermometer", later("Thermometer U, K"), later("U (k = 2), K, or its id in the register")
)
