"""Tolerances in the text of a STEP file: read with signs, units and faces, or refused by name.

Each guard has a counterexample: an impossible statement that must not become a limit.
"""

from __future__ import annotations

import time

import pytest

from ocmm_cad.pmi import Dimension, Pmi, Tolerance, may_say_tolerances, read_pmi
from tests.cad.pmi_texts import FACES, SIZE, UNITS, WHOLE, ZONE, labels_of, text_of

MM = "LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE({}),#1)"
VALUE = (
    "(LENGTH_MEASURE_WITH_UNIT()MEASURE_REPRESENTATION_ITEM()"
    "MEASURE_WITH_UNIT(LENGTH_MEASURE({}),#1)REPRESENTATION_ITEM('{}'))"
)


def read(**changes: str) -> Pmi:
    return read_pmi(text_of(*WHOLE, **changes))[0]


def size(**changes: str) -> Dimension:
    (found,) = read(**changes).dimensions
    return found


def zone(**changes: str) -> Tolerance:
    return read(**changes).tolerances[0]


def test_a_size_comes_with_the_sign_of_both_limits_and_its_faces() -> None:
    found = size()
    assert found.fault == ""
    assert (found.name, found.word, found.of) == ("Bore size", "diameter", "length")
    assert (found.nominal, found.lower, found.upper) == (12.0, -0.2, 0.1)
    assert found.faces == (13, 14)
    # What another reader loses: both limits above the nominal are another tolerance.
    found = size(_36=MM.format("0.05"))
    assert (found.lower, found.upper) == (0.05, 0.1)


def test_a_tolerance_comes_with_zone_modifier_datum_and_inches_as_mm() -> None:
    place, flat = read().tolerances
    assert place.fault == flat.fault == ""
    assert (place.word, place.size, place.zone) == ("position", 0.254, "cylindrical or circular")
    assert place.modifiers == ("maximum material requirement",)
    assert [one.labels for one in place.datums] == [("A",)]
    assert (flat.word, flat.size, flat.faces, flat.datums) == ("flatness", 0.05, (11,), ())
    (datum,) = read().datums
    assert (datum.name, datum.faces, datum.fault) == ("A", (11,), "")


def test_faces_stand_in_the_order_of_the_file_with_their_kind() -> None:
    faces = read_pmi(text_of(*WHOLE))[1]
    assert [(one.number, one.shape, one.radius) for one in faces] == [
        (11, "Plane", 0.0),
        (13, "Cylinder", 6.0),
        (14, "Cylinder", 6.0),
        (16, "b spline surface with knots", 0.0),
    ]


def test_limits_of_a_size_become_deviations() -> None:
    two = "SHAPE_DIMENSION_REPRESENTATION('',({}),#95)"
    limits = {
        "_61": VALUE.format("11.9", "lower limit"),
        "_62": VALUE.format("12.3", "upper limit"),
    }
    found = size(_32=two.format("#33,#61,#62"), _34="", **limits)
    assert (found.fault, found.nominal, found.lower, found.upper) == ("", 12.0, -0.1, 0.3)
    # Without a nominal it is the middle.
    found = size(_32=two.format("#61,#62"), _34="", **limits)
    assert (found.nominal, found.lower, found.upper) == (12.1, -0.2, 0.2)
    for alone in ("#61", "#62", "#33,#61"):
        assert "limit" in size(_32=two.format(alone), _34="", **limits).fault
    # Once as limits and once as deviations: ambiguous.
    assert "more than once" in size(_32=two.format("#33,#61,#62"), **limits).fault


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"_36": MM.format("0.3")}, "upper limit +0.1 is below"),
        ({"_36": MM.format("0.1")}, "is no more than the lower one"),
        ({"_36": MM.format("-12.1")}, "reach below zero"),
        ({"_33": VALUE.format("-12.", "nominal value")}, "reach below zero"),
        ({"_36": ""}, "refers to #36, which the file does not have"),
        ({"_33": ""}, "refers to #33"),
        ({"_21": ""}, "refers to #21"),
        ({"_23": ""}, "refers to #23"),
        ({"_14": ""}, "refers to #14"),
        ({"_36": "LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(-0.2),$)"}, "no unit"),
        ({"_36": "LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE('few'),#1)"}, "not a number"),
        ({"_36": "LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(NaN),#1)"}, "cannot be read"),
        ({"_36": MM.format("1.E400")}, "absurd"),
        ({"_36": MM.format("-2.E5")}, "absurd"),
        ({"_36": "LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(-0.2),#9)"}, "neither of lengths"),
        ({"_36": "PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(-0.2),#6)"}, "no lengths"),
        ({"_36": "MEASURE_WITH_UNIT(LENGTH_MEASURE(-0.2),#6)"}, "in another unit"),
        ({"_36": "MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(-0.2),#1)"}, "in another unit"),
        ({"_36": "MEASURE_WITH_UNIT(COUNT_MEASURE(-2),#1)"}, "in another unit"),
        ({"_36": "LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(-0.2)"}, "too early"),
        ({"_35": "TOLERANCE_VALUE(#36)"}, "fewer than its type"),
        ({"_35": "TOLERANCE_VALUE((#36,#37),#37)"}, "refers to 2 entities"),
        ({"_60": "PLUS_MINUS_TOLERANCE(#35,#30)"}, "more than once"),
        ({"_60": "DIMENSIONAL_CHARACTERISTIC_REPRESENTATION(#30,#32)"}, "gives it 2 values"),
        ({"_31": ""}, "a tolerance and no value"),
        ({"_33": VALUE.format("12.", "some value")}, "unknown or stands twice"),
        ({"_30": "DIMENSIONAL_SIZE_WITH_PATH(#21,'diameter',#22)"}, "is not supported"),
    ],
)
def test_a_size_that_cannot_be_says_why_and_has_no_limits(
    changes: dict[str, str], why: str
) -> None:
    found = size(**changes)
    assert why in found.fault
    assert found.lower is None
    assert found.upper is None


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"_2": MM.format("2.54")}, "'INCH' is 2.54 mm"),
        ({"_2": MM.format("0.")}, "'INCH' is 0 mm"),
        ({"_3": "(CONVERSION_BASED_UNIT('CUBIT',#2)LENGTH_UNIT()NAMED_UNIT(#9))"}, "'CUBIT'"),
        ({"_2": "LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#3)"}, "refers to itself"),
        ({"_1": "(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.ATTO.,.METRE.))"}, "#1 is ATTO METRE"),
        ({"_1": "(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.SECOND.))"}, "#1 is MILLI SECOND"),
        ({"_41": MM.format("-0.1")}, "no width of a zone"),
        ({"_41": MM.format("5000.")}, "no width of a zone"),
        ({"_41": "PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(1.),#6)"}, "no width"),
        ({"_44": ""}, "refers to #44"),
        ({"_46": ""}, "refers to #46"),
        ({"_45": "DATUM_REFERENCE_COMPARTMENT('',$,#20,.F.,$,$)"}, "names no datum"),
        ({"_46": "DATUM('',$,#20,.F.,'')"}, "has no letter"),
        ({"_43": ""}, "refers to #43"),
    ],
)
def test_a_tolerance_that_cannot_be_says_why_and_has_no_size(
    changes: dict[str, str], why: str
) -> None:
    found = zone(**changes)
    assert why in found.fault
    assert found.size is None


def test_the_unit_of_angles_is_degrees() -> None:
    angle = "(MEASURE_REPRESENTATION_ITEM()MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE({}),{})"
    angle += "PLANE_ANGLE_MEASURE_WITH_UNIT()REPRESENTATION_ITEM('nominal value'))"
    off = "PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE({}),#6)"
    more = {
        "_30": "ANGULAR_LOCATION('angle',$,#28,#21,.EQUAL.)",
        "_36": off.format("-0.5"),
        "_37": off.format("0.5"),
    }
    found = size(_33=angle.format("60.", "#6"), **more)
    assert (found.of, found.nominal, found.lower, found.upper) == ("angle", 60.0, -0.5, 0.5)
    assert (found.faces, found.other_faces) == ((11,), (13, 14))
    found = size(_33=angle.format("1.0471975511966", "#4"), **more)
    assert found.nominal == pytest.approx(60.0, abs=1e-6)
    # A unit of pi/200 is not a degree.
    wrong = "PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(0.015707963),#4)"
    assert "'DEGREE'" in size(_33=angle.format("60.", "#6"), _5=wrong, **more).fault


@pytest.mark.parametrize(
    ("name", "mm", "value"),
    [("FOOT", 304.8, 304.8), ("thou", 0.0254, 0.0254), ("centimetre", 10.0, 10.0),
     ("INCHES", 25.4, 25.4), ("US survey foot", 304.8006096, 304.800610)],
)  # fmt: skip
def test_a_unit_has_the_names_of_the_grammar(name: str, mm: float, value: float) -> None:
    unit = f"(CONVERSION_BASED_UNIT('{name}',#2)LENGTH_UNIT()NAMED_UNIT(#9))"
    found = zone(_2=MM.format(mm), _3=unit, _41=MM.format("1.").replace("#1)", "#3)"))
    assert (found.fault, found.size) == ("", value)


def test_values_of_one_dimension_have_units_of_their_own() -> None:
    found = size(_33=VALUE.format("1.5", "nominal value").replace("#1)", "#3)"))
    assert (found.nominal, found.lower, found.upper) == (38.1, -0.2, 0.1)


def test_what_changes_a_meaning_is_named() -> None:
    assert zone(_60="PROJECTED_ZONE_DEFINITION(#42,(#28),#28,#41)").extras == ("projected zone",)
    older = "(GEOMETRIC_TOLERANCE('Place','',#41,#21)POSITION_TOLERANCE()"
    unequal = f"{older}UNEQUALLY_DISPOSED_GEOMETRIC_TOLERANCE(#41))"
    assert zone(_40=unequal).extras == ("unequally disposed",)
    both = "GEOMETRIC_TOLERANCE_RELATIONSHIP('composite','',#40,#50)"
    upper, lower = read(_60=both).tolerances
    assert (upper.segment, lower.segment) == ("upper", "lower")
    simultaneous = zone(_60="GEOMETRIC_TOLERANCE_RELATIONSHIP('simultaneity','',#40,#50)")
    assert simultaneous.extras == ("related to another one ('simultaneity')",)
    modified = "DATUM_REFERENCE_COMPARTMENT('',$,#20,.F.,#46,(SIMPLE_DATUM_REFERENCE_MODIFIER("
    found = zone(_45=modified + ".MAXIMUM_MATERIAL_REQUIREMENT.)))")
    assert found.datums[0].modifiers == ("maximum material requirement",)
    element = "DATUM_REFERENCE_ELEMENT('',$,#20,.F.,#46,$)"
    common = "DATUM_REFERENCE_COMPARTMENT('',$,#20,.F.,COMMON_DATUM_LIST((#60,#60)),$)"
    assert zone(_45=common, _60=element).datums[0].labels == ("A", "A")
    fit = size(_35="LIMITS_AND_FITS('H','hole','7','')")
    assert (fit.fit, fit.lower) == ("H7", None)
    note = "DESCRIPTIVE_REPRESENTATION_ITEM('dimensional note','theoretical')"
    held = "SHAPE_DIMENSION_REPRESENTATION('',(#33,#60),#95)"
    assert size(_32=held, _60=note, _34="").notes == ("theoretical",)


def test_datums_that_contradict_each_other_are_refused() -> None:
    (datum,) = read(_60="GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#46,#96,#13)").datums
    assert "other faces" in datum.fault
    both = read(_60="DATUM('',$,#20,.F.,'A')").datums
    assert all("twice" in one.fault for one in both)


def test_a_tolerance_without_faces_has_none_and_edges_are_named() -> None:
    assert zone(_24="", _25="").faces == ()
    found = zone(_27="GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#23,#96,#60)", _60="EDGE_CURVE('',#1)")
    assert (found.faces, found.odd) == ((13,), ("EDGE_CURVE",))


def test_circles_of_aspects_and_numbers_given_twice_end() -> None:
    assert size(_60="SHAPE_ASPECT_RELATIONSHIP('',$,#22,#21)").faces == (13, 14)
    text = text_of(*WHOLE).replace("DATA;", f"DATA;#36={MM.format('-0.1')};")
    assert "two entities #36" in read_pmi(text)[0].dimensions[0].fault


def test_damage_of_the_whole_text_is_said_or_leaves_items_with_faults() -> None:
    assert read_pmi("nothing")[0].fault == "the file has no data section"
    assert read_pmi(text_of(UNITS, FACES))[0].is_empty
    deep = read(_36="LENGTH_MEASURE_WITH_UNIT(" + 200 * "(" + 200 * ")" + ")")
    assert "deeper" in deep.dimensions[0].fault
    whole = text_of(*WHOLE)
    for end in range(len(whole), 0, -97):
        pmi, _ = read_pmi(whole[:end])
        for one in pmi.dimensions:
            assert one.lower in (None, -0.2), whole[:end][-60:]
        for other in pmi.tolerances:
            assert other.size in (None, 0.254, 0.05)


def test_texts_made_to_cost_time_do_not() -> None:
    long = "(" * 200_000
    texts = (
        text_of(*WHOLE) + "#70=" + "'" * 200_001,
        "DATA;" + "#7='a" * 100_000,
        "DATA;" + "#1" * 300_000,
        "DATA;" + "/*" * 300_000,
        text_of(*WHOLE, _60="(" + "A" * 300_000),
        text_of(*WHOLE, _60=f"PLANE({long})"),
        text_of(*WHOLE, _60="(" + "A(" * 100_000),
    )
    began = time.process_time()
    for text in texts:
        read_pmi(text)
    # A way that looks back would take minutes.
    assert time.process_time() - began < 20.0


def test_comments_and_texts_that_look_like_entities_are_none() -> None:
    text = text_of(UNITS, FACES, SIZE, ZONE).replace(
        "DATA;", "DATA;/* #36=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(-9.),#1); */"
    )
    assert read_pmi(text)[0].dimensions[0].lower == -0.2
    headed = text_of(*WHOLE).replace(
        "HEADER;", "HEADER;\nFILE_DESCRIPTION(('the DATA; of it'),'2;1');"
    )
    assert read_pmi(headed)[0].dimensions[0].lower == -0.2
    named = size(_38="DRAUGHTING_CALLOUT('a; #30=X(''b'') \\X2\\00D8\\X0\\ /* c */',())")
    assert named.name == "a; #30=X('b') Ø /* c */"


def test_labels_are_counted_as_another_reader_does() -> None:
    # One size; the label ends at its own aspect; flatness and position; datum A once.
    assert labels_of(read()) == (1, 2, 1)
    note = "DRAUGHTING_CALLOUT('note',())"
    assert labels_of(read(_60=note)) == (2, 2, 1)
    assert labels_of(read(_24="", _25="")) == (1, 1, 0)


def test_a_text_without_a_word_of_tolerances_need_not_be_read() -> None:
    assert not may_say_tolerances(text_of(UNITS, FACES))
    callout = "#99=DRAUGHTING_CALLOUT('note',());"
    for parts in ((SIZE,), (ZONE,), (callout,), ("#99=DATUM('','',#1,.F.,'A');",)):
        text = text_of(UNITS, FACES, *parts)
        assert may_say_tolerances(text)
        assert not read_pmi(text)[0].is_empty
