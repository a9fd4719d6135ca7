"""Frame of all plots with a title, and arrows with their scale."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen

from ocmm_core.geometry import Float
from ocmm_gui.kit import PaintedWidget, digit_font, fitted, text_font

HEAD_PX, SMALL_HEAD_PX, LEGEND_PX = 24.0, 18.0, 24.0
ARROW_SHARE = 0.07
"""Length of an RMS arrow, relative to the picture's shorter side."""
_BARB = 0.3
_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter


@dataclass(frozen=True, slots=True)
class Head:
    """Format of the line above a plot: title at the left, a word at its right."""

    height_px: float
    text_px: int
    loud_word: bool
    """Emphasise the word instead of the title."""
    gap_px: float
    tuck_px: float
    """Upward shift of a second line."""


LARGE_HEAD = Head(HEAD_PX, 15, loud_word=False, gap_px=14.0, tuck_px=4.0)
"""Of a single plot: the title identifies it."""
SMALL_HEAD = Head(SMALL_HEAD_PX, 13, loud_word=True, gap_px=10.0, tuck_px=0.0)
"""Of one of many side by side: the word matters."""


class Plot(PaintedWidget):
    """A title, a word at its right, and a painted area below."""

    def __init__(
        self,
        name: str,
        head: Head = LARGE_HEAD,
        size: tuple[int, int] = (280, 220),
        least: tuple[int, int] = (140, 100),
    ) -> None:
        super().__init__(name, size, least)
        self._title = name
        self._head = head
        self._word = ""

    def word(self) -> str:
        return self._word

    def _say(self, word: str) -> None:
        self._word = word
        self.setAccessibleDescription(word)
        self.update()

    def _paint_head(self, painter: QPainter, *, lines: int = 1) -> QRectF:
        """Paint title and word, on one line or two, and return the area below."""
        look, theme = self._head, self._theme
        head = QRectF(0.0, 0.0, self.width(), look.height_px)
        loud, soft = QColor(theme.text), QColor(theme.muted)
        painter.setFont(text_font(look.text_px, bold=not look.loud_word))
        painter.setPen(soft if look.loud_word else loud)
        painter.drawText(head, _LEFT, self._title)
        room = head.width()
        if lines == 1:
            room -= painter.fontMetrics().horizontalAdvance(self._title) + look.gap_px
        font = text_font(look.text_px, bold=look.loud_word)
        painter.setFont(fitted(font, self._word, room, look.height_px, look.text_px))
        painter.setPen(loud if look.loud_word else soft)
        place = head.translated(0.0, (lines - 1) * (look.height_px - look.tuck_px))
        if lines == 1:
            place.setLeft(head.right() - room)
        painter.drawText(place, _RIGHT if lines == 1 else _LEFT, self._word)
        return QRectF(self.rect()).adjusted(0.0, place.bottom() + 2.0, 0.0, 0.0)

    def _paint_legend(self, painter: QPainter, box: QRectF, pixels: float, text: str) -> None:
        """Paint an arrow with its meaning, at the lower left of a box."""
        y = box.bottom() - 0.5 * LEGEND_PX
        painter.setPen(QPen(QColor(self._theme.text), 2.0))
        start = QPointF(box.left() + 6.0, y)
        painter.drawLines(arrow_lines(np.array([[start.x(), y]]), np.array([[pixels, 0.0]])))
        painter.setFont(digit_font(15, bold=False))
        place = QRectF(start.x() + pixels + 8.0, y - 0.5 * LEGEND_PX, 240.0, LEGEND_PX)
        painter.drawText(place, _LEFT, text)


def rms_of(values: Float) -> float:
    """Return the root mean square, zero if empty."""
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0


def scale_arrows(rms: float, pixels: float) -> tuple[float, float]:
    """Return a round value near ``rms``, ``pixels`` long, and its arrow length, px."""
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
