"""Plots of a tip calibration: reached directions, and quantities that must reach a target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QRadialGradient

from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, Points3, unit
from ocmm_gui.kit import (
    LEFT,
    RIGHT,
    SCENE_LEAST,
    SCENE_SIZE,
    PaintedWidget,
    fitted,
    ink,
    text_font,
    tr,
)
from ocmm_gui.views import upright

_RING = np.radians(15.0)
_WIDE = np.radians(60.0)
_LABELS = np.radians(22.5)
"""Position of the ring numbers: to the right, and down by this angle."""

_FOOT_PX = 24.0
_LEAST_REACH = np.radians(35.0)
_NEAR = np.radians(4.0)
"""Minimum distance from the mark for an arrow."""

_NOTHING: Points3 = np.empty((0, 3))
_NOWHERE: Float = np.full(3, np.nan)


@dataclass(frozen=True, slots=True)
class Mapped:
    """Contents of a map; unit vectors in the world frame."""

    middle: Float = field(default_factory=_NOWHERE.copy)
    """(3,): centre of the map; NaN leaves it empty."""
    done: Points3 = field(default_factory=_NOTHING.copy)
    open: Points3 = field(default_factory=_NOTHING.copy)
    """`done`, `open`: (n, 3): wanted and reached, wanted and not reached."""
    extra: Points3 = field(default_factory=_NOTHING.copy)
    """(n, 3): reached and not wanted."""
    aim: Float = field(default_factory=_NOWHERE.copy)
    """(3,): next one of ``open``; NaN: the one nearest to ``now``."""
    now: Float = field(default_factory=_NOWHERE.copy)
    """(3,): current direction; NaN while unknown."""
    spacing: float = float(np.radians(8.0))
    """rad: between neighbours."""


class SphereMap(PaintedWidget):
    """Directions about a centre, from above, cameras below; azimuthal equidistant."""

    def __init__(self, name: str, rig: Rig) -> None:
        super().__init__(name, SCENE_SIZE, SCENE_LEAST)
        self._up = upright(rig)
        seats = np.mean([camera.centre_world for camera in rig.cameras], axis=0)
        self._seat = unit(seats - rig.volume_world.mean(axis=0))
        self._mapped = Mapped()

    def show_map(self, mapped: Mapped) -> None:
        self._mapped = mapped
        total = len(mapped.done) + len(mapped.open)
        self.setAccessibleDescription(
            tr("{count} of %n directions", "{count} of 1 direction", total).format(
                count=len(mapped.done)
            )
        )
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        frame, theme, shown = self._paint_panel(painter), self._theme, self._mapped
        box = frame.adjusted(8.0, 8.0, -8.0, -_FOOT_PX)
        radius = 0.5 * min(box.width(), box.height()) - 4.0
        centre = box.center()
        reach = self._reach()
        self._paint_sphere(painter, centre, radius, reach)
        ink(painter, QColor(theme.muted), font=text_font(14))
        foot = QRectF(frame.left(), frame.bottom() - _FOOT_PX, frame.width(), _FOOT_PX - 2.0)
        painter.drawText(foot, Qt.AlignmentFlag.AlignCenter, tr("▼ cameras"))
        if not np.isfinite(shown.middle).all():
            painter.setFont(text_font(20))
            painter.drawText(box, Qt.AlignmentFlag.AlignCenter, tr("nothing yet"))
            return
        scale = radius / reach
        dot = max(0.42 * shown.spacing * scale, 4.0)
        for places, fill, edge, size in (
            (shown.extra, theme.zone_good, theme.good, 0.5 * dot),
            (shown.open, theme.background, theme.warn, dot),
            (shown.done, theme.good, theme.panel, dot),
        ):
            ink(painter, QPen(QColor(edge), 2.0), QColor(fill))
            for x, y in (scale * self._flat(places)).tolist():
                painter.drawEllipse(centre + QPointF(x, y), size, size)
        self._paint_now(painter, centre, scale, dot)

    def _paint_sphere(
        self, painter: QPainter, centre: QPointF, radius: float, reach: float
    ) -> None:
        theme = self._theme
        shade = QRadialGradient(centre, radius)
        shade.setColorAt(0.0, QColor(theme.panel))
        shade.setColorAt(1.0, QColor(theme.background))
        ink(painter, QPen(QColor(theme.border), 2.0), shade)
        painter.drawEllipse(centre, radius, radius)
        ink(painter, QPen(QColor(theme.border), 1.0), Qt.BrushStyle.NoBrush)
        step = _RING if reach < _WIDE else 2.0 * _RING
        rings = np.arange(step, reach, step).tolist()
        for ring in rings:
            painter.drawEllipse(centre, radius * ring / reach, radius * ring / reach)
        for across in (QPointF(radius, 0.0), QPointF(0.0, radius)):
            painter.drawLine(centre - across, centre + across)
        ink(painter, QColor(theme.muted), font=text_font(12))
        aside, below = np.cos(_LABELS), np.sin(_LABELS)
        for ring in rings:
            at = radius * ring / reach + 2.0
            painter.drawText(centre + QPointF(at * aside, at * below), f"{np.degrees(ring):.0f}°")

    def _paint_now(self, painter: QPainter, centre: QPointF, scale: float, dot: float) -> None:
        theme, shown = self._theme, self._mapped
        aim = shown.aim
        has_now = bool(np.isfinite(shown.now).all())
        if not np.isfinite(aim).all() and has_now and len(shown.open):
            aim = shown.open[int(np.argmax(shown.open @ shown.now))]
        if np.isfinite(aim).all():
            x, y = (scale * self._flat(aim[None]))[0].tolist()
            target = centre + QPointF(x, y)
            ink(painter, QPen(QColor(theme.text), 2.0), QColor(theme.accent))
            painter.drawEllipse(target, dot, dot)
        if not has_now:
            return
        x, y = (scale * self._flat(shown.now[None]))[0].tolist()
        place = centre + QPointF(x, y)
        if np.isfinite(aim).all() and float(aim @ shown.now) < np.cos(_NEAR):
            painter.setPen(QPen(QColor(theme.accent), 4.0, c=Qt.PenCapStyle.RoundCap))
            painter.drawLine(place, target)
        ink(painter, QPen(QColor(theme.text), 4.0), Qt.BrushStyle.NoBrush)
        painter.drawEllipse(place, 1.5 * dot, 1.5 * dot)
        painter.setBrush(QColor(theme.text))
        painter.drawEllipse(place, 3.0, 3.0)

    def _reach(self) -> float:
        """Return the angle from the centre to the rim, rad."""
        shown = self._mapped
        wanted = np.concatenate([shown.done, shown.open])
        if not len(wanted) or not np.isfinite(shown.middle).all():
            return float(_LEAST_REACH)
        widest = float(np.arccos(np.clip(wanted @ shown.middle, -1.0, 1.0)).max())
        return float(np.clip(widest + shown.spacing, _LEAST_REACH, np.pi))

    def _flat(self, directions: Points3) -> Float:
        """Return places (n, 2) of directions (n, 3) on the map, rad, x right, y down."""
        middle = self._mapped.middle
        toward = self._seat - (self._seat @ middle) * middle
        if float(np.linalg.norm(toward)) < 0.3:
            # Along the cameras' axis: up on the map is up.
            toward = (self._up @ middle) * middle - self._up
        down = unit(toward)
        right = np.cross(middle, down)
        angle = np.arccos(np.clip(directions @ middle, -1.0, 1.0))
        flat = np.stack([directions @ right, directions @ down], axis=1)
        length = np.maximum(np.linalg.norm(flat, axis=1), 1e-12)
        # Directions beyond the rim are shown at it.
        places: Float = flat * (np.minimum(angle, self._reach()) / length)[:, None]
        return places


_ROW_PX, _ROOMY_PX, _LEAST_PX, _BAR_PX = 46.0, 32.0, 18.0, 9.0


@dataclass(frozen=True, slots=True)
class Row:
    name: str
    value: str
    """`name`, `value`: caption, and value with unit and target."""
    share: float
    """Relative to the target, 1 if reached."""


class Bars(PaintedWidget):
    """Bars with names and values."""

    def __init__(self, name: str, rows: int) -> None:
        super().__init__(name, (240, round(_ROW_PX * rows)), (160, round(_LEAST_PX * rows)))
        self._rows: tuple[Row, ...] = ()

    def show_rows(self, rows: Sequence[Row]) -> None:
        if tuple(rows) != self._rows:
            self._rows = tuple(rows)
            self.setAccessibleDescription(", ".join(f"{row.name} {row.value}" for row in rows))
            self.update()

    def labels(self) -> tuple[str, ...]:
        return tuple(f"{row.name} {row.value}" for row in self._rows)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        high = min(self.height() / max(len(self._rows), 1), _ROW_PX)
        for index, row in enumerate(self._rows):
            whole = QRectF(0.5, index * high + 1.0, self.width() - 1.0, high - 3.0)
            # Without room for a bar below the text it is behind it.
            bar, text = QRectF(whole), whole.adjusted(4.0, 0.0, -4.0, 0.0)
            if high >= _ROOMY_PX:
                bar.setTop(whole.bottom() - _BAR_PX)
                text = QRectF(whole)
                text.setBottom(bar.top() - 1.0)
            self._paint_bar(painter, bar, row.share, behind=high < _ROOMY_PX)
            self._paint_words(painter, text, row)

    def _paint_bar(self, painter: QPainter, bar: QRectF, share: float, *, behind: bool) -> None:
        theme, done = self._theme, share >= 1.0
        ink(painter, QPen(QColor(theme.border), theme.border_px), QColor(theme.background))
        painter.drawRect(bar)
        bar.setWidth(bar.width() * min(max(share, 0.0), 1.0))
        fill = theme.good if done else theme.accent
        if behind:
            fill = theme.zone_good if done else theme.zone_warn
        painter.fillRect(bar, QColor(fill))

    def _paint_words(self, painter: QPainter, text: QRectF, row: Row) -> None:
        theme, done = self._theme, row.share >= 1.0
        value = f"{row.value} ✓" if done else row.value
        bold = text_font(18, bold=True)
        painter.setFont(fitted(bold, value, 0.5 * text.width(), text.height(), 20.0))
        painter.setPen(QColor(theme.text))
        painter.drawText(text, RIGHT, value)
        room = text.width() - painter.fontMetrics().horizontalAdvance(value) - 8.0
        painter.setFont(fitted(text_font(16), row.name, room, text.height(), 16.0))
        painter.setPen(QColor(theme.text))
        painter.drawText(text, LEFT, row.name)
