"""Numbers that people type: unit and range of each, in one table.

Forms of the window, commands and procedures check here, so that none of them accepts a number that
another refuses. Readings of a room, which may be ranges, are in `ocmm_core.surroundings`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from ocmm_core import surroundings
from ocmm_core.errors import InputError
from ocmm_core.surroundings import Quantity
from ocmm_core.tables import typed_number
from ocmm_core.units import find_unit, scaled

_WITH_UNIT = re.compile(r"(?P<number>.*?[\d.,])?\s*(?P<unit>[^\d\s.,+-]\D*)")


@dataclass(frozen=True, slots=True)
class NumberField:
    """One number of a form."""

    quantity: Quantity
    words: str
    """Noun of a sentence."""
    whole: bool = False

    def check(self, value: float) -> float:
        """Return a number within its range; raise InputError otherwise, also for nan."""
        if value not in self.quantity or (self.whole and value != int(value)):
            raise self._refusal(f"{value:g} {self.quantity.unit}".strip())
        return value

    def read(self, text: str, *, comma: bool = False) -> float:
        """Return a typed number, with or without its unit; a length may be in inch.

        ``comma``: the form shows numbers with a decimal comma; see `tables.typed_number`.
        InputError if it is no number, ambiguous, in another unit, or out of range.
        """
        found = _WITH_UNIT.fullmatch(text.strip())
        typed, named = (found["number"], found["unit"]) if found else (text, "")
        value = typed_number(typed or text, comma=comma)
        given = repr(text.strip()[:40])
        if value is None:
            raise self._refusal(f"{given}, which is not a number")
        if named and named != self.quantity.unit:
            unit = find_unit(named, "length") if self.quantity.unit == "mm" else None
            if unit is None:
                raise self._refusal(f"{given}, which is in another unit")
            value = scaled(value, unit.factor)
        return self.check(value)

    def _refusal(self, given: str) -> InputError:
        """Return the error of a number that is not one of this field."""
        one = self.quantity
        kind = "whole number" if self.whole else "number"
        unit = f" {one.unit}" if one.unit else ""
        return InputError(
            f"number.{one.field}",
            f"The typed {self.words} is {given}.",
            f"Enter a {kind} from {one.least:g} to {one.most:g}{unit}.",
        )


TEMPERATURE = NumberField(surroundings.TEMPERATURE, "temperature")
BALL = NumberField(Quantity("ball", "mm", 0.1, 100.0), "ball diameter")
REFERENCE = NumberField(Quantity("reference", "mm", 1e-4, 1e5), "reference length")
PARTS = NumberField(Quantity("parts", "", 1, 1000), "number of parts", whole=True)
TRIALS = NumberField(Quantity("trials", "", 1, 100), "number of trials", whole=True)
SEED = NumberField(Quantity("seed", "", 0, 2**31), "seed", whole=True)
TILT = NumberField(Quantity("tilt", "°", 0.0, 180.0), "tilt")
SPOT_NOISE = NumberField(Quantity("noise", "px", 1e-4, 10.0), "noise of spots")
COORDINATE = NumberField(Quantity("coordinate", "", -1e6, 1e6), "number")

NUMBER_FIELDS = (
    TEMPERATURE, BALL, REFERENCE, PARTS, TRIALS, SEED, TILT, SPOT_NOISE, COORDINATE,
)  # fmt: skip
