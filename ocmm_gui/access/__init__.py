"""Accessibility: zoom for all screens, and targets for gloves.

In: settings of the window, the screen, the contents of a window. Out: the same window, enlarged,
with targets for a gloved finger, and scrolled if it no longer fits.

Read `_zoom` (scale factor), `_zoom_area` (scrolls pages that do not fit, except the far view),
`_screen` (physical size of a pixel), `_touch` (targets of 15 mm), `_ruler` (a line to measure, for
screens of unknown size), `_hands_and_eyes` (joins all to the keys and settings of a window).
It must not know any page: it uses the widgets that it finds.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.access._hands_and_eyes import HandsAndEyes
    from ocmm_gui.access._ruler import RulerLine
    from ocmm_gui.access._screen import RULER_PX, ScreenSize, screen_size
    from ocmm_gui.access._touch import TARGET_MM, TouchTargets
    from ocmm_gui.access._zoom import Zoom, fitting_factor, screen_factor, zoom_before_start
    from ocmm_gui.access._zoom_area import PageStack, ZoomArea
else:
    __getattr__ = door(
        __name__,
        _hands_and_eyes="HandsAndEyes",
        _ruler="RulerLine",
        _screen="RULER_PX ScreenSize screen_size",
        _touch="TARGET_MM TouchTargets",
        _zoom="Zoom fitting_factor screen_factor zoom_before_start",
        _zoom_area="PageStack ZoomArea",
    )

__all__ = [
    "RULER_PX", "TARGET_MM", "HandsAndEyes", "PageStack", "RulerLine", "ScreenSize", "TouchTargets",
    "Zoom", "ZoomArea", "fitting_factor", "screen_factor", "screen_size",
    "zoom_before_start",
]  # fmt: skip
