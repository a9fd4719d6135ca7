"""Several things that must each reach a mark, as bars below each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QPaintEvent, QPen

from ocmm_gui.painted import Painted
from ocmm_gui.theme import fitted, text_font

_ROW_PX, _LEAST_PX, _BAR_PX = 46.0, 26.0, 9.0
_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter


@dataclass(frozen=True, slots=True)
class Row:
    """One bar.

    Attributes
    ----------
    name, value
        What it is and how much of it there is, with unit and aim.
    share
        Of the aim, 1 where it is reached.
    """

    name: str
    value: str
    share: float


class Bars(Painted):
    """Bars with names and values.

    Parameters
    ----------
    name
        What they say together.
    rows
        How many there are at most.
    """

    def __init__(self, name: str, rows: int) -> None:
        super().__init__(name, (240, round(_ROW_PX * rows)), (160, round(_LEAST_PX * rows)))
        self._rows: tuple[Row, ...] = ()

    def show_rows(self, rows: Sequence[Row]) -> None:
        """Show bars, the first one at the top."""
        if tuple(rows) != self._rows:
            self._rows = tuple(rows)
            self.setAccessibleDescription(", ".join(f"{row.name} {row.value}" for row in rows))
            self.update()

    def words(self) -> tuple[str, ...]:
        """Return name and value of each bar."""
        return tuple(f"{row.name} {row.value}" for row in self._rows)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint names, values and bars."""
        painter, theme = self._painter(), self._theme
        high = min(self.height() / max(len(self._rows), 1), _ROW_PX)
        for index, row in enumerate(self._rows):
            done = row.share >= 1.0
            text = QRectF(0.0, index * high, self.width(), high - _BAR_PX - 5.0)
            value = text_font(18, bold=True)
            painter.setFont(fitted(value, row.value, 0.5 * text.width(), text.height(), 20.0))
            painter.setPen(QColor(theme.good if done else theme.text))
            painter.drawText(text, _RIGHT, f"{row.value} ✓" if done else row.value)
            room = text.width() - painter.fontMetrics().horizontalAdvance(f"{row.value} ✓") - 8.0
            painter.setFont(fitted(text_font(16), row.name, room, text.height(), 16.0))
            painter.setPen(QColor(theme.muted))
            painter.drawText(text, _LEFT, row.name)
            bar = QRectF(0.5, text.bottom() + 1.0, self.width() - 1.0, _BAR_PX)
            painter.setPen(QPen(QColor(theme.border), theme.border_px))
            painter.setBrush(QColor(theme.background))
            painter.drawRect(bar)
            bar.setWidth(bar.width() * min(max(row.share, 0.0), 1.0))
            painter.fillRect(bar, QColor(theme.good if done else theme.accent))
