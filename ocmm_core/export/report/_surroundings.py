"""What a person reads off beside a measurement: temperature, humidity and pressure of the room.

Readings are typed once for a job, as a number, a range ("19.8 to 20.4") or with what they are
uncertain by ("20.1 ± 0.3"), with or without their unit. What is no such reading, or cannot be one
of a room, is refused: on paper it would look like a fact.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

from ocmm_core.errors import InputError
from ocmm_core.export.report._template import Particulars

_NUMBER = r"([+-]?[0-9]{1,5}(?:[.,][0-9]{1,4})?)"
_READING = re.compile(
    rf"{_NUMBER}(?:\s*(?:to|bis|…|–)\s*{_NUMBER}|\s*(?:±|\+/-|\+-)\s*{_NUMBER})?\s*([^0-9\s]*)"
)


@dataclass(frozen=True, slots=True)
class _Kind:
    """What can be read off: its field, how it is said on paper, its unit, and what it can be."""

    field: str
    said: Callable[[str], str]
    unit: str
    least: float
    most: float


_KINDS = (
    _Kind("room", lambda reading: f"Room {reading}.", "°C", -20.0, 60.0),
    _Kind("humidity", lambda reading: f"Humidity {reading}.", "%", 0.0, 100.0),
    _Kind("pressure", lambda reading: f"Air pressure {reading}.", "hPa", 500.0, 1100.0),
)


def surroundings(given: Particulars) -> tuple[str, ...]:
    """Return what was read off, a sentence each; nothing for what nobody read.

    Raises
    ------
    InputError
        A field holds no reading, another unit, or a number that is none of a room.
    """
    return tuple(
        kind.said(_told(kind, text))
        for kind in _KINDS
        if (text := getattr(given, kind.field).strip())
    )


def _told(kind: _Kind, text: str) -> str:
    found = _READING.fullmatch(text)
    if found is None:
        raise _error(kind, text, "is no number")
    first, last, spread, unit = found.groups()
    if unit not in ("", kind.unit):
        raise _error(kind, text, f"is not in {kind.unit}")
    values = [float(one.replace(",", ".")) for one in (first, last) if one]
    if not all(kind.least <= value <= kind.most for value in values):
        raise _error(kind, text, f"is not between {kind.least:g} and {kind.most:g} {kind.unit}")
    if values != sorted(values) or (spread and float(spread.replace(",", ".")) < 0.0):
        raise _error(kind, text, "has its smaller number last")
    # Without a word: the paper may be in another language.
    told = " … ".join(one.replace(",", ".") for one in (first, last) if one)
    return f"{told} ± {spread.replace(',', '.')} {kind.unit}" if spread else f"{told} {kind.unit}"


def _error(kind: _Kind, text: str, fault: str) -> InputError:
    return InputError(
        "report.surroundings",
        f"'{kind.field}' is {text[:40]!r}, which {fault}.",
        f"Give a number in {kind.unit}, a range such as '19.8 to 20.4', or leave it empty.",
    )
