"""Mouse and keys over the 3-D view while they lead the ball, not the view."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QEvent, QObject, QPointF, Qt, Signal
from PySide6.QtGui import QKeyEvent, QMouseEvent, QWheelEvent

from ocmm_gui.scene import OrbitView

_LEAN = float(np.radians(5.0))
_WHEEL_MM = 1.5
"""For each notch of a wheel, which is 120."""
_NOTCH = 120.0


class BallLead(QObject):
    """Turn what is done in a view into where the ball shall be.

    Moving leads, the left button touches, the wheel brings nearer, the arrow keys lean the probe.
    The right button turns the view and the middle one moves it, as long as this leads.

    Parameters
    ----------
    view
        Whose mouse and keys.
    parent
        Outlives neither the view nor the window.
    """

    pointed = Signal(object, object)
    """Emits a ray of the eye: (3,), mm, and (3,), unit, world."""
    touched = Signal(object, object)
    """Emits the same where somebody pressed."""
    nearer = Signal(float)
    """Emits how much nearer to the surface, mm."""
    leaned = Signal(float, float)
    """Emits how far to the right and back, rad."""

    def __init__(self, view: OrbitView, parent: QObject) -> None:
        super().__init__(parent)
        self._view = view
        self._leads = False
        self._turned: QPointF | None = None

    def set_leading(self, leads: bool) -> None:
        """Lead the ball from now on, or the view."""
        if leads is self._leads:
            return
        self._leads, self._turned = leads, None
        self._view.setMouseTracking(leads)
        if leads:
            self._view.installEventFilter(self)
            self._view.setCursor(Qt.CursorShape.CrossCursor)
        else:
            self._view.removeEventFilter(self)
            self._view.unsetCursor()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Take what leads the ball; leave the rest to the view."""
        kind = event.type()
        if isinstance(event, QWheelEvent):
            self.nearer.emit(_WHEEL_MM * event.angleDelta().y() / _NOTCH)
            return True
        if isinstance(event, QMouseEvent):
            return self._mouse(kind, event)
        if isinstance(event, QKeyEvent) and kind is QEvent.Type.KeyPress:
            return self._key(event)
        return super().eventFilter(watched, event)

    def _mouse(self, kind: QEvent.Type, event: QMouseEvent) -> bool:
        place, button = event.position(), event.button()
        if kind is QEvent.Type.MouseMove:
            if self._turned is not None:
                way = place - self._turned
                self._turned = place
                self._view.turn(-0.008 * way.x(), 0.008 * way.y())
                return True
            if event.buttons() & Qt.MouseButton.MiddleButton:
                return False
            self.pointed.emit(*self._view.ray_at(place))
            return True
        if kind is QEvent.Type.MouseButtonDblClick and button is Qt.MouseButton.LeftButton:
            # Two clicks are two touches; the second comes while the first is made.
            return True
        if kind is QEvent.Type.MouseButtonPress and button is Qt.MouseButton.LeftButton:
            self._view.setFocus()
            self.touched.emit(*self._view.ray_at(place))
            return True
        if button is Qt.MouseButton.RightButton:
            self._turned = place if kind is QEvent.Type.MouseButtonPress else None
            return True
        return button is not Qt.MouseButton.MiddleButton

    def _key(self, event: QKeyEvent) -> bool:
        leans = {
            Qt.Key.Key_Left: (-_LEAN, 0.0),
            Qt.Key.Key_Right: (_LEAN, 0.0),
            Qt.Key.Key_Up: (0.0, _LEAN),
            Qt.Key.Key_Down: (0.0, -_LEAN),
        }
        lean = leans.get(Qt.Key(event.key()))
        if lean is None:
            return False
        self.leaned.emit(*lean)
        return True
