from __future__ import annotations

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPaintEvent

from ocmm_gui.kit._marks import Mark, paint_mark
from ocmm_gui.kit._painted import Painted
from ocmm_gui.kit._theme import digit_font, fitted, text_font

_LEAST_PX = 9


class FitText(Painted):
    """One line in the largest type that also fits ``reserve``: digits do not resize it."""

    def __init__(
        self,
        name: str,
        *,
        limit: float = 400.0,
        align: Qt.AlignmentFlag = Qt.AlignmentFlag.AlignLeft,
        digits: bool = False,
        reserve: str = "",
    ) -> None:
        super().__init__(name, (80, 24), (20, 14))
        self._name = name
        self._limit = limit
        self._align = align
        self._digits = digits
        self._reserve = reserve
        self._text = ""
        self._colour: str | None = None
        self._mark: Mark | None = None

    def show_text(self, text: str, colour: str | None = None, mark: Mark | None = None) -> None:
        """Show a line; the default colour is that of text."""
        if (text, colour, mark) != (self._text, self._colour, self._mark):
            self._text, self._colour, self._mark = text, colour, mark
            self.setAccessibleName(f"{self._name}: {text}" if text else self._name)
            self.update()

    def use_limit(self, limit: float) -> None:
        if limit != self._limit:
            self._limit = limit
            self.update()

    def text(self) -> str:
        return self._text

    def type_pixels(self) -> int:
        return self._font_size()

    def size_of(self, text: str) -> int:
        """Return the pixel size of a line with a mark."""
        return self._size(text, marked=True)

    def fits(self) -> bool:
        """Return whether the whole line is visible in readable type."""
        size = self._font_size()
        font = digit_font(size) if self._digits else text_font(size, bold=True)
        used = QFontMetricsF(font).horizontalAdvance(self._text)
        if self._mark is not None:
            used += 0.95 * size
        return size >= _LEAST_PX and used <= self.width() + 1.0

    def _font_size(self) -> int:
        longest = max(self._text, self._reserve, key=len)
        return self._size(longest, marked=self._mark is not None)

    def _size(self, text: str, *, marked: bool) -> int:
        base = digit_font(10) if self._digits else text_font(10, bold=True)
        width = float(self.width())
        if marked:
            width -= 0.95 * min(self._limit, self.height() / 1.17)
        return fitted(base, text, width, self.height(), self._limit).pixelSize()

    def paintEvent(self, event: QPaintEvent) -> None:
        size = self._font_size()
        painter = QPainter(self)
        painter.setFont(digit_font(size) if self._digits else text_font(size, bold=True))
        colour = self._colour or self._theme.text
        box = QRectF(self.rect())
        if self._mark is not None:
            side = 0.72 * size
            advance = painter.fontMetrics().horizontalAdvance(self._text)
            left = 0.0
            if self._align & Qt.AlignmentFlag.AlignRight:
                left = box.width() - advance - 0.95 * size
            elif self._align & Qt.AlignmentFlag.AlignHCenter:
                left = 0.5 * (box.width() - advance - 0.95 * size)
            left = max(left, 0.0)
            mark_box = QRectF(left, 0.5 * (box.height() - side), side, side)
            paint_mark(painter, self._mark, mark_box, colour, self._theme.background)
            box.setLeft(left + 0.95 * size)
            align = Qt.AlignmentFlag.AlignLeft
        else:
            align = self._align
        painter.setPen(QColor(colour))
        painter.drawText(box, align | Qt.AlignmentFlag.AlignVCenter, self._text)
