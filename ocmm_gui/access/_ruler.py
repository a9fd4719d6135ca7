"""A line to be measured with a ruler, for screens of unknown size."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QSize, Qt
from PySide6.QtGui import QColor, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy

from ocmm_gui.access._screen import RULER_PX, screen_size
from ocmm_gui.kit import Painted, localised, text_font, tr

_HIGH_PX, _END_PX = 56, 12


class RulerLine(Painted):
    """A line of `RULER_PX` dots, and its length by the screen."""

    def __init__(self) -> None:
        super().__init__(
            tr("Line to be measured with a ruler"), (RULER_PX + 20, _HIGH_PX), (60, _HIGH_PX)
        )
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self._ruler_mm: float | None = None

    def show_length(self, ruler_mm: float | None) -> None:
        self._ruler_mm = ruler_mm
        self.setAccessibleDescription(self.words())
        self.update()

    def words(self) -> str:
        size = screen_size(self.screen(), self._ruler_mm)
        length = localised(f"{size.mm_per_px * self.length_px():.0f}")
        if self._ruler_mm is not None:
            return tr("Measured: {length} mm.").format(length=length)
        if size.known:
            return tr("The screen says {length} mm. Measure it if that is wrong.").format(
                length=length
            )
        return tr("This screen does not tell its size. Measure the line with a ruler.")

    def length_px(self) -> float:
        """Return the length of the line in pixels of the layout."""
        return RULER_PX / self.devicePixelRatioF()

    def minimumSizeHint(self) -> QSize:
        """Return room for the whole line: part of it would be measured wrong."""
        return QSize(round(self.length_px()) + 4, _HIGH_PX)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        painter.setPen(QPen(QColor(self._theme.text), 1.0))
        left, right, y = 1.5, 1.5 + self.length_px(), 0.5 * _END_PX + 4.0
        painter.drawLine(QPointF(left, y), QPointF(right, y))
        for x in (left, right):
            painter.drawLine(QPointF(x, y - 0.5 * _END_PX), QPointF(x, y + 0.5 * _END_PX))
        painter.setFont(text_font(14))
        painter.setPen(QColor(self._theme.muted))
        box = self.rect().adjusted(0, _END_PX + 8, 0, 0)
        flags = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap
        painter.drawText(box, flags, self.words())
