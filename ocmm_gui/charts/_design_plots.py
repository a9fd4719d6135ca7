"""Plots of the probe's design: maps of the tip uncertainty, and probe bending."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QBrush, QColor, QPainter, QPaintEvent, QPen, QPolygonF

from ocmm_core.calibration.probe_design import TipMap
from ocmm_core.geometry import Float
from ocmm_core.measuring import Mechanics, colour_at
from ocmm_gui.charts._plot import Plot
from ocmm_gui.kit import LEFT, RIGHT, fitted, ink, localised, text_font, tr

_LEFT_PX, _FOOT_PX, _SCALE_PX = 44.0, 36.0, 70.0
_CENTRE = Qt.AlignmentFlag.AlignCenter
_HATCHED = Qt.BrushStyle.BDiagPattern


class MapPlot(Plot):
    """A map of the tip's uncertainty as coloured cells, with its scale in um."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self._map: TipMap | None = None
        self._limits = (0.0, 1.0)

    def show_map(self, found: TipMap, limits: tuple[float, float]) -> None:
        """Show a map on a scale shared with others."""
        self._map, self._limits = found, limits
        known = found.space_um[np.isfinite(found.space_um)]
        span = tr("{least:.1f} to {most:.1f} µm")
        if known.size < found.space_um.size:
            span = tr("{least:.1f} to {most:.1f} µm; hatched: not seen")
        self._show_message(
            span.format(least=known.min(), most=known.max()) if known.size else tr("nothing seen")
        )

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        box = self._paint_head(painter).adjusted(_LEFT_PX, 4.0, -_SCALE_PX, -_FOOT_PX)
        if self._map is None or box.height() < 20.0:
            return
        rows, columns = self._map.space_um.shape
        wide, high = box.width() / columns, box.height() / rows
        low, top = self._limits
        for row in range(rows):
            for column in range(columns):
                value = float(self._map.space_um[row, column])
                cell = QRectF(
                    box.left() + column * wide, box.bottom() - (row + 1) * high,
                    wide + 0.6, high + 0.6,
                )  # fmt: skip
                if np.isfinite(value):
                    painter.fillRect(cell, QColor(colour_at((value - low) / (top - low))))
                else:
                    painter.fillRect(cell, QBrush(QColor(self._theme.muted), _HATCHED))
        ink(painter, QColor(self._theme.text), font=text_font(13))
        self._paint_axes(painter, box, self._map)
        self._paint_scale(painter, box)

    def _paint_axes(self, painter: QPainter, box: QRectF, found: TipMap) -> None:
        for share in (0.0, 0.5, 1.0):
            x, y = box.left() + share * box.width(), box.bottom() - share * box.height()
            across = f"{_at(found.columns, share):.0f}"
            painter.drawText(QRectF(x - 30.0, box.bottom() + 1.0, 60.0, 16.0), _CENTRE, across)
            y = min(max(y, box.top() + 8.0), box.bottom() - 8.0)
            along = f"{_at(found.rows, share):.0f}"
            painter.drawText(QRectF(box.left() - 46.0, y - 8.0, 42.0, 16.0), RIGHT, along)
        painter.setPen(QColor(self._theme.muted))
        names = tr("across: {across}   up: {up}").format(across=found.names[0], up=found.names[1])
        painter.setFont(fitted(text_font(13), names, self.width(), 17.0, 13))
        painter.drawText(QRectF(0.0, box.bottom() + 17.0, self.width(), 17.0), _CENTRE, names)

    def _paint_scale(self, painter: QPainter, box: QRectF) -> None:
        painter.setFont(text_font(13))
        steps, left = 40, box.right() + 10.0
        high = box.height() / steps
        for step in range(steps):
            painter.fillRect(
                QRectF(left, box.bottom() - (step + 1) * high, 12.0, high + 0.6),
                QColor(colour_at((step + 0.5) / steps)),
            )
        painter.setPen(QColor(self._theme.text))
        low, top = self._limits
        for share in (0.0, 0.5, 1.0):
            y = box.bottom() - share * box.height()
            y = min(max(y, box.top() + 8.0), box.bottom() - 8.0)
            place = QRectF(left + 16.0, y - 8.0, _SCALE_PX - 26.0, 16.0)
            painter.drawText(place, LEFT, localised(f"{low + share * (top - low):.1f}"))


class BendingPlot(Plot):
    """Sag of the level probe, and its deflection by 1 N on the ball."""

    def __init__(self) -> None:
        super().__init__(tr("Bending"))
        self._found: Mechanics | None = None

    def show_mechanics(self, found: Mechanics | None) -> None:
        """Show the lines of a design; None for an unknown design."""
        self._found = found
        self._show_message(
            tr("design not known") if found is None else tr("marks: LEDs; dashed: hand")
        )

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        box = self._paint_head(painter).adjusted(_LEFT_PX, 2.0, -14.0, -4.0)
        found = self._found
        if found is None or box.height() < 80.0:
            return
        half = 0.5 * box.height()
        for index, (line, words) in enumerate(
            (
                (found.sag_line_nm, tr("sag, held level / nm")),
                (found.side_line_nm, tr("1 N on the ball / nm")),
            )
        ):
            part = QRectF(box.left(), box.top() + index * half, box.width(), half)
            self._paint_line(painter, part, found, line, words)

    def _paint_line(
        self, painter: QPainter, part: QRectF, found: Mechanics, line: Float, words: str
    ) -> None:
        theme = self._theme
        ink(painter, QColor(theme.muted), font=text_font(13))
        painter.drawText(QRectF(part.left(), part.top(), part.width(), 16.0), RIGHT, words)
        room = part.adjusted(0.0, 18.0, 0.0, -8.0)
        low, top = min(float(line.min()), 0.0), max(float(line.max()), 0.0)
        span, length = max(top - low, 1e-9), float(found.x_mm[-1])

        def place(x_mm: float, value: float) -> QPointF:
            return QPointF(
                room.left() + x_mm / length * room.width(),
                room.bottom() - (value - low) / span * room.height(),
            )

        painter.setPen(QPen(QColor(theme.border), 1.0))
        painter.drawLine(place(0.0, 0.0), place(length, 0.0))
        painter.setPen(QPen(QColor(theme.muted), 1.0, Qt.PenStyle.DashLine))
        painter.drawLine(place(found.handle_mm, low), place(found.handle_mm, top))
        painter.setPen(QPen(QColor(theme.accent), 2.0))
        painter.drawPolyline(
            QPolygonF([place(float(x), float(y)) for x, y in zip(found.x_mm, line, strict=True)])
        )
        painter.setPen(QPen(QColor(theme.text), 2.0))
        for led in set(found.leds_mm):
            at = place(led, 0.0)
            painter.drawLine(at - QPointF(0.0, 4.0), at + QPointF(0.0, 4.0))
        for value in (low, top):
            y = place(0.0, value).y()
            painter.drawText(QRectF(0.0, y - 8.0, _LEFT_PX - 5.0, 16.0), RIGHT, f"{round(value)}")


def _at(values: Float, share: float) -> float:
    return float(values[0] + share * (values[-1] - values[0]))
