"""Every addition that the schema allows to an item of PMI changes the item or refuses it.

One addition at a time: a part of its entity, a modifier, a qualifier, an argument, or an entity
that refers to it. Types and enumerations are those of ISO 10303-242 ed. 2.
"""

from __future__ import annotations

import re

import pytest

from ocmm_cad.pmi import Pmi, read_pmi
from tests.cad.pmi_texts import WHOLE, text_of

MODIFIERS = (
    "ANY_CROSS_SECTION ANY_LONGITUDINAL_SECTION AREA_OF_LONGITUDINAL COMMON_ZONE "
    "EACH_RADIAL_ELEMENT FREE_STATE LEAST_MATERIAL_REQUIREMENT LINE_ELEMENT MAJOR_DIAMETER "
    "MINOR_DIAMETER NOT_CONVEX PITCH_DIAMETER RECIPROCITY_REQUIREMENT SEPARATE_REQUIREMENT "
    "STATISTICAL_TOLERANCE TANGENT_PLANE SEPARATE_ZONE ASSOCIATED_MINMAX_FEATURE "
    "UNITED_FEATURE"
)
DATUM_MODIFIERS = (
    "ANY_CROSS_SECTION ANY_LONGITUDINAL_SECTION BASIC CONTACTING_FEATURE "
    "DEGREE_OF_FREEDOM_CONSTRAINT_U DISTANCE_VARIABLE FREE_STATE LEAST_MATERIAL_REQUIREMENT "
    "LINE MAJOR_DIAMETER MAXIMUM_MATERIAL_REQUIREMENT MINOR_DIAMETER ORIENTATION "
    "PITCH_DIAMETER PLANE POINT TRANSLATION"
)
PARTS = {
    "#40": (
        "GEOMETRIC_TOLERANCE_WITH_DEFINED_UNIT(#41) "
        "GEOMETRIC_TOLERANCE_WITH_MAXIMUM_TOLERANCE(#41) "
        "GEOMETRIC_TOLERANCE_WITH_DEFINED_AREA_UNIT(.RECTANGULAR.,#41) "
        "UNEQUALLY_DISPOSED_GEOMETRIC_TOLERANCE(#41) FLATNESS_TOLERANCE() "
        "TOLERANCE_WITH_STATISTICAL_DISTRIBUTION() "
        "GEOMETRIC_TOLERANCE_AUXILIARY_CLASSIFICATION()"
    ),
    "#33": ("UNCERTAINTY_QUALIFIER() QUALIFIED_REPRESENTATION_ITEM((#80)) EXPRESSION_ITEM()"),
}
"""Further parts of complex entities."""
MORE_PARTS = {
    "#30": (
        "DIMENSIONAL_SIZE(#21,'diameter')",
        "DIMENSIONAL_SIZE_WITH_PATH(#22) DIMENSIONAL_SIZE_WITH_DATUM_FEATURE() "
        "SHAPE_ASPECT('',$,#20,.T.)",
    ),
    "#21": (
        "COMPOSITE_SHAPE_ASPECT('','bore',#20,.T.)",
        "CONTINUOUS_SHAPE_ASPECT() BETWEEN_SHAPE_ASPECT() TANGENT() PARALLEL_OFFSET(#41) "
        "APEX() EXTENSION() GEOMETRIC_CONTACT() PERPENDICULAR_TO() COMMON_DATUM() THREAD() "
        "ROUND_HOLE()",
    ),
    "#42": (
        "TOLERANCE_ZONE('',$,#20,.F.,(#40),#43)",
        "ORIENTED_TOLERANCE_ZONE(#46) DIRECTED_TOLERANCE_ZONE(#99) TOLERANCE_ZONE_WITH_DATUM(#44)",
    ),
    "#24": (
        "SHAPE_ASPECT_RELATIONSHIP('',$,#21,#22)",
        "SHAPE_ASPECT_ASSOCIATIVITY() SHAPE_ASPECT_TRANSITION() "
        "FEATURE_COMPONENT_RELATIONSHIP() SHAPE_DEFINING_RELATIONSHIP() "
        "FREE_FORM_RELATION()",
    ),
    "#46": ("DATUM('',$,#20,.F.,'A')", "COMMON_DATUM() DATUM_TARGET('1') DATUM_FEATURE()"),
    "#44": ("DATUM_SYSTEM('',$,#20,.F.,(#45))", "DATUM_SYSTEM_WITH_FRAME(#99)"),
    "#45": (
        "DATUM_REFERENCE_COMPARTMENT('',$,#20,.F.,#46,$)",
        "REFERENCED_MODIFIED_DATUM(.MAXIMUM_MATERIAL_CONDITION.)",
    ),
    "#32": (
        "SHAPE_DIMENSION_REPRESENTATION('',(#33),#95)",
        "UNCERTAINTY_ASSIGNED_REPRESENTATION(()) COMPOUND()",
    ),
    "#35": (
        "TOLERANCE_VALUE(#36,#37)",
        "STATISTICAL_TOLERANCE_VALUE() LIMITS_AND_FITS('H','hole','7','')",
    ),
    "#36": (
        "LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(-0.2),#1)",
        "UNCERTAINTY_MEASURE_WITH_UNIT('','') RATIO_MEASURE_WITH_UNIT()",
    ),
    "#1": ("", "RATIO_UNIT() CONTEXT_DEPENDENT_UNIT_WITH_OFFSET('x')"),
}
"""Simple entities that become complex with one part more."""
USERS = {
    "#40": (
        "GEOMETRIC_TOLERANCE_RELATIONSHIP('simultaneity','',#40,#50) "
        "GEOMETRIC_TOLERANCE_RELATIONSHIP('x','',#40,#93) "
        "GEOMETRIC_TOLERANCE_AUXILIARY_CLASSIFICATION((#40),.ALL_OVER.) "
        "PROPERTY_DEFINITION('affected_plane','',#40) "
        "DIMENSION_RELATED_TOLERANCE_ZONE_ELEMENT(#30,#40) "
        "APPLIED_DOCUMENT_REFERENCE(#98,'',(#40)) TOLERANCE_ZONE('',$,#20,.F.,(#40),#99)"
    ),
    "#42": (
        "PROJECTED_ZONE_DEFINITION(#42,(#28),#28,#41) RUNOUT_ZONE_DEFINITION(#42,(#28),#41) "
        "PROJECTED_ZONE_DEFINITION_WITH_OFFSET(#42,(#28),#28,#41,#41) "
        "NON_UNIFORM_ZONE_DEFINITION(#42,(#28)) TOLERANCE_ZONE_DEFINITION(#42,(#28)) "
        "DIMENSION_RELATED_TOLERANCE_ZONE_ELEMENT(#30,#42)"
    ),
    "#30": (
        "PROPERTY_DEFINITION('statistics','',#30) LIMIT_CONDITION('maximum "
        "material','',#30,#21) DIMENSION_PAIR('chained','',#30,#30) "
        "DIMENSIONAL_CHARACTERISTIC_REPRESENTATION(#30,#32) PLUS_MINUS_TOLERANCE(#35,#30) "
        "DIMENSION_RELATED_TOLERANCE_ZONE_ELEMENT(#30,#42)"
    ),
    "#31": ("SIZE_CRITERION(#31) PROPERTY_DEFINITION_RELATIONSHIP('','',#31,#31)"),
    "#32": ("REPRESENTATION_RELATIONSHIP('','',#32,#32)"),
    "#33": ("MEASURE_QUALIFICATION('','',#33,(#80))"),
    "#34": ("STATISTICAL_TOLERANCE(#34)"),
    "#36": ("MEASURE_QUALIFICATION('','',#36,(#80))"),
    "#41": ("MEASURE_QUALIFICATION('','',#41,(#80))"),
    "#21": (
        "SHAPE_ASPECT_RELATIONSHIP('affected plane association','',#21,#28) "
        "SHAPE_ASPECT_RELATIONSHIP('',$,#21,#28) SHAPE_ASPECT_ASSOCIATIVITY('',$,#21,#28) "
        "FEATURE_COMPONENT_RELATIONSHIP('',$,#21,#28) "
        "GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#21,#96,#16) "
        "SHAPE_ASPECT_OCCURRENCE('','',#20,.T.,#21)"
    ),
    "#45": ("DATUM_REFERENCE_MODIFIER_WITH_VALUE(.CIRCULAR_OR_CYLINDRICAL.,#45)"),
    "#44": ("DATUM_SYSTEM_FRAME(#44) GENERAL_DATUM_REFERENCE_FRAME('',#44)"),
    "#46": (
        "SHAPE_ASPECT_RELATIONSHIP('',$,#28,#46) DATUM_CONDITION(#46) "
        "FEATURE_FOR_DATUM_RELATIONSHIP('',$,#28,#46)"
    ),
}
"""Entities that refer to an item."""
ITEMS = tuple(f"#{number}" for number in (*range(21, 24), 26, 28, *range(30, 38), *range(40, 52)))
HARMLESS = {
    "DRAUGHTING_MODEL_ITEM_ASSOCIATION('','',{},#94,#38)": "a picture",
    "ID_ATTRIBUTE('12',{})": "an identifier",
    "NAME_ATTRIBUTE('x',{})": "a name",
    "PROPERTY_DEFINITION('pmi validation property','',{})": "repeats the item",
    "APPLIED_EXTERNAL_IDENTIFICATION_ASSIGNMENT('x',#98,#98,({}))": "an identifier",
}
WORDS = re.compile(r"[A-Z_0-9]+\((?:[^()]|\([^()]*\))*\)")


def meaning(pmi: Pmi) -> str:
    """Return the parts of the model that enter a plan."""
    return repr((pmi.dimensions, pmi.tolerances, pmi.datums))


def read(**changes: str) -> str:
    return meaning(read_pmi(text_of(*WHOLE, **changes))[0])


def body(entity: str) -> str:
    text = text_of(*WHOLE)
    found = re.search(rf"^{entity}=(.*?);$", text, re.MULTILINE | re.DOTALL)
    assert found is not None
    return found[1]


BASE = read()


def changed(entity: str, text: str) -> dict[str, str]:
    return {f"_{entity[1:]}": text, "_80": "TYPE_QUALIFIER('maximum')"}


def test_the_text_itself_is_read_whole() -> None:
    assert "#" not in BASE.replace("labels=('#47',)", "")
    assert BASE.count("fault=''") == 4


def test_no_modifier_and_no_part_is_ignored() -> None:
    ignored = []
    place = body("#40")
    changes = [
        changed("#40", place.replace(".MAXIMUM_MATERIAL_REQUIREMENT.", text))
        for word in MODIFIERS.split()
        for text in (f".{word}.", f".MAXIMUM_MATERIAL_REQUIREMENT.,.{word}.")
    ]
    compartment = "DATUM_REFERENCE_COMPARTMENT('',$,#20,.F.,#46,({}))"
    changes += [
        changed("#45", compartment.format(text))
        for word in DATUM_MODIFIERS.split()
        for text in (f".{word}.", f"SIMPLE_DATUM_REFERENCE_MODIFIER(.{word}.)")
    ]
    changes += [changed("#45", compartment.format("#41"))]
    for entity, words in PARTS.items():
        whole = body(entity)
        changes += [changed(entity, f"{whole[:-1]}{part})") for part in WORDS.findall(words)]
    for entity, (simple, words) in MORE_PARTS.items():
        whole = f"({simple})" if simple else body(entity)
        changes += [changed(entity, f"{whole[:-1]}{part})") for part in WORDS.findall(words)]
    for change in changes:
        if read(**change) == BASE:
            ignored.append(change)
    assert not ignored
    assert len(changes) > 100


def test_no_entity_that_refers_to_an_item_is_ignored() -> None:
    changes = [
        {"_60": user, "_80": "TYPE_QUALIFIER('maximum')"}
        for users in USERS.values()
        for user in WORDS.findall(users)
    ]
    # An unknown type at each entity of each item.
    strange = [{"_60": f"STRANGE_REQUIREMENT('',(#99,{entity}))"} for entity in ITEMS]
    assert [one for one in changes if read(**one) == BASE] == []
    shared = {f"#{number}" for number in (26, 33, 35, 36, 37, 41, 43, 48, 49, 51)}
    ignored = {entity for entity, one in zip(ITEMS, strange, strict=True) if read(**one) == BASE}
    # Values and forms may be shared by other items; only qualifiers change them.
    assert ignored <= shared
    assert len(changes) > 30


def test_no_argument_too_many_is_ignored() -> None:
    for entity in ITEMS:
        text = body(entity)
        longer = f"{text[:-2]},$))" if text.startswith("(") else f"{text[:-1]},$)"
        assert read(**changed(entity, longer.replace("(,", "("))) != BASE, entity


@pytest.mark.parametrize("user", HARMLESS)
def test_identifiers_pictures_and_checks_are_harmless(user: str) -> None:
    for entity in ("#40", "#50", "#30", "#21", "#46", "#44"):
        assert read(_60=user.format(entity)) == BASE
