"""What can be read from three metres: one word, a line below it, and a bar that runs down."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QPaintEvent, QPen

from ocmm_gui.operator.marks import Mark, mark_colour, paint_mark
from ocmm_gui.painted import Painted
from ocmm_gui.theme import fitted, text_font

_BAR_PX = 10.0
_NOTE_SHARE, _NOTE_LIMIT = 0.27, 34.0
_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter


@dataclass(frozen=True, slots=True)
class Told:
    """What the banner says.

    Attributes
    ----------
    word
        A word or three, in capitals.
    note
        What to do, in a sentence.
    mark
        Its shape; its colour follows from it.
    share
        How much of the bar is filled, 0 to 1; None paints no bar.
    """

    word: str = ""
    note: str = ""
    mark: Mark = Mark.OPEN
    share: float | None = None


class FarBanner(Painted):
    """A word as large as its place allows.

    Parameters
    ----------
    name
        What it tells.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name, (600, 124), (300, 64))
        self._name = name
        self._told = Told()

    def tell(self, told: Told) -> None:
        """Show a word with its line."""
        if told != self._told:
            self._told = told
            self.setAccessibleName(f"{self._name}: {told.word}")
            self.setAccessibleDescription(told.note)
            self.update()

    def word(self) -> str:
        """Return the word."""
        return self._told.word

    def note(self) -> str:
        """Return the line below it."""
        return self._told.note

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint mark, word, line and bar."""
        painter = self._painter()
        frame, theme, told = self._paint_panel(painter), self._theme, self._told
        colour = QColor(mark_colour(theme, told.mark))
        inside = frame.adjusted(14.0, 6.0, -14.0, -_BAR_PX - 6.0)
        note = QRectF(inside)
        note.setTop(inside.bottom() - min(_NOTE_SHARE * inside.height(), 1.25 * _NOTE_LIMIT))
        head = QRectF(inside)
        head.setBottom(note.top())
        side = 0.72 * head.height()
        box = QRectF(head.left(), head.center().y() - 0.5 * side, side, side)
        paint_mark(painter, told.mark, box, colour.name(), theme.panel)
        word = QRectF(head)
        word.setLeft(box.right() + 0.25 * side)
        big = text_font(10, bold=True)
        painter.setFont(fitted(big, told.word, word.width(), word.height(), 400.0))
        painter.setPen(colour)
        painter.drawText(word, _LEFT, told.word)
        small = text_font(10)
        painter.setFont(fitted(small, told.note, note.width(), note.height(), _NOTE_LIMIT))
        painter.setPen(QColor(theme.text))
        painter.drawText(note, _LEFT, told.note)
        if told.share is not None:
            bar = QRectF(inside.left(), frame.bottom() - _BAR_PX - 5.0, inside.width(), _BAR_PX)
            painter.setPen(QPen(QColor(theme.border), theme.border_px))
            painter.setBrush(QColor(theme.background))
            painter.drawRect(bar)
            bar.setWidth(bar.width() * min(max(told.share, 0.0), 1.0))
            painter.fillRect(bar, colour)
