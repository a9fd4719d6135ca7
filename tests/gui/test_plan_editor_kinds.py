"""Every construction and alignment is added, filled in, removed and undone in the window."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QComboBox, QLineEdit
from pytestqt.qtbot import QtBot

from ocmm_core.alignment import (
    Alignment,
    DatumAlignment,
    Relocation,
    SavedFrame,
    frame_document,
    save_frame,
)
from ocmm_core.documents import resource
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.features.measured import Construction, Intersection, Midpoint
from ocmm_core.geometry import RigidTransform
from ocmm_core.inspection.plan import add_construction, load_plan, with_alignment
from ocmm_core.tolerances.zones import Characteristic
from ocmm_gui.plan_editor import PlanSheet
from ocmm_gui.plan_editor._form_lines import FieldKind, closed, form_lines, opened, tag_field
from ocmm_gui.plan_editor._item_form import ItemForm
from ocmm_gui.plan_editor._plan_checks import faulty_field
from ocmm_gui.plan_editor._plan_items import ALIGNMENT, HEAD, ItemKey
from tests.host import HANG_MS

CONSTRUCTIONS: dict[str, dict[str, str]] = {
    "intersection": {"features": "BED, BOSS"},
    "projection": {"features": "BORE_B, BED"},
    "midpoint": {"features": "BORE_A, BORE_B"},
    "bisector": {"features": "BED, PLATE_TOP", "which": "across"},
    "symmetry": {"features": "BORE_A, BORE_B"},
    "offset": {"features": "BORE_A, EDGE", "towards": "CORNER", "distance": "-2.5"},
    "best fit": {"features": "BORE_A, BORE_B, BALL", "shape": "Plane", "through": "centres"},
    "bolt circle": {"features": "BORE_A, BORE_B, BALL"},
    "cone section": {"features": "CONE", "diameter": "12"},
    "tapped hole": {"features": "BOSS, BED", "play": "0,02"},
    "hidden point": {"features": "BALL, BORE_A", "distance": "30,5"},
    "part of": {"features": "BOSS", "part": "axis"},
}
"""Entries for every kind, on the shipped plan of twelve features."""

MOST_CHANGES = 30
"""More are not made by filling in one item."""

CONDITIONS = "BORE_A 0 0 1\nBORE_B 0 0 1\nSLOT 0 0 1\nBORE_A 1 0 0\nBORE_A 0 1 0\nBORE_B 0 1 0"
ALIGNMENTS: dict[str, dict[str, str]] = {
    "3-2-1": {
        "primary": "BED", "secondary": "EDGE", "origin": "CORNER", "towards": "BALL",
        "primary_axis": "-z", "secondary_axis": "y",
    },
    "plane-axis-point": {"plane": "BED", "axis": "EDGE", "point": "CORNER"},
    "datum reference frame": {"datums": "BED, BORE_A, BORE_B"},
    "best fit": {
        "points": "BORE_A, BORE_B, BALL", "weights": "1 1 2.5", "start.type": "plane-axis-point",
        "start.plane": "BED", "start.axis": "EDGE", "start.point": "CORNER", "locked": "z, rx",
    },
    "rps": {"conditions": CONDITIONS},
}  # fmt: skip
"""All but those that come from the document of a frame."""


@pytest.fixture
def sheet(qtbot: QtBot, tmp_path: Path) -> Iterator[PlanSheet]:
    """Return the editor on a copy of the plan of twelve features, as a separate window."""
    path = tmp_path / "gauge.toml"
    path.write_bytes(resource("plans", "gauge.toml").read_bytes())
    made = PlanSheet(load_plan(path), path, lambda: Path("none.ocmm"))
    qtbot.addWidget(made)
    made.resize(1280, 640)
    with qtbot.waitActive(made):
        made.show()
        made.activateWindow()
    yield made
    made.close_work()


def _fill(form: ItemForm, key: str, text: str) -> None:
    """Fill a field in by the keyboard alone."""
    field = form.fields[key]
    field.setFocus()
    assert QApplication.focusWidget() is field
    if isinstance(field, QComboBox):
        row = field.findText(text)
        assert row >= 0, text
        while form.fields[key].currentText() != text:  # type: ignore[union-attr] # a choice, too
            now = form.fields[key]
            assert isinstance(now, QComboBox)
            QTest.keyClick(now, Qt.Key.Key_Down if now.currentIndex() < row else Qt.Key.Key_Up)
        return
    QTest.keyClick(field, Qt.Key.Key_A, Qt.KeyboardModifier.ControlModifier)
    if isinstance(field, QLineEdit):
        QTest.keyClicks(field, text)
    else:
        field.setPlainText(text)
    QTest.keyClick(field, Qt.Key.Key_Tab)


@pytest.mark.parametrize("kind", CONSTRUCTIONS)
def test_every_construction_is_filled_in_and_undone(sheet: PlanSheet, kind: str) -> None:
    before = sheet.draft.plan
    sheet.items.choose(ItemKey("features", "BORE_A"))
    QTest.keyClick(sheet, Qt.Key.Key_F6, Qt.KeyboardModifier.ShiftModifier)
    form = sheet.form()
    _fill(form, "kind", kind)
    for key, text in CONSTRUCTIONS[kind].items():
        _fill(form, key, text)
    _fill(form, "name", "MADE")
    assert sheet.checks.text().startswith("✔"), sheet.checks.text()
    (item,) = sheet.draft.plan.constructions
    assert item.name == "MADE"
    assert type(item).__struct_config__.tag == kind
    assert item == form.item()
    assert ", ".join(item.features) == CONSTRUCTIONS[kind]["features"]
    after = sheet.draft.plan
    changes = 0
    while sheet.draft.plan != before and changes < MOST_CHANGES:
        QTest.keyClick(sheet, Qt.Key.Key_F10)
        changes += 1
    assert sheet.draft.plan == before
    for _ in range(changes):
        QTest.keyClick(sheet, Qt.Key.Key_F10, Qt.KeyboardModifier.ShiftModifier)
    assert sheet.draft.plan == after
    sheet.items.choose(ItemKey("constructions", "MADE"))
    QTest.keyClick(sheet, Qt.Key.Key_F9)
    assert sheet.draft.plan == before


@pytest.mark.parametrize("kind", ALIGNMENTS)
def test_every_alignment_is_filled_in_saved_and_removed(
    sheet: PlanSheet, tmp_path: Path, kind: str
) -> None:
    before = sheet.draft.plan
    QTest.keyClick(sheet, Qt.Key.Key_F5)
    form = sheet.form()
    _fill(form, "type", kind)
    for key, text in ALIGNMENTS[kind].items():
        _fill(form, key, text)
    assert sheet.checks.text().startswith("✔"), sheet.checks.text()
    rule = sheet.draft.plan.alignment
    assert rule is not None
    assert type(rule).__struct_config__.tag == kind
    sheet.save_as(tmp_path / "again.toml")
    assert load_plan(tmp_path / "again.toml").alignment == rule
    sheet.items.choose(ALIGNMENT)
    assert form.item() == rule
    QTest.keyClick(sheet, Qt.Key.Key_F9)
    assert sheet.draft.plan == with_alignment(before, None)
    sheet.undo()
    assert sheet.draft.plan.alignment == rule


def test_the_frame_of_a_document_is_taken_or_found_again(
    sheet: PlanSheet, qtbot: QtBot, tmp_path: Path
) -> None:
    T = RigidTransform(np.eye(3), np.array([1.0, 2.0, 3.0]))
    places = {name: np.array(place) for name, place in (
        ("BORE_A", [0.0, 0.0, 0.0]), ("BORE_B", [90.0, 0.0, 0.0]), ("BALL", [0.0, 50.0, 9.0]),
    )}  # fmt: skip
    path = tmp_path / "machine.toml"
    save_frame(path, frame_document("MACHINE", "2026-01-01T00:00:00Z", "here", T, places))
    sheet.align()
    form = sheet.form()
    _fill(form, "type", "saved frame")
    assert "comes from its document" in sheet.checks.text()
    assert form.faulty() == "digest"
    sheet.import_file(path)
    qtbot.waitUntil(sheet.models.importing.isHidden, timeout=HANG_MS)
    assert isinstance(sheet.draft.plan.alignment, SavedFrame)
    assert form.item() == sheet.draft.plan.alignment
    rotation = form.fields["rotation"]
    assert not isinstance(rotation, QLineEdit | QComboBox)
    assert rotation.isReadOnly()
    _fill(form, "type", "relocation")
    sheet.import_file(path)
    qtbot.waitUntil(sheet.models.importing.isHidden, timeout=HANG_MS)
    _fill(form, "limit", "0,25")
    rule = sheet.draft.plan.alignment
    assert isinstance(rule, Relocation)
    assert (rule.limit, len(rule.control), rule.name) == (0.25, 3, "MACHINE")


@pytest.mark.parametrize(
    ("kind", "filled", "said", "faulty"),
    [
        ("best fit", {"points": "BORE_A, BORE_B"}, "three", "points"),
        ("best fit", {"points": "BORE_A, BORE_B, BALL", "locked": "z"}, "start", "start.type"),
        ("rps", {"conditions": "BORE_A 0 0 1"}, "six", "conditions"),
        ("rps", {"conditions": "BORE_A 0 0"}, "one name and three numbers", "conditions"),
        ("plane-axis-point", {"plane": "EDGE"}, "needs one of: plane", "plane"),
        ("datum reference frame", {"datums": "NOWHERE"}, "NOWHERE", "datums"),
    ],
)
def test_what_is_wrong_with_an_alignment_is_said_at_its_field(
    sheet: PlanSheet, kind: str, filled: dict[str, str], said: str, faulty: str
) -> None:
    sheet.align()
    _fill(sheet.form(), "type", kind)
    for key, text in filled.items():
        before = sheet.draft.plan
        _fill(sheet.form(), key, text)
    assert sheet.draft.plan == before
    assert sheet.checks.text().startswith("✖")
    assert said in sheet.checks.text()
    assert sheet.form().faulty() == faulty


def test_what_the_nominals_do_not_give_is_said_and_taken_over(sheet: PlanSheet) -> None:
    plan = add_construction(sheet.draft.plan, Intersection(name="NEVER", features=("BED", "EDGE")))
    sheet.draft.did(plan)
    sheet.open()
    assert "The nominals do not define NEVER" in sheet.checks.text()
    sheet.undo()
    sheet.align()
    _fill(sheet.form(), "secondary", "BOSS")
    rule = sheet.draft.plan.alignment
    assert isinstance(rule, DatumAlignment)
    assert rule.secondary == ("BOSS",)
    assert "could not be aligned" in sheet.checks.text()
    assert sheet.form().faulty() == ""


def test_a_construction_that_others_need_stays_and_takes_its_name_along(sheet: PlanSheet) -> None:
    plan = add_construction(
        sheet.draft.plan, Midpoint(name="MIDDLE", features=("BORE_A", "BORE_B"))
    )
    # A characteristic may have the name of a feature: the list distinguishes them.
    wanted = Characteristic(
        name="MIDDLE", kind="coordinate", axis="x", features=["MIDDLE"], lower=-1.0, upper=1.0
    )
    plan = msgspec.structs.replace(plan, characteristics=[*plan.characteristics, wanted])
    sheet.draft.did(plan)
    key = ItemKey("constructions", "MIDDLE")
    sheet.items.show_plan(plan, key)
    errors: list[OcmmError] = []
    sheet.failed.connect(errors.append)
    sheet.remove()
    assert "is used by MIDDLE" in errors[0].what
    sheet.items.show_plan(plan, ItemKey("characteristics", "MIDDLE"))
    sheet.remove()
    assert sheet.draft.plan.characteristics == plan.characteristics[:-1]
    assert sheet.draft.plan.constructions == plan.constructions
    sheet.undo()
    sheet.items.choose(key)
    _fill(sheet.form(), "name", "CENTRE")
    changed = sheet.draft.plan
    assert changed.constructions[0].name == "CENTRE"
    assert (changed.characteristics[-1].name, changed.characteristics[-1].features) == (
        "MIDDLE", ["CENTRE"],
    )  # fmt: skip
    sheet.items.choose(ItemKey("characteristics", "MIDDLE"))
    assert sheet.form().item() == changed.characteristics[-1]
    sheet.remove()
    assert len(sheet.draft.plan.characteristics) == len(plan.characteristics) - 1
    sheet.items.choose(ItemKey("constructions", "CENTRE"))
    sheet.add_construction()
    assert [item.name for item in sheet.draft.plan.constructions] == ["CENTRE", "CENTRE2"]


def test_a_fault_marks_the_field_of_its_own_item_only(sheet: PlanSheet) -> None:
    plan = sheet.draft.plan
    first = ItemKey("features", plan.features[0].name)
    for place, field in (
        ("features[0].name", "name"), ("features[1].name", ""), ("characteristics[0].name", ""),
    ):  # fmt: skip
        fault = InputError("plan.field", f"the plan: field '{place}' is wrong.", "Correct it.")
        assert faulty_field(fault, plan, first) == field


def _every_field(make: Any, data: dict[str, Any] | None = None) -> int:
    """Return the number of lines in the forms of a type, choice by choice."""
    data = opened(make, data)
    lines = form_lines(make, data)
    assert len({line.key for line in lines}) == len(lines)
    assert all(line.label and line.tip for line in lines)
    return len(lines)


@pytest.mark.parametrize("make", [Alignment | None, Construction], ids=["rule", "construction"])
def test_every_field_of_the_types_has_a_line_with_words(make: Any) -> None:
    field = tag_field(make)
    (first, *_) = form_lines(make, opened(make, None))
    for kind in (choice for choice in first.choices if choice):
        data = {field: kind}
        assert _every_field(make, data) > 1
        inner = next((line for line in form_lines(make, data)[1:] if line.decides), None)
        for choice in inner.choices if inner is not None else ():
            _every_field(make, {field: kind, "start": {"type": choice}})
        # Neutral values are plain data of the type, except for mandatory entries.
        plain = closed(make, {line.key: line.neutral for line in form_lines(make, data)
                              if "." not in line.key} | data)  # fmt: skip
        if not any(line.kind is FieldKind.FIXED for line in form_lines(make, data)):
            msgspec.convert(plain, make)


def test_name_material_and_rule_of_the_plan(sheet: PlanSheet) -> None:
    sheet.items.choose(HEAD)
    form = sheet.form()
    _fill(form, "name", "OTHER")
    _fill(form, "rule", "ilac-g8")
    _fill(form, "material.given", "given")
    _fill(form, "material.name", "steel")
    _fill(form, "material.expansion_ppm", "999")
    assert form.faulty() == "material.expansion_ppm"
    _fill(form, "material.expansion_ppm", "11.5")
    plan = sheet.draft.plan
    assert (plan.name, plan.rule) == ("OTHER", "ilac-g8")
    assert plan.material is not None
    assert (plan.material.name, plan.material.expansion_ppm) == ("steel", 11.5)
    _fill(form, "material.given", "")
    assert sheet.draft.plan.material is None


def test_another_plan_is_opened_or_begun_only_when_this_one_is_saved(
    sheet: PlanSheet, qtbot: QtBot, tmp_path: Path
) -> None:
    sheet.items.choose(ItemKey("characteristics", "Ball diameter"))
    sheet.remove()
    changed = sheet.draft.plan
    assert not sheet.draft.is_saved
    calls: list[Callable[[], None]] = [
        lambda: sheet.open_file(resource("plans", "demo.toml")),
        sheet.keys["new"].trigger,
        sheet.measure,
    ]
    for call in calls:
        with qtbot.waitSignal(sheet.told, timeout=HANG_MS):
            call()
        assert sheet.draft.plan == changed
    sheet.save_as(tmp_path / "gauge.toml")
    with qtbot.waitSignal(sheet.measure_wanted, timeout=HANG_MS):
        sheet.measure()
    sheet.keys["new"].trigger()
    assert [item.name for item in sheet.draft.plan.features] == ["FEATURE"]
    assert sheet.draft.path is None
    sheet.open_file(resource("plans", "demo.toml"))
    assert sheet.draft.plan.name == "DEMO"
