"""Hands and eyes: how large everything is, for gloves, for weak eyes and for every screen.

In: settings of the window, the screen, whatever stands in a window. Out: the same window, larger,
with targets that a gloved finger hits, and scrolled where it no longer fits.

Read `_zoom` (how large everything is painted), `_zoom_area` (what no longer fits is scrolled, and
the far view is not), `_screen` (how large a pixel really is), `_touch` (targets of 15 mm),
`_ruler` (a line to be measured where a screen does not tell its size), `_hands_and_eyes` (joins
all to the keys and settings of a window).
It must not know any page: it takes the widgets that it finds.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.access._hands_and_eyes import HandsAndEyes
    from ocmm_gui.access._ruler import RulerLine
    from ocmm_gui.access._screen import RULER_PX, ScreenSize, screen_size
    from ocmm_gui.access._touch import TARGET_MM, TouchTargets, small_targets
    from ocmm_gui.access._zoom import Zoom, fitting_factor, screen_factor, zoom_before_start
    from ocmm_gui.access._zoom_area import PageStack, ZoomArea
else:
    __getattr__ = door(
        __name__,
        _hands_and_eyes="HandsAndEyes",
        _ruler="RulerLine",
        _screen="RULER_PX ScreenSize screen_size",
        _touch="TARGET_MM TouchTargets small_targets",
        _zoom="Zoom fitting_factor screen_factor zoom_before_start",
        _zoom_area="PageStack ZoomArea",
    )

__all__ = [
    "RULER_PX", "TARGET_MM", "HandsAndEyes", "PageStack", "RulerLine", "ScreenSize", "TouchTargets",
    "Zoom", "ZoomArea", "fitting_factor", "screen_factor", "screen_size", "small_targets",
    "zoom_before_start",
]  # fmt: skip
