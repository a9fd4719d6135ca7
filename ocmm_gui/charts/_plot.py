"""Frame of all plots with a title, and arrows with their scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen

from ocmm_core.geometry import Float
from ocmm_gui.kit import LEFT, RIGHT, PaintedWidget, Theme, digit_font, fitted, text_font

HEAD_PX, SMALL_HEAD_PX, LEGEND_PX = 24.0, 18.0, 24.0
ARROW_SHARE = 0.07
"""Length of an RMS arrow, relative to the picture's shorter side."""
_BARB = 0.3
_LABEL_PX = 15.0
"""Least distance of two labels."""


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

    def _show_message(self, word: str) -> None:
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
        painter.drawText(head, LEFT, self._title)
        room = head.width()
        if lines == 1:
            room -= painter.fontMetrics().horizontalAdvance(self._title) + look.gap_px
        font = text_font(look.text_px, bold=look.loud_word)
        painter.setFont(fitted(font, self._word, room, look.height_px, look.text_px))
        painter.setPen(loud if look.loud_word else soft)
        place = head.translated(0.0, (lines - 1) * (look.height_px - look.tuck_px))
        if lines == 1:
            place.setLeft(head.right() - room)
        painter.drawText(place, RIGHT if lines == 1 else LEFT, self._word)
        return QRectF(self.rect()).adjusted(0.0, place.bottom() + 2.0, 0.0, 0.0)

    def _paint_legend(self, painter: QPainter, box: QRectF, pixels: float, text: str) -> None:
        """Paint an arrow with its meaning, at the lower left of a box."""
        y = box.bottom() - 0.5 * LEGEND_PX
        painter.setPen(QPen(QColor(self._theme.text), 2.0))
        start = QPointF(box.left() + 6.0, y)
        painter.drawLines(arrow_lines(np.array([[start.x(), y]]), np.array([[pixels, 0.0]])))
        painter.setFont(digit_font(15, bold=False))
        place = QRectF(start.x() + pixels + 8.0, y - 0.5 * LEGEND_PX, 240.0, LEGEND_PX)
        painter.drawText(place, LEFT, text)


class LevelLine(NamedTuple):
    """A line across a plot, at a height in px, with its label."""

    y: float
    label: str
    style: Qt.PenStyle


def paint_levels(
    painter: QPainter, box: QRectF, levels: Sequence[LevelLine], right: float, theme: Theme
) -> None:
    """Paint levels with their labels at the left of a box, up to ``right``, px."""
    painter.setFont(digit_font(12, bold=False))
    taken: list[float] = []
    for y, label, style in levels:
        painter.setPen(QPen(QColor(theme.text), 1.4, style))
        painter.drawLine(QPointF(box.left(), y), QPointF(box.right(), y))
        # Avoid overlapping labels.
        if all(abs(y - other) > _LABEL_PX for other in taken):
            taken.append(y)
            painter.drawText(QRectF(0.0, y - 9.0, right, 18.0), RIGHT, label)


def height_of(box: QRectF, value: float, reach: float) -> float:
    """Return the height of a value in a box that shows minus to plus ``reach``, px."""
    return box.center().y() - 0.5 * box.height() * value / reach


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
