"""Accessibility: zoom for all screens, and targets for gloves.

In: settings of the window, the screen, the contents of a window. Out: the same window, enlarged,
with targets for a gloved finger, and scrolled if it no longer fits.

Read `_zoom` (scale factor; scrolls pages that do not fit, except the far view) and
`_hands_and_eyes` (targets of 15 mm, by the physical size of a pixel, with a line to measure for
screens of unknown size; joins all to the keys and settings of a window).
It must not know any page: it uses the widgets that it finds.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_gui.access._hands_and_eyes import (
        RULER_PX, TARGET_MM, HandsAndEyes, RulerLine, TouchTargets, screen_size,
    )  # fmt: skip
    from ocmm_gui.access._zoom import (
        PageStack, Zoom, ZoomArea, fitting_factor, screen_factor, zoom_before_start,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "RULER_PX", "TARGET_MM", "HandsAndEyes", "PageStack", "RulerLine", "TouchTargets", "Zoom",
    "ZoomArea", "fitting_factor", "screen_factor", "screen_size", "zoom_before_start",
]  # fmt: skip
