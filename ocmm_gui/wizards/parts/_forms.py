"""What is filled in before a session of a wizard begins."""

from __future__ import annotations

from dataclasses import dataclass

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


WHO = Field("who", later("Done by"), later("Your name, for the record"))
TEMPERATURE = Field(
    "temperature", later("Temperature, °C"), later("Of the room; empty if not measured"), ""
)
