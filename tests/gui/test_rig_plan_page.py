"""The page of a planned rig, with a real process."""

from __future__ import annotations

import multiprocessing
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_gui.maintain import RigPlanPage
from ocmm_planner import read_sheet
from tests.host import HANG_MS


def opened(qtbot: QtBot, rig: str) -> RigPlanPage:
    page = RigPlanPage(load_rig(resource("rigs", f"{rig}.toml")))
    page.resize(1100, 660)
    qtbot.addWidget(page, before_close_func=lambda widget: widget.cancel())
    page.show()
    return page


@pytest.mark.usefixtures("fresh_sides")
def test_the_page_predicts_compares_and_writes(qtbot: QtBot, tmp_path: Path) -> None:
    page = opened(qtbot, "recommended")
    page.fields["out"].setText(str(tmp_path / "new"))
    with qtbot.waitSignal(page.shown, timeout=HANG_MS):
        QTest.mouseClick(page.button, Qt.MouseButton.LeftButton)
        assert page.button.text() == "Cancel"
    sheet = read_sheet(tmp_path / "new" / "thesis_rig.json")
    assert f"U {sheet.best.worst_um:.1f} µm" in page.number.text()
    assert (tmp_path / "new" / "thesis_rig.pdf").read_bytes().startswith(b"%PDF")
    assert "Camera 'left' is 135 mm from its planned place" in page.summary()
    assert "thesis_rig.pdf" in page.summary()
    assert all(plot.isVisible() for plot in page.maps)
    assert page.places.cells(0)[:4] == ("left", "-165.0", "-1000.0", "0.0")


def test_a_prediction_can_be_cancelled_and_a_wrong_plan_is_told(
    qtbot: QtBot, tmp_path: Path
) -> None:
    page = opened(qtbot, "thesis")
    page.fields["search"].setText("100000")
    QTest.mouseClick(page.button, Qt.MouseButton.LeftButton)
    QTest.mouseClick(page.button, Qt.MouseButton.LeftButton)
    assert multiprocessing.active_children() == []
    assert page.button.text() == "Predict"
    page.fields["search"].setText("many")
    with qtbot.waitSignal(page.failed, timeout=HANG_MS):
        QTest.keyClick(page.fields["search"], Qt.Key.Key_Return)
    assert "which is not a number" in page.summary()
    page.fields["search"].setText("0")
    page.fields["plan"].setText(str(tmp_path / "none.toml"))
    with qtbot.waitSignal(page.failed, timeout=HANG_MS):
        QTest.keyClick(page.fields["plan"], Qt.Key.Key_Return)
    assert "none.toml: file not found" in page.summary()
    assert page.number.text() == ""
    qtbot.waitUntil(lambda: multiprocessing.active_children() == [], timeout=HANG_MS)
