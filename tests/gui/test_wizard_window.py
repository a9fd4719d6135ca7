"""Wizards in the main window: opened by a key, fed by the station, left without a trace."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QAccessible, QImage, QKeySequence
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QComboBox,
    QLabel,
    QLineEdit,
    QListWidget,
    QTableWidget,
    QWidget,
)
from pytestqt.qtbot import QtBot

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.guided import ProcedureKind
from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.inspection.evaluation import StatusWord
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import ACTIONS, THEMES, Mode, NoticeCentre, ThemedWidget
from ocmm_gui.window import MainWindow
from ocmm_gui.wizards import WIZARDS
from ocmm_gui.wizards._wizard_parts import WIZARD_ACTIONS
from ocmm_gui.wizards.pages import CollectPage
from tests.core.calibration.test_procedure_tip import TIP, Tips
from tests.gui.wizard_bench import WizardBench
from tests.host import HANG_MS

if TYPE_CHECKING:
    from tests.gui.conftest import OpenWindow

PATIENCE_MS = HANG_MS
_SHORTCUTS = {info.key: info.shortcuts[0] for info in ACTIONS}
_KINDS = [kind for kind in ProcedureKind if kind is not ProcedureKind.TRACKER]
"""Those of a rig of cameras."""
_KEYS: dict[ProcedureKind, Qt.Key] = {
    wizard.kind: Qt.Key[f"Key_{_SHORTCUTS[wizard.action]}"]
    for wizard in WIZARDS if wizard.kind in _KINDS
}  # fmt: skip
_QT_PARTS = ("qt_", "Scroll", "ExtensionButton")


@pytest.fixture
def window(qtbot: QtBot, qapp: QApplication, tmp_path: Path) -> Iterator[MainWindow]:
    """Return a window whose calibrations are kept in a folder, with frames of a virtual rig."""
    built = build_station(
        StationRequest(
            plan=resource("plans", "quick.toml"),
            out=tmp_path / "job",
            speed=1.0,
            stay=True,
            frame_rate_hz=800,
            calibrations=tmp_path / "calibrations",
            uncalibrated=True,
        )
    )
    bridge, notices = StationBridge(built.station), NoticeCentre()
    made = MainWindow(bridge, notices, out=tmp_path / "out")
    made.resize(1280, 720)
    with qtbot.waitActive(made):
        made.show()
        made.activateWindow()
    bridge.start()
    yield made
    made.close()
    made.deleteLater()
    bridge.deleteLater()
    notices.deleteLater()


def _press(key: Qt.Key) -> None:
    widget = QApplication.focusWidget()
    assert widget is not None
    QTest.keyClick(widget, key)


@pytest.mark.parametrize("kind", _KINDS)
def test_a_key_opens_a_wizard_and_esc_leaves_it(
    qtbot: QtBot, window: MainWindow, kind: ProcedureKind
) -> None:
    _press(Qt.Key.Key_M)
    _press(_KEYS[kind])
    qtbot.waitUntil(window.maintenance.wizard.isVisible, timeout=PATIENCE_MS)
    assert window.mode() is Mode.MAINTAIN
    enabled = {info.key for info in ACTIONS if window.actions_by_key[info.key].isEnabled()}
    assert enabled == {"theme", "log", "manual", "gloves", "zoom_in", "zoom_out", "zoom_reset"}
    _press(Qt.Key.Key_Escape)
    qtbot.waitUntil(window.maintenance.view.isVisible, timeout=PATIENCE_MS)
    assert window.actions_by_key["mode"].isEnabled()


def test_frames_of_the_station_reach_the_procedure_and_measure_nothing(
    qtbot: QtBot, window: MainWindow
) -> None:
    _press(Qt.Key.Key_M)
    _press(Qt.Key.Key_R)
    _press(Qt.Key.Key_Return)
    runner = window.maintenance.wizard.runner
    assert runner is not None, window.maintenance.wizard.start.trouble.text()
    qtbot.waitUntil(lambda: runner.actions_by_key["next"].isEnabled(), timeout=PATIENCE_MS)
    _press(Qt.Key.Key_Return)
    page = runner.pages["seats"]
    assert isinstance(page, CollectPage)
    qtbot.waitUntil(page.isVisible, timeout=PATIENCE_MS)
    # The operator of the virtual rig touches the part, and the procedure sees it.
    qtbot.waitUntil(
        lambda: [one.accessibleDescription() for one in page.live.cameras] == ["6 spots"] * 2,
        timeout=PATIENCE_MS,
    )
    # Whoever reads the manual meanwhile comes back to it, and nowhere else: elsewhere no point
    # would be taken. Whatever page is shown, the machine is not ready.
    _press(Qt.Key.Key_F1)
    assert window.sheets.manual.isVisible()
    assert not window.pages.may_be_left()
    assert not window.actions_by_key["settings"].isEnabled()
    _press(Qt.Key.Key_Escape)
    assert window.maintenance.wizard.isVisible()
    live = window._bridge.station.looks.live()  # noqa: SLF001 - independent of the shown page
    assert (live.status, live.tip_world) == (StatusWord.NOT_READY, None)
    assert "procedure" in live.reason
    # The window may be closed in the middle: everything ends, and the session is kept.
    window.close()
    assert window.maintenance.wizard.runner is None


def test_no_point_is_taken_while_a_procedure_watches(qtbot: QtBot, open_window: OpenWindow) -> None:
    bench = open_window(speed=4.0)
    frames: list[FrameBlock] = []
    bench.bridge.station.maintenance.set_frame_tap(frames.append)
    touches = bench.built.virtual
    assert touches is not None
    third = touches.truth.touches[2].last_frame
    qtbot.waitUntil(
        lambda: bool(frames) and int(frames[-1].counter[-1]) > third, timeout=PATIENCE_MS
    )
    assert sum(len(feature.points) for feature in bench.bridge.shown.job.features) == 0
    assert bench.bridge.shown.job.refusal is None
    bench.bridge.station.maintenance.set_frame_tap(None)
    qtbot.waitUntil(
        lambda: sum(len(feature.points) for feature in bench.bridge.shown.job.features) > 0,
        timeout=PATIENCE_MS,
    )


def test_without_a_store_it_says_why_nothing_can_be_calibrated(
    qtbot: QtBot, open_window: OpenWindow
) -> None:
    window = open_window(speed=0.1).window
    window.show_mode(Mode.MAINTAIN)
    window.maintenance.open_wizard(ProcedureKind.RELOCATION)
    assert "in Settings (Instrument)" in window.maintenance.wizard.start.trouble.text()
    window.maintenance.wizard.start.begin_button.click()
    assert window.maintenance.wizard.runner is None


def test_no_two_actions_of_a_wizard_share_a_key_with_each_other_or_the_window() -> None:
    keys = [QKeySequence(keys) for info in WIZARD_ACTIONS for keys in info.shortcuts]
    keys += [
        QKeySequence(keys)
        for info in ACTIONS
        if info.key in ("theme", "log")
        for keys in info.shortcuts
    ]
    words = [key.toString() for key in keys]
    assert all(words)
    assert len(words) == len(set(words))


@pytest.mark.parametrize("kind", _KINDS)
def test_every_page_is_named_fits_and_uses_the_theme(
    qtbot: QtBot, qapp: QApplication, tmp_path: Path, kind: ProcedureKind
) -> None:
    bench = WizardBench(qtbot, tmp_path, TIP)
    try:
        if kind is ProcedureKind.VERIFICATION:
            bench.bench.calibrated(120)
        if kind in (ProcedureKind.QUALIFICATION, ProcedureKind.TIP_CHECK):
            Tips.at(tmp_path, qualified=True)
        points = tmp_path / "points.csv"
        points.write_text(
            "# ocmm reference points\n# unit: mm\n# uncertainty: 0.002\n# frame: CMM\n"
            "name;x;y;z\nP1;0;0;0\nP2;50;0;0\n"
        )
        values = {"points": str(points)} if kind is ProcedureKind.KNOWN_POINTS else {}
        bench.begin(kind, **values)
        assert bench.wizard.runner is not None, bench.wizard.start.trouble.text()
        for page in (None, *bench.runner.pages.values()):
            if page is not None:
                bench.runner.show_page(page)
            QTest.qWait(30)
            # The smallest window, less the trust bar: nothing may push it open.
            assert (bench.wizard.width(), bench.wizard.height()) == (1024, 600)
            assert bench.wizard.minimumSizeHint().width() <= 1024
            for button in bench.runner.buttons.values():
                if button.isVisible():
                    assert button.width() >= button.minimumSizeHint().width(), button.text()
            for theme in THEMES:
                bench.dress(theme)
                image = bench.wizard.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
                assert not image.isNull()
        for widget in bench.wizard.findChildren(QWidget):
            if _is_control(widget) and not widget.objectName().startswith(_QT_PARTS):
                interface = QAccessible.queryAccessibleInterface(widget)
                assert interface is not None
                assert interface.text(QAccessible.Text.Name).strip(), widget
    finally:
        bench.close()


def _is_control(widget: QWidget) -> bool:
    paints_itself = isinstance(widget, ThemedWidget) and not QWidget.children(widget)
    return not isinstance(widget, QLabel) and (
        paints_itself
        or isinstance(widget, QAbstractButton | QLineEdit | QListWidget | QTableWidget | QComboBox)
    )
