"""Hand at the virtual rig, led over the part by the user.

In: the virtual rig, and target positions of the ball. Out: the motion of the probe, frame by frame,
with contact on the true surfaces; a mesh of the part.

Start with `_hand_at_rig` (take over, lead, release) and `_led_hand` (motion, target queue); then
`_solids` (material that stops the ball) with `_kernel` (compiled loops), `_shape_mesh` (visible
shape).
It must not import user interfaces or frame consumers.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_sim.hand._hand_at_rig import HandAtRig, LedView
    from ocmm_sim.hand._led_hand import HandTarget, HandView, MouseHand
else:
    __getattr__ = lazy_exports(__name__)

__all__ = ["HandAtRig", "HandTarget", "HandView", "LedView", "MouseHand"]
