"""Where the points lie that drive a value: features in 3-D, these points marked by shape."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QRectF
from PySide6.QtGui import QPaintEvent

from ocmm_core.geometry import Float
from ocmm_core.inspection.causes import Explanation, points_words
from ocmm_core.inspection.evaluation import JobView
from ocmm_gui.kit import Theme, text_font, tr
from ocmm_gui.scene import Diamonds, Item, Orbit, OrbitView, Tag, paint_scene
from ocmm_gui.views import job_items

_START = np.radians(38.0)
_UP = np.array([0.0, 0.0, 1.0])
_ROOM = 1.5
"""Of the points and their features to the edge of the picture."""


class DrivingPoints(OrbitView):
    """A small 3-D view: arrow keys or the mouse turn it, plus and minus or the wheel zoom."""

    def __init__(self) -> None:
        start = Orbit(np.zeros(3), 0.5, float(_START), 100.0, _UP)
        super().__init__(tr("Points that determine the value"), (420, 220), (220, 130), start)
        self._job: JobView | None = None
        self._explained: Explanation | None = None
        self._items: tuple[Item, ...] = ()
        self._reach = np.empty((0, 3))

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

    def fit(self) -> None:
        """Show all of it."""
        self._fit()
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
