"""How the points of a feature scatter: one bar a point, to be clicked."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPen

from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import FeatureView
from ocmm_gui.kit import Painted, digit_font, length_words, millimetres, text_font, tr

_LINE_PX = 22.0
_TALLEST_PX = 90.0
_WIDEST_PX = 40.0
_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter


class ResidualChart(Painted):
    """Distance of every point from the fitted feature; outliers in red, the chosen one framed."""

    point_chosen = Signal(int)
    """Emits the number of the point whose bar was clicked."""

    def __init__(self) -> None:
        super().__init__(
            tr("Residuals of the points from the fitted feature"), (160, 120), (160, 0)
        )
        self._residuals: Float = np.empty(0)
        self._numbers: tuple[int, ...] = ()
        self._flagged: frozenset[int] = frozenset()
        self._chosen = 0

    def show_feature(self, feature: FeatureView, chosen: int) -> None:
        """Show the residuals of a feature; without a fit the chart is empty."""
        fit = feature.fit
        self._residuals = np.empty(0) if fit is None else fit.residuals
        self._numbers = tuple(point.number for point in feature.points)
        self._flagged, self._chosen = frozenset(feature.outliers), chosen
        self.setAccessibleDescription(
            " ".join(
                f"{number}: {millimetres(float(r), signed=True)}"
                for number, r in zip(self._numbers, self._residuals, strict=False)
            )
        )
        self.update()

    def place_of(self, number: int) -> QPointF:
        """Return the middle of the bar of a point; for tests."""
        pitch = self._pitch()
        return QPointF((self._numbers.index(number) + 0.5) * pitch, 0.5 * self.height())

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Choose the point whose bar is clicked."""
        index = int(event.position().x() / self._pitch()) if len(self._residuals) else -1
        if 0 <= index < min(len(self._residuals), len(self._numbers)):
            self.point_chosen.emit(self._numbers[index])

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint a bar for each point, if there is room."""
        top = _LINE_PX
        count = len(self._residuals)
        if not count or self.height() < 3 * top:
            return
        painter = self._painter()
        reach = max(float(np.abs(self._residuals).max()), 0.005)
        painter.setFont(text_font(13))
        painter.setPen(QColor(self._theme.muted))
        line = QRectF(0, 0, self.width(), top)
        painter.drawText(line, _LEFT, tr("Points from the fit"))
        painter.drawText(line, _RIGHT, f"±{length_words(reach)}")
        high = min(0.5 * (self.height() - 2.0 * top), _TALLEST_PX)
        zero = top + high
        pitch = self._pitch()
        for index, residual in enumerate(self._residuals.tolist()):
            tall = high * residual / reach
            bar = QRectF(index * pitch + 0.2 * pitch, zero, 0.6 * pitch, -tall).normalized()
            self._paint_bar(painter, bar, index)
        painter.setPen(QPen(QColor(self._theme.text), 1))
        painter.drawLine(QPointF(0, zero), QPointF(count * pitch, zero))
        painter.setFont(digit_font(11, bold=False))
        painter.setPen(QColor(self._theme.muted))
        every = 1 if pitch >= 20.0 else 5
        for index in range(0, count, every):
            box = QRectF(index * pitch, zero + high + 2.0, pitch * every, 14.0)
            painter.drawText(box, Qt.AlignmentFlag.AlignLeft, f" {index + 1}")

    def _paint_bar(self, painter: QPainter, bar: QRectF, index: int) -> None:
        number = self._numbers[index] if index < len(self._numbers) else 0
        outlier = number in self._flagged
        painter.fillRect(bar, QColor(self._theme.bad if outlier else self._theme.accent))
        if number == self._chosen:
            painter.setPen(QPen(QColor(self._theme.text), 2.0))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRect(bar.adjusted(-3, -3, 3, 3))

    def _pitch(self) -> float:
        return min(self.width() / max(len(self._residuals), 1), _WIDEST_PX)
