"""Another plan is chosen in the window, and the job before goes on later; pictures of steps."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import msgspec
from PySide6.QtCore import Qt
from PySide6.QtGui import QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from ocmm_core.documents import resource
from ocmm_core.errors import OcmmError
from ocmm_core.inspection.plan import load_plan, save_plan
from ocmm_gui.plan_editor import PlanSheet
from ocmm_gui.plan_editor._plan_items import ItemKey
from tests.host import HANG_MS

if TYPE_CHECKING:
    from tests.gui.conftest import OpenWindow

KEY = Qt.Key


def _press(*keys: Qt.Key) -> None:
    for key in keys:
        widget = QApplication.focusWidget()
        assert widget is not None
        QTest.keyClick(widget, key)


def _write(text: str) -> None:
    """Write into the field that has the keyboard, and give it."""
    field = QApplication.focusWidget()
    assert field is not None
    QTest.keyClick(field, KEY.Key_A, Qt.KeyboardModifier.ControlModifier)
    QTest.keyClicks(field, text)
    QTest.keyClick(field, KEY.Key_Return)


def test_the_next_job_is_begun_by_another_plan_by_keyboard(
    open_window: OpenWindow, qtbot: QtBot, tmp_path: Path
) -> None:
    bench = open_window(stay=True)
    window, bridge = bench.window, bench.bridge
    qtbot.waitUntil(lambda: len(bridge.station.job.stored()[1]) >= 2, timeout=HANG_MS)
    first, other = bridge.station.job.path, tmp_path / "other.toml"
    plan = load_plan(resource("plans", "demo.toml"))
    picture = QImage(32, 20, QImage.Format.Format_RGB32)
    assert picture.save(str(tmp_path / "bed.png"))
    bed = msgspec.structs.replace(plan.features[0], picture="bed.png")
    save_plan(
        msgspec.structs.replace(plan, part="OTHER", features=[bed, *plan.features[1:]]), other
    )

    _press(KEY.Key_J, KEY.Key_F9)
    _write(str(other))
    job = window.sheets.job
    assert job.plans.currentText() == "DEMO, other.toml, not released"
    assert QApplication.focusWidget() is job.plans
    with qtbot.waitSignals([bridge.plan_changed, bridge.jobs.job_left], timeout=HANG_MS):
        _press(KEY.Key_F8)
    qtbot.waitUntil(lambda: bridge.shown.job.header.part == "OTHER", timeout=HANG_MS)
    assert window.windowTitle() == "OCMM – OTHER"
    qtbot.waitUntil(lambda: f"{first.stem} is paused" in window.banner.text())
    # The steps and their pictures are those of the new plan, in the window and in its editor.
    assert [item.name for item in bridge.shown.job.features] == [
        item.name for item in plan.features
    ]
    qtbot.waitUntil(window.desk.picture.has_picture, timeout=HANG_MS)
    assert window.sheets.plan.draft.path == other
    assert window.sheets.plan.draft.plan.part == "OTHER"

    _press(KEY.Key_J)
    assert "QUICK, quick.toml, not released" in [
        job.plans.itemText(row) for row in range(job.plans.count())
    ]
    with qtbot.waitSignal(bridge.plan_changed, timeout=HANG_MS):
        _press(KEY.Key_F7)
    qtbot.waitUntil(lambda: bridge.shown.job.paused, timeout=HANG_MS)
    assert bridge.station.job.path == first
    assert bridge.station.job.plan_file == resource("plans", "quick.toml")
    assert len(bridge.station.job.stored()[1]) >= 2


def test_a_picture_is_attached_to_a_step_and_shown(qtbot: QtBot, tmp_path: Path) -> None:
    path = tmp_path / "plans" / "gauge.toml"
    path.parent.mkdir()
    path.write_bytes(resource("plans", "gauge.toml").read_bytes())
    sheet = PlanSheet(load_plan(path), path, lambda: Path("none.ocmm"))
    qtbot.addWidget(sheet)
    with qtbot.waitActive(sheet):
        sheet.show()
        sheet.activateWindow()
    source = tmp_path / "Bore left.jpg"
    image = QImage(64, 48, QImage.Format.Format_RGB32)
    image.fill(Qt.GlobalColor.darkCyan)
    assert image.save(str(source))
    sheet.items.choose(ItemKey("features", "BORE_A"))
    assert not sheet.picture.has_picture()
    sheet.items.setFocus()
    QTest.keyClick(sheet.items, KEY.Key_F7, Qt.KeyboardModifier.ShiftModifier)
    _write(str(source))
    assert sheet.draft.plan.feature("BORE_A").picture == "Bore_left.jpg"
    assert sheet.picture.has_picture()
    errors: list[OcmmError] = []
    sheet.failed.connect(errors.append)
    torn = tmp_path / "torn.png"
    torn.write_bytes(b"\x89PNG\r\n\x1a\n" + b"\0" * 20)
    sheet.attach_picture(torn)
    assert "not a readable picture" in errors[0].what
    assert sheet.draft.plan.feature("BORE_A").picture == "Bore_left.jpg"
    # Without its file the step is drawn, and a sentence reports that.
    (path.parent / "Bore_left.jpg").unlink()
    sheet.open()
    assert "icture of BORE_A not found beside the plan" in sheet.checks.text()
    sheet.undo()
    assert sheet.draft.is_saved
