"""Painted widgets, their ink, and marks: a shape per outcome, so that nothing depends on colour."""

from __future__ import annotations

from enum import Enum

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import (
    QBrush,
    QColor,
    QFont,
    QFontMetricsF,
    QGradient,
    QPainter,
    QPaintEvent,
    QPen,
    QPolygonF,
)
from PySide6.QtWidgets import QSizePolicy, QWidget

from ocmm_core.inspection.evaluation import FeatureState, FeatureView, StatusWord
from ocmm_core.tolerances.decisions import Verdict
from ocmm_gui.kit._texts import said_word
from ocmm_gui.kit._theme import Theme, Themed, digit_font, fitted, text_font

SCENE_SIZE, SCENE_LEAST = (460, 340), (200, 130)
"""Size and minimum of pictures that fill most of a page."""


class PaintedWidget(Themed, QWidget):
    """A widget painted in the colours of a theme; ``size``: hint, ``least``: legible, px."""

    def __init__(self, name: str, size: tuple[int, int], least: tuple[int, int]) -> None:
        super().__init__()
        self._size_hint = QSize(*size)
        self._least_size = QSize(*least)
        self.setAccessibleName(name)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    def sizeHint(self) -> QSize:
        return self._size_hint

    def minimumSizeHint(self) -> QSize:
        return self._least_size

    def _painter(self) -> QPainter:
        """Return an antialiased painter; only for use in `paintEvent`."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        return painter

    def _paint_panel(self, painter: QPainter) -> QRectF:
        """Paint and return the frame of a panel, highlighted if it has the focus."""
        frame = QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5)
        theme = self._theme
        pen = QPen(QColor(theme.border), theme.border_px)
        if self.hasFocus():
            pen = QPen(QColor(theme.accent), theme.border_px + 1)
        ink(painter, pen, QColor(self._theme.panel))
        painter.drawRoundedRect(frame, 6, 6)
        return frame


def ink(
    painter: QPainter,
    pen: QPen | QColor | Qt.PenStyle | None = None,
    brush: QBrush | QColor | QGradient | Qt.BrushStyle | None = None,
    *,
    font: QFont | None = None,
) -> None:
    """Set pen, brush and font of a painter, if given."""
    if pen is not None:
        painter.setPen(pen)
    if brush is not None:
        painter.setBrush(brush)
    if font is not None:
        painter.setFont(font)


class Mark(Enum):
    """A shape in a circle, a square or a triangle."""

    OPEN = "empty circle"
    ACTIVE = "arrow"
    DONE = "full circle"
    GOOD = "tick"
    BAD = "cross"
    DOUBT = "triangle"

    @property
    def colour(self) -> str:
        """Name of its colour in a theme."""
        return {
            Mark.GOOD: "good",
            Mark.BAD: "bad",
            Mark.DOUBT: "warn",
            Mark.ACTIVE: "accent",
            Mark.DONE: "text",
            Mark.OPEN: "muted",
        }[self]


def feature_mark(feature: FeatureView, verdict: Verdict | None) -> Mark:
    """Return the mark of a feature in the plan; ``verdict`` is that of the feature."""
    if feature.state is FeatureState.ACTIVE:
        return Mark.ACTIVE
    if feature.state in (FeatureState.PENDING, FeatureState.SKIPPED):
        return Mark.OPEN
    return verdict_mark(verdict)


def verdict_mark(verdict: Verdict | None) -> Mark:
    return {
        Verdict.CONFORM: Mark.GOOD,
        Verdict.NOT_CONFORM: Mark.BAD,
        Verdict.NOT_PROVEN: Mark.DOUBT,
        Verdict.NOT_MEASURED: Mark.OPEN,
        Verdict.PROVISIONAL: Mark.OPEN,
        None: Mark.DONE,
    }[verdict]


def status_mark(status: StatusWord) -> Mark:
    return {
        StatusWord.READY: Mark.GOOD,
        StatusWord.MEASURING: Mark.ACTIVE,
        StatusWord.NOT_READY: Mark.DOUBT,
        StatusWord.INACCURATE: Mark.DOUBT,
        StatusWord.LOST: Mark.BAD,
        StatusWord.FAILED: Mark.BAD,
    }[status]


def mark_colour(theme: Theme, mark: Mark) -> str:
    return theme.colour(mark.colour)


def paint_mark(painter: QPainter, mark: Mark, box: QRectF, colour: str, inside: str) -> None:
    """Paint a mark into a square box; ``inside`` is the colour of its cut-outs."""
    size = box.width()
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.translate(box.topLeft())
    painter.scale(size, size)
    fill, hole = QColor(colour), QPen(QColor(inside), 0.12)
    hole.setCapStyle(Qt.PenCapStyle.RoundCap)
    hole.setJoinStyle(Qt.PenJoinStyle.RoundJoin)
    ink(painter, Qt.PenStyle.NoPen, fill)
    if mark is Mark.OPEN:
        ink(painter, QPen(fill, 0.1), Qt.BrushStyle.NoBrush)
        painter.drawEllipse(QRectF(0.12, 0.12, 0.76, 0.76))
    elif mark is Mark.ACTIVE:
        painter.drawPolygon(_polygon((0.15, 0.08), (0.92, 0.5), (0.15, 0.92)))
    elif mark is Mark.DONE:
        painter.drawEllipse(QRectF(0.12, 0.12, 0.76, 0.76))
    elif mark is Mark.GOOD:
        painter.drawEllipse(QRectF(0.04, 0.04, 0.92, 0.92))
        painter.setPen(hole)
        painter.drawPolyline(_polygon((0.28, 0.53), (0.44, 0.69), (0.73, 0.33)))
    elif mark is Mark.BAD:
        painter.drawRoundedRect(QRectF(0.06, 0.06, 0.88, 0.88), 0.12, 0.12)
        painter.setPen(hole)
        painter.drawLine(QPointF(0.3, 0.3), QPointF(0.7, 0.7))
        painter.drawLine(QPointF(0.7, 0.3), QPointF(0.3, 0.7))
    else:
        painter.drawPolygon(_polygon((0.5, 0.04), (0.98, 0.94), (0.02, 0.94)))
        painter.setPen(hole)
        painter.drawLine(QPointF(0.5, 0.38), QPointF(0.5, 0.62))
        painter.drawPoint(QPointF(0.5, 0.8))
    painter.restore()


def _polygon(*corners: tuple[float, float]) -> QPolygonF:
    return QPolygonF([QPointF(x, y) for x, y in corners])


_LEAST_PX = 9


class FitText(PaintedWidget):
    """One line in the largest type that also fits ``reserve``: digits do not resize it.

    `limit`: Greatest type, px. `high`: Fixed height, px; 0: that of the layout.
    """

    def __init__(
        self,
        name: str,
        *,
        limit: float = 400.0,
        align: Qt.AlignmentFlag = Qt.AlignmentFlag.AlignLeft,
        digits: bool = False,
        reserve: str = "",
        high: int = 0,
    ) -> None:
        super().__init__(name, (80, 24), (20, 14))
        if high:
            self.setFixedHeight(high)
        self._name = name
        self._limit = limit
        self._align = align
        self._digits = digits
        self._reserve = reserve
        self._text, self._colour = "", "text"
        self._mark: Mark | None = None

    def show_text(self, text: str, colour: str = "", mark: Mark | None = None) -> None:
        """Show a line; `colour`: of the theme, by default that of the mark, or of text."""
        colour = colour or ("text" if mark is None else mark.colour)
        if (text, colour, mark) != (self._text, self._colour, self._mark):
            self._text, self._colour, self._mark = text, colour, mark
            self.setAccessibleName(f"{self._name}: {text}" if text else self._name)
            self.update()

    def show_verdict(self, text: str, verdict: Verdict | None) -> None:
        """Show a verdict in words with its mark; without one muted, and without a mark."""
        if verdict is None:
            self.show_text(text, "muted")
        else:
            self.show_text(text, mark=verdict_mark(verdict))

    def show_status(self, status: StatusWord) -> None:
        """Show the word of a status with its mark."""
        self.show_text(said_word(status.value), mark=status_mark(status))

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
        return self._size(max(self._text, self._reserve, key=len), marked=self._mark is not None)

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
        colour = self._theme.colour(self._colour)
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
