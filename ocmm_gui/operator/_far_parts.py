"""Parts of the far view, readable at three metres: message, and ring about the next point."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPaintEvent, QPen

from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import Target, cue
from ocmm_gui.kit import (
    PaintedWidget,
    digit_font,
    distance_words,
    far_type,
    fitted,
    ink,
    text_font,
    tr,
    wrapped_pixels,
)

_LINE = 1.17
_LEAST_PX = 16
"""Minimum size for text below the step."""
_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter


class FarMessage(PaintedWidget):
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
        ink(painter, QColor(self._theme.muted), font=font)
        painter.drawText(second, _LEFT, self._words)

    def _first(self) -> QRectF:
        """Return the place of the first sentence: one line if there is a second one."""
        box = QRectF(self.rect())
        if not self._trouble:
            box.setHeight(min(_LINE * far_type(self) + 1.0, box.height()))
        return box


class TargetRing(PaintedWidget):
    """A ring about a dot; its radius is the distance of the ball from the target."""

    def __init__(self) -> None:
        super().__init__(tr("Distance to the next point"), (120, 120), (60, 60))
        self._distance: float | None = None
        self._approximate = False

    def show_target(self, target: Target | None, tip_world: Float | None) -> None:
        """Show the distance of the ball (3,), mm, from a target; None shows nothing."""
        distance = None if target is None or tip_world is None else target.distance(tip_world)
        approximate = target is not None and target.approximate
        if (distance, approximate) != (self._distance, self._approximate):
            self._distance, self._approximate = distance, approximate
            self.setAccessibleDescription(self.words())
            self.update()

    def words(self) -> str:
        """Return the distance in words; empty if unknown."""
        if self._distance is None:
            return ""
        return distance_words(self._distance, approximate=self._approximate)

    def paintEvent(self, event: QPaintEvent) -> None:
        if self._distance is None:
            return
        painter = self._painter()
        high = max(16.0, 0.3 * self.height())
        side = min(float(self.width()), self.height() - high)
        middle = QPointF(0.5 * self.width(), 0.5 * side)
        led = cue(self._distance)
        colour = QColor(self._theme.good if led.arrived else self._theme.accent)
        dot = max(3.0, 0.03 * side)
        greatest = 0.5 * side - 4.0
        ink(painter, QPen(colour, max(3.0, 0.04 * side)), Qt.BrushStyle.NoBrush)
        radius = greatest * led.ring_px_fraction
        painter.drawEllipse(middle, radius, radius)
        ink(painter, Qt.PenStyle.NoPen, colour)
        painter.drawEllipse(middle, dot, dot)
        mark = "≈" if self._approximate else ""
        text = tr("there") if led.arrived else f"{mark}{self._distance:.0f} mm"
        base = text_font(10, bold=True) if led.arrived else digit_font(10)
        ink(painter, QColor(self._theme.text), font=fitted(base, text, self.width(), high, 64))
        box = QRectF(0.0, self.height() - high, self.width(), high)
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, text)
