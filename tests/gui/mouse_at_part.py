"""A user of the mouse in a window that leads the probe, for tests of touches by hand."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from ocmm_core.geometry import Float
from ocmm_sim.hand import HandAtRig, MouseHand
from ocmm_sim.scene import VirtualRig
from tests.host import HANG_MS

if TYPE_CHECKING:
    from tests.gui.conftest import Bench

BALL_RADIUS_MM = 3.0
_CLICKS = 4
_SAME_MM = 2.0
"""A pixel is 0.7 mm of the part; what lies before a place is farther off than this."""


class Mouse:
    """Somebody at the mouse of a window that leads the probe."""

    def __init__(self, qtbot: QtBot, bench: Bench) -> None:
        assert bench.built.hand is not None
        assert isinstance(bench.built.virtual, VirtualRig)
        self.qtbot, self.bench = qtbot, bench
        self.hand: HandAtRig = bench.built.hand
        self.part = bench.built.virtual.part
        self.view = bench.window.desk.points
        self.wanted = 0
        # Another one at the same part: what would be meant, without leading.
        self.other = MouseHand(bench.built.virtual)

    def take_over(self) -> None:
        """Press the key."""
        QTest.keyClick(self.bench.window, Qt.Key.Key_T, Qt.KeyboardModifier.ControlModifier)
        self.qtbot.waitUntil(lambda: self.hand.taken, timeout=HANG_MS)
        self.wanted = self.points()

    def points(self) -> int:
        """Return the number of points of the job."""
        return sum(len(one.points) for one in self.bench.bridge.shown.job.features)

    def at(self, place_part: Float) -> QPoint:
        """Return the pixel of a place of the part."""
        world = self.part.T_world_from_part.apply(np.array(place_part)[None])
        x, y = self.view.projected(world)[0]
        return QPoint(round(float(x)), round(float(y)))

    def sees(self, place: Float, normal: Float) -> bool:
        """Return whether the mouse over the ball there means the place itself."""
        ball = place + BALL_RADIUS_MM * normal
        spot = self.at(ball)
        if not self.view.rect().contains(spot):
            return False
        origin, toward = self.view.ray_at(QPointF(spot))
        wish = self.other.wish_at(origin, toward, 12.0, np.zeros(2))
        return bool(np.linalg.norm(wish.contact_part - ball) < _SAME_MM)

    def press(self, place: Float, normal: Float) -> None:
        """Move there and click once the hand is free."""
        self.qtbot.waitUntil(lambda: not self.hand.view().hand.busy, timeout=HANG_MS)
        spot = self.at(place + BALL_RADIUS_MM * normal)
        QTest.mouseMove(self.view, spot)
        QTest.mouseClick(self.view, Qt.MouseButton.LeftButton, pos=spot)

    def click(self, place: Float, normal: Float) -> None:
        """Click at a target of the ball, again if a busy computer drops frames."""
        self.wanted += 1
        assert any(self.tries(place, normal) for _ in range(_CLICKS))

    def tries(self, place: Float, normal: Float) -> bool:
        """Click there and wait until the touch is made; return whether a point came of it."""
        before = self.points()
        self.press(place, normal)
        self.qtbot.waitUntil(
            lambda: self.points() > before or not self.hand.view().hand.busy, timeout=HANG_MS
        )
        if self.points() == before:
            # The last frames of a touch are still on their way.
            self.watch(1.0, lambda: self.points() > before)
        return self.points() > before

    def watch(self, seconds: float, until: Callable[[], bool] = lambda: False) -> None:
        """Wait for this time of the bus, which a busy computer stretches, or for an event."""
        looks = self.bench.built.station.looks
        end_s = looks.live().time_s + seconds
        self.qtbot.waitUntil(lambda: until() or looks.live().time_s > end_s, timeout=HANG_MS)

    def turn_view(self, right_px: int, down_px: int) -> None:
        """Turn the view with the right button, as it is turned while the left one touches."""
        start = self.view.rect().center()
        QTest.mousePress(self.view, Qt.MouseButton.RightButton, pos=start)
        QTest.mouseMove(self.view, start + QPoint(right_px, down_px))
        QTest.mouseRelease(self.view, Qt.MouseButton.RightButton, pos=start)
