"""Stacked bars of quantities that must each reach a target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen

from ocmm_gui.kit import Painted, fitted, text_font

_ROW_PX, _ROOMY_PX, _LEAST_PX, _BAR_PX = 46.0, 32.0, 18.0, 9.0
_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter


@dataclass(frozen=True, slots=True)
class Row:
    name: str
    value: str
    """`name`, `value`: caption, and value with unit and target."""
    share: float
    """Relative to the target, 1 if reached."""


class Bars(Painted):
    """Bars with names and values."""

    def __init__(self, name: str, rows: int) -> None:
        super().__init__(name, (240, round(_ROW_PX * rows)), (160, round(_LEAST_PX * rows)))
        self._rows: tuple[Row, ...] = ()

    def show_rows(self, rows: Sequence[Row]) -> None:
        if tuple(rows) != self._rows:
            self._rows = tuple(rows)
            self.setAccessibleDescription(", ".join(f"{row.name} {row.value}" for row in rows))
            self.update()

    def words(self) -> tuple[str, ...]:
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
        painter.setPen(QPen(QColor(theme.border), theme.border_px))
        painter.setBrush(QColor(theme.background))
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
        painter.drawText(text, _RIGHT, value)
        room = text.width() - painter.fontMetrics().horizontalAdvance(value) - 8.0
        painter.setFont(fitted(text_font(16), row.name, room, text.height(), 16.0))
        painter.setPen(QColor(theme.text))
        painter.drawText(text, _LEFT, row.name)
