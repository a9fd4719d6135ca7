"""Physical size of a screen's pixels, and its plausibility."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import QSizeF
from PySide6.QtGui import QScreen

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
    """Return the size of a screen's pixels.

    `ruler_mm`: measured length of a line of `RULER_PX` dots, or None.
    """
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
    """Return the size of a dot, mm; None if the reported size is implausible.

    `physical`: reported width and height, mm.
    """
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
