"""Values of PMI, converted from their units: lengths to mm, angles to degrees."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

from ocmm_cad.pmi._part21 import Argument, BadEntityError, Part21, Ref, Typed, Word, plain, refs
from ocmm_cad.pmi._schema import check_entity
from ocmm_core.errors import InputError
from ocmm_core.units import MeasureUnit, agreed_unit, find_unit, scaled

FARTHEST_MM = 1e5
MOST_DEG = 360.0
_DECIMALS = 6
_DEEPEST = 5

_MEASURES = (
    "MEASURE_WITH_UNIT",
    "LENGTH_MEASURE_WITH_UNIT",
    "PLANE_ANGLE_MEASURE_WITH_UNIT",
    "MEASURE_REPRESENTATION_ITEM",
)

_SI: dict[str, Literal["length", "angle"]] = {"LENGTH_UNIT": "length", "PLANE_ANGLE_UNIT": "angle"}
_HARMLESS = frozenset({"NAMED_UNIT", "CONTEXT_DEPENDENT_UNIT"})
"""Parts of a unit without a meaning of their own: its dimensional exponents."""


class Measure(NamedTuple):
    """A value, mm or degrees."""

    value: float
    of: str
    """``length`` or ``angle``."""


def qualifiers_of(file: Part21, number: int) -> list[str]:
    """Return the qualifiers of a value, without its number of digits."""
    named = refs(file.records(number).get("QUALIFIED_REPRESENTATION_ITEM", ()))
    for user in file.users_of(number):
        if "MEASURE_QUALIFICATION" in file.types(user):
            named += refs(file.argument(user, 3, "MEASURE_QUALIFICATION"))
    found = []
    for qualifier in named:
        types = file.types(qualifier)
        if "TYPE_QUALIFIER" in types:
            found.append(plain(file.argument(qualifier, 0, "TYPE_QUALIFIER")))
        elif types != {"VALUE_FORMAT_TYPE_QUALIFIER"}:
            found.append(" ".join(sorted(types)).replace("_", " ").lower())
    return found


def measure_of(file: Part21, number: int, *, is_qualified: bool = False) -> Measure:
    """Return the value of a measure with a unit. `is_qualified`: the caller reads its qualifiers.

    BadEntityError without number or known unit, if it contradicts its name, or if implausible.
    """
    check_entity(file, number, "measure")
    odd = [] if is_qualified else qualifiers_of(file, number)
    if odd:
        msg = f"its value #{number} is '{odd[0]}', which is not supported"
        raise BadEntityError(msg)
    value, unit = _value_and_unit(file, number)
    found = unit_of(file, unit)
    size = scaled(value, found.factor)
    most = FARTHEST_MM if found.dimension == "length" else MOST_DEG
    if not math.isfinite(size) or abs(size) > most:
        word = "mm" if found.dimension == "length" else "degrees"
        msg = f"its value {size:g} {word} is absurd"
        raise BadEntityError(msg)
    return Measure(round(size, _DECIMALS) + 0.0, found.dimension)


def unit_of(file: Part21, number: int, depth: int = 0) -> MeasureUnit:
    """Return a unit of length or angle; BadEntityError if other, unknown or contradictory."""
    if depth > _DEEPEST:
        msg = f"its unit #{number} refers to itself"
        raise BadEntityError(msg)
    records = file.records(number)
    kinds = sorted(set(records) & set(_SI))
    odd = set(records) - {*_SI, *_HARMLESS, "SI_UNIT", "CONVERSION_BASED_UNIT"}
    if len(kinds) != 1 or odd:
        msg = f"its unit #{number} is neither of lengths nor of angles"
        raise BadEntityError(msg)
    of = _SI[kinds[0]]
    if "SI_UNIT" in records:
        prefix, name = records["SI_UNIT"][-2:]
        words = [one.word for one in (prefix, name) if isinstance(one, Word)]
        found = find_unit("".join(words), of) if prefix is None or len(words) == 2 else None
        if found is None:
            msg = f"its unit #{number} is {' '.join(words) or 'unknown'}"
            raise BadEntityError(msg)
        return found
    if "CONVERSION_BASED_UNIT" not in records:
        msg = f"its unit #{number} is unknown"
        raise BadEntityError(msg)
    name, base = records["CONVERSION_BASED_UNIT"][:2]
    if not isinstance(base, Ref):
        msg = f"its unit {plain(name)} has no base"
        raise BadEntityError(msg)
    value, below = _value_and_unit(file, base.number)
    of_base = unit_of(file, below, depth + 1)
    if of_base.dimension != of:
        msg = f"its unit #{number} {plain(name)!r} is converted to {of_base.symbol}"
        raise BadEntityError(msg)
    try:
        return agreed_unit(plain(name), scaled(value, of_base.si), of, f"its unit #{number}")
    except InputError as error:
        raise BadEntityError(error.what.rstrip(".")) from error


def _value_and_unit(file: Part21, number: int) -> tuple[float, int]:
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
    types = file.types(unit)
    for word, wanted in (("LENGTH", "LENGTH_UNIT"), ("ANGLE", "PLANE_ANGLE_UNIT")):
        if word in value.name and wanted in types:
            return
    if types & {"LENGTH_UNIT", "PLANE_ANGLE_UNIT"}:
        msg = f"its value #{number} is a {value.name.lower().replace('_', ' ')} in another unit"
        raise BadEntityError(msg)
