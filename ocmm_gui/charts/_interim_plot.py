"""Interim checks over time: errors, centre, and the hard limit."""

from __future__ import annotations

import math
from collections.abc import Callable

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen

from ocmm_core.acceptance import InterimChart, InterimWord
from ocmm_gui.charts._plot import Plot
from ocmm_gui.kit import digit_font, localised, said_word, text_font, tr

_SCALE_PX, _FOOT_PX = 84.0, 24.0
_SIGMAS = 3.0


class InterimPlot(Plot):
    """One dot per check: round if good, otherwise square."""

    def __init__(self) -> None:
        super().__init__(tr("Interim checks, error in µm"))
        self._chart: InterimChart | None = None
        self._say(tr("no checks yet"))

    def show_chart(self, chart: InterimChart) -> None:
        self._chart = chart
        if not chart.points:
            self._say(tr("no checks yet"))
            return
        last = chart.points[-1]
        said = tr(
            "%n checks, last {error:+.1f} µm: {word}",
            "1 check, last {error:+.1f} µm: {word}",
            len(chart.points),
        ).format(error=1e3 * last.check.error_mm, word=said_word(last.word.value))
        self._say(f"{said_word(chart.doubt)}   {said}" if chart.doubt else said)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        box = self._paint_head(painter).adjusted(_SCALE_PX, 4.0, -8.0, -_FOOT_PX)
        chart, theme = self._chart, self._theme
        painter.setPen(QPen(QColor(theme.border), max(theme.border_px, 1)))
        painter.setBrush(QColor(theme.background))
        painter.drawRect(box)
        if chart is None or not chart.points:
            return
        errors = [one.check.error_mm for one in chart.points]
        shown = [one for one in errors if math.isfinite(one)]
        limit = max(one.check.limit_mm for one in chart.points)
        reach = 1.1 * max([limit, *(abs(one) for one in shown)])

        def y(value: float) -> float:
            return box.center().y() - 0.5 * box.height() * value / reach

        painter.fillRect(
            QRectF(box.left(), y(limit), box.width(), y(-limit) - y(limit)), QColor(theme.zone_good)
        )
        self._paint_levels(painter, box, chart, limit, y)
        self._paint_checks(painter, box, chart, y)
        painter.setFont(text_font(12))
        painter.setPen(QColor(theme.muted))
        foot = QRectF(box.left(), box.bottom() + 2.0, box.width(), _FOOT_PX - 2.0)
        centre = Qt.AlignmentFlag.AlignVCenter
        painter.drawText(foot, centre | Qt.AlignmentFlag.AlignLeft, chart.points[0].check.utc[:16])
        painter.drawText(
            foot, centre | Qt.AlignmentFlag.AlignRight, chart.points[-1].check.utc[:16]
        )

    def _paint_levels(
        self,
        painter: QPainter,
        box: QRectF,
        chart: InterimChart,
        limit: float,
        y: Callable[[float], float],
    ) -> None:  # fmt: skip
        levels = [(tr("limit"), limit, Qt.PenStyle.SolidLine)]
        levels += [(tr("limit"), -limit, Qt.PenStyle.SolidLine)]
        if math.isfinite(chart.centre):
            spread = _SIGMAS * chart.sigma
            levels += [
                (tr("centre"), chart.centre, Qt.PenStyle.DotLine),
                (tr("+3 s"), chart.centre + spread, Qt.PenStyle.DashLine),
                (tr("-3 s"), chart.centre - spread, Qt.PenStyle.DashLine),
            ]
        painter.setFont(digit_font(12, bold=False))
        taken: list[float] = []
        for name, value, style in levels:
            painter.setPen(QPen(QColor(self._theme.text), 1.4, style))
            painter.drawLine(QPointF(box.left(), y(value)), QPointF(box.right(), y(value)))
            if all(abs(y(value) - other) > 15.0 for other in taken):
                taken.append(y(value))
                place = QRectF(0.0, y(value) - 9.0, _SCALE_PX - 6.0, 18.0)
                right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
                painter.drawText(place, right, localised(f"{name} {1e3 * value:+.1f}"))

    def _paint_checks(
        self, painter: QPainter, box: QRectF, chart: InterimChart, y: Callable[[float], float]
    ) -> None:
        theme = self._theme
        pitch = box.width() / len(chart.points)
        colours = {
            InterimWord.GOOD: theme.good, InterimWord.LEARNING: theme.accent,
            InterimWord.REPEAT: theme.warn, InterimWord.STOP: theme.bad,
        }  # fmt: skip
        for index, one in enumerate(chart.points):
            x = box.left() + (index + 0.5) * pitch
            painter.setPen(QPen(QColor(theme.text), 1.2))
            painter.setBrush(QColor(colours[one.word]))
            if not math.isfinite(one.check.error_mm):
                painter.drawText(QPointF(x - 4.0, box.bottom() - 4.0), "?")
            elif one.word in (InterimWord.GOOD, InterimWord.LEARNING):
                painter.drawEllipse(QPointF(x, y(one.check.error_mm)), 5.0, 5.0)
            else:
                painter.drawRect(QRectF(x - 6.0, y(one.check.error_mm) - 6.0, 12.0, 12.0))
