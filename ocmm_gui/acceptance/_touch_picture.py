"""Pictures of a planned position: touch points or artefact pose."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen

from ocmm_core.acceptance import AcceptanceView, PlannedPosition
from ocmm_core.geometry import Float, unit
from ocmm_gui.kit import SCENE_LEAST, PaintedWidget, Theme, ink, said, text_font, tr
from ocmm_gui.scene import Dots, Item, Lines, Tag
from ocmm_gui.wizards.pages import BarPlace, Contents, bars

_UP = np.array([0.0, 0.0, 1.0])
_TILT = np.radians(25.0)
"""The view is tilted, so that the sphere's pole is visible."""


class TouchPicture(PaintedWidget):
    """A sphere with touch points, the next highlighted; ``away`` (3,), unit: cameras to volume."""

    def __init__(self, away: Float) -> None:
        super().__init__(tr("Where to touch"), (300, 300), SCENE_LEAST)
        self._away = away
        self._normals: Float = np.empty((0, 3))
        self._next, self._title = 0, ""

    def show_normals(self, normals: Float, following: int, title: str) -> None:
        """Show touch directions (n, 3), and the number already recorded."""
        self._normals, self._next, self._title = normals, following, title
        self.setAccessibleDescription(
            tr("{title}: point {next} of {count}").format(
                title=title, next=following + 1, count=len(normals)
            )
        )
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        theme = self._theme
        frame = self._paint_panel(painter)
        ink(painter, QColor(theme.text), font=text_font(16, bold=True))
        painter.drawText(frame.adjusted(12, 8, -12, -8), Qt.AlignmentFlag.AlignTop, self._title)
        if not len(self._normals):
            return
        radius = 0.36 * min(frame.width(), frame.height())
        centre = QPointF(frame.center().x(), frame.center().y() + 0.03 * frame.height())
        ink(painter, QPen(QColor(theme.text), 2.0), QColor(theme.background))
        painter.drawEllipse(centre, radius, radius)
        right = unit(np.cross(self._away, _UP))
        level = unit(np.cross(_UP, right))
        toward = -np.cos(_TILT) * level + np.sin(_TILT) * _UP
        above = np.cross(toward, right)
        for number, normal in enumerate(self._normals):
            if number != self._next:
                self._dot(painter, theme, centre, radius, normal, (right, above, toward), number)
        if self._next < len(self._normals):
            normal = self._normals[self._next]
            self._dot(painter, theme, centre, radius, normal, (right, above, toward), self._next)

    def _dot(
        self, painter: QPainter, theme: Theme, centre: QPointF, radius: float, normal: Float,
        axes: Sequence[Float], number: int,
    ) -> None:  # fmt: skip
        x, y, depth = (float(normal @ axis) for axis in axes)
        behind = depth < -0.05
        place = QPointF(centre.x() + radius * x, centre.y() - radius * y)
        done, following = number < self._next, number == self._next
        size = 11.0 if following else 5.0 if behind else 8.0
        outline = theme.text if following else theme.border if behind else theme.muted
        fill = theme.accent if following else theme.good if done else theme.panel
        ink(painter, QPen(QColor(outline), 2.0 if following else 1.4), QColor(fill))
        painter.drawEllipse(place, size, size)
        if following:
            ink(painter, QColor(theme.text), font=text_font(15, bold=True))
            painter.drawText(place + QPointF(14.0, 5.0), f"{number + 1}")


def planned_places(view: AcceptanceView) -> tuple[BarPlace, ...]:
    """Return the positions of a test as places in the volume."""
    found = []
    for one, done in zip(view.positions, view.done, strict=True):
        points = np.array(one.points_world)
        ends = points[[0, -1]]
        length = float(np.linalg.norm(ends[1] - ends[0])) or 1.0
        shares = tuple(float(np.linalg.norm(point - ends[0])) / length for point in points)
        # Repeats are sequential: the marks start again.
        per = len(points)
        taken = done if done == per * one.repeats else done % per
        nests = per if done < per * one.repeats else done
        found.append(BarPlace(said(one.name), ends, nests, taken, shares))
    return tuple(found)


def position_contents(view: AcceptanceView) -> Contents:
    """Return the picture of a test in the volume: bars as lines, others as places."""
    lines = [one for one in view.positions if one.role == "bar"]
    current = view.current if view.current >= 0 else None
    if lines and len(lines) == len(view.positions):
        return bars(planned_places(view), current)

    def contents(theme: Theme) -> Sequence[Item]:
        items: list[Item] = []
        for one, done in zip(view.positions, view.done, strict=True):
            colour = theme.good if done == len(one.points_world) * one.repeats else theme.panel
            items.append(Dots(_middle(one)[None], colour, 14.0, theme.muted))
        if current is not None:
            plan = view.positions[current]
            point = np.array(plan.points_world[view.next_item])
            middle = _middle(plan)
            items.append(Dots(middle[None], theme.accent, 20.0, theme.text))
            if plan.normals:
                arm = middle + 60.0 * unit(point - middle)
                items.append(Lines(np.stack([middle, arm])[None], theme.accent, 3.0))
            elif float(np.linalg.norm(point - middle)) > 1.0:
                items.append(Dots(point[None], theme.warn, 16.0, theme.text))
            items.append(Tag(middle, said(plan.name), theme.accent))
        return items

    return contents


def _middle(one: PlannedPosition) -> Float:
    points = np.array(one.points_world)
    middle: Float = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return middle
