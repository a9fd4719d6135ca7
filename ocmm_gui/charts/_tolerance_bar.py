"""Tolerance bar: a deviation between its limits, with its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QPolygonF

from ocmm_core.tolerances.decisions import CharacteristicResult
from ocmm_core.tolerances.kinds import spec_of
from ocmm_gui.kit import Painted, digit_font, named_quantity, quantity, said_word, tr

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
        share = (deviation - self.low) / (self.high - self.low)
        return min(max(share, 0.0), 1.0)


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


class ToleranceBar(Painted):
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
                    deviation=named_quantity(result, result.deviation, signed=True),
                    lower=named_quantity(result, result.lower, signed=True),
                    upper=named_quantity(result, result.upper, signed=True),
                    verdict=said_word(result.verdict.value),
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
        painter.setPen(QPen(QColor(theme.border), theme.border_px))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRect(bar.adjusted(0.5, 0, -0.5, 0))

    def _paint_limits(
        self,
        painter: QPainter,
        bar: QRectF,
        scale: BarScale,
        digits: float,
        result: CharacteristicResult,
    ) -> None:
        painter.setFont(digit_font(digits, bold=False))
        metrics = painter.fontMetrics()
        values = [scale.lower, scale.upper]
        if scale.lower < 0.0 < scale.upper:
            values.append(0.0)
        for value in values:
            x = bar.left() + bar.width() * scale.place(value)
            painter.setPen(QPen(QColor(self._theme.text), 2))
            painter.drawLine(QPointF(x, bar.bottom() - 3), QPointF(x, bar.bottom() + 4))
            text = "0" if value == 0.0 else quantity(result, value, signed=True)
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
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(colour)
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
