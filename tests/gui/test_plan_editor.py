"""The plan editor: the plan holds the entered values, and errors are reported."""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import msgspec
import pytest
from PySide6.QtWidgets import QApplication, QComboBox, QLineEdit
from pytestqt.qtbot import QtBot

from ocmm_core.documents import resource
from ocmm_core.errors import OcmmError
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.plan import EnvironmentLimits, Plan, feature_table, load_plan
from ocmm_core.tolerances.kinds import KINDS, spec_of
from ocmm_core.tolerances.zones import Characteristic
from ocmm_gui.kit import use_language
from ocmm_gui.plan_editor import PlanSheet
from ocmm_gui.plan_editor._field_labels import choice_word
from ocmm_gui.plan_editor._form_lines import FLAGS, GIVEN, FieldKind, form_lines
from ocmm_gui.plan_editor._plan_items import ALIGNMENT, HEAD, LISTS, ItemKey, item_of
from tests.host import HANG_MS

BORE = "BORE_A"


@pytest.fixture
def sheet(qtbot: QtBot) -> Iterator[PlanSheet]:
    """Return the editor on the shipped plan of twelve features."""
    path = resource("plans", "gauge.toml")
    made = PlanSheet(load_plan(path), path, lambda: Path("none.ocmm"))
    qtbot.addWidget(made)
    yield made
    made.close_work()


def _choose(sheet: PlanSheet, name: str, group: str = "features") -> None:
    sheet.items.choose(ItemKey(group, name))
    assert sheet.items.chosen() == ItemKey(group, name)


def _fill(sheet: PlanSheet, key: str, text: str) -> None:
    field = sheet.form().fields[key]
    if isinstance(field, QComboBox):
        assert field.findText(text) >= 0
        field.setCurrentText(text)
        return
    if isinstance(field, QLineEdit):
        field.setText(text)
    else:
        field.setPlainText(text)
    field.editingFinished.emit()


def test_every_item_of_a_plan_comes_back_from_its_form(sheet: PlanSheet) -> None:
    plan = sheet.draft.plan
    for group in LISTS:
        for item in getattr(plan, group):
            _choose(sheet, item.name, group)
            assert sheet.form().item() == item, item.name
    for key in (HEAD, ALIGNMENT):
        sheet.items.choose(key)
        assert sheet.form().item() == item_of(plan, key)
    assert sheet.draft.plan is plan


@pytest.mark.parametrize(
    ("key", "text", "value"),
    [
        ("name", "BORE_1", "BORE_1"),
        ("points", "9", 9),
        ("point", "1,5 -17 15.25", (1.5, -17.0, 15.25)),
        ("diameter", "20.5", 20.5),
        ("side", "outer", "outer"),
        ("projection", "", ""),
        ("compensation", "nominal", "nominal"),
        ("text", "Half way down.", "Half way down."),
    ],
)
def test_a_field_that_is_filled_in_is_in_the_plan(
    sheet: PlanSheet, key: str, text: str, value: object
) -> None:
    _choose(sheet, BORE)
    _fill(sheet, key, text)
    feature = next(item for item in sheet.draft.plan.features if item.name in (BORE, "BORE_1"))
    assert getattr(feature, key) == value
    assert not sheet.draft.is_saved
    # Another place or diameter of the bore contradicts its characteristics.
    contradicts = key in ("point", "diameter")
    assert sheet.checks.text().startswith("✖  The plan is not valid" if contradicts else "✔")


@pytest.mark.parametrize("shape", list(Shape))
def test_the_form_has_the_fields_of_the_shape(sheet: PlanSheet, shape: Shape) -> None:
    _choose(sheet, BORE)
    _fill(sheet, "shape", shape.value)
    assert set(NominalFeature.__struct_fields__) - set(sheet.form().fields) == shape.spec.unused


@pytest.mark.parametrize("kind", KINDS)
def test_the_form_has_the_fields_of_the_kind(sheet: PlanSheet, kind: str) -> None:
    _choose(sheet, sheet.draft.plan.characteristics[0].name, "characteristics")
    _fill(sheet, "kind", kind)
    shown = {name.partition(".")[0] for name in sheet.form().fields}
    assert set(Characteristic.__struct_fields__) - shown == spec_of(kind).unused


def test_a_value_without_a_meaning_stays_visible(sheet: PlanSheet) -> None:
    """A document may contain one: it is shown, and the plan check names it."""
    _choose(sheet, BORE)
    bore = next(item for item in sheet.draft.plan.features if item.name == BORE)
    sheet.form().show_item(msgspec.structs.replace(bore, angle_deg=30.0))
    assert "angle_deg" in sheet.form().fields
    _fill(sheet, "shape", "Cylinder")
    assert sheet.form().item().angle_deg == 0.0


@pytest.mark.parametrize(
    ("key", "text", "said"),
    [
        ("diameter", "0", "diameter"),
        ("diameter", "wide", "Diameter, mm is 'wide'"),
        ("points", "2", "points"),
        ("point", "1 2", "three numbers"),
        ("name", "a,b", "name"),
        ("projection", "NOWHERE", "NOWHERE"),
    ],
)
def test_what_is_wrong_is_said_and_not_taken_over(
    sheet: PlanSheet, key: str, text: str, said: str
) -> None:
    before = sheet.draft.plan
    _choose(sheet, BORE)
    _fill(sheet, key, text)
    assert sheet.draft.plan == before
    assert sheet.checks.text().startswith("✖")
    assert said in sheet.checks.text()
    assert sheet.form().faulty() == key


@pytest.mark.parametrize("text", ["19 – 21.5", "19 to 21,5", "19 bis 21,5", "19 21.5", "19 - 21.5"])
def test_limits_of_the_room_are_in_the_plan_and_go_with_an_empty_field(
    sheet: PlanSheet, text: str
) -> None:
    sheet.items.choose(HEAD)
    assert sheet.draft.plan.environment is None
    _fill(sheet, "environment.temperature_c", text)
    _fill(sheet, "environment.humidity_percent", "30 60")
    found = sheet.draft.plan.environment
    assert found == EnvironmentLimits(temperature_c=(19.0, 21.5), humidity_percent=(30.0, 60.0))
    field = sheet.form().fields["environment.temperature_c"]
    assert isinstance(field, QLineEdit)
    assert field.text() == "19 – 21.5"
    assert sheet.form().item().environment == found
    _fill(sheet, "environment.temperature_c", "")
    _fill(sheet, "environment.humidity_percent", "")
    assert sheet.draft.plan.environment is None


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("20", "two numbers, least and most"),
        ("warm", "two numbers, least and most"),
        ("19 20 21", "two numbers, least and most"),
        ("21 – 19", "smaller number last"),
        ("190 – 210", "a room has"),
    ],
)
def test_a_room_that_cannot_be_is_said_and_not_taken_over(
    sheet: PlanSheet, text: str, said: str
) -> None:
    sheet.items.choose(HEAD)
    _fill(sheet, "environment.temperature_c", text)
    assert sheet.draft.plan.environment is None
    assert sheet.checks.text().startswith("✖")
    assert said in sheet.checks.text()
    assert sheet.form().faulty() == "environment.temperature_c"


def test_features_and_tolerances_are_added_moved_removed_and_undone(sheet: PlanSheet) -> None:
    before = sheet.draft.plan
    _choose(sheet, BORE)
    sheet.add_feature()
    names = [item.name for item in sheet.draft.plan.features]
    assert names[names.index(BORE) + 1] == "BORE_A2"
    sheet.add_characteristic()
    assert sheet.draft.plan.characteristics[-1].features == ["BORE_A2"]
    with_both = sheet.draft.plan
    _choose(sheet, "BORE_A2")
    errors: list[OcmmError] = []
    sheet.failed.connect(errors.append)
    sheet.remove()
    assert sheet.draft.plan == with_both
    assert "used by" in errors[0].what
    for _ in range(2):
        sheet.undo()
    assert sheet.draft.plan == before


def test_a_plan_is_saved_with_features_from_a_table(
    sheet: PlanSheet, qtbot: QtBot, tmp_path: Path
) -> None:
    table = tmp_path / "more.csv"
    table.write_text("name,shape,x,y,z,diameter\nPIN_1,Circle,1,2,3,8\nPIN_2,Circle,4,5,6,8\n")
    before = sheet.draft.plan
    with qtbot.waitSignal(sheet.models.importing.previewed, timeout=HANG_MS):
        sheet.import_file(table)
    assert sheet.draft.plan == before
    sheet.models.table.take.click()
    path = tmp_path / "mine.toml"
    with qtbot.waitSignal(sheet.saved, timeout=HANG_MS):
        sheet.save_as(path)
    assert sheet.draft.is_saved
    again = load_plan(path)
    assert msgspec.json.encode(again) == msgspec.json.encode(sheet.draft.plan)
    assert [item.name for item in again.features][-2:] == ["PIN_1", "PIN_2"]


def test_a_model_is_read_beside_the_window_and_can_be_given_up(
    sheet: PlanSheet, qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A reader that never comes back; the reading process has the same path.
    (tmp_path / "OCP.py").write_text("import time\ntime.sleep(600)\n")
    monkeypatch.syspath_prepend(tmp_path)
    path = tmp_path / "a.step"
    path.write_text("ISO-10303-21;\n")
    before = sheet.draft.plan
    told: list[object] = []
    sheet.failed.connect(told.append)
    sheet.import_file(path)
    assert sheet.models.importing.message() == "Importing a.step. Shift+F9 cancels."
    sheet.keys["import"].trigger()
    assert sheet.models.importing.message() == ""
    qtbot.waitUntil(lambda: multiprocessing.active_children() == [], timeout=HANG_MS)
    assert (sheet.draft.plan, told) == (before, [])


def test_the_form_of_a_characteristic_offers_every_kind() -> None:
    lines = {line.key: line for line in form_lines(Characteristic, {})}
    assert lines["kind"].kind is FieldKind.CHOICE
    assert lines["kind"].choices == tuple(KINDS)
    assert lines["kind"].neutral == "diameter"
    assert lines["name"].kind is FieldKind.TEXT


def _structs(make: Any, seen: set[type[msgspec.Struct]]) -> set[type[msgspec.Struct]]:
    for one in (make, *get_args(make)):
        if isinstance(one, type) and issubclass(one, msgspec.Struct) and one not in seen:
            seen.add(one)
            for item in msgspec.structs.fields(one):
                _structs(item.type, seen)
        elif one is not make:
            _structs(one, seen)
    return seen


def _choices(make: Any) -> Iterator[str]:
    if get_origin(make) is Literal:
        yield from get_args(make)
    elif isinstance(make, type) and issubclass(make, Enum):
        yield from (one.value for one in make)
    else:
        for one in get_args(make):
            yield from _choices(one)


def test_every_choice_of_a_plan_is_shown_in_german(qapp: QApplication) -> None:
    structs = _structs(Plan, set())
    words = {str(one.__struct_config__.tag) for one in structs if one.__struct_config__.tag}
    words |= {
        word
        for one in structs
        for item in msgspec.structs.fields(one)
        for word in _choices(item.type)
    }
    words |= {*KINDS, *FLAGS, GIVEN}
    assert len(words) > 60
    use_language(qapp, "de")
    try:
        left = {word for word in words if word and choice_word(word) == word}
    finally:
        use_language(qapp, "en")
    axes = {*"xyz", "-x", "-y", "-z", "rx", "ry", "rz"}
    assert left <= axes | {"3-2-1", "rps", "iso14253-1", "ilac-g8", "position", "Ellipse", "Torus"}


def test_the_requirements_are_written_as_an_inspection_plan(
    sheet: PlanSheet, tmp_path: Path
) -> None:
    """The same core method as `ocmm plan account`; a plan without a source has none."""
    errors: list[OcmmError] = []
    told: list[str] = []
    sheet.failed.connect(errors.append)
    sheet.told.connect(told.append)
    sheet.ask_requirements()
    assert sheet.listing.isVisibleTo(sheet)
    sheet.write_requirements(tmp_path / "list.csv")
    assert [one.code for one in errors] == ["plan.no_account"]
    table = tmp_path / "t.csv"
    table.write_text("name,shape,x,y,z\nPAD,Plane,0,0,77\n", encoding="utf-8")
    plan = feature_table(table).added_to(sheet.draft.plan)
    sheet.draft.did(plan)
    sheet.write_requirements(tmp_path / "list.csv")
    assert "PAD" in (tmp_path / "list.csv").read_text("utf-8-sig")
    assert "list.csv" in told[-1]
