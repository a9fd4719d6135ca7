"""The grammar of units: names, factors, places in text, and prose."""

from __future__ import annotations

import math

import pytest

from ocmm_core.errors import InputError
from ocmm_core.units import agreed_unit, find_unit, heading_unit, named_unit, scaled, unit_statement


@pytest.mark.parametrize(
    ("text", "factor"),
    [
        ("mm", 1.0), ("MM", 1.0), ("Millimetern", 1.0), ("milímetros", 1.0),
        ("\\milli\\metre", 1.0),
        ("µm", 1e-3), ("\N{GREEK SMALL LETTER MU}m", 1e-3), ("micron", 1e-3), ("m", 1e3),
        ("in", 25.4), ("in.", 25.4), ('"', 25.4), ("\N{DOUBLE PRIME}", 25.4), ("Zoll", 25.4),
        ("'", 304.8), ("feet", 304.8), ("US survey feet", 1200e3 / 3937), ("mil", 0.0254),
        ("thousandths of an inch", 0.0254), ("0.001 inch", 0.0254), ("1/100 mm", 0.01),
        ("10^-3 m", 1.0), ("\N{ANGSTROM SIGN}", 1e-7), ("µin", 25.4e-6),
    ],
)  # fmt: skip
def test_lengths(text: str, factor: float) -> None:
    unit = find_unit(text, "length")
    assert unit is not None
    assert unit.factor == pytest.approx(factor, rel=1e-12)
    assert unit.si == pytest.approx(1e-3 * factor, rel=1e-12)


@pytest.mark.parametrize("text", ["", "M", "Mm", "mM", "NM", "Nm", "furlong", "lab", "points",
"grad",
                                  "1e999 mm", "0 mm", "2 3 mm", "mm2", "in-house"])  # fmt: skip
def test_other_words_are_not_lengths(text: str) -> None:
    assert find_unit(text, "length") is None
    with pytest.raises(InputError, match="line 3"):
        named_unit(text, "length", "a.txt", 3)


def test_angles_and_temperatures() -> None:
    for text, degrees in (("deg", 1.0), ("°", 1.0), ("rad", math.degrees(1.0)), ("gon", 0.9),
                          ("'", 1 / 60), ('"', 1 / 3600)):  # fmt: skip
        assert named_unit(text, "angle", "a").factor == pytest.approx(degrees)
    fahrenheit = named_unit("°F", "temperature", "a")
    assert 68.0 * fahrenheit.factor + fahrenheit.offset == pytest.approx(20.0)


def test_name_and_factor_agree() -> None:
    assert agreed_unit("mm", 0.001, "length", "a.qif").symbol == "mm"
    assert agreed_unit("inch", None, "length", "a.qif").factor == 25.4
    with pytest.raises(InputError, match=r"25\.4 mm in the document, but 1 by its name"):
        agreed_unit("mm", 0.0254, "length", "a.qif")


@pytest.mark.parametrize(
    ("text", "symbol"),
    [
        ("unit: mm", "mm"), ("unit: in", "inch"), ("Units are in in", "inch"),
        ("unit: 1/100 mm, deg", "1/100 mm"), ("# Units are in mm", "mm"),
        ("UNITS/INCH,ANGDEC", "inch"),
        ("Einheit: Zoll", "inch"), ("Alle Maße in mm", "mm"), ("units: deg, mm", "mm"),
        ("all values in um", "µm"), ("exported in inches", "inch"), ("[mm]", "mm"), ("G20", "inch"),
        ("CMM export (inch)", "inch"), ("单位\N{FULLWIDTH COLON}毫米", "mm"),
        ("単位: インチ", "inch"), ("Единицы: дюймы", "inch"), ("Единица измерения: мм", "mm"),
        ('units = "mm"', "mm"), ("x, y, z in mm", "mm"), ("comment unit mm", "mm"),
    ],
)  # fmt: skip
def test_places_that_state_a_unit(text: str, symbol: str) -> None:
    found = unit_statement(text)
    assert found is not None
    assert found.unit is not None
    assert found.unit.symbol == symbol


@pytest.mark.parametrize(
    "text",
    ["data recorded in in-house lab", "the unit was calibrated in May", "Unit 5 of 10",
    "made in Italy",
     "points in the machine frame", "unit under test: 7", "measured in lab 3", "part in",
     "scale: 1.0",
     "unit: °C", "This unit is in good order"],
)  # fmt: skip
def test_prose_states_no_unit(text: str) -> None:
    assert unit_statement(text) is None


@pytest.mark.parametrize("text", ["units: furlongs", "unit: mm or inch", "coordinates in furlongs",
                                  "scale: 25.4", "probe radius in inches",
                                  "imperial units"])  # fmt: skip
def test_unclear_statements_are_no_units(text: str) -> None:
    found = unit_statement(text)
    assert found is not None
    assert found.unit is None


@pytest.mark.parametrize(
    "text", ["All dimensions INCH", "Measured in imperial", "IPS template, Zoll", "寸法 インチ"]
)
def test_a_mentioned_unit_is_asked_for(text: str) -> None:
    found = unit_statement(text)
    assert found is not None
    assert (found.unit, found.is_mention) == (None, True)


@pytest.mark.parametrize("text", ["probe 4, 2 inch stem", "1/2-inch ball", "pinch, thousand"])
def test_a_property_in_inch_is_no_unit(text: str) -> None:
    assert unit_statement(text) is None


@pytest.mark.parametrize(
    ("cell", "parts"),
    [
        ("X [mm]", ("X", "mm")), ("x (in)", ("x", "in")), ("x/mm", ("x", "mm")),
        ("x/1/100 mm", ("x", "1/100 mm")),
        ('X (")', ("X", '"')),
        ("x_mm", ("x", "mm")), ("z in mm", ("z", "mm")), ("x_m", ("x_m", "")), ("xmm", ("x", "mm")),
        ("z (actual)", ("z actual", "")), ("x [furlong]", ("x", "furlong")), ("X", ("X", "")),
    ],
)  # fmt: skip
def test_headings_with_units(cell: str, parts: tuple[str, str]) -> None:
    assert heading_unit(cell) == parts


@pytest.mark.parametrize(
    ("value", "unit", "mm"),
    [(1.5, "inch", 38.1), (0.375, "inch", 9.525), (-0.007, "in", -0.1778), (1.1, "ft", 335.28),
     (0.3, "µm", 0.0003), (3.3, "mil", 0.08382), (0.7, "cm", 7.0), (1e-5, "m", 0.01)],
)  # fmt: skip
def test_converted_lengths_are_rounded_once(value: float, unit: str, mm: float) -> None:
    found = find_unit(unit, "length")
    assert found is not None
    assert scaled(value, found.factor) == mm
