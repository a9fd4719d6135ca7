"""The probe of a virtual rig in the hands of whoever sits before the window.

In: mouse and keys over the 3-D view, and a hand of the core that can be led. Out: who holds the
probe, where it is to go, and what to try with it.

Read `_hand_control` (joins all), `_hand_strip` (says
who holds the probe), `_tour` (two minutes, one thing to do after another).
It must not know how a hand moves, nor what becomes of its frames.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.led._hand_control import HandControl, LedProbe
    from ocmm_gui.led._tour import TOUR
else:
    __getattr__ = door(__name__, _hand_control="HandControl LedProbe", _tour="TOUR")

__all__ = ["TOUR", "HandControl", "LedProbe"]
