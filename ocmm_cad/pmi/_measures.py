"""Entity types of PMI, and its values converted from their units: mm and degrees.

Types (ISO 10303-242) are understood, or without influence; `check_entity` refuses others. A part of
its entity, an argument or a referring entity can change the meaning of a tolerance.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Literal, NamedTuple

from ocmm_cad.pmi._part21 import Argument, BadEntityError, Part21, Ref, Typed, Word, plain, refs
from ocmm_core.errors import InputError
from ocmm_core.units import MeasureUnit, agreed_unit, find_unit, scaled

_WITH_DATUMS = (
    "ANGULARITY", "CIRCULAR_RUNOUT", "COAXIALITY", "CONCENTRICITY", "PARALLELISM",
    "PERPENDICULARITY", "SYMMETRY", "TOTAL_RUNOUT",
)  # fmt: skip
_OTHERS = (
    "CYLINDRICITY", "FLATNESS", "LINE_PROFILE", "POSITION", "ROUNDNESS", "STRAIGHTNESS",
    "SURFACE_PROFILE",
)  # fmt: skip
_KINDS = {f"{kind}_TOLERANCE": (0, 5) for kind in _WITH_DATUMS} | {
    f"{kind}_TOLERANCE": (0, 4) for kind in _OTHERS
}
TOLERANCES = tuple(sorted(_KINDS))
SIZES = ("DIMENSIONAL_SIZE", "ANGULAR_SIZE")
LOCATIONS = ("DIMENSIONAL_LOCATION", "ANGULAR_LOCATION")
USAGES = ("GEOMETRIC_ITEM_SPECIFIC_USAGE", "ITEM_IDENTIFIED_REPRESENTATION_USAGE")
RELATIONS = ("SHAPE_ASPECT_RELATIONSHIP", "SHAPE_ASPECT_DERIVING_RELATIONSHIP")
ZONES = {
    "PROJECTED_ZONE_DEFINITION": "projected zone",
    "PROJECTED_ZONE_DEFINITION_WITH_OFFSET": "projected zone",
    "NON_UNIFORM_ZONE_DEFINITION": "non-uniform zone",
    "ORIENTED_TOLERANCE_ZONE": "oriented zone",
    "DIRECTED_TOLERANCE_ZONE": "directed zone",
    "TOLERANCE_ZONE_WITH_DATUM": "zone with a datum",
}
"""Zones, and definitions that refer to one; likewise."""
EXTRAS = {
    "GEOMETRIC_TOLERANCE_WITH_DEFINED_UNIT": "per unit",
    "GEOMETRIC_TOLERANCE_WITH_DEFINED_AREA_UNIT": "per unit of area",
    "GEOMETRIC_TOLERANCE_WITH_MAXIMUM_TOLERANCE": "with a maximum",
    "UNEQUALLY_DISPOSED_GEOMETRIC_TOLERANCE": "unequally disposed",
    "MODIFIED_GEOMETRIC_TOLERANCE": "with a modifier of an older schema",
}
"""Parts of a tolerance that are read, and refuse it."""

_MODELS = ("GEOMETRIC_TOLERANCE", "GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE")
_SHOWN = frozenset({
    # Pictures, identifiers and layers.
    "DRAUGHTING_MODEL_ITEM_ASSOCIATION", "DRAUGHTING_MODEL_ITEM_ASSOCIATION_WITH_PLACEHOLDER",
    "DRAUGHTING_CALLOUT_RELATIONSHIP", "ID_ATTRIBUTE", "NAME_ATTRIBUTE", "DESCRIPTION_ATTRIBUTE",
    "PRESENTATION_LAYER_ASSIGNMENT", "STYLED_ITEM", "PROPERTY_DEFINITION",
    "APPLIED_EXTERNAL_IDENTIFICATION_ASSIGNMENT", "APPLIED_IDENTIFICATION_ASSIGNMENT",
    "APPLIED_GROUP_ASSIGNMENT",
})  # fmt: skip
_VALIDATION = "validation property"
"""End of the names of properties that repeat the item, to check a translation."""
_ASPECTS = {
    "SHAPE_ASPECT": (4,), "COMPOSITE_SHAPE_ASPECT": (0, 4), "COMPOSITE_GROUP_SHAPE_ASPECT": (0, 4),
    "ALL_AROUND_SHAPE_ASPECT": (0, 4), "DERIVED_SHAPE_ASPECT": (0, 4),
    "CENTRE_OF_SYMMETRY": (0, 4), "DATUM_FEATURE": (0, 4),
}  # fmt: skip
_OF_ASPECTS = frozenset({
    *USAGES, *RELATIONS, *SIZES, *LOCATIONS, *TOLERANCES, *_MODELS,
    # Read as items of their own, which are refused.
    "FEATURE_FOR_DATUM_TARGET_RELATIONSHIP", "PROJECTED_ZONE_DEFINITION",
    "PROJECTED_ZONE_DEFINITION_WITH_OFFSET", "DIRECTED_DIMENSIONAL_LOCATION",
    "DIMENSIONAL_LOCATION_WITH_PATH", "DIMENSIONAL_SIZE_WITH_PATH",
})  # fmt: skip
_REFERENCES = frozenset({
    "DATUM_REFERENCE_COMPARTMENT", "DATUM_REFERENCE_ELEMENT", "DATUM_REFERENCE",
})  # fmt: skip


class EntityRule(NamedTuple):
    """Types that an entity in a role may have, and types that may refer to it."""

    parts: Mapping[str, tuple[int, ...]]
    """Numbers of arguments by type: alone, and as a part of several types."""
    users: frozenset[str] | None
    """None if it may be shared by other items."""


ROLES = {
    "tolerance": EntityRule(
        {
            "GEOMETRIC_TOLERANCE": (4,), "GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE": (1,),
            "GEOMETRIC_TOLERANCE_WITH_MODIFIERS": (1,), **_KINDS,
            **dict.fromkeys(EXTRAS, (1, 2, 5)),
        },
        frozenset({"TOLERANCE_ZONE", *ZONES, "GEOMETRIC_TOLERANCE_RELATIONSHIP"}),
    ),
    "zone": EntityRule(
        {"TOLERANCE_ZONE": (2, 6), "SHAPE_ASPECT": (4,),
         **{word: (0, 1, 6, 7) for word in ZONES if "DEFINITION" not in word}},
        frozenset(word for word in ZONES if "DEFINITION" in word)
    ),
    "zone form": EntityRule({"TOLERANCE_ZONE_FORM": (1,)}, None),
    "dimension": EntityRule(
        {"DIMENSIONAL_SIZE": (2,), "ANGULAR_SIZE": (1, 3),
         "DIMENSIONAL_LOCATION": (0, 4), "ANGULAR_LOCATION": (1, 5),
         "SHAPE_ASPECT_RELATIONSHIP": (4,)},
        frozenset({"DIMENSIONAL_CHARACTERISTIC_REPRESENTATION", "PLUS_MINUS_TOLERANCE"}),
    ),
    "value": EntityRule({"DIMENSIONAL_CHARACTERISTIC_REPRESENTATION": (2,)}, frozenset()),
    "values": EntityRule(
        {"SHAPE_DIMENSION_REPRESENTATION": (0, 3), "SHAPE_REPRESENTATION": (0,),
         "REPRESENTATION": (3,)},
        frozenset({"DIMENSIONAL_CHARACTERISTIC_REPRESENTATION"}),
    ),
    "limits": EntityRule({"PLUS_MINUS_TOLERANCE": (2,)}, frozenset()),
    "limit values": EntityRule({"TOLERANCE_VALUE": (2,)}, None),
    "fit": EntityRule({"LIMITS_AND_FITS": (4,)}, None),
    "measure": EntityRule(
        {"MEASURE_WITH_UNIT": (2,), "LENGTH_MEASURE_WITH_UNIT": (0, 2),
         "PLANE_ANGLE_MEASURE_WITH_UNIT": (0, 2), "MEASURE_REPRESENTATION_ITEM": (0, 3),
         "REPRESENTATION_ITEM": (1,), "QUALIFIED_REPRESENTATION_ITEM": (1,)},
        None,
    ),
    "aspect": EntityRule(_ASPECTS, _OF_ASPECTS),
    "datum": EntityRule(
        {"DATUM": (1, 5), "SHAPE_ASPECT": (4,)}, _REFERENCES | {*RELATIONS, *USAGES}
    ),
    "datum system": EntityRule(
        {"DATUM_SYSTEM": (1, 5), "SHAPE_ASPECT": (4,)},
        frozenset({*TOLERANCES, "GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE"}),
    ),
    "datum reference": EntityRule(
        {"DATUM_REFERENCE_COMPARTMENT": (0, 6), "DATUM_REFERENCE_ELEMENT": (0, 6),
         "GENERAL_DATUM_REFERENCE": (2,), "SHAPE_ASPECT": (4,)},
        frozenset({"DATUM_SYSTEM", "DATUM_REFERENCE_COMPARTMENT"}),
    ),
    "older datum reference": EntityRule(
        {"DATUM_REFERENCE": (2,)},
        frozenset({*TOLERANCES, "GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE"}),
    ),
    "relation": EntityRule(
        {"SHAPE_ASPECT_RELATIONSHIP": (4,), "SHAPE_ASPECT_DERIVING_RELATIONSHIP": (0, 4)},
        frozenset(),
    ),
    "usage": EntityRule(dict.fromkeys(USAGES, (5,)), frozenset()),
}  # fmt: skip
"""By the role that readers assign to an entity."""


def check_entity(file: Part21, number: int, role: str) -> None:
    """Raise BadEntityError for a type, argument count or user outside the entity's role."""
    parts, users = ROLES[role]
    for word, arguments in file.records(number).items():
        if word not in parts:
            raise BadEntityError(f"its {role} #{number} is a {_text(word)}, which is not supported")
        if len(arguments) not in parts[word]:
            word_of = "fewer" if len(arguments) < min(parts[word]) else "other or more"
            raise BadEntityError(
                f"#{number} has {len(arguments)} arguments, {word_of} than its type"
            )
    if users is None:
        return
    for user in file.users_of(number):
        types = file.types(user)
        odd = types - users - _SHOWN
        is_item = role in ("tolerance", "dimension")
        if is_item and "PROPERTY_DEFINITION" in types:
            name = plain(file.argument(user, 0, "PROPERTY_DEFINITION"))
            odd |= set() if name.endswith(_VALIDATION) else {f"PROPERTY '{name}'"}
        # A user that is an item itself is checked when it is read.
        if odd and not types & users:
            raise BadEntityError(
                f"the {_text(min(odd))} #{user} refers to it, which is not supported"
            )


def _text(word: str) -> str:
    return word.replace("_", " ").lower()


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
        raise BadEntityError(f"its value #{number} is '{odd[0]}', which is not supported")
    value, unit = _value_and_unit(file, number)
    found = unit_of(file, unit)
    size = scaled(value, found.factor)
    most = FARTHEST_MM if found.dimension == "length" else MOST_DEG
    if not math.isfinite(size) or abs(size) > most:
        word = "mm" if found.dimension == "length" else "degrees"
        raise BadEntityError(f"its value {size:g} {word} is absurd")
    return Measure(round(size, _DECIMALS) + 0.0, found.dimension)


def unit_of(file: Part21, number: int, depth: int = 0) -> MeasureUnit:
    """Return a unit of length or angle; BadEntityError if other, unknown or contradictory."""
    if depth > _DEEPEST:
        raise BadEntityError(f"its unit #{number} refers to itself")
    records = file.records(number)
    kinds = sorted(set(records) & set(_SI))
    odd = set(records) - {*_SI, *_HARMLESS, "SI_UNIT", "CONVERSION_BASED_UNIT"}
    if len(kinds) != 1 or odd:
        raise BadEntityError(f"its unit #{number} is neither of lengths nor of angles")
    of = _SI[kinds[0]]
    if "SI_UNIT" in records:
        prefix, name = records["SI_UNIT"][-2:]
        words = [one.word for one in (prefix, name) if isinstance(one, Word)]
        found = find_unit("".join(words), of) if prefix is None or len(words) == 2 else None
        if found is None:
            raise BadEntityError(f"its unit #{number} is {' '.join(words) or 'unknown'}")
        return found
    if "CONVERSION_BASED_UNIT" not in records:
        raise BadEntityError(f"its unit #{number} is unknown")
    name, base = records["CONVERSION_BASED_UNIT"][:2]
    if not isinstance(base, Ref):
        raise BadEntityError(f"its unit {plain(name)} has no base")
    value, below = _value_and_unit(file, base.number)
    of_base = unit_of(file, below, depth + 1)
    if of_base.dimension != of:
        raise BadEntityError(f"its unit #{number} {plain(name)!r} is converted to {of_base.symbol}")
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
        raise BadEntityError(f"its value #{number} is not a number")
    if len(units) != 1:
        raise BadEntityError(f"its value #{number} has no unit")
    value: Argument = values[0]
    if isinstance(value, Typed):
        _check_kind(file, value, units[0], number)
        value = value.values[0] if value.values else None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise BadEntityError(f"its value #{number} is not a number")
    return float(value), units[0]


def _check_kind(file: Part21, value: Typed, unit: int, number: int) -> None:
    types = file.types(unit)
    for word, wanted in (("LENGTH", "LENGTH_UNIT"), ("ANGLE", "PLANE_ANGLE_UNIT")):
        if word in value.name and wanted in types:
            return
    if types & {"LENGTH_UNIT", "PLANE_ANGLE_UNIT"}:
        raise BadEntityError(
            f"its value #{number} is a {value.name.lower().replace('_', ' ')} in another unit"
        )
