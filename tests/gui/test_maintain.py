"""Maintain: one key there and back, no mouse, and nothing that measures by mistake."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLineEdit, QPushButton
from pytestqt.qtbot import QtBot

from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import ACTIONS, Mode, NoticeCentre
from ocmm_gui.window import MainWindow
from tests.gui.bus_reports import IN_ORDER, MISSING, BusStation, publish, station_on_bus
from tests.host import HANG_MS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ocmm_core.fieldbus.report import BusReport
    from tests.gui.conftest import OpenWindow

PATIENCE_MS = HANG_MS


class BusBench:
    """A window on a station whose bus is played by the test."""

    def __init__(self, qtbot: QtBot, folder: Path, out: Path | None = None) -> None:
        self.bus: BusStation = station_on_bus(folder)
        self.bridge = StationBridge(self.bus.station)
        self.window = MainWindow(self.bridge, NoticeCentre(), out=out)
        self.window.resize(1280, 720)
        with qtbot.waitActive(self.window):
            self.window.show()
            self.window.activateWindow()
        self.bridge.start()

    def wait_phase(self, qtbot: QtBot, report: BusReport, phase: str) -> None:
        """Write a report until the page shows its phase: it shows none that is older than 1 s."""

        def shown() -> bool:
            publish(self.bus.ring, report)
            return self.window.maintenance.bus.phase.text() == phase

        qtbot.waitUntil(shown, timeout=PATIENCE_MS)

    def close(self) -> None:
        """Close the window and everything behind it."""
        self.window.close()
        self.window.deleteLater()
        self.bridge.deleteLater()


@pytest.fixture
def bench(qtbot: QtBot, qapp: QApplication, tmp_path: Path) -> Iterator[BusBench]:
    made = BusBench(qtbot, tmp_path)
    yield made
    made.close()


def test_one_key_there_and_back(qtbot: QtBot, bench: BusBench) -> None:
    window = bench.window
    for far in (False, True):
        window.show_far(far)
        QTest.keyClick(window, Qt.Key.Key_M)
        assert window.mode() is Mode.MAINTAIN
        assert window.maintenance.bus.isVisible()
        QTest.keyClick(window, Qt.Key.Key_M)
        assert window.mode() is Mode.INSPECT
        assert window.is_far() is far
        assert not window.maintenance.bus.isVisible()


def test_no_key_measures_in_maintain(bench: BusBench) -> None:
    window, actions = bench.window, bench.window.actions_by_key
    enabled = {mode: set[str]() for mode in Mode}
    for mode in Mode:
        window.show_mode(mode)
        enabled[mode] = {info.key for info in ACTIONS if actions[info.key].isEnabled()}
    assert enabled[Mode.MAINTAIN] == {
        "bus_text", "calibrate", "relocate", "tracker", "verify", "recall", "write_cameras",
        "define",
        "mount", "check_tip", "qualify", "pivot", "theme", "log", "mode", "find", "settings",
        "start", "acceptance", "interim", "artefacts", "study", "certificate", "archive",
        "manual", "what_to_do", "support", "gloves", "zoom_in", "zoom_out", "zoom_reset",
    }  # fmt: skip
    assert "bus_text" not in enabled[Mode.INSPECT]
    assert {"take", "undo", "finish", "flip", "export"} < enabled[Mode.INSPECT]


def test_the_recall_is_a_key_away_and_leads_back(bench: BusBench) -> None:
    window, recall = bench.window, bench.window.sheets.recall
    window.show_mode(Mode.MAINTAIN)
    QTest.keyClick(window, Qt.Key.Key_F12)
    assert recall.isVisible()
    assert recall.is_working()
    QTest.keyClick(recall.result.table, Qt.Key.Key_F9)
    assert not recall.is_working()
    QTest.keyClick(recall.result.table, Qt.Key.Key_Escape)
    assert not recall.isVisible()
    assert window.mode() is Mode.MAINTAIN


def test_everything_is_reached_without_a_mouse(qtbot: QtBot, bench: BusBench) -> None:
    window = bench.window
    QTest.keyClick(window, Qt.Key.Key_M)
    bench.wait_phase(qtbot, MISSING, "RECOVERING")
    reached = []
    for _ in range(12):
        widget = window.focusWidget()
        assert widget is not None
        reached.append(widget.accessibleName())
        QTest.keyClick(widget, Qt.Key.Key_Tab)
    assert reached[0] == "Pages"
    assert {
        "Inspect", "Cameras on the bus", "Events, newest first", "Bus report", "Theme", "Save log",
    } < set(reached)  # fmt: skip
    window.maintenance.bus.events.setFocus()
    for _ in range(2):
        QTest.keyClick(window.maintenance.bus.events, Qt.Key.Key_Down)
    assert window.maintenance.bus.events.currentRow() == 2


def test_space_presses_the_button_that_has_the_focus(qtbot: QtBot, bench: BusBench) -> None:
    window = bench.window
    QTest.keyClick(window, Qt.Key.Key_M)
    refused: list[object] = []
    bench.bridge.point_refused.connect(refused.append)
    back = window.maintenance.view.findChild(QPushButton, "back")
    assert back is not None
    back.setFocus()
    QTest.keyClick(back, Qt.Key.Key_Space)
    assert window.mode() is Mode.INSPECT
    assert not refused


def test_the_report_is_written_where_the_panel_says(
    qtbot: QtBot, bench: BusBench, tmp_path: Path
) -> None:
    window = bench.window
    QTest.keyClick(window, Qt.Key.Key_M)
    bench.wait_phase(qtbot, IN_ORDER, "IN OPERATION")
    QTest.keyClick(window, Qt.Key.Key_B)
    field = window.output.bus_panel.findChild(QLineEdit, "path")
    assert field is not None
    assert window.output.bus_panel.isVisible()
    assert field.hasFocus()
    assert field.text().endswith(".txt")
    # Letters that are keys of the window belong to the field while it is open.
    path = tmp_path / "for mail" / "bus txt"
    field.selectAll()
    QTest.keyClicks(field, str(path))
    assert field.text() == str(path)
    with qtbot.waitSignal(bench.bridge.maintenance.bus_text_saved, timeout=PATIENCE_MS):
        QTest.keyClick(field, Qt.Key.Key_Return)
    assert not window.output.bus_panel.isVisible()
    text = path.read_text(encoding="utf-8")
    assert text.startswith("OCMM bus report")
    assert "Rig            recommended" in text
    assert "  elapsed          600015" in text
    qtbot.waitUntil(lambda: str(path) in window.banner.text(), timeout=PATIENCE_MS)


def test_esc_puts_the_panel_away(bench: BusBench) -> None:
    window = bench.window
    publish(bench.bus.ring, IN_ORDER)
    QTest.keyClick(window, Qt.Key.Key_M)
    QTest.keyClick(window, Qt.Key.Key_B)
    field = window.output.bus_panel.findChild(QLineEdit, "path")
    assert field is not None
    QTest.keyClick(field, Qt.Key.Key_Escape)
    assert not window.output.bus_panel.isVisible()
    assert window.mode() is Mode.MAINTAIN


def test_a_folder_that_is_given_is_not_asked_for(
    qtbot: QtBot, qapp: QApplication, tmp_path: Path
) -> None:
    bench = BusBench(qtbot, tmp_path, out=tmp_path / "out")
    try:
        publish(bench.bus.ring, IN_ORDER)
        QTest.keyClick(bench.window, Qt.Key.Key_M)
        with qtbot.waitSignal(
            bench.bridge.maintenance.bus_text_saved, timeout=PATIENCE_MS
        ) as saved:
            QTest.keyClick(bench.window, Qt.Key.Key_B)
        (path,) = saved.args
        assert path.parent == tmp_path / "out"
        assert path.read_text(encoding="utf-8").startswith("OCMM bus report")
    finally:
        bench.close()


def test_without_a_bus_the_page_and_the_key_say_why(qtbot: QtBot, open_window: OpenWindow) -> None:
    window = open_window(out=Path("nowhere")).window
    QTest.keyClick(window, Qt.Key.Key_M)
    assert "do not come from a camera bus" in window.maintenance.bus.trouble()
    QTest.keyClick(window, Qt.Key.Key_B)
    qtbot.waitUntil(
        lambda: "do not come from a camera bus" in window.banner.text(), timeout=PATIENCE_MS
    )


def _fits(window: MainWindow, size: tuple[int, int]) -> bool:
    bus = window.maintenance.bus
    bars = (bus.cameras.horizontalScrollBar(), bus.cameras.verticalScrollBar())
    return (
        (window.width(), window.height()) == size
        and not any(bar.isVisible() for bar in (*bars, bus.events.horizontalScrollBar()))
        and all(label.width() >= label.sizeHint().width() for label in bus.facts.values())
    )


def test_every_text_fits_in_every_size(qtbot: QtBot, bench: BusBench) -> None:
    window = bench.window
    QTest.keyClick(window, Qt.Key.Key_M)
    bench.wait_phase(qtbot, MISSING, "RECOVERING")
    for size in ((1280, 720), (1920, 1080)):
        window.resize(*size)
        # The layout follows by events.
        qtbot.waitUntil(partial(_fits, window, size))
