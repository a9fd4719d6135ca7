"""Where the points lie that drive a value: features in 3-D, these points marked by shape."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QKeyEvent, QMouseEvent, QPaintEvent, QWheelEvent

from ocmm_core.geometry import Float
from ocmm_core.inspection.causes import Explanation, points_words
from ocmm_core.inspection.evaluation import JobView
from ocmm_gui.kit import Painted, Theme, text_font, tr
from ocmm_gui.views import Diamonds, Item, Orbit, Tag, job_items, paint_scene

_START = np.radians(38.0)
_TURN = np.radians(10.0)
_UP = np.array([0.0, 0.0, 1.0])
_ROOM = 1.5
"""Of the points and their features to the edge of the picture."""


class DrivingPoints(Painted):
    """A small 3-D view: arrow keys or the mouse turn it, plus and minus or the wheel zoom."""

    def __init__(self) -> None:
        super().__init__(tr("Points that determine the value"), (420, 220), (220, 130))
        self._job: JobView | None = None
        self._explained: Explanation | None = None
        self._items: tuple[Item, ...] = ()
        self._reach = np.empty((0, 3))
        self._orbit = Orbit(np.zeros(3), 0.5, float(_START), 100.0, _UP)
        self._mouse: QPointF | None = None
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)

    def show_points(self, job: JobView | None, explained: Explanation | None, up: Float) -> None:
        """Mark the points of an explanation in a job; without any nothing is shown.

        Parameters
        ----------
        up
            (3,), unit, world: upright in the picture.
        """
        if job is self._job and explained == self._explained:
            return
        self._job, self._explained = job, explained
        self._orbit = Orbit(np.zeros(3), 0.5, float(_START), 100.0, up)
        self._make()
        self._fit()
        numbers = () if explained is None else self.marked()
        self.setVisible(bool(numbers))
        self.setAccessibleDescription(
            tr("Marked: {points_words}. Arrow keys rotate the view, plus and minus zoom.").format(
                points_words=points_words(numbers)
            )
            if numbers
            else ""
        )
        self.update()

    def marked(self) -> tuple[int, ...]:
        """Return the numbers of the points that are marked."""
        if self._job is None or self._explained is None:
            return ()
        there = {point.number for item in self._job.features for point in item.points}
        return tuple(number for number in self._explained.points if number in there)

    def set_theme(self, theme: Theme) -> None:
        """Paint with ``theme`` from now on."""
        self._theme = theme
        self._make()
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the features, and the marks above them."""
        painter = self._painter()
        inside = self._paint_panel(painter).adjusted(2, 2, -2, -2)
        if self._job is not None:
            paint_scene(
                painter, self._items, self._orbit, QRectF(inside), text_font(13),
                self._theme.panel,
            )  # fmt: skip

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

    def _turn(self, azimuth: float, elevation: float) -> None:
        self._orbit = self._orbit.turned(azimuth, elevation)
        self.update()

    def _zoom(self, factor: float) -> None:
        self._orbit = self._orbit.zoomed(factor)
        self.update()

    def _make(self) -> None:
        if self._job is None or self._explained is None:
            self._items, self._reach = (), np.empty((0, 3))
            return
        numbers = set(self.marked())
        touched = [
            item for item in self._job.features
            if item.name in self._explained.finding.features
            or any(point.number in numbers for point in item.points)
        ]  # fmt: skip
        places = {
            point.number: point.surface_world
            for item in self._job.features for point in item.points if point.number in numbers
        }  # fmt: skip
        items, _ = job_items(self._job, self._theme)
        tags = [
            Tag(place, tr("point {number}").format(number=number), self._theme.text)
            for number, place in places.items()
        ]
        marks = (
            [Diamonds(np.stack(list(places.values())), self._theme.text, 17.0)] if places else []
        )
        # The words of the marks have the right of way.
        self._items = (*tags, *items, *marks)
        near = [point.surface_world for item in touched for point in item.points]
        self._reach = np.array(near) if near else np.empty((0, 3))

    def _fit(self) -> None:
        if len(self._reach):
            self._orbit = self._orbit.fitted(
                self._reach, float(self.width()), float(self.height()), margin=_ROOM
            )
