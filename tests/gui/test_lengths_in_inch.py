"""Lengths in inch: unmistakable for mm, on the screen and in a field."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

import msgspec
import pytest
from PySide6.QtWidgets import QApplication, QLabel, QLineEdit
from pytestqt.qtbot import QtBot

from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.features.shapes import NominalFeature
from ocmm_core.inspection.plan import load_plan
from ocmm_core.tolerances.kinds import KINDS, spec_of
from ocmm_core.tolerances.zones import Characteristic
from ocmm_gui.kit import (
    INCH_MM,
    NumberStyle,
    field_length,
    quantity,
    split_unit,
    style_of,
    to_mm,
    use_numbers,
)
from ocmm_gui.plan_editor._field_labels import FieldUnit
from ocmm_gui.plan_editor._item_form import ItemForm
from tests.gui.plain_numbers import plain_number
from tests.host import HANG_MS

if TYPE_CHECKING:
    from tests.gui.conftest import OpenWindow


@pytest.fixture(params=["en", "de"])
def inch(request: pytest.FixtureRequest) -> Iterator[str]:
    """Show inch for one test, with a point and with a comma."""
    use_numbers(style_of(request.param, units="inch"))
    yield request.param
    use_numbers(NumberStyle())


_PLAN = load_plan(resource("plans", "demo.toml"))


def _of_kind(unit: str) -> Characteristic:
    return next(one for one in _PLAN.characteristics if spec_of(one.kind).unit == unit)


def _form(qtbot: QtBot, item: msgspec.Struct) -> ItemForm:
    form = ItemForm("form", type(item))
    qtbot.addWidget(form)
    form.show_item(item)
    return form


def _type(form: ItemForm, key: str, text: str) -> None:
    field = form.fields[key]
    assert isinstance(field, QLineEdit)
    field.setText(text)


def _text(form: ItemForm, key: str) -> str:
    field = form.fields[key]
    assert isinstance(field, QLineEdit)
    return field.text()


@pytest.mark.usefixtures("inch")
@pytest.mark.parametrize(
    ("typed", "stored_mm"),
    [
        ("0.003", 0.0762),
        ("0.003 in", 0.0762),
        ("0,003", 0.0762),
        ('0.003"', 0.0762),
        ("0.003 inch", 0.0762),
        ("0.08 mm", 0.08),
        ("0.08mm", 0.08),
    ],
)
def test_a_tolerance_typed_in_inch_is_stored_in_mm(
    qtbot: QtBot, typed: str, stored_mm: float
) -> None:
    form = _form(qtbot, _of_kind("mm"))
    _type(form, "upper", typed)
    item = form.item()
    assert item.upper == stored_mm
    # A value shown again has its unit, and the same meaning when read again.
    form.show_item(item)
    assert _text(form, "upper").endswith(" in")
    assert form.item() == item
    use_numbers(NumberStyle())
    form.show_item(item)
    assert _text(form, "upper") == f"{stored_mm:g}"
    assert form.item() == item


@pytest.mark.parametrize(("typed", "stored_mm"), [("0.08", 0.08), ("0.003 in", 0.0762)])
def test_in_mm_a_number_is_mm_unless_it_says_inch(
    qtbot: QtBot, typed: str, stored_mm: float
) -> None:
    form = _form(qtbot, _of_kind("mm"))
    _type(form, "upper", typed)
    assert form.item().upper == stored_mm


@pytest.mark.usefixtures("inch")
def test_an_angle_is_never_a_length(qtbot: QtBot) -> None:
    kind = next(kind for kind in KINDS if spec_of(kind).unit == "deg")
    item = msgspec.structs.replace(_of_kind("mm"), kind=kind, nominal=30.0, lower=-0.5, upper=0.5)
    form = _form(qtbot, item)
    assert _text(form, "nominal") == "30"
    assert form.item() == item
    _type(form, "upper", "0.25")
    assert form.item().upper == 0.25
    for wrong in ("0.25 in", "0.25 mm", '0.25"'):
        _type(form, "upper", wrong)
        with pytest.raises(InputError):
            form.item()


@pytest.mark.usefixtures("inch")
def test_what_was_a_length_does_not_become_an_angle_of_the_same_number(qtbot: QtBot) -> None:
    form = _form(qtbot, _of_kind("mm"))
    kind = next(kind for kind in KINDS if spec_of(kind).unit == "deg")
    form.fields["kind"].setCurrentText(kind)  # type: ignore[union-attr]
    with pytest.raises(InputError):
        form.item()


@pytest.mark.usefixtures("inch")
@pytest.mark.parametrize(
    "item", [*_PLAN.features, *_PLAN.characteristics], ids=lambda one: one.name
)
def test_a_form_that_nobody_touched_changes_no_digit(
    qtbot: QtBot, item: NominalFeature | Characteristic
) -> None:
    form = _form(qtbot, item)
    assert form.item() == item
    for line in form.lines():
        if line.measure is FieldUnit.LENGTH:
            field = form.fields[line.key]
            text = field.text() if isinstance(field, QLineEdit) else ""
            assert not text or text.endswith(" in"), line.key
            assert not re.search(r"\bmm\b", f"{line.label} {line.tip}"), line.key


def length_of_field(text: str) -> float:
    number, unit = split_unit(text)
    return to_mm(float(plain_number(number)), unit)


@pytest.mark.usefixtures("inch")
@pytest.mark.parametrize(
    "value_mm", [0.0, 0.08, -0.08, 0.001, 1e-6, 19.989, 1234.567891, -2999.999999, 25.4]
)
def test_every_length_of_a_nanometre_comes_back(value_mm: float) -> None:
    assert length_of_field(field_length(value_mm)) == value_mm


@pytest.mark.usefixtures("inch")
@pytest.mark.parametrize(
    "typed", ["", "in", "0.1 kg", "1/4 in", "0.1 in in", "1.234,5", "0.1 in 2"]
)
def test_what_is_no_length_is_refused(typed: str) -> None:
    with pytest.raises(ValueError, match="could not convert"):
        length_of_field(typed)


def test_everything_that_is_shown_of_a_result_says_inch(
    open_window: OpenWindow, qtbot: QtBot, qapp: QApplication, inch: str
) -> None:
    bench = open_window(stay=True)
    window = bench.window
    bench.wait_complete(qtbot)
    qtbot.waitUntil(lambda: bench.bridge.shown.job.part_verdict.complete, timeout=HANG_MS)
    sign = "," if inch == "de" else "."
    number = re.compile(rf"[+-]?\d+{re.escape(sign)}\d{{5}}")
    for result in bench.bridge.shown.job.characteristics:
        if result.unit == "mm" and result.measured is not None:
            text = quantity(result, result.measured)
            assert text.endswith(" in")
            shown = float(text.removesuffix(" in").replace(",", "."))
            # Half of the last digit.
            assert shown * INCH_MM == pytest.approx(result.measured, abs=0.51e-5 * INCH_MM)
    window.sheets.show_sheet("results")
    qtbot.wait(200)
    table = window.sheets.results.table
    cells = [word for row in range(table.rowCount()) for word in table.cells(row)]
    lengths = [word for word in cells if number.search(word)]
    assert len(lengths) > 5
    assert all("in" in word.split() for word in lengths), lengths
    # No length appears with its number in mm.
    in_mm = [word for word in cells if re.search(rf"\d{re.escape(sign)}\d{{3}}(?!\d)", word)]
    assert in_mm == []
    window.sheets.left.emit()
    qtbot.wait(100)
    told = [label.text() for label in window.desk.findChildren(QLabel) if label.isVisible()]
    assert not [text for text in told if number.search(text) and "in" not in text.split()]
