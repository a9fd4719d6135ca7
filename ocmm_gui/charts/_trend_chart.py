"""One characteristic over a batch, with tolerance, control limits and U."""

from __future__ import annotations

import math

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen

from ocmm_core.inspection.archive import Trend
from ocmm_gui.kit import SCENE_LEAST, SCENE_SIZE, Painted, digit_font, kind_value, text_font, tr

_HEAD_PX, _FOOT_PX, _SCALE_PX = 34.0, 24.0, 112.0


class TrendChart(Painted):
    """Values as dots with their U; the field is the tolerance, dashed the limits."""

    def __init__(self) -> None:
        super().__init__(tr("Trend over the parts"), SCENE_SIZE, SCENE_LEAST)
        self._trend: Trend | None = None

    def show_trend(self, trend: Trend | None) -> None:
        self._trend = trend
        self.setAccessibleDescription("" if trend is None else _description(trend))
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        frame = self._paint_panel(painter)
        trend = self._trend
        if trend is None or not len(trend.values):
            return
        painter.setFont(text_font(15, bold=True))
        painter.setPen(QColor(self._theme.text))
        head = QRectF(frame.left() + 12.0, frame.top(), frame.width() - 24.0, _HEAD_PX)
        painter.drawText(head, Qt.AlignmentFlag.AlignVCenter, trend.name)
        box = frame.adjusted(_SCALE_PX, _HEAD_PX, -16.0, -_FOOT_PX)
        low, high = trend.span()
        self._paint_levels(painter, trend, box, low, high)
        self._paint_parts(painter, trend, box, low, high)

    def _paint_levels(
        self, painter: QPainter, trend: Trend, box: QRectF, low: float, high: float
    ) -> None:
        def y(value: float) -> float:
            return box.bottom() - (value - low) / (high - low) * box.height()

        top = y(min(trend.high, high))
        bottom = y(max(trend.low, low))
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(self._theme.zone_good))
        painter.drawRect(QRectF(box.left(), top, box.width(), bottom - top))
        painter.setFont(digit_font(12, bold=False))
        levels: list[tuple[str, float, Qt.PenStyle]] = [
            (tr("limit"), value, Qt.PenStyle.SolidLine)
            for value in (trend.low, trend.high)
            if math.isfinite(value)
        ]
        if trend.chart is not None:
            levels += [
                (tr("mean"), trend.chart.centre, Qt.PenStyle.DotLine),
                (tr("UCL"), trend.chart.high, Qt.PenStyle.DashLine),
                (tr("LCL"), trend.chart.low, Qt.PenStyle.DashLine),
            ]
        taken: list[float] = []
        for name, value, style in levels:
            painter.setPen(QPen(QColor(self._theme.text), 1.4, style))
            painter.drawLine(QPointF(box.left(), y(value)), QPointF(box.right(), y(value)))
            # Avoid overlapping labels.
            if all(abs(y(value) - other) > 15.0 for other in taken):
                taken.append(y(value))
                place = QRectF(box.left() - _SCALE_PX + 6.0, y(value) - 9.0, _SCALE_PX - 12.0, 18.0)
                right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
                painter.drawText(place, right, f"{name} {kind_value(trend.kind, value, 3)}")

    def _paint_parts(
        self, painter: QPainter, trend: Trend, box: QRectF, low: float, high: float
    ) -> None:
        warned = {index for index, _ in trend.chart.signals} if trend.chart is not None else set()
        scale = box.height() / (high - low)
        step = box.width() / max(len(trend.parts), 1)
        size = min(max(0.4 * step, 2.0), 5.0)
        before: QPointF | None = None
        marks: list[tuple[QPointF, bool]] = []
        counted = -1
        for index, part in enumerate(trend.parts):
            x = box.left() + (index + 0.5) * step
            if part.value is None or part.uncertainty is None:
                painter.setFont(text_font(13, bold=True))
                painter.setPen(QColor(self._theme.muted))
                painter.drawText(QPointF(x - 4.0, box.bottom() - 4.0), "?")
                continue
            counted += 1
            place = QPointF(x, box.bottom() - (part.value - low) * scale)
            reach = part.uncertainty * scale
            painter.setPen(QPen(QColor(self._theme.muted), 1.2))
            if before is not None:
                painter.drawLine(before, place)
            painter.drawLine(place - QPointF(0.0, reach), place + QPointF(0.0, reach))
            marks.append((place, counted in warned))
            before = place
        painter.setPen(QPen(QColor(self._theme.text), min(1.6, 0.4 * size)))
        # Noteworthy dots last: on top.
        for place, odd in sorted(marks, key=lambda one: one[1]):
            painter.setBrush(QColor(self._theme.bad if odd else self._theme.accent))
            if odd:
                painter.drawRect(QRectF(place.x() - 6.0, place.y() - 6.0, 12.0, 12.0))
            else:
                painter.drawEllipse(place, size, size)
        painter.setFont(text_font(12))
        painter.setPen(QColor(self._theme.muted))
        foot = QRectF(box.left(), box.bottom(), box.width(), _FOOT_PX)
        centre = Qt.AlignmentFlag.AlignVCenter
        painter.drawText(foot, centre | Qt.AlignmentFlag.AlignLeft, trend.parts[0].serial)
        painter.drawText(foot, centre | Qt.AlignmentFlag.AlignRight, trend.parts[-1].serial)


def _description(trend: Trend) -> str:
    values = trend.values
    if not len(values):
        return tr("{name}: no parts included").format(name=trend.name)
    signals = 0 if trend.chart is None else len(trend.chart.signals)
    return tr(
        "{name}: %n parts, {least} to {most}, {signals}",
        "{name}: 1 part, {least} to {most}, {signals}",
        len(values),
    ).format(
        name=trend.name,
        least=kind_value(trend.kind, float(values.min()), 4),
        most=kind_value(trend.kind, float(values.max()), 4),
        signals=tr("%n signals", "1 signal", signals),
    )
