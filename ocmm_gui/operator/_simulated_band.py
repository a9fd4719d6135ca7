"""Band at the edge of every screen that marks simulated measurements."""

from __future__ import annotations

from PySide6.QtCore import QPointF
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QResizeEvent

from ocmm_core.inspection.evaluation import SIMULATED
from ocmm_gui.kit import CAP_HEIGHT, Painted, far_type, said_word, text_font, tr

_DESK_SHARE = 0.022
"""Type size over window height at the desk."""


class SimulatedBand(Painted):
    """One word, vertical, repeated as space permits. Costs only width: height is scarce."""

    def __init__(self) -> None:
        super().__init__(tr("Simulated: not a real part"), (30, 400), (12, 60))
        self._far = False
        self.hide()

    def show_far(self, far: bool) -> None:
        """Set the type for far or near reading."""
        self._far = far
        self._fit()

    def type_pixels(self) -> int:
        if self._far:
            return far_type(self)
        return max(13, round(_DESK_SHARE * self.window().height()))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the width that the type needs."""
        super().resizeEvent(event)
        self._fit()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(self._theme.warn))
        painter.setPen(QColor(self._theme.background))
        font = text_font(self.type_pixels(), bold=True)
        painter.setFont(font)
        text = said_word(SIMULATED)
        word = painter.fontMetrics().horizontalAdvance(text)
        times = max(1, self.height() // (2 * word))
        share = self.height() / times
        painter.translate(0.0, self.height())
        painter.rotate(-90.0)
        # Centre the capitals: the descent is unused.
        base = 0.5 * (self.width() + CAP_HEIGHT * self.type_pixels())
        for index in range(times):
            painter.drawText(QPointF((index + 0.5) * share - 0.5 * word, base), text)

    def _fit(self) -> None:
        self.setFixedWidth(round(1.25 * CAP_HEIGHT * self.type_pixels()))
        self.update()
