"""Next step or obstacle, in sentences readable at three metres."""

from __future__ import annotations

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QPaintEvent

from ocmm_gui.kit import Painted, far_type, fitted, text_font, tr, wrapped_pixels

_LINE = 1.17
_LEAST_PX = 16
"""Minimum size for text below the step."""
_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter


class FarMessage(Painted):
    """The next step with the plan's text below it; trouble replaces both."""

    def __init__(self) -> None:
        super().__init__(tr("Next step"), (600, 120), (300, 60))
        self._step, self._words, self._trouble = "", "", ""

    def tell(self, step: str, words: str, trouble: str) -> None:
        """Show a step with its plan text, or trouble instead."""
        if (step, words, trouble) != (self._step, self._words, self._trouble):
            self._step, self._words, self._trouble = step, words, trouble
            self.setAccessibleDescription(trouble or f"{step} {words}".strip())
            self.update()

    def text(self) -> str:
        return self._trouble or self._step

    def is_trouble(self) -> bool:
        return bool(self._trouble)

    def type_pixels(self) -> int:
        first = self._first()
        if self._trouble:
            return wrapped_pixels(self._trouble, first, far_type(self), bold=True)
        bold = text_font(10, bold=True)
        return fitted(bold, self._step, first.width(), first.height(), far_type(self)).pixelSize()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        first = self._first()
        painter.setFont(text_font(self.type_pixels(), bold=True))
        painter.setPen(QColor(self._theme.bad if self._trouble else self._theme.text))
        painter.drawText(first, _LEFT | Qt.TextFlag.TextWordWrap, self.text())
        if self._trouble or not self._words:
            return
        second = QRectF(self.rect())
        second.setTop(first.bottom())
        font = fitted(text_font(10), self._words, second.width(), second.height(), far_type(self))
        if font.pixelSize() < _LEAST_PX:
            return
        painter.setFont(font)
        painter.setPen(QColor(self._theme.muted))
        painter.drawText(second, _LEFT, self._words)

    def _first(self) -> QRectF:
        """Return the place of the first sentence: one line if there is a second one."""
        box = QRectF(self.rect())
        if not self._trouble:
            box.setHeight(min(_LINE * far_type(self) + 1.0, box.height()))
        return box
