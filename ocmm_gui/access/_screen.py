"""How large a pixel of a screen really is, and whether the screen can be believed."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import QSizeF
from PySide6.QtGui import QScreen

RULER_PX = 500
"""Dots in the line that is measured: 78 mm on 3840 at 27 inch, 207 mm on 1280 at 24 inch."""

_PITCH_MM = (0.04, 1.0)
"""A telephone has 0.05 mm a dot, a television of 85 inch 0.98 mm."""
_ASPECT = 0.12
"""Relative difference of both sides that a screen of square dots may show."""
_PLACEHOLDERS = ((160, 90), (160, 100), (16, 9), (16, 10), (1600, 900), (1600, 1000))
"""What screens and projectors write instead of their size: their aspect ratio, in mm or cm."""
_UNKNOWN_MM = 25.4 / 96.0
"""What systems take a dot for where nobody knows."""


@dataclass(frozen=True, slots=True)
class ScreenSize:
    """Size of a screen."""

    mm_per_px: float
    known: bool
    """It was measured, or the screen says something that can be so."""


def screen_size(screen: QScreen, ruler_mm: float | None) -> ScreenSize:
    """Return how large the pixels of a screen are.

    Parameters
    ----------
    screen
        What the system says of it.
    ruler_mm
        Length of a line of `RULER_PX` dots as somebody measured it; None where nobody did.
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
    """Return the size of a dot, mm; None where what a screen says of itself cannot be so.

    Parameters
    ----------
    physical
        Width and height, mm, as the screen says.
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
