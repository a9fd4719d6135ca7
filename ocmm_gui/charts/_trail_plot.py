"""Paths of the LEDs about the ball, in space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QKeyEvent, QMouseEvent, QPaintEvent

from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, Points3
from ocmm_gui.charts._plot import Plot
from ocmm_gui.kit import text_font, tr
from ocmm_gui.scene import Dots, Item, Lines, Tag, paint_scene
from ocmm_gui.views import seen_from, upright

_MOST_POSES = 1200
"""More are indistinguishable."""

_TURN_PER_PX, _TURN_PER_KEY = 0.008, np.radians(10.0)
_KEYS = {
    Qt.Key.Key_Left: (-_TURN_PER_KEY, 0.0),
    Qt.Key.Key_Right: (_TURN_PER_KEY, 0.0),
    Qt.Key.Key_Up: (0.0, _TURN_PER_KEY),
    Qt.Key.Key_Down: (0.0, -_TURN_PER_KEY),
}


@dataclass(frozen=True, slots=True)
class Trail:
    name: str
    paths_world: Float
    """(n, L, 3), mm; NaN for omitted frames."""
    centre_world: Float
    """(3,), mm: the ball."""


class TrailPlot(Plot):
    """Every LED on its sphere; drag or arrow keys turn the picture."""

    def __init__(self, rig: Rig) -> None:
        super().__init__(tr("Paths of the LEDs about the ball"))
        self._orbit = seen_from(rig, upright(rig))
        self._trails: tuple[Trail, ...] = ()
        self._pulled: QPointF | None = None
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)

    def show_trails(self, trails: Sequence[Trail]) -> None:
        self._trails = tuple(_thinned(trail) for trail in trails)
        poses = sum(int(np.isfinite(one.paths_world[:, 0, 0]).sum()) for one in trails)
        leds = trails[0].paths_world.shape[1] if trails else 0
        self._say(
            tr(
                "%n poses, {leds} LEDs; drag to rotate",
                "1 pose, {leds} LEDs; drag to rotate",
                poses,
            ).format(leds=leds)
        )

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        box = self._paint_head(painter)
        if not self._trails:
            return
        theme, items = self._theme, list[Item]()
        reach: list[Points3] = []
        for index, trail in enumerate(self._trails):
            colour = (theme.accent, theme.warn)[index % 2]
            places = trail.paths_world.reshape(-1, 3)
            reach += [places[np.isfinite(places).all(axis=1)], trail.centre_world[None]]
            pieces = np.stack([trail.paths_world[:-1], trail.paths_world[1:]], axis=2)
            pieces = pieces.reshape(-1, 2, 3)
            items.append(Lines(pieces[np.isfinite(pieces).all(axis=(1, 2))], colour, 1.0))
            # Spokes from the ball to the LEDs of one pose show the rotation.
            whole = trail.paths_world[np.isfinite(trail.paths_world).all(axis=(1, 2))]
            if len(whole):
                leds = whole[len(whole) // 2]
                spokes = np.stack([np.broadcast_to(trail.centre_world, leds.shape), leds], axis=1)
                items.append(Lines(spokes, theme.muted, 1.0))
                items.append(Dots(leds, colour, 9.0, theme.text))
            items.append(Dots(trail.centre_world[None], colour, 14.0, theme.text))
            items.append(Tag(trail.centre_world, trail.name, theme.text))
        everything = np.concatenate(reach)
        orbit = self._orbit.fitted(everything, box.width(), box.height(), 1.1)
        paint_scene(painter, items, orbit, box, text_font(15, bold=True), theme.panel)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self._pulled = event.position()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._pulled is not None:
            by = event.position() - self._pulled
            self._pulled = event.position()
            self._turn(-_TURN_PER_PX * by.x(), _TURN_PER_PX * by.y())

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        self._pulled = None

    def keyPressEvent(self, event: QKeyEvent) -> None:
        turn = _KEYS.get(Qt.Key(event.key()))
        if turn is None:
            super().keyPressEvent(event)
        else:
            self._turn(*turn)

    def _turn(self, azimuth: float, elevation: float) -> None:
        self._orbit = self._orbit.turned(azimuth, elevation)
        self.update()


def _thinned(trail: Trail) -> Trail:
    step = max(len(trail.paths_world) // _MOST_POSES, 1)
    return Trail(trail.name, trail.paths_world[::step], trail.centre_world)
