"""Results against tolerances: one deviation with uncertainty, and a characteristic of a batch."""

from __future__ import annotations

import math
from dataclasses import dataclass

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QPolygonF

from ocmm_core.inspection.finished import Trend
from ocmm_core.tolerances.decisions import CharacteristicResult
from ocmm_core.tolerances.kinds import spec_of
from ocmm_gui import kit
from ocmm_gui.charts._plot import LevelLine, paint_levels
from ocmm_gui.kit import tr

_MARGIN_SHARE = 0.4
"""Margin beyond each limit, in widths of the tolerance."""


@dataclass(frozen=True, slots=True)
class BarScale:
    """Scale of the bar; mm."""

    low: float
    high: float
    """`low`, `high`: deviation at the ends."""
    lower: float
    upper: float
    guard: float
    """Width of the zone inside each limit in which conformity is not proven (ISO 14253-1)."""
    one_sided: bool
    """The lower limit is a natural bound, such as zero for a form deviation."""

    @property
    def proven(self) -> tuple[float, float]:
        """Return the ends of the zone of proven conformity; crossed if empty."""
        return self.lower + (0.0 if self.one_sided else self.guard), self.upper - self.guard

    def place(self, deviation: float) -> float:
        """Return the relative place of a deviation, 0 (left end) to 1, clamped."""
        return min(max((deviation - self.low) / (self.high - self.low), 0.0), 1.0)


def make_scale(result: CharacteristicResult) -> BarScale:
    """Return the scale of a characteristic, with a guard band of U if required."""
    width = max(result.upper - result.lower, 1e-6)
    guarded = result.rule.partition("/")[0] != "simple"
    guard = result.uncertainty if guarded and result.uncertainty is not None else 0.0
    one_sided = spec_of(result.kind).one_sided and result.lower <= 0.0
    return BarScale(
        low=result.lower - (0.0 if one_sided else _MARGIN_SHARE * width),
        high=result.upper + _MARGIN_SHARE * width,
        lower=result.lower,
        upper=result.upper,
        guard=guard,
        one_sided=one_sided,
    )


class ToleranceBar(kit.PaintedWidget):
    """Bar with red, amber and green fields, limits in digits and a marker with ±U."""

    def __init__(self, *, digits_share: float = 0.3) -> None:
        super().__init__(tr("Tolerance bar"), (240, 56), (160, 44))
        self._digits_share = digits_share
        self._result: CharacteristicResult | None = None

    def show_result(self, result: CharacteristicResult | None) -> None:
        self._result = result
        if result is None:
            self.setAccessibleDescription(tr("no tolerance"))
        else:
            self.setAccessibleDescription(
                tr("{name}: deviation {deviation}, limits {lower} to {upper}, {verdict}").format(
                    name=result.name,
                    deviation=kit.named_quantity(result, result.deviation, signed=True),
                    lower=kit.named_quantity(result, result.lower, signed=True),
                    upper=kit.named_quantity(result, result.upper, signed=True),
                    verdict=kit.said_word(result.verdict.value),
                )
            )
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        digits = min(max(12.0, self._digits_share * self.height()), 48.0)
        bar = QRectF(0, 0.14 * self.height(), self.width(), self.height() - 1.3 * digits)
        bar.setBottom(self.height() - 1.3 * digits)
        if self._result is None:
            painter.setPen(QPen(QColor(self._theme.border), 1, Qt.PenStyle.DashLine))
            painter.drawRoundedRect(bar.adjusted(1, 0, -1, 0), 4, 4)
            return
        scale = make_scale(self._result)
        self._paint_fields(painter, bar, scale)
        self._paint_limits(painter, bar, scale, digits, self._result)
        self._paint_marker(painter, bar, scale, self._result)

    def _paint_fields(self, painter: QPainter, bar: QRectF, scale: BarScale) -> None:
        theme = self._theme
        painter.setPen(Qt.PenStyle.NoPen)
        for low, high, colour in (
            (scale.low, scale.high, theme.zone_bad),
            (scale.lower, scale.upper, theme.zone_warn),
            (*scale.proven, theme.zone_good),
        ):
            if high <= low:
                continue
            left, right = (bar.left() + bar.width() * scale.place(v) for v in (low, high))
            painter.setBrush(QColor(colour))
            painter.drawRect(QRectF(left, bar.top(), right - left, bar.height()))
        kit.ink(painter, QPen(QColor(theme.border), theme.border_px), Qt.BrushStyle.NoBrush)
        painter.drawRect(bar.adjusted(0.5, 0, -0.5, 0))

    def _paint_limits(
        self,
        painter: QPainter,
        bar: QRectF,
        scale: BarScale,
        digits: float,
        result: CharacteristicResult,
    ) -> None:
        painter.setFont(kit.digit_font(digits, bold=False))
        metrics = painter.fontMetrics()
        values = [scale.lower, scale.upper]
        if scale.lower < 0.0 < scale.upper:
            values.append(0.0)
        for value in values:
            x = bar.left() + bar.width() * scale.place(value)
            painter.setPen(QPen(QColor(self._theme.text), 2))
            painter.drawLine(QPointF(x, bar.bottom() - 3), QPointF(x, bar.bottom() + 4))
            text = "0" if value == 0.0 else kit.quantity(result, value, signed=True)
            wide = metrics.horizontalAdvance(text)
            left = min(max(x - 0.5 * wide, 0.0), self.width() - wide)
            place = QRectF(left, bar.bottom() + 3, wide + 2.0, self.height() - bar.bottom() - 3)
            painter.drawText(place, Qt.AlignmentFlag.AlignCenter, text)

    def _paint_marker(
        self, painter: QPainter, bar: QRectF, scale: BarScale, result: CharacteristicResult
    ) -> None:
        if result.deviation is None:
            return
        x = bar.left() + bar.width() * scale.place(result.deviation)
        colour = QColor(self._theme.text)
        thick = max(4.0, 0.012 * bar.width())
        middle = bar.center().y()
        if result.uncertainty is not None:
            painter.setPen(QPen(colour, max(2.0, 0.3 * thick)))
            ends = [
                bar.left() + bar.width() * scale.place(result.deviation + sign * result.uncertainty)
                for sign in (-1.0, 1.0)
            ]
            painter.drawLine(QPointF(ends[0], middle), QPointF(ends[1], middle))
            for end in ends:
                painter.drawLine(
                    QPointF(end, middle - 0.2 * bar.height()),
                    QPointF(end, middle + 0.2 * bar.height()),
                )
        kit.ink(painter, Qt.PenStyle.NoPen, colour)
        if not scale.low <= result.deviation <= scale.high:
            # Off the scale: an outward arrow.
            turn = 1.0 if result.deviation > scale.high else -1.0
            high = 0.5 * bar.height()
            painter.drawPolygon(
                QPolygonF(
                    [
                        QPointF(x, middle),
                        QPointF(x - turn * high, middle - high),
                        QPointF(x - turn * high, middle + high),
                    ]
                )
            )
            return
        x = min(max(x, 0.5 * thick), self.width() - 0.5 * thick)
        reach = 0.14 * self.height()
        painter.drawRect(QRectF(x - 0.5 * thick, bar.top() - reach, thick, bar.height() + reach))


_HEAD_PX, _FOOT_PX, _SCALE_PX = 34.0, 24.0, 112.0


class TrendChart(kit.PaintedWidget):
    """Values as dots with their U; the field is the tolerance, dashed the limits."""

    def __init__(self) -> None:
        super().__init__(tr("Trend over the parts"), kit.SCENE_SIZE, kit.SCENE_LEAST)
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
        kit.ink(painter, QColor(self._theme.text), font=kit.text_font(15, bold=True))
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
        kit.ink(painter, Qt.PenStyle.NoPen, QColor(self._theme.zone_good))
        painter.drawRect(QRectF(box.left(), top, box.width(), bottom - top))
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
        lines = [
            LevelLine(y(value), f"{name} {kit.kind_value(trend.kind, value, 3)}", style)
            for name, value, style in levels
        ]
        paint_levels(painter, box, lines, box.left() - 6.0, self._theme)

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
                kit.ink(painter, QColor(self._theme.muted), font=kit.text_font(13, bold=True))
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
        kit.ink(painter, QColor(self._theme.muted), font=kit.text_font(12))
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
        least=kit.kind_value(trend.kind, float(values.min()), 4),
        most=kit.kind_value(trend.kind, float(values.max()), 4),
        signals=tr("%n signals", "1 signal", signals),
    )
