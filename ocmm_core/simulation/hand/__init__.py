"""A hand at the virtual rig that somebody leads, from outside, over the part.

In: the virtual rig, and wishes where the ball shall be. Out: the motion of the probe, frame by
frame, with contact on the true surfaces; what the part looks like.

Read `_hand_at_rig` (taken over from the robot, led, handed back), `_led_hand` (the hand and its box
of wishes), `_solids` (what a ball cannot enter) with `_kernel` (its compiled loops), `_shape_mesh`
(what that looks like).
It must not know who leads it, nor what becomes of the frames.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.simulation.hand._hand_at_rig import HandAtRig, LedView
    from ocmm_core.simulation.hand._led_hand import HandView, MouseHand, Wish
else:
    __getattr__ = door(
        __name__, _hand_at_rig="HandAtRig LedView", _led_hand="HandView MouseHand Wish"
    )

__all__ = ["HandAtRig", "HandView", "LedView", "MouseHand", "Wish"]
