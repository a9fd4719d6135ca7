from __future__ import annotations

from math import cos, pi, sin

from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen

from ocmm_core.calibration.guided import VerificationView
from ocmm_core.camera import Rig
from ocmm_gui.kit import SCENE_LEAST, SCENE_SIZE, Painted, text_font, tr
from ocmm_gui.wizards.parts import CollectPage, Seen

_LAYERS = ((0.0, 1, 0.0), (22.5, 4, 0.0), (45.0, 8, 22.5), (67.5, 4, 45.0), (90.0, 8, 67.5))
"""Degrees below the pole, points, and turn of the layer: 25 points over a half sphere."""

_TILT = 0.42
"""Lean of the pole towards the eye, sine."""


class SpherePicture(Painted):
    """A half sphere with suggested touch points, from pole to equator."""

    def __init__(self) -> None:
        super().__init__(tr("Where to touch the sphere"), SCENE_SIZE, SCENE_LEAST)
        self._taken = 0
        self._title = ""

    def show_taken(self, taken: int, title: str) -> None:
        """Show the number of recorded points; the places are advice only."""
        if (taken, title) != (self._taken, self._title):
            self._taken, self._title = taken, title
            self.setAccessibleDescription(
                tr("{title}: %n points", "{title}: 1 point", taken).format(title=title)
            )
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        theme = self._theme
        frame = self._paint_panel(painter)
        painter.setPen(QColor(theme.text))
        painter.setFont(text_font(17, bold=True))
        painter.drawText(frame.adjusted(14, 10, -14, -10), Qt.AlignmentFlag.AlignTop, self._title)
        radius = 0.34 * min(frame.width(), frame.height())
        centre = QPointF(frame.center().x(), frame.center().y() - 0.04 * frame.height())
        painter.setPen(QPen(QColor(theme.muted), 0.16 * radius, c=Qt.PenCapStyle.FlatCap))
        painter.drawLine(
            QPointF(centre.x(), centre.y() + radius), QPointF(centre.x(), frame.bottom() - 4.0)
        )
        painter.setPen(QPen(QColor(theme.text), 2.0))
        painter.setBrush(QColor(theme.background))
        painter.drawEllipse(centre, radius, radius)
        number = 0
        for below, count, turn in _LAYERS:
            for index in range(count):
                around = 2.0 * pi * index / count + turn * pi / 180.0
                self._paint_place(painter, centre, radius, below * pi / 180.0, around, number)
                number += 1

    def _paint_place(
        self,
        painter: QPainter,
        centre: QPointF,
        radius: float,
        below: float,
        around: float,
        number: int,
    ) -> None:
        theme = self._theme
        x, z = sin(below) * cos(around), cos(below)
        toward = sin(below) * sin(around)
        lean = (1.0 - _TILT**2) ** 0.5
        up, depth = lean * z - _TILT * toward, _TILT * z + lean * toward
        place = QPointF(centre.x() + radius * x, centre.y() - radius * up)
        behind = depth < -0.05
        size = 5.0 if behind else 8.0
        done = number < self._taken
        painter.setPen(QPen(QColor(theme.border if behind else theme.text), 1.5))
        painter.setBrush(QColor(theme.good if done else theme.panel))
        if number == self._taken:
            painter.setBrush(QColor(theme.accent))
            size = 11.0
        painter.drawEllipse(place, size, size)


class SpheresPage(CollectPage):
    """Points on the spheres, one sphere after the other."""

    def __init__(self, rig: Rig) -> None:
        super().__init__(rig, tr("Points on spheres"))
        self.sphere = SpherePicture()
        self.beside.replaceWidget(self.picture, self.sphere)
        self.picture.hide()
        self.picture.setParent(self)

    def show_seen(self, seen: Seen) -> None:
        super().show_seen(seen)
        view = seen.view_as(VerificationView)
        if not view.spheres:
            self.sphere.show_taken(0, tr("No sphere chosen: press Next."))
            return
        open_ones = [i for i, taken in enumerate(view.spheres) if taken < view.sphere_points]
        number = open_ones[0] if open_ones else len(view.spheres) - 1
        taken = view.spheres[number]
        title = tr("Sphere {number} of {count}: {taken} of {sphere_points}").format(
            number=number + 1,
            count=len(view.spheres),
            taken=taken,
            sphere_points=view.sphere_points,
        )
        if view.places[number]:
            title += f", {view.places[number]}"
        self.sphere.show_taken(taken, title)
