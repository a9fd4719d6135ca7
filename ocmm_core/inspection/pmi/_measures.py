"""Values with their units: lengths in mm, angles in degrees, and nothing that is in doubt."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

from ocmm_core.inspection.pmi._part21 import (
    Argument,
    BadEntityError,
    Part21,
    Ref,
    Typed,
    Word,
    plain,
)

FARTHEST_MM = 1e5
MOST_DEG = 360.0
_DECIMALS = 6
_DEEPEST = 5
_SAME = 1e-6

_PREFIXES = {
    "KILO": 1e3, "HECTO": 1e2, "DECA": 1e1, "DECI": 1e-1, "CENTI": 1e-2, "MILLI": 1e-3,
    "MICRO": 1e-6, "NANO": 1e-9,
}  # fmt: skip
_KNOWN = {
    "MILLIMETRE": 1.0, "MILLIMETER": 1.0, "MM": 1.0, "CENTIMETRE": 10.0, "METRE": 1000.0,
    "METER": 1000.0, "INCH": 25.4, "IN": 25.4, "FOOT": 304.8, "FT": 304.8,
    "DEGREE": 1.0, "DEGREES": 1.0, "DEG": 1.0, "RADIAN": math.degrees(1.0),
}  # fmt: skip
"""What one of a unit is, mm or degrees: a file that says otherwise is not believed."""

_MEASURES = (
    "MEASURE_WITH_UNIT",
    "LENGTH_MEASURE_WITH_UNIT",
    "PLANE_ANGLE_MEASURE_WITH_UNIT",
    "MEASURE_REPRESENTATION_ITEM",
)

Dimension = Literal["length", "angle"]


class Measure(NamedTuple):
    """A value, mm or degrees."""

    value: float
    of: Dimension


def measure_of(file: Part21, number: int) -> Measure:
    """Return the value of a measure with a unit.

    Raises
    ------
    BadEntityError
        It has no number or unit, the unit is unknown or contradicts its name, or the value is
        larger than any part.
    """
    value, unit = _value_and_unit(file, number)
    factor, of = unit_of(file, unit)
    size = value * factor
    most = FARTHEST_MM if of == "length" else MOST_DEG
    if not math.isfinite(size) or abs(size) > most:
        word = "mm" if of == "length" else "degrees"
        msg = f"its value {size:g} {word} is absurd"
        raise BadEntityError(msg)
    return Measure(round(size, _DECIMALS) + 0.0, of)


def unit_of(file: Part21, number: int, depth: int = 0) -> tuple[float, Dimension]:
    """Return what one of a unit is, mm or degrees.

    Raises
    ------
    BadEntityError
        It is no length or angle, or contradicts its own name.
    """
    if depth > _DEEPEST:
        msg = f"its unit #{number} refers to itself"
        raise BadEntityError(msg)
    records = file.records(number)
    of: Dimension
    if "LENGTH_UNIT" in records:
        of = "length"
    elif "PLANE_ANGLE_UNIT" in records:
        of = "angle"
    else:
        msg = f"its unit #{number} is neither of lengths nor of angles"
        raise BadEntityError(msg)
    if "SI_UNIT" in records:
        return _si_factor(records["SI_UNIT"], of), of
    if "CONVERSION_BASED_UNIT" not in records:
        msg = f"its unit #{number} is unknown"
        raise BadEntityError(msg)
    name, base = records["CONVERSION_BASED_UNIT"][:2]
    if not isinstance(base, Ref):
        msg = f"its unit {plain(name)} has no base"
        raise BadEntityError(msg)
    value, below = _value_and_unit(file, base.number)
    factor, of_base = unit_of(file, below, depth + 1)
    factor *= value
    said = _KNOWN.get(plain(name).upper().strip(" '"))
    if of_base != of or said is None or abs(factor / said - 1.0) > _SAME:
        what = "mm" if of == "length" else "degrees"
        msg = f"the file says that one of its unit '{plain(name)}' is {factor:g} {what}"
        raise BadEntityError(msg)
    return said, of


def _si_factor(arguments: tuple[object, ...], of: Dimension) -> float:
    prefix, name = arguments[-2], arguments[-1]
    word = name.word if isinstance(name, Word) else ""
    if word != {"length": "METRE", "angle": "RADIAN"}[of]:
        msg = f"its unit is {word or 'unknown'}"
        raise BadEntityError(msg)
    if prefix is not None and not (isinstance(prefix, Word) and prefix.word in _PREFIXES):
        msg = "the prefix of its unit is unknown"
        raise BadEntityError(msg)
    scale = _PREFIXES[prefix.word] if isinstance(prefix, Word) else 1.0
    return scale * (1000.0 if of == "length" else math.degrees(1.0))


def _value_and_unit(file: Part21, number: int) -> tuple[float, int]:
    """Return a value and the number of its unit."""
    records = file.records(number)
    arguments = next((records[word] for word in _MEASURES if records.get(word)), ())
    values = [one for one in arguments if isinstance(one, Typed | int | float)]
    units = [one.number for one in arguments if isinstance(one, Ref)]
    if len(values) != 1:
        msg = f"its value #{number} is not a number"
        raise BadEntityError(msg)
    if len(units) != 1:
        msg = f"its value #{number} has no unit"
        raise BadEntityError(msg)
    value: Argument = values[0]
    if isinstance(value, Typed):
        _check_kind(file, value, units[0], number)
        value = value.values[0] if value.values else None
    if isinstance(value, bool) or not isinstance(value, int | float):
        msg = f"its value #{number} is not a number"
        raise BadEntityError(msg)
    return float(value), units[0]


def _check_kind(file: Part21, value: Typed, unit: int, number: int) -> None:
    """Refuse a length with a unit of angles, and the other way round."""
    types = file.types(unit)
    for word, wanted in (("LENGTH", "LENGTH_UNIT"), ("ANGLE", "PLANE_ANGLE_UNIT")):
        if word in value.name and wanted in types:
            return
    if types & {"LENGTH_UNIT", "PLANE_ANGLE_UNIT"}:
        msg = f"its value #{number} is a {value.name.lower().replace('_', ' ')} in another unit"
        raise BadEntityError(msg)
