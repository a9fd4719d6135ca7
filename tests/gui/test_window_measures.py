"""The window on the real station: points arrive, keys command, values are those of the core."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from ocmm_core.inspection.evaluation import FeatureState, FeatureView, JobView, StatusWord
from ocmm_core.tolerances.decisions import U_LABEL
from ocmm_gui.kit import DASHES, DEBOUNCE_S, millimetres
from ocmm_sim.scene import ScriptedOcclusion, WorldOptions
from tests.host import HANG_MS, HANG_S
from tests.waiting import let_pass

if TYPE_CHECKING:
    from tests.gui.conftest import OpenWindow

PATIENCE_MS = HANG_MS


def _last_touched(job: JobView) -> FeatureView:
    return max(job.features, key=lambda feature: feature.points[-1].number)


def test_points_arrive_and_the_panel_shows_the_values_of_the_job(
    qtbot: QtBot, open_window: OpenWindow
) -> None:
    bench = open_window()
    qtbot.waitUntil(lambda: bench.bridge.shown.job.complete, timeout=PATIENCE_MS)
    job = bench.built.station.job.view()
    last = _last_touched(job)
    result = job.deciding(last.name)
    assert result is not None
    assert result.measured is not None
    panel = bench.window.desk.feature
    assert last.fit is not None
    expected = {
        "Measured": f"{result.measured:.3f}",
        "Nominal": f"{result.nominal:.3f}",
        "Deviation": millimetres(result.deviation, signed=True),
        U_LABEL: millimetres(result.uncertainty),
        "Form": f"{last.fit.form:.3f}",
    }
    assert {name: panel.value(name) for name in expected} == expected
    assert panel.title.text().endswith(last.name)
    assert panel.verdict.text() == result.verdict.value
    rows = [bench.window.desk.plan.item(row).text() for row in range(len(job.features))]
    for row, feature in zip(rows, job.features, strict=True):
        assert row.startswith(feature.name)
        assert f"{len(feature.points)} of {feature.needed} points" in row
    assert "All features measured" in bench.window.desk.guidance.step.text()


def test_readout_shows_the_tip_and_the_strip_the_counters(
    qtbot: QtBot, open_window: OpenWindow
) -> None:
    bench = open_window(speed=1.0, stay=True)
    desk = bench.window.desk
    qtbot.waitUntil(lambda: DASHES not in desk.readout.values(), timeout=PATIENCE_MS)
    assert desk.strip.status.text() in {word.value for word in StatusWord}
    assert desk.strip.counter("Cameras") == "2/2"
    shown = np.array([float(value) for value in desk.readout.values()])
    tip = bench.built.station.looks.live().tip_world
    assert tip is not None
    # The probe moves at most 0.6 m/s between the shown frame (12 Hz) and this query.
    assert np.abs(shown - tip).max() < 100.0
    assert desk.cameras.isHidden(), "the part has the room until somebody asks for the cameras"
    for name in ("left", "right"):
        assert f"{name}: " in desk.camera_bar.words.text()
    bench.window.actions_by_key["cameras"].trigger()
    plots = desk.cameras.plots()
    qtbot.waitUntil(lambda: all(len(plot.labels()) >= 3 for plot in plots), timeout=PATIENCE_MS)
    for plot in plots:
        assert all("·s" in label for label in plot.labels())


def test_keys_take_undo_and_finish_reach_the_job(qtbot: QtBot, open_window: OpenWindow) -> None:
    bench = open_window()
    # While the script lasts, the operator repeats undone touches.
    assert bench.built.station.wait_finished(HANG_S)
    bench.wait_complete(qtbot)
    before = _last_touched(bench.built.station.job.view())
    QTest.keyClick(bench.window, Qt.Key.Key_Backspace)
    qtbot.waitUntil(lambda: not bench.bridge.shown.job.complete, timeout=HANG_MS)
    after = bench.built.station.job.view()
    assert after.active == before.name
    remaining = next(feature for feature in after.features if feature.name == before.name)
    assert remaining.points == before.points[:-1]
    assert bench.window.desk.guidance.step.text() == f"Touch one more point on {before.name}."
    let_pass(DEBOUNCE_S)
    QTest.keyClick(bench.window, Qt.Key.Key_F15)
    qtbot.waitUntil(lambda: bench.bridge.shown.job.complete, timeout=HANG_MS)
    states = {feature.name: feature.state for feature in bench.built.station.job.view().features}
    assert states[before.name] is FeatureState.DONE


def test_a_job_that_is_done_lets_choose_points_pause_and_hear_why_there_is_no_point(
    qtbot: QtBot, open_window: OpenWindow
) -> None:
    bench = open_window(speed=20.0, stay=True)
    bench.wait_complete(qtbot)
    desk, choice = bench.window.desk, bench.window.choice
    number = _last_touched(bench.bridge.shown.job).points[0].number
    for picture in (desk.feature.coverage, desk.feature.residuals):
        choice.choose(0)
        place = picture.place_of(number).toPoint()
        QTest.mouseClick(picture, Qt.MouseButton.LeftButton, pos=place)
        assert choice.chosen == number
    QTest.keyClick(bench.window, Qt.Key.Key_Z)
    qtbot.waitUntil(lambda: desk.strip.status.text() == "PAUSED", timeout=PATIENCE_MS)
    QTest.keyClick(bench.window, Qt.Key.Key_Z)
    qtbot.waitUntil(lambda: not bench.bridge.shown.job.paused, timeout=PATIENCE_MS)
    assert desk.strip.status.text() in {word.value for word in StatusWord}
    # All is measured and the probe goes home or rests there: a point now can only be refused.
    assert bench.bridge.shown.job.refusal is None
    QTest.keyClick(bench.window, Qt.Key.Key_Space)
    qtbot.waitUntil(lambda: bench.bridge.shown.job.refusal is not None, timeout=PATIENCE_MS)
    refusal = bench.built.station.job.view().refusal
    assert refusal is not None
    assert refusal.what in desk.guidance.trouble.text()
    assert refusal.remedy in desk.guidance.trouble.text()


def test_a_lost_probe_shows_dashes_and_the_reason(qtbot: QtBot, open_window: OpenWindow) -> None:
    hidden = ScriptedOcclusion(1, (0, 1, 2, 3, 4, 5, 6, 7), 400, 10**9)
    bench = open_window(speed=1.0, stay=True, world=WorldOptions(occlusions=(hidden,)))
    desk, far = bench.window.desk, bench.window.far
    qtbot.waitUntil(lambda: desk.strip.status.text() == "LOST", timeout=PATIENCE_MS)
    assert desk.readout.values() == (DASHES,) * 3
    assert "LOST" in desk.guidance.trouble.text()
    assert bench.built.station.looks.live().reason in desk.guidance.trouble.text()
    bench.window.show_far(True)
    qtbot.waitUntil(lambda: far.readout.values() == (DASHES,) * 3, timeout=HANG_MS)


def test_the_far_view_can_be_read_at_three_metres(qtbot: QtBot, open_window: OpenWindow) -> None:
    bench = open_window()
    bench.window.resize(1920, 1080)
    QTest.keyClick(bench.window, Qt.Key.Key_F11)
    assert bench.window.is_far()
    bench.wait_complete(qtbot)
    # 63 px of capital are 20 minutes of arc at 3 m on a 24-inch screen.
    assert bench.window.far.readout.cap_height() >= 63.0
    for name, pixels in bench.window.far.type_pixels().items():
        assert 0.729 * pixels >= 63.0, name
    QTest.keyClick(bench.window, Qt.Key.Key_V)
    assert not bench.window.is_far()


def test_export_writes_into_the_given_folder_and_names_the_files(
    qtbot: QtBot, open_window: OpenWindow, tmp_path: Path
) -> None:
    bench = open_window(out=tmp_path / "report")
    bench.wait_complete(qtbot)
    with qtbot.waitSignal(bench.window.output.exported, timeout=HANG_MS) as written:
        QTest.keyClick(bench.window, Qt.Key.Key_E)
    paths: tuple[Path, ...] = written.args[0]
    assert paths
    assert all(path.is_file() and path.is_relative_to(tmp_path / "report") for path in paths)
    qtbot.waitUntil(lambda: paths[0].name in bench.window.banner.text(), timeout=HANG_MS)


def test_a_command_that_fails_is_explained_in_the_banner(
    qtbot: QtBot, open_window: OpenWindow
) -> None:
    bench = open_window(speed=0.1, stay=True)
    QTest.keyClick(bench.window, Qt.Key.Key_Return)
    qtbot.waitUntil(bench.window.banner.isVisible, timeout=HANG_MS)
    assert "0 of the 3 points" in bench.window.banner.text()
    QTest.keyClick(bench.window, Qt.Key.Key_Escape)
    assert not bench.window.banner.isVisible()
    assert bench.window.isVisible()


def test_a_click_in_the_plan_selects_the_feature(qtbot: QtBot, open_window: OpenWindow) -> None:
    bench = open_window(speed=0.1, stay=True)
    plan = bench.window.desk.plan
    qtbot.waitUntil(lambda: plan.count() == 3, timeout=HANG_MS)
    place = plan.visualItemRect(plan.item(2)).center()
    QTest.mouseClick(plan.viewport(), Qt.MouseButton.LeftButton, pos=place)
    qtbot.waitUntil(lambda: bench.bridge.shown.job.active == "SPHERE", timeout=HANG_MS)
    # The list has the focus now; its own use of the key must not win.
    plan.setFocus()
    QTest.keyClick(plan, Qt.Key.Key_PageUp)
    qtbot.waitUntil(lambda: bench.bridge.shown.job.active == "BLOCK_TOP", timeout=HANG_MS)
