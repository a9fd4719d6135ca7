"""Banner readable from three metres: a word, a sentence, and a progress bar."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPaintEvent, QPen

from ocmm_gui.kit import (
    Mark,
    Painted,
    far_type,
    fitted,
    mark_colour,
    paint_mark,
    text_font,
    wrapped_pixels,
)

_BAR_PX = 10.0
_LINE, _MOST_NOTE = 1.17, 0.56
"""Line height over type size, and the maximum share of the sentence."""
_MARK_SHARE, _GAP_SHARE = 0.72, 0.18
"""Relative to the height of the word."""
_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter


@dataclass(frozen=True, slots=True)
class Told:
    """Message of the banner."""

    word: str = ""
    """One to three words in capitals."""
    note: str = ""
    mark: Mark = Mark.OPEN
    """Determines shape and colour."""
    share: float | None = None
    """Filled share of the bar, 0 to 1; None paints no bar."""


class FarBanner(Painted):
    """A word as large as its place allows."""

    def __init__(self, name: str) -> None:
        super().__init__(name, (600, 124), (300, 64))
        self._name = name
        self._told = Told()

    def tell(self, told: Told) -> None:
        if told != self._told:
            self._told = told
            self.setAccessibleName(f"{self._name}: {told.word}")
            self.setAccessibleDescription(told.note)
            self.update()

    def word(self) -> str:
        return self._told.word

    def note(self) -> str:
        return self._told.note

    def type_pixels(self) -> tuple[int, int]:
        inside = _inside(QRectF(self.rect()))
        note = self._note_box(inside)
        head = QRectF(inside)
        head.setBottom(note.top())
        wide = head.width() - (_MARK_SHARE + _GAP_SHARE) * head.height()
        word = fitted(text_font(10, bold=True), self._told.word, wide, head.height(), 400.0)
        return word.pixelSize(), wrapped_pixels(self._told.note, note, far_type(self))

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        frame, theme, told = self._paint_panel(painter), self._theme, self._told
        colour = QColor(mark_colour(theme, told.mark))
        inside = _inside(frame)
        note = self._note_box(inside)
        head = QRectF(inside)
        head.setBottom(note.top())
        side = _MARK_SHARE * head.height()
        box = QRectF(head.left(), head.center().y() - 0.5 * side, side, side)
        paint_mark(painter, told.mark, box, colour.name(), theme.panel)
        word = QRectF(head)
        word.setLeft(box.right() + _GAP_SHARE * head.height())
        pixels, note_pixels = self.type_pixels()
        painter.setFont(text_font(pixels, bold=True))
        painter.setPen(colour)
        painter.drawText(word, _LEFT, told.word)
        painter.setFont(text_font(note_pixels))
        painter.setPen(QColor(theme.text))
        painter.drawText(note, _LEFT | Qt.TextFlag.TextWordWrap, told.note)
        if told.share is not None:
            bar = QRectF(inside.left(), frame.bottom() - _BAR_PX - 5.0, inside.width(), _BAR_PX)
            painter.setPen(QPen(QColor(theme.border), theme.border_px))
            painter.setBrush(QColor(theme.background))
            painter.drawRect(bar)
            bar.setWidth(bar.width() * min(max(told.share, 0.0), 1.0))
            painter.fillRect(bar, colour)

    def _note_box(self, inside: QRectF) -> QRectF:
        """Return the place of the sentence: one line if it fits, otherwise two."""
        pixels = far_type(self)
        metrics = QFontMetricsF(text_font(pixels))
        lines = 1 if metrics.horizontalAdvance(self._told.note) < inside.width() else 2
        note = QRectF(inside)
        high = min(lines * _LINE * pixels + 2.0, _MOST_NOTE * inside.height())
        note.setTop(inside.bottom() - high)
        return note


def _inside(frame: QRectF) -> QRectF:
    return frame.adjusted(14.0, 4.0, -14.0, -_BAR_PX - 6.0)
