"""Faces to align by are chosen on the part or in the list, by name, and go into the plan."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from ocmm_core.alignment import ModelBestFit
from ocmm_core.inspection.plan import PartOfPlan, new_plan
from ocmm_core.part_model import PartModel
from ocmm_gui.kit import THEMES
from ocmm_gui.plan_editor import PlanSheet
from ocmm_gui.plan_editor._from_models import FaceChoice
from tests.core.part_model.model_faces import FREE_FORMS, face_of, plane
from tests.host import HANG_MS
from tests.made_parts import PartMaker


def part() -> PartModel:
    """Return a block whose first three faces have exact surfaces, of which one has a name."""
    made = PartMaker().box((0.0, 0.0, 0.0), (100.0, 60.0, 20.0)).part()
    exact = (
        replace(face_of(FREE_FORMS["waves"]()), name="SKIN", number=1),
        face_of(plane(), number=2),
        replace(face_of(plane(), number=3), feature="PLANE_3"),
    )
    rest = tuple(replace(face, spline=None) for face in made.faces[3:])
    return replace(made, faces=(*exact, *rest))


@pytest.fixture
def choice(qtbot: QtBot) -> FaceChoice:
    made = FaceChoice()
    qtbot.addWidget(made)
    made.resize(1200, 700)
    made.show_faces(part(), new_plan("P", "BLOCK"))
    return made


def test_faces_stand_by_name_and_only_those_with_a_surface(choice: FaceChoice) -> None:
    lines = [choice.list.item(row).text() for row in range(choice.list.count())]
    assert lines[0].startswith("SKIN   face 1")
    assert lines[1].startswith("face 2")
    assert lines[2].startswith("PLANE_3   face 3")
    assert len(lines) == 3
    assert choice.chosen() == ()
    # A face without a surface cannot be chosen on the part either.
    choice.picture.face_clicked.emit(4)
    assert choice.chosen() == ()


def test_list_and_picture_are_one_choice(choice: FaceChoice, qtbot: QtBot) -> None:
    choice.picture.face_clicked.emit(1)
    QTest.keyClick(choice.list, Qt.Key.Key_Home)
    QTest.keyClick(choice.list, Qt.Key.Key_Space)
    assert [face.number for face in choice.chosen()] == [1, 2]
    choice.picture.face_clicked.emit(1)
    assert "1 of 3 faces" in choice.message()
    with qtbot.waitSignal(choice.taken, timeout=HANG_MS) as told:
        QTest.keyClick(choice.list, Qt.Key.Key_Return)
    assert [face.name for face in told.args[0]] == ["SKIN"]


def test_nothing_chosen_aligns_nothing(choice: FaceChoice) -> None:
    taken: list[object] = []
    choice.taken.connect(taken.append)
    QTest.keyClick(choice.list, Qt.Key.Key_Return)
    assert taken == []
    assert "leave no motion of the part open" in choice.message()


@pytest.mark.parametrize("theme", list(THEMES))
def test_the_faces_take_every_theme(choice: FaceChoice, theme: str) -> None:
    choice.set_theme(THEMES[theme])
    assert choice.chosen() == ()


def test_the_plan_is_aligned_by_what_was_chosen(qtbot: QtBot, tmp_path: Path) -> None:
    sheet = PlanSheet(new_plan("P", "BLOCK"), None, lambda: tmp_path / "none.ocmm")
    qtbot.addWidget(sheet)
    said: list[str] = []
    sheet.told.connect(said.append)
    sheet.choose_faces()
    assert "No CAD model" in said[-1]
    sheet.models.importing.part_read.emit(PartOfPlan(part()))
    assert not sheet.models.faces.isHidden()
    sheet.models.faces.picture.face_clicked.emit(0)
    QTest.keyClick(sheet.models.faces.list, Qt.Key.Key_Return)
    rule = sheet.draft.plan.alignment
    assert isinstance(rule, ModelBestFit)
    assert [face.number for face in rule.faces] == [1]
    assert all(name.startswith("SKIN on ") for name in rule.points)
    assert sheet.models.faces.isHidden()
    assert "24 points added" in said[-1]
    # The form shows them, and a second look begins with them.
    sheet.models.importing.part_read.emit(PartOfPlan(part()))
    assert [face.number for face in sheet.models.faces.chosen()] == [1]
    QTest.keyClick(sheet.models.faces.list, Qt.Key.Key_Escape)
    assert sheet.models.faces.isHidden()
    sheet.undo()
    assert sheet.draft.plan.alignment is None
    sheet.close_work()
