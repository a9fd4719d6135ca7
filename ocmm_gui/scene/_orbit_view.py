"""Common base of the 3-D views: turn, pan and zoom by mouse and keys."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt, QTimer
from PySide6.QtGui import QKeyEvent, QMouseEvent, QResizeEvent, QWheelEvent

from ocmm_core.geometry import Float
from ocmm_gui.kit import ARROWS, PaintedWidget
from ocmm_gui.scene._scene import Orbit

_KEY_TURN = np.radians(10.0)
_STILL_MS = 140
"""A view at rest for this long is painted in full quality."""
_CLICK_PX = 4.0
_EYE_MM = 1500.0


class OrbitView(PaintedWidget):
    """Orbit with left button or arrow keys, pan with the right one, zoom by wheel."""

    def __init__(
        self, name: str, size: tuple[int, int], least: tuple[int, int], orbit: Orbit
    ) -> None:
        super().__init__(name, size, least)
        self._orbit = orbit
        self._mouse: QPointF | None = None
        self._pressed: QPointF | None = None
        self._moving = QTimer(self, singleShot=True, interval=_STILL_MS)
        self._moving.timeout.connect(self.update)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)

    def fit(self) -> None:
        """Show everything."""

    def projected(self, places: Float) -> Float:
        """Return the picture coordinates (n, 2), px, of places (n, 3), mm, world."""
        box = self._inside()
        flat = self._orbit.project(places, box.width(), box.height())[:, :2]
        moved: Float = flat + np.array([box.left(), box.top()])
        return moved

    def ray_at(self, place: QPointF) -> tuple[Float, Float]:
        """Return the ray at a position, px: (3,), mm, in front of all items, and (3,), unit."""
        box = self._inside()
        right, up, outward = self._orbit.axes()
        scale = 2.0 * self._orbit.radius / min(box.width(), box.height())
        x, y = place.x() - box.center().x(), place.y() - box.center().y()
        start: Float = self._orbit.target + scale * (x * right - y * up) + _EYE_MM * outward
        return start, -outward

    def shows(self, places: Float) -> bool:
        """Return whether places (n, 3), mm, world, are all in view."""
        seen = self.projected(places)
        return bool(((seen > 0.0) & (seen < (self.width(), self.height()))).all())

    def is_moving(self) -> bool:
        """Return whether the view is moving, so that coarse painting suffices."""
        return self._moving.isActive()

    def _inside(self) -> QRectF:
        return QRectF(self.rect()).adjusted(2.5, 2.5, -2.5, -2.5)

    def _moved(self, orbit: Orbit) -> None:
        self._moved_to(orbit)

    def _moved_to(self, orbit: Orbit) -> None:
        """Change the view; more changes may follow."""
        self._orbit = orbit
        self._moving.start()
        self.update()

    def _clicked(self, place: QPointF) -> None:
        """Handle a click without motion."""

    def _hovered(self, place: QPointF) -> None:
        """Handle mouse motion without buttons."""

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Paint coarsely during resizing, then in full."""
        super().resizeEvent(event)
        self._moving.start()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self._mouse = self._pressed = event.position()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Turn with the left button, pan with others."""
        if self._mouse is None:
            self._hovered(event.position())
            return
        if self._pressed is not None:
            away = event.position() - self._pressed
            if float(np.hypot(away.x(), away.y())) <= _CLICK_PX:
                return
            self._pressed = None
        delta = event.position() - self._mouse
        self._mouse = event.position()
        if event.buttons() & Qt.MouseButton.LeftButton:
            self.turn(-0.008 * delta.x(), 0.008 * delta.y())
        else:
            box = self._inside()
            scale = 2.0 * self._orbit.radius / min(box.width(), box.height())
            right, up, _ = self._orbit.axes()
            moved = self._orbit.target - scale * (delta.x() * right - delta.y() * up)
            self._moved(self._orbit.about(moved))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End turning; a press without motion is a click."""
        pressed, self._mouse, self._pressed = self._pressed, None, None
        if pressed is not None and event.button() == Qt.MouseButton.LeftButton:
            self._clicked(event.position())

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        self.fit()

    def wheelEvent(self, event: QWheelEvent) -> None:
        self._moved(self._orbit.zoomed(0.999 ** event.angleDelta().y()))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Turn with the arrows, zoom with plus and minus."""
        key = Qt.Key(event.key())
        if key in ARROWS:
            right, up = ARROWS[key]
            self.turn(_KEY_TURN * right, _KEY_TURN * up)
        elif key in (Qt.Key.Key_Plus, Qt.Key.Key_Equal):
            self._moved(self._orbit.zoomed(1.0 / 1.2))
        elif key is Qt.Key.Key_Minus:
            self._moved(self._orbit.zoomed(1.2))
        else:
            super().keyPressEvent(event)

    def turn(self, azimuth: float, elevation: float = 0.0) -> None:
        """Turn the view, rad, as mouse and arrow keys do."""
        self._moved(self._orbit.turned(azimuth, elevation))
