"""A job by continuous probing in the window: the next step shows the path, the part conforms."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from ocmm_core.inspection.evaluation import LiveView
from ocmm_core.tolerances.decisions import PartWord
from ocmm_gui.kit import next_step
from tests.gui.conftest import OpenWindow
from tests.host import HANG_MS


def test_paths_are_led_shown_and_undone_as_one_step(open_window: OpenWindow, qtbot: QtBot) -> None:
    bench = open_window(plan="paths.toml", start=False)
    view = bench.built.station.job.view()
    assert next_step(view) == "Press on BED, hold the button and slide 60 mm."
    steps: list[str] = []
    points: list[int] = []
    bench.bridge.live_changed.connect(
        lambda live: steps.append(next_step(bench.bridge.shown.job, live))
    )
    bench.bridge.point_taken.connect(lambda point: points.append(point.number))
    bench.bridge.start()
    qtbot.waitUntil(
        lambda: any("Release the button to finish." in one for one in steps), timeout=HANG_MS
    )
    bench.wait_complete(qtbot)
    assert bench.bridge.shown.job.part_verdict.word is PartWord.CONFORMS
    # One sound a path, whatever the number of its points.
    assert len(points) == 3
    count = len(bench.bridge.shown.job.features[2].points)
    QTest.keyClick(bench.window, Qt.Key.Key_Backspace)
    qtbot.waitUntil(lambda: len(bench.bridge.shown.job.features[2].points) < count)
    assert not bench.bridge.shown.job.features[2].points


def test_a_scan_shows_its_coverage(open_window: OpenWindow, qtbot: QtBot) -> None:
    bench = open_window(plan="scans.toml", start=False)
    steps: list[str] = []
    shares: list[float] = []

    def note(live: LiveView) -> None:
        steps.append(next_step(bench.bridge.shown.job, live))
        if live.path is not None and live.path.covered is not None:
            shares.append(live.path.covered)

    bench.bridge.live_changed.connect(note)
    bench.bridge.start()
    qtbot.waitUntil(lambda: bench.bridge.shown.job.complete, timeout=HANG_MS)
    assert any(" % of the scan, " in one for one in steps)
    assert max(shares) > 0.5
    assert bench.bridge.shown.job.part_verdict.word is PartWord.CONFORMS
