"""The account of a model's tolerances is shown before anything is taken over."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from ocmm_cad.drawing import plan_with_tolerances
from ocmm_cad.pmi import Dimension, Pmi
from ocmm_cad.step import StepModel
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.plan import Plan, new_plan
from ocmm_gui.kit import THEMES, dress
from ocmm_gui.plan_editor import PlanSheet
from ocmm_gui.plan_editor._importing import ImportResult
from ocmm_gui.plan_editor._plan_items import ItemKey

BORE = NominalFeature(
    name="BORE", shape=Shape.CYLINDER, points=12, point=(0, 0, 0), diameter=12.0, length=20.0,
    side="inner",
)  # fmt: skip
TOP = NominalFeature(name="TOP", shape=Shape.PLANE, points=9, point=(0, 0, 10))
SIZES = tuple(
    Dimension(
        entity=entity, name=name, word="diameter", is_location=False, of="length", nominal=nominal,
        lower=-0.1, upper=0.2, faces=(1,),
    )
    for entity, name, nominal in ((30, "Good <b>", 12.0), (31, "Wrong", 25.4))
)  # fmt: skip


@pytest.fixture
def sheet(qtbot: QtBot, tmp_path: Path) -> Iterator[PlanSheet]:
    plan = msgspec.structs.replace(new_plan("P", "P"), features=[TOP])
    sheet = PlanSheet(plan, None, lambda: tmp_path / "none.ocmm")
    qtbot.addWidget(sheet)
    sheet.resize(1600, 900)
    with qtbot.waitActive(sheet):
        sheet.show()
        sheet.activateWindow()
    sheet.open()
    yield sheet
    sheet.close_work()


def imported(before: Plan) -> ImportResult:
    bare = msgspec.structs.replace(before, features=[*before.features, BORE])
    model = StepModel((BORE,), (), {}, pmi=Pmi(dimensions=SIZES), faces={1: ("BORE",)})
    plan, account = plan_with_tolerances(bare, model)
    return ImportResult(before, plan, ItemKey("features", "BORE"), "1 feature.", account, bare)


def test_nothing_is_taken_over_before_it_is_answered(sheet: PlanSheet) -> None:
    before = sheet.draft.plan
    sheet.models.importing.imported.emit(imported(before))
    account = sheet.models.tolerances
    assert account.isVisible()
    assert not sheet.items.isVisible()
    assert sheet.draft.plan == before
    assert "1 of 2 dimensions" in account.summary.text()
    assert account.table.rowCount() == 2
    # Items outside the plan come first, with the reason; a label is text and never markup.
    status, label, says, why = account.table.cells(0)
    assert (status, label, says) == ("✖ refused", "Wrong", "diameter 25.4 +0.2 -0.1 mm")
    assert "says 25.4 mm, but the diameter of BORE" in why
    assert account.table.cells(1)[1:] == ("Good <b>", "diameter 12 +0.2 -0.1 mm", "Good b")
    for theme in THEMES.values():
        dress(account, theme)
        first = account.table.item(0, 0)
        assert first is not None
        assert first.foreground().color().name() == theme.bad.lower()


def test_return_takes_all_over_and_undo_takes_it_back(sheet: PlanSheet) -> None:
    before = sheet.draft.plan
    sheet.models.importing.imported.emit(imported(before))
    QTest.keyClick(sheet.models.tolerances.question, Qt.Key.Key_Return)
    assert not sheet.models.tolerances.isVisible()
    assert sheet.items.isVisible()
    assert [one.name for one in sheet.draft.plan.characteristics] == ["Good b"]
    assert [one.name for one in sheet.draft.plan.features] == ["TOP", "BORE"]
    sheet.undo()
    assert sheet.draft.plan == before


def test_the_features_alone_or_nothing(sheet: PlanSheet) -> None:
    before = sheet.draft.plan
    sheet.models.importing.imported.emit(imported(before))
    QTest.keyClick(sheet.models.tolerances.question, Qt.Key.Key_Escape)
    assert sheet.draft.plan == before
    assert sheet.items.isVisible()
    sheet.models.importing.imported.emit(imported(before))
    QTest.mouseClick(sheet.models.tolerances.features_only, Qt.MouseButton.LeftButton)
    assert [one.name for one in sheet.draft.plan.features] == ["TOP", "BORE"]
    assert sheet.draft.plan.characteristics == []


def test_a_plan_that_changed_meanwhile_is_not_overwritten(sheet: PlanSheet) -> None:
    found = imported(sheet.draft.plan)
    sheet.models.importing.imported.emit(found)
    other = msgspec.structs.replace(sheet.draft.plan, part="OTHER")
    sheet.draft.did(other)
    QTest.keyClick(sheet.models.tolerances.question, Qt.Key.Key_Return)
    assert sheet.draft.plan == other
