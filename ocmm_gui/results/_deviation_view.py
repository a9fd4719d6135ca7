"""The part with its deviations as whiskers, and the scale below them."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QKeyEvent, QMouseEvent, QPaintEvent, QWheelEvent

from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import JobView
from ocmm_core.tolerances.decisions import NO_DEVIATIONS
from ocmm_gui.kit import Painted, Theme, text_font, tr
from ocmm_gui.views import (
    SCALE_PX,
    Item,
    Orbit,
    deviations_of,
    job_items,
    paint_scale,
    paint_scene,
    scale_words,
)

_START = np.radians(38.0)
_TURN = np.radians(10.0)
_UP = np.array([0.0, 0.0, 1.0])


class DeviationView(Painted):
    """A 3-D view of a job: arrow keys or the mouse turn it, plus and minus or the wheel zoom."""

    def __init__(self) -> None:
        super().__init__(tr("Deviations of the touched places"), (420, 260), (240, 170))
        self._job: JobView | None = None
        self._seen = NO_DEVIATIONS
        self._items: tuple[Item, ...] = ()
        self._reach = np.empty((0, 3))
        self._orbit = Orbit(np.zeros(3), 0.5, float(_START), 100.0, _UP)
        self._mouse: QPointF | None = None
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.hide()

    def show_job(self, job: JobView, up: Float | None) -> None:
        """Show the deviations of a job; a job without any hides it.

        Parameters
        ----------
        up
            (3,), unit, world: upright in the picture; None leaves it as it is.
        """
        if job is self._job:
            return
        self._job = job
        self._seen = deviations_of(job)
        if up is not None:
            self._orbit = Orbit(np.zeros(3), 0.5, float(_START), 100.0, up)
        self._make()
        self._fit()
        self.setVisible(bool(self._seen.whiskers))
        self.setAccessibleDescription(
            ". ".join(
                (*scale_words(self._seen), tr("Arrow keys rotate the view, plus and minus zoom."))
            )
            if self._seen.whiskers
            else ""
        )
        self.update()

    def set_theme(self, theme: Theme) -> None:
        """Paint with ``theme`` from now on."""
        self._theme = theme
        self._make()
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the part, its whiskers and the scale."""
        painter = self._painter()
        inside = QRectF(self._paint_panel(painter)).adjusted(2, 2, -2, -2)
        paint_scene(
            painter, self._items, self._orbit, self._scene_box(inside), text_font(13),
            self._theme.panel,
        )  # fmt: skip
        wide, high = min(SCALE_PX[0] + 120.0, inside.width() - 16.0), SCALE_PX[1]
        below = QRectF(inside.left() + 8.0, inside.bottom() - high, wide, high)
        paint_scale(painter, below, self._seen, self._theme)

    def resizeEvent(self, event: object) -> None:
        """Show all of it in the new size."""
        self._fit()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Begin to turn."""
        self._mouse = event.position()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Turn."""
        if self._mouse is not None:
            moved = event.position() - self._mouse
            self._mouse = event.position()
            self._turn(-0.008 * moved.x(), 0.008 * moved.y())

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End turning."""
        self._mouse = None

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom."""
        self._zoom(0.999 ** event.angleDelta().y())

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Turn with the arrows, zoom with plus and minus."""
        turns = {
            Qt.Key.Key_Left: (-_TURN, 0.0), Qt.Key.Key_Right: (_TURN, 0.0),
            Qt.Key.Key_Up: (0.0, _TURN), Qt.Key.Key_Down: (0.0, -_TURN),
        }  # fmt: skip
        key = Qt.Key(event.key())
        if key in turns:
            self._turn(*turns[key])
        elif key in (Qt.Key.Key_Plus, Qt.Key.Key_Equal):
            self._zoom(1.0 / 1.2)
        elif key is Qt.Key.Key_Minus:
            self._zoom(1.2)
        else:
            super().keyPressEvent(event)

    def _scene_box(self, inside: QRectF) -> QRectF:
        return inside.adjusted(0.0, 0.0, 0.0, -SCALE_PX[1] - 4.0)

    def _turn(self, azimuth: float, elevation: float) -> None:
        self._orbit = self._orbit.turned(azimuth, elevation)
        self.update()

    def _zoom(self, factor: float) -> None:
        self._orbit = self._orbit.zoomed(factor)
        self.update()

    def _make(self) -> None:
        if self._job is None:
            return
        self._items, reach = job_items(self._job, self._theme)
        ends = [whisker.end_world for whisker in self._seen.whiskers]
        self._reach = np.concatenate([reach, np.array(ends).reshape(-1, 3)])

    def _fit(self) -> None:
        if len(self._reach):
            box = self._scene_box(QRectF(self.rect()))
            self._orbit = self._orbit.fitted(
                self._reach, box.width(), max(box.height(), 10.0), margin=1.2
            )
