"""A hand at the virtual rig that somebody leads, from outside, over the part.

In: the virtual rig, and wishes where the ball shall be. Out: the motion of the probe, frame by
frame, with contact on the true surfaces; what the part looks like.

Read `_led_hand` (the hand and its box of wishes), `_solids` (what a ball cannot enter) with
`_kernel` (its compiled loops), `_shape_mesh` (what that looks like).
It must not know who leads it, nor what becomes of the frames.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.simulation.hand._led_hand import (
        CLEAR_MM,
        FARTHEST_MM,
        NEAREST_MM,
        HandView,
        MouseHand,
        Wish,
    )
else:
    __getattr__ = door(
        __name__,
        _led_hand="CLEAR_MM FARTHEST_MM HandView MouseHand NEAREST_MM Wish",
    )

__all__ = ["CLEAR_MM", "FARTHEST_MM", "NEAREST_MM", "HandView", "MouseHand", "Wish"]
