"""Take over: the mouse leads the probe of the virtual rig, and its touches are measured."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from ocmm_core.acquisition.frames import FrameFlag
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import StatusWord
from ocmm_gui.led import TOUR
from ocmm_sim.scene import sample
from ocmm_sim.sources import true_values
from tests.gui.mouse_at_part import Mouse
from tests.host import HANG_MS

if TYPE_CHECKING:
    from tests.gui.conftest import OpenWindow

PATIENCE_MS = HANG_MS
_STEPS = 12
"""So many steps of 5° lean the probe as far as a hand may."""
_UP, _DOWN, _LEFT, _RIGHT = Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_Left, Qt.Key.Key_Right
_WAYS = ((_UP, _DOWN), (_DOWN, _UP), (_LEFT, _RIGHT), (_RIGHT, _LEFT))


def _touch_all(mouse: Mouse) -> None:
    """Touch the active feature at a visible place, until the job is complete."""
    job = mouse.bench.built.station.job
    while not job.view().complete:
        name = job.view().active
        entry = mouse.part.artefact(name)
        needed = job.view().feature(name).needed
        contacts = sample(entry, 60, np.random.default_rng(7))
        seen = [
            (point, normal)
            for point, normal in zip(contacts.points, contacts.normals, strict=True)
            if mouse.sees(point, normal)
        ]
        assert len(seen) >= needed, name
        for place, normal in _spread(seen, needed):
            mouse.click(place, normal)
        mouse.qtbot.waitUntil(lambda: job.view().active != name, timeout=PATIENCE_MS)  # noqa: B023


def _spread(seen: list[tuple[Float, Float]], count: int) -> list[tuple[Float, Float]]:
    """Return places far apart, as a person touches: four of a plane near a line give it no U."""
    places = np.array([place for place, _normal in seen])
    chosen = [0]
    while len(chosen) < count:
        apart = np.linalg.norm(places[:, None] - places[chosen], axis=2).min(axis=1)
        chosen.append(int(apart.argmax()))
    return [seen[number] for number in chosen]


@pytest.mark.slow
def test_what_the_mouse_touches_is_measured_to_its_uncertainty(
    qtbot: QtBot, open_window: OpenWindow
) -> None:
    bench = open_window(speed=5.0, stay=True, plan="quick.toml", start=False, led=True)
    mouse = Mouse(qtbot, bench)
    mouse.take_over()
    bench.bridge.start()
    _touch_all(mouse)
    job = bench.built.station.job.view()
    truth = true_values(bench.built.station.job.plan, mouse.part)
    results = [one for one in job.characteristics if one.measured is not None]
    assert results
    for one in results:
        assert one.measured is not None
        assert one.uncertainty is not None
        # U is 95 %: of few results none should be far beyond it.
        assert abs(one.measured - truth[one.name]) <= 1.5 * one.uncertainty, one.name
    inside = [abs(one.measured - truth[one.name]) <= one.uncertainty for one in results]  # type: ignore[operator]  # measured, see above
    assert np.mean(inside) >= 0.75
    assert job.simulated


def test_the_probes_button_goes_the_whole_way_from_space(
    qtbot: QtBot, open_window: OpenWindow
) -> None:
    bench = open_window(speed=2.0, stay=True, start=False, led=True)
    mouse = Mouse(qtbot, bench)
    mouse.take_over()
    flags: list[int] = []
    changes = bench.built.station.events.button
    changes.connect(lambda change: flags.append(1))
    bench.bridge.start()
    plate = np.array([-72.0, 0.0, 20.342])

    # Nothing is touched yet: down to the surface by the wheel.
    def settled() -> bool:
        tip = bench.built.station.looks.live().tip_world
        inverse = mouse.part.T_world_from_part.inverse()
        if tip is not None and abs(inverse.apply(tip)[0] + 72.0) < 5.0:
            return True
        # The view may have moved away under the mouse: a user would follow it.
        QTest.mouseMove(mouse.view, mouse.at(plate))
        return False

    qtbot.waitUntil(settled, timeout=PATIENCE_MS)
    for _ in range(10):
        _wheel(mouse, 120)
    qtbot.waitUntil(lambda: mouse.hand.view().hand.touches, timeout=PATIENCE_MS)
    assert mouse.points() == 0, "touching alone takes nothing"
    mouse.watch(0.8)
    QTest.keyClick(bench.window, Qt.Key.Key_Space)
    qtbot.waitUntil(lambda: mouse.points() == 1, timeout=PATIENCE_MS)
    assert flags, "the button came over the frames, not from the window"
    assert FrameFlag.BUTTON


def test_handed_back_the_robot_measures_what_is_missing(
    qtbot: QtBot, open_window: OpenWindow
) -> None:
    bench = open_window(speed=10.0, stay=True, start=False, led=True)
    mouse = Mouse(qtbot, bench)
    window = bench.window
    window.show_far(True)
    assert "The probe rests" in window.hand.strip.text.text()
    mouse.take_over()
    assert not window.is_far()
    assert "you measure" in window.hand.strip.text.text()
    assert window.actions_by_key["hand"].text() == "Hand back"
    bench.bridge.start()
    mouse.watch(1.0)
    assert mouse.points() == 0, "the robot has let go"
    window.hand.strip.hand_button.click()
    assert not mouse.hand.taken
    assert "robot hand" in window.hand.strip.text.text()
    qtbot.waitUntil(lambda: bench.bridge.shown.job.complete, timeout=PATIENCE_MS)


def test_a_probe_that_is_tilted_out_of_sight_says_so(qtbot: QtBot, open_window: OpenWindow) -> None:
    bench = open_window(speed=2.0, stay=True, start=False, led=True)
    mouse = Mouse(qtbot, bench)
    mouse.take_over()
    bench.bridge.start()
    QTest.mouseMove(mouse.view, mouse.at(np.array([-72.0, 0.0, 20.0])))
    looks = bench.built.station.looks

    def is_ready() -> bool:
        return looks.live().status is StatusWord.READY

    reasons: list[str] = []

    def leant(key: Qt.Key) -> bool:
        """Lean it by 60° that way; return whether it was out of sight before 4 s of the bus."""
        for _ in range(_STEPS):
            QTest.keyClick(mouse.view, key)
        end_s = looks.live().time_s + 4.0

        def told() -> bool:
            live = looks.live()
            if live.status is not StatusWord.READY:
                reasons.append(live.reason)
            return bool(reasons) or live.time_s > end_s

        qtbot.waitUntil(told, timeout=PATIENCE_MS)
        return bool(reasons)

    qtbot.waitUntil(is_ready, timeout=PATIENCE_MS)
    # The direction out of sight depends on the part of the scene under the mouse, which may still
    # move: over a wall the probe lies down, and leaning it back lifts it.
    for key, back in _WAYS:
        if leant(key):
            break
        leant(back)
    assert reasons[0]
    for _ in range(_STEPS):
        QTest.keyClick(mouse.view, back)
    qtbot.waitUntil(is_ready, timeout=PATIENCE_MS)


def test_the_tour_sees_what_is_done_and_ends(qtbot: QtBot, open_window: OpenWindow) -> None:
    bench = open_window(speed=2.0, stay=True, start=False, led=True)
    mouse, window = Mouse(qtbot, bench), bench.window
    tour = window.hand.tour
    bench.bridge.start()
    QTest.keyClick(window, Qt.Key.Key_G, Qt.KeyboardModifier.ControlModifier)

    def stands_at(key: str) -> None:
        qtbot.waitUntil(lambda: tour.step is not None and tour.step.key == key, timeout=PATIENCE_MS)
        assert tour.step is not None
        shown = window.hand.strip.text.text()
        assert f"{tour.number}/{len(TOUR)}" in shown

    stands_at("take")
    window.hand.strip.hand_button.click()
    mouse.wanted = mouse.points()
    stands_at("move")
    QTest.mouseMove(mouse.view, mouse.at(np.array([-150.0, -55.0, 0.0])))
    mouse.watch(1.4)
    QTest.mouseMove(mouse.view, mouse.at(np.array([60.0, -55.0, 0.0])))
    stands_at("touch")
    up = np.array([0.0, 0.0, 1.0])
    mouse.click(np.array([60.0, -55.0, 0.0]), up)
    stands_at("more")
    for x in (-150.0, 150.0):
        mouse.click(np.array([x, -55.0, 0.0]), up)
    stands_at("undo")
    QTest.keyClick(mouse.view, Qt.Key.Key_Backspace)
    stands_at("lean")
    QTest.keyClick(mouse.view, Qt.Key.Key_Right)
    stands_at("results")
    QTest.keyClick(mouse.view, Qt.Key.Key_F3)
    stands_at("return")
    focus = QApplication.focusWidget()
    assert focus is not None
    QTest.keyClick(focus, Qt.Key.Key_Escape)
    stands_at("back")
    window.hand.strip.hand_button.click()
    qtbot.waitUntil(lambda: not tour.runs, timeout=PATIENCE_MS)
    assert not window.hand.strip.skip_button.isVisible()


def test_every_step_of_the_tour_can_be_skipped(qtbot: QtBot, open_window: OpenWindow) -> None:
    window = open_window(speed=1.0, stay=True, start=False, led=True).window
    window.hand.toggle_tour()
    for _ in TOUR:
        assert window.hand.tour.runs
        window.hand.strip.skip_button.click()
    assert not window.hand.tour.runs
    window.hand.toggle_tour()
    window.hand.toggle_tour()
    assert not window.hand.tour.runs


def test_where_the_probe_is_real_nobody_takes_it_over(
    qtbot: QtBot, open_window: OpenWindow
) -> None:
    bench = open_window(speed=0.1, start=False)
    assert not bench.window.hand.strip.isVisible()
    for key in ("hand", "tour"):
        bench.window.actions_by_key[key].trigger()
    assert not bench.window.hand.taken
    with contextlib.suppress(IndexError):
        assert "virtual rig" in bench.notices.kept()[-1].what


def _wheel(mouse: Mouse, delta: int) -> None:
    place = QPointF(mouse.at(np.array([-72.0, 0.0, 20.342])))
    event = QWheelEvent(
        place, mouse.view.mapToGlobal(place), QPoint(), QPoint(0, delta), Qt.MouseButton.NoButton,
        Qt.KeyboardModifier.NoModifier, Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip
    QApplication.sendEvent(mouse.view, event)
