"""The frame of all plots of a wizard, and arrows with their scale."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen

from ocmm_core.geometry import Float
from ocmm_gui.kit import Painted, digit_font, fitted, text_font

HEAD_PX, LEGEND_PX = 24.0, 24.0
ARROW_SHARE = 0.07
"""An arrow of the RMS is so long, as a part of the picture's shorter side."""
_BARB = 0.3
_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter


class Plot(Painted):
    """A title, a word at its right, and something painted below.

    Parameters
    ----------
    name
        What is shown, also for screen readers.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name, (280, 220), (140, 100))
        self._title = name
        self._word = ""

    def word(self) -> str:
        """Return what stands at the right of the title."""
        return self._word

    def _say(self, word: str) -> None:
        self._word = word
        self.setAccessibleDescription(word)
        self.update()

    def _paint_head(self, painter: QPainter, *, lines: int = 1) -> QRectF:
        """Paint title and word, on one line or two, and return what is left below them."""
        head = QRectF(0.0, 0.0, self.width(), HEAD_PX)
        painter.setFont(text_font(15, bold=True))
        painter.setPen(QColor(self._theme.text))
        painter.drawText(head, _LEFT, self._title)
        room = head.width()
        if lines == 1:
            room -= painter.fontMetrics().horizontalAdvance(self._title) + 14.0
        painter.setFont(fitted(text_font(15), self._word, room, HEAD_PX, 15))
        painter.setPen(QColor(self._theme.muted))
        place = head.translated(0.0, (lines - 1) * (HEAD_PX - 4.0))
        painter.drawText(place, _RIGHT if lines == 1 else _LEFT, self._word)
        return QRectF(self.rect()).adjusted(0.0, place.bottom() + 2.0, 0.0, 0.0)

    def _paint_legend(self, painter: QPainter, box: QRectF, pixels: float, text: str) -> None:
        """Paint an arrow of a length with its meaning, at the lower left of a box."""
        y = box.bottom() - 0.5 * LEGEND_PX
        painter.setPen(QPen(QColor(self._theme.text), 2.0))
        start = QPointF(box.left() + 6.0, y)
        painter.drawLines(arrow_lines(np.array([[start.x(), y]]), np.array([[pixels, 0.0]])))
        painter.setFont(digit_font(15, bold=False))
        place = QRectF(start.x() + pixels + 8.0, y - 0.5 * LEGEND_PX, 240.0, LEGEND_PX)
        painter.drawText(place, _LEFT, text)


def rms_of(values: Float) -> float:
    """Return the root mean square, zero of nothing."""
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0


def scale_arrows(rms: float, pixels: float) -> tuple[float, float]:
    """Return a round value near ``rms`` and how long its arrow is, px, if ``rms`` is ``pixels``."""
    if not rms > 0.0:
        return 0.0, 0.0
    decade = 10.0 ** np.floor(np.log10(rms))
    nice = float(max(step for step in (1.0, 2.0, 5.0) if step * decade <= rms * 1.0001) * decade)
    return nice, pixels * nice / rms


def arrow_lines(starts: Float, vectors: Float) -> list[QLineF]:
    """Return the lines of arrows from ``starts`` (n, 2) along ``vectors`` (n, 2), px."""
    ends = starts + vectors
    across = np.stack([-vectors[:, 1], vectors[:, 0]], axis=1)
    barbs = [ends - _BARB * vectors + side * 0.5 * _BARB * across for side in (-1.0, 1.0)]
    lines = np.concatenate(
        [np.hstack([starts, ends]), *(np.hstack([ends, barb]) for barb in barbs)]
    )
    return [QLineF(*line) for line in lines.tolist()]
