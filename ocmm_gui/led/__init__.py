"""Probe of a virtual rig, led by the user of the window.

In: mouse and keys over the 3-D view, and a leadable hand of the core. Out: the holder of the probe,
its target, and a guided tour.

Start with `_hand_control` (joins all); then `_hand_strip` (shows the holder of the probe, and the
tour: two minutes, step by step).
It must not depend on the motion of the hand or on its frames.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_gui.led._hand_control import HandControl, LedProbe
    from ocmm_gui.led._hand_strip import TOUR
else:
    __getattr__ = lazy_exports(__name__)

__all__ = ["TOUR", "HandControl", "LedProbe"]
