"""Ring that closes round the next point, with the distance, visible from afar."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPaintEvent, QPen

from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import Target, cue
from ocmm_gui.kit import Painted, digit_font, distance_words, fitted, text_font, tr


class TargetRing(Painted):
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
        painter.setPen(QPen(colour, max(3.0, 0.04 * side)))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        radius = greatest * led.ring_px_fraction
        painter.drawEllipse(middle, radius, radius)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(colour)
        painter.drawEllipse(middle, dot, dot)
        mark = "≈" if self._approximate else ""
        text = tr("there") if led.arrived else f"{mark}{self._distance:.0f} mm"
        base = text_font(10, bold=True) if led.arrived else digit_font(10)
        painter.setFont(fitted(base, text, self.width(), high, 64))
        painter.setPen(QColor(self._theme.text))
        box = QRectF(0.0, self.height() - high, self.width(), high)
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, text)
