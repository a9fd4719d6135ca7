"""Physical size of a screen's pixels, its plausibility, and a line to be measured with a ruler."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import QPointF, QSize, QSizeF, Qt
from PySide6.QtGui import QColor, QPaintEvent, QPen, QScreen
from PySide6.QtWidgets import QSizePolicy

from ocmm_gui.kit import PaintedWidget, ink, localised, text_font, tr

RULER_PX = 500
"""Dots in the measured line: 78 mm on 3840 at 27 inch, 207 mm on 1280 at 24 inch."""

_PITCH_MM = (0.04, 1.0)
"""A telephone has 0.05 mm a dot, a television of 85 inch 0.98 mm."""
_ASPECT = 0.12
"""Tolerated relative difference of both pitches; dots are square."""
_PLACEHOLDERS = ((160, 90), (160, 100), (16, 9), (16, 10), (1600, 900), (1600, 1000))
"""Aspect ratios that screens and projectors report instead of their size, in mm or cm."""
_UNKNOWN_MM = 25.4 / 96.0
"""Default dot size of systems."""


@dataclass(frozen=True, slots=True)
class ScreenSize:
    mm_per_px: float
    known: bool
    """Measured, or plausible by the screen."""


def screen_size(screen: QScreen, ruler_mm: float | None) -> ScreenSize:
    """Return the pixel size; `ruler_mm`: measured length of `RULER_PX` dots, or None."""
    ratio = screen.devicePixelRatio()
    if ruler_mm is not None:
        return ScreenSize(ruler_mm / RULER_PX * ratio, known=True)
    dots = QSizeF(screen.geometry().size()) * ratio
    pitch = believed_pitch(screen.physicalSize(), dots)
    if pitch is None:
        # Not times the ratio: too large a target is better than too small a one.
        return ScreenSize(_UNKNOWN_MM, known=False)
    return ScreenSize(pitch * ratio, known=True)


def believed_pitch(physical: QSizeF, dots: QSizeF) -> float | None:
    """Return the size of a dot, mm; None if the reported width and height are implausible."""
    if min(physical.width(), physical.height(), dots.width(), dots.height()) <= 0.0:
        return None
    if (round(physical.width()), round(physical.height())) in _PLACEHOLDERS:
        return None
    wide, high = physical.width() / dots.width(), physical.height() / dots.height()
    if abs(wide - high) > _ASPECT * max(wide, high):
        return None
    # The smaller one gives the larger target.
    pitch = min(wide, high)
    return pitch if _PITCH_MM[0] <= pitch <= _PITCH_MM[1] else None


_HIGH_PX, _END_PX = 56, 12


class RulerLine(PaintedWidget):
    """A line of `RULER_PX` dots, and its length by the screen."""

    def __init__(self) -> None:
        super().__init__(
            tr("Line to be measured with a ruler"), (RULER_PX + 20, _HIGH_PX), (60, _HIGH_PX)
        )
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self._ruler_mm: float | None = None

    def show_length(self, ruler_mm: float | None) -> None:
        self._ruler_mm = ruler_mm
        self.setAccessibleDescription(self.words())
        self.update()

    def words(self) -> str:
        size = screen_size(self.screen(), self._ruler_mm)
        length = localised(f"{size.mm_per_px * self.length_px():.0f}")
        if self._ruler_mm is not None:
            return tr("Measured: {length} mm.").format(length=length)
        if size.known:
            return tr("The screen says {length} mm. Measure it if that is wrong.").format(
                length=length
            )
        return tr("This screen does not tell its size. Measure the line with a ruler.")

    def length_px(self) -> float:
        """Return the length of the line in pixels of the layout."""
        return RULER_PX / self.devicePixelRatioF()

    def minimumSizeHint(self) -> QSize:
        """Return room for the whole line: part of it would be measured wrong."""
        return QSize(round(self.length_px()) + 4, _HIGH_PX)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        painter.setPen(QPen(QColor(self._theme.text), 1.0))
        left, right, y = 1.5, 1.5 + self.length_px(), 0.5 * _END_PX + 4.0
        painter.drawLine(QPointF(left, y), QPointF(right, y))
        for x in (left, right):
            painter.drawLine(QPointF(x, y - 0.5 * _END_PX), QPointF(x, y + 0.5 * _END_PX))
        ink(painter, QColor(self._theme.muted), font=text_font(14))
        box = self.rect().adjusted(0, _END_PX + 8, 0, 0)
        flags = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap
        painter.drawText(box, flags, self.words())
