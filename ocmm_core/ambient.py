"""Typed temperature, humidity and pressure of a room, checked alike everywhere.

A reading is a number, a range ("19.8 to 20.4") or a number with its uncertainty ("20.1 ± 0.3"),
with or without unit. Others, and implausible ones, are refused.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from ocmm_core.errors import InputError

_NUMBER = r"([+-]?[0-9]{1,5}(?:[.,][0-9]{1,4})?)"
_READING = re.compile(
    rf"{_NUMBER}(?:\s*(?:to|bis|…|–)\s*{_NUMBER}|\s*(?:±|\+/-|\+-)\s*{_NUMBER})?\s*([^0-9\s]*)"
)


@dataclass(frozen=True, slots=True)
class Quantity:
    """What can be read off."""

    field: str
    """Its name where it is typed."""
    unit: str
    least: float
    most: float
    """`least`, `most`: What it can be in a room where people measure."""

    def __contains__(self, value: float) -> bool:
        """Return whether a room can have it; never for what is no number."""
        return self.least <= value <= self.most


ROOM = Quantity("room", "°C", -20.0, 60.0)
TEMPERATURE = Quantity("temperature", "°C", 0.0, 50.0)
"""Of a probe, part or artefact while measuring."""
HUMIDITY = Quantity("humidity", "%", 0.0, 100.0)
PRESSURE = Quantity("pressure", "hPa", 500.0, 1100.0)
QUANTITIES = (ROOM, HUMIDITY, PRESSURE)


@dataclass(frozen=True, slots=True)
class Reading:
    """What was read off."""

    low: float
    high: float
    """`low`, `high`: Ends of the range; the same for one number."""
    spread: float
    """What it is uncertain by."""
    words: str
    """Numbers and unit, in no language."""


@dataclass(frozen=True, slots=True)
class TypedRoom:
    """What was read off in a room at one time, as it was typed; empty where nobody read it."""

    room: str = ""
    humidity: str = ""
    pressure: str = ""
    """`room`, `humidity`, `pressure`: Temperature, relative humidity and pressure of the air."""

    @property
    def empty(self) -> bool:
        """Return whether nothing was typed."""
        return not f"{self.room}{self.humidity}{self.pressure}".strip()

    def check(self) -> None:
        """Raise InputError where something is no reading of a room."""
        for quantity in QUANTITIES:
            reading_of(quantity, getattr(self, quantity.field))


def reading_of(quantity: Quantity, text: str) -> Reading | None:
    """Return what was typed, None if nothing; InputError unless a number possible in a room."""
    typed = text.strip()
    if not typed:
        return None
    found = _READING.fullmatch(typed)
    if found is None:
        raise _error(quantity, text, "is no number")
    first, last, spread, unit = found.groups()
    if unit not in ("", quantity.unit):
        raise _error(quantity, text, f"is not in {quantity.unit}")
    values = [float(one.replace(",", ".")) for one in (first, last) if one]
    wide = float(spread.replace(",", ".")) if spread else 0.0
    if not all(value in quantity for value in values) or wide > quantity.most - quantity.least:
        least, most = f"{quantity.least:g}", f"{quantity.most:g}"
        raise _error(quantity, text, f"is not between {least} and {most} {quantity.unit}")
    if values != sorted(values) or wide < 0.0:
        raise _error(quantity, text, "has its smaller number last")
    # Without a word: the paper may be in another language.
    told = " … ".join(one.replace(",", ".") for one in (first, last) if one)
    beside = f" ± {spread.replace(',', '.')}" if spread else ""
    return Reading(values[0], values[-1], wide, f"{told}{beside} {quantity.unit}")


def number_of(quantity: Quantity, text: str) -> float | None:
    """Return one number that was typed, None where nothing was; InputError as `reading_of`."""
    found = reading_of(quantity, text)
    if found is None:
        return None
    if found.low != found.high or found.spread:
        raise _error(quantity, text, "is more than one number")
    return found.low


def _error(quantity: Quantity, text: str, fault: str) -> InputError:
    return InputError(
        "surroundings.reading",
        f"'{quantity.field}' is {text[:40]!r}, which {fault}.",
        f"Give a number in {quantity.unit}, a range such as '19.8 to 20.4', or leave it empty.",
    )
