"""Fields of a wizard session."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_gui.kit import later


@dataclass(frozen=True, slots=True)
class Field:
    key: str
    label: str
    tip: str
    proposal: str = ""
    choices: tuple[tuple[str, str], ...] = ()
    """Permitted values with their texts; the first is proposed."""


WHO = Field("who", later("Done by"), later("Your name, for the record"))
TEMPERATURE = Field(
    "temperature", later("Temperature, °C"), later("Of the room; empty if not measured"), ""
)
