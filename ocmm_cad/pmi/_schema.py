"""Entity types (ISO 10303-242) understood, or without influence; `check_entity` refuses others.

A part of its entity, an argument or a referring entity can change the meaning of a tolerance.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from ocmm_cad.pmi._part21 import BadEntityError, Part21, plain

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
            msg = f"its {role} #{number} is a {_words(word)}, which is not supported"
            raise BadEntityError(msg)
        if len(arguments) not in parts[word]:
            word_of = "fewer" if len(arguments) < min(parts[word]) else "other or more"
            msg = f"#{number} has {len(arguments)} arguments, {word_of} than its type"
            raise BadEntityError(msg)
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
            msg = f"the {_words(min(odd))} #{user} refers to it, which is not supported"
            raise BadEntityError(msg)


def _words(word: str) -> str:
    return word.replace("_", " ").lower()
