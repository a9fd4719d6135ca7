"""The line about the tip: on every screen, in words, and what mounting a tip does to it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from ocmm_core.calibration.records import Blocker, CalibrationStatus, CalibrationView, ProbeView
from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import Mark, NoticeCentre, use_language
from ocmm_gui.maintain._status_page import _sentence
from ocmm_gui.operator import TrustPlace
from ocmm_gui.operator._status_bands import tip_mark, tip_words, trust_words
from ocmm_gui.window import MainWindow
from tests.core.calibration.fresh_tips import TIP, Tips
from tests.host import HANG_MS

VIEW = ProbeView(
    word=CalibrationStatus.VALID, probe="standard", tip=TIP, identity="0" * 64, diameter_mm=5.9981
)
MOUNTED = Blocker("Tip '6 mm' was mounted and has not been checked since.", "Check it.")


def test_words_and_marks_of_every_standing() -> None:
    assert tip_words(VIEW, TrustPlace.DESK) == "Probe standard, tip 6 mm: VALID, ball 5.9981 mm."
    assert tip_words(VIEW, TrustPlace.FAR) == "Tip 6 mm: VALID"
    assert tip_mark(VIEW) is Mark.GOOD
    suspect = replace(VIEW, word=CalibrationStatus.SUSPECT, blocker=MOUNTED)
    assert tip_mark(suspect) is Mark.DOUBT
    # The status strip of the desk view gives the reason; the other screens have none.
    assert "mounted" not in tip_words(suspect, TrustPlace.DESK)
    assert tip_words(suspect, TrustPlace.MAINTAIN).endswith(f"No points: {MOUNTED}")
    due = replace(VIEW, word=CalibrationStatus.DUE, warnings=("It ends soon. Qualify the tip.",))
    assert tip_words(due, TrustPlace.DESK).endswith("It ends soon. Qualify the tip.")
    assert tip_mark(due) is Mark.DOUBT
    assert tip_mark(replace(VIEW, word=CalibrationStatus.EXPIRED, blocker=MOUNTED)) is Mark.BAD
    design = replace(VIEW, word=CalibrationStatus.DESIGN, tip="")
    assert tip_words(design, TrustPlace.FAR) == "Probe standard: DESIGN"
    assert "nominal geometry" in tip_words(design, TrustPlace.DESK)
    insisted = replace(suspect, uncalibrated=True)
    assert tip_words(insisted, TrustPlace.FAR) == "Tip 6 mm: UNCALIBRATED"
    assert tip_mark(insisted) is Mark.BAD
    assert MOUNTED.what in tip_words(insisted, TrustPlace.DESK)


def test_the_lines_about_cameras_and_tip_are_german_in_a_german_window(qapp: QApplication) -> None:
    replaced = Blocker(
        "Another calibration has been activated since this job was started.",
        "End this job and start a new one.",
    )
    soon = "The calibration expires on 2026-12-01. Calibrate the cameras before that day."
    cameras = CalibrationView(
        word=CalibrationStatus.UNUSABLE, rig="r", identity="0", blocker=replaced
    )
    suspect = replace(VIEW, word=CalibrationStatus.SUSPECT, blocker=replaced)
    assert use_language(qapp, "de")
    try:
        told = (
            trust_words(cameras, TrustPlace.MAINTAIN),
            trust_words(replace(cameras, blocker=None, warnings=(soon,)), TrustPlace.DESK),
            tip_words(suspect, TrustPlace.MAINTAIN),
            tip_words(replace(VIEW, warnings=(soon,)), TrustPlace.DESK),
            _sentence(replaced, "", uncalibrated=False),
            _sentence(replaced, "", uncalibrated=True),
        )
    finally:
        use_language(qapp, "en")
    for text in told:
        assert text
        for english in ("Another", "End this job", "expires", "before"):
            assert english not in text, text


@pytest.fixture
def tips(tmp_path: Path) -> Tips:
    return Tips(tmp_path)


@pytest.fixture
def window(qtbot: QtBot, qapp: QApplication, tmp_path: Path, tips: Tips) -> Iterator[MainWindow]:
    request = StationRequest(
        plan=resource("plans", "quick.toml"),
        out=tmp_path / "out",
        frame_rate_hz=800,
        speed=1.0,
        stay=True,
        probes=tmp_path,
    )
    bridge = StationBridge(build_station(request).station)
    window = MainWindow(bridge, NoticeCentre(), out=tmp_path)
    window.resize(1280, 720)
    with qtbot.waitActive(window):
        window.show()
        window.activateWindow()
    bridge.start()
    yield window
    window.close()
    window.deleteLater()
    bridge.deleteLater()


def test_mounting_a_tip_is_said_on_every_screen(
    window: MainWindow, qtbot: QtBot, tips: Tips
) -> None:
    line = window.running.tip_line
    qtbot.waitUntil(lambda: "VALID until" in line.text(), timeout=HANG_MS)
    QTest.keyClick(window, Qt.Key.Key_V)
    qtbot.waitUntil(lambda: line.text() == f"Tip {TIP}: VALID", timeout=HANG_MS)
    QTest.keyClick(window, Qt.Key.Key_M)
    window.maintenance.view.list.setCurrentRow(2)
    page = window.maintenance.probe
    qtbot.waitUntil(lambda: page.isVisible() and page.tips.rowCount() == 1, timeout=HANG_MS)
    QTest.keyClick(window, Qt.Key.Key_N)
    assert "SUSPECT" not in line.text()
    QTest.keyClick(window, Qt.Key.Key_N)
    qtbot.waitUntil(
        lambda: "was mounted and has not been checked since" in line.text(), timeout=HANG_MS
    )
    assert "Run the quick tip check (one minute)." in line.text()
    # It is on every screen anyway: the notice of the key is not covered.
    assert "not been checked since" not in window.banner.text()
    QTest.keyClick(window, Qt.Key.Key_M)
    qtbot.waitUntil(lambda: line.text() == f"Tip {TIP}: SUSPECT", timeout=HANG_MS)
    QTest.keyClick(window, Qt.Key.Key_V)
    qtbot.waitUntil(lambda: "SUSPECT" in line.text() and "ball" in line.text(), timeout=HANG_MS)
    qtbot.waitUntil(lambda: window.desk.strip.status.text() == "NOT READY", timeout=HANG_MS)
    tips.check()
    qtbot.waitUntil(lambda: "Points are taken again" in window.banner.text(), timeout=HANG_MS)
    assert "VALID until" in line.text()
