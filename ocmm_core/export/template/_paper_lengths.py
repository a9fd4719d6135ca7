"""Lengths in reports: mm or inch in every head; machine-readable files keep theirs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

LengthUnit = Literal["mm", "inch"]

_MM_PER_INCH = 25.4
"""Exact, by the definition of 1959."""

_DECIMALS: dict[LengthUnit, int] = {"mm": 4, "inch": 5}
"""0.00001 in is 0.25 µm. One digit less, 2.5 µm, is as large as U: a limit of 0.02 mm would be
printed as 0.0008 in, which is 0.0203 mm."""

_WORDS: dict[LengthUnit, str] = {"mm": "mm", "inch": "in"}


@dataclass(frozen=True, slots=True)
class PaperLengths:
    """Format of lengths, and U, in a report."""

    unit: LengthUnit = "mm"

    @property
    def word(self) -> str:
        return _WORDS[self.unit]

    @property
    def per_mm(self) -> float:
        """Return the number of units per mm."""
        return 1.0 / _MM_PER_INCH if self.unit == "inch" else 1.0

    @property
    def decimals(self) -> int:
        return _DECIMALS[self.unit]

    def number(self, mm: float, *, signed: bool = False) -> str:
        """Return a length without its unit and never as a negative zero."""
        value = mm / _MM_PER_INCH if self.unit == "inch" else mm
        return f"{value:+z.{self.decimals}f}" if signed else f"{value:z.{self.decimals}f}"

    def quantity(self, value: float, unit: str, *, signed: bool = False) -> str:
        """Return a value for tables with a unit in the head; `value`: mm, or degrees, with sign."""
        if unit == "deg":
            return f"{value:+z.4f}°" if signed else f"{value:z.4f}°"
        return self.number(value, signed=signed)

    @property
    def sentence(self) -> str:
        if self.unit == "inch":
            return (
                "Lengths of tables and plots in inch (1 in = 25.4 mm), in sentences in mm; "
                "angles in degrees."
            )
        return "Lengths in mm, angles in degrees."
