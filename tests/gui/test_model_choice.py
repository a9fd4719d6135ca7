"""Choosing from a model: list and picture are one choice, and the keyboard alone is enough."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from msgspec.structs import replace as replace_feature
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from ocmm_cad.step import FreeForm, Offer, StepModel, setting_of, usual_request
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.plan import new_plan
from ocmm_core.part_model import nominal_face, searched, spread_places
from ocmm_gui.kit import THEMES
from ocmm_gui.plan_editor import PlanSheet
from ocmm_gui.plan_editor._importing import LoadedModel
from ocmm_gui.plan_editor._part_choice import ModelChoice
from tests.core.part_model.model_faces import FREE_FORMS, face_of
from tests.host import HANG_MS
from tests.made_parts import PartMaker

PART = PartMaker().box((0.0, 0.0, 0.0), (100.0, 60.0, 20.0)).part()
WHY = "the stylus would touch face 5"


def offers() -> tuple[Offer, ...]:
    """Return the six faces of a block: the fifth is out of reach."""
    made = []
    for number in range(1, 7):
        feature = NominalFeature(
            name=f"PLANE_{number}", shape=Shape.PLANE, points=9, point=(50.0, 30.0, 10.0),
            length=100.0, width=60.0,
        )  # fmt: skip
        made.append(Offer(feature, (number,), WHY if number == 5 else ""))
    return tuple(made)


def free_form() -> Offer:
    """Return a free-form face with twenty places."""
    face = nominal_face(face_of(FREE_FORMS["waves"](), number=7))
    places, normals = spread_places(searched(face), 20, 4.0, 3.0)
    free = FreeForm(
        "FREE FORM 7", face, tuple(map(tuple, places.tolist())), tuple(map(tuple, normals.tolist()))
    )
    return Offer(free.feature, (7,), free_form=free)


@pytest.fixture
def choice(qtbot: QtBot) -> ModelChoice:
    """Return the choice from a block."""
    made = ModelChoice()
    qtbot.addWidget(made)
    made.resize(1200, 700)
    made.show_model(LoadedModel(Path("block.stp"), StepModel((), (), {}, PART), offers(), "+z"))
    return made


def names(taken: tuple[Offer, ...]) -> list[str]:
    """Return the numbers of the chosen surfaces."""
    return [offer.feature.name.removeprefix("PLANE_") for offer in taken]


def test_what_nothing_stands_against_is_chosen_to_begin_with(choice: ModelChoice) -> None:
    assert names(choice.chosen()) == ["1", "2", "3", "4", "6"]
    assert "5 of 6 surfaces are chosen." in choice.message()


def test_the_keyboard_alone_chooses_and_takes_over(choice: ModelChoice, qtbot: QtBot) -> None:
    for _ in range(4):
        QTest.keyClick(choice.list, Qt.Key.Key_Down)
    # It is selected, and a sentence gives the reason why it was not chosen.
    assert f"PLANE_5: {WHY}." in choice.message()
    QTest.keyClick(choice.list, Qt.Key.Key_Space)
    QTest.keyClick(choice.list, Qt.Key.Key_Home)
    QTest.keyClick(choice.list, Qt.Key.Key_Space)
    with qtbot.waitSignal(choice.taken, timeout=HANG_MS) as told:
        QTest.keyClick(choice.list, Qt.Key.Key_Return)
    assert names(told.args[0]) == ["2", "3", "4", "5", "6"]
    with qtbot.waitSignal(choice.declined, timeout=HANG_MS):
        QTest.keyClick(choice.list, Qt.Key.Key_Escape)


def test_a_click_on_a_face_is_a_click_on_its_line(choice: ModelChoice) -> None:
    choice.picture.face_clicked.emit(2)
    assert names(choice.chosen()) == ["1", "2", "4", "6"]
    assert choice.list.currentRow() == 2
    choice.picture.face_clicked.emit(2)
    assert names(choice.chosen()) == ["1", "2", "3", "4", "6"]
    # Beside the part nothing is chosen.
    choice.picture.face_clicked.emit(-1)
    assert names(choice.chosen()) == ["1", "2", "3", "4", "6"]


def test_nothing_chosen_cannot_be_taken_over(choice: ModelChoice, qtbot: QtBot) -> None:
    for row in range(6):
        choice.list.item(row).setCheckState(Qt.CheckState.Unchecked)
    taken: list[object] = []
    choice.taken.connect(taken.append)
    QTest.keyClick(choice.list, Qt.Key.Key_Return)
    assert taken == []


@pytest.mark.parametrize("theme", list(THEMES))
def test_the_choice_takes_every_theme(choice: ModelChoice, theme: str) -> None:
    choice.set_theme(THEMES[theme])
    assert names(choice.chosen()) == ["1", "2", "3", "4", "6"]


@pytest.fixture
def sheet(qtbot: QtBot) -> Iterator[PlanSheet]:
    """Return the editor on a plan that was never saved."""
    made = PlanSheet(new_plan("P", "PART"), None, lambda: Path("none.ocmm"))
    qtbot.addWidget(made)
    yield made
    made.close_work()


def test_the_plan_gets_what_was_chosen_and_nothing_before(sheet: PlanSheet, qtbot: QtBot) -> None:
    before = sheet.draft.plan
    model = StepModel((), (), {}, PART)
    sheet.models.importing.offered.emit(LoadedModel(Path("block.step"), model, offers(), "+z"))
    assert not sheet.models.choice.isHidden()
    assert sheet.draft.plan is before
    QTest.keyClick(sheet.models.choice.list, Qt.Key.Key_Space)
    QTest.keyClick(sheet.models.choice.list, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: sheet.draft.plan is not before, timeout=HANG_MS)
    found = {feature.name for feature in sheet.draft.plan.features}
    assert found >= {"PLANE_2", "PLANE_3", "PLANE_4", "PLANE_6"}
    assert "PLANE_1" not in found
    assert sheet.models.choice.isHidden()
    # Back without: the plan stays.
    now = sheet.draft.plan
    sheet.models.importing.offered.emit(LoadedModel(Path("block.step"), model, offers(), "+z"))
    QTest.keyClick(sheet.models.choice.list, Qt.Key.Key_Escape)
    assert sheet.models.choice.isHidden()
    assert sheet.draft.plan is now


def test_what_was_left_out_of_a_choice_is_no_good_news(sheet: PlanSheet, qtbot: QtBot) -> None:
    """A notice of success would vanish after a time."""
    unasked = StepModel((), (), {}, unasked=setting_of(usual_request()))
    good = Offer(replace_feature(offers()[0].feature, targets=((50.0, 30.0, 20.0),)), (1,))
    sheet.models.importing.offered.emit(LoadedModel(Path("block.step"), unasked, (good,), "+z"))
    with (
        qtbot.assertNotEmitted(sheet.told),
        qtbot.waitSignal(sheet.warned, timeout=HANG_MS) as warned,
    ):
        QTest.keyClick(sheet.models.choice.list, Qt.Key.Key_Return)
    assert "(the part was not read): PLANE_1." in warned.args[0]


def test_a_free_form_is_taken_with_its_zone_and_not_without(sheet: PlanSheet, qtbot: QtBot) -> None:
    before = sheet.draft.plan
    model = StepModel((), (), {}, PART)
    read = LoadedModel(Path("block.step"), model, (*offers(), free_form()), "+z")
    sheet.models.importing.offered.emit(read)
    choice = sheet.models.choice
    assert not choice.zone.isHidden()
    assert "7" not in "".join(names(choice.chosen()))
    choice.list.setCurrentRow(6)
    QTest.keyClick(choice.list, Qt.Key.Key_Space)
    assert "Enter the profile of free forms." in choice.message()
    QTest.keyClick(choice.list, Qt.Key.Key_Return)
    assert sheet.draft.plan is before
    for text in ("0", "-1", "word"):
        choice.zone.setText(text)
        assert choice.zone_mm() is None
    choice.zone.setText("0,05")
    assert "Enter the profile" not in choice.message()
    QTest.keyClick(choice.list, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: sheet.draft.plan is not before, timeout=HANG_MS)
    (item,) = sheet.draft.plan.characteristics
    assert (item.name, item.kind, item.upper) == ("FREE FORM 7", "surface profile", 0.05)
    assert sum(one.shape is Shape.POINT for one in sheet.draft.plan.features) == 20


def test_without_free_forms_nobody_is_asked_for_a_zone(choice: ModelChoice) -> None:
    assert choice.zone.isHidden()
    assert choice.zone_mm() is None
