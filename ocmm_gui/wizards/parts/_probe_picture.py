from __future__ import annotations

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtGui import QPaintEvent

from ocmm_core.geometry import Float, Points3
from ocmm_gui.kit import SCENE_LEAST, SCENE_SIZE, Painted, led_name, text_font, tr
from ocmm_gui.scene import Dots, Item, Lines, Orbit, Tag, paint_scene

_RAY_MM = 25.0
_AZIMUTH, _ELEVATION = np.radians(60.0), np.radians(20.0)
_UP = np.array([0.0, 0.0, 1.0])


class ProbePicture(Painted):
    """The probe as defined; undefined parts are omitted."""

    def __init__(self) -> None:
        super().__init__(tr("Picture of the probe"), SCENE_SIZE, SCENE_LEAST)
        self._leds: Points3 = np.empty((0, 3))
        self._directions: Points3 = np.empty((0, 3))
        self._tip: Float = np.zeros(3)

    def show_probe(self, leds_probe: Points3, directions_probe: Points3, tip_probe: Float) -> None:
        """Show LEDs (n, 3), mm, with their directions (n, 3), and the ball (3,)."""
        self._leds, self._directions, self._tip = leds_probe, directions_probe, tip_probe
        self.setAccessibleDescription(tr("%n LEDs", "1 LED", len(leds_probe)))
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        inside = self._paint_panel(painter).adjusted(10.0, 10.0, -10.0, -10.0)
        theme = self._theme
        if not len(self._leds):
            painter.drawText(inside, Qt.AlignmentFlag.AlignCenter, tr("no LEDs yet"))
            return
        length = np.linalg.norm(self._directions, axis=1, keepdims=True)
        rays = self._leds + _RAY_MM * self._directions / np.maximum(length, 1e-9)
        everything = np.concatenate([self._leds, rays, self._tip[None]])
        orbit = Orbit(np.zeros(3), _AZIMUTH, _ELEVATION, 100.0, _UP)
        orbit = orbit.fitted(everything, inside.width(), inside.height(), 1.2)
        middle = self._leds.mean(axis=0)
        arms = np.stack([np.broadcast_to(middle, self._leds.shape), self._leds], axis=1)
        items: list[Item] = [
            Lines(np.stack([self._tip, middle])[None], theme.text, 5.0),
            Lines(arms, theme.muted, 2.0),
            Lines(np.stack([self._leds, rays], axis=1), theme.warn, 2.0),
            Dots(self._tip[None], theme.accent, 14.0, theme.text),
            Dots(self._leds, theme.bad, 11.0, theme.text),
            Tag(self._tip, tr("ball"), theme.text),
        ]
        items += [Tag(led, led_name(n), theme.text) for n, led in enumerate(self._leds)]
        paint_scene(painter, items, orbit, inside, text_font(15, bold=True), theme.panel)
