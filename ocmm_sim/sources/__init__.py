"""The virtual rig as frame sources, with scenes, hands and true values.

In: a station request, or a guided procedure. Out: feeds of frames, scripts of scenes, true values.

Start with `_specs` (entry points of `ocmm.sources`) and `_feed_makers`, whose operator touches
again what a station refused, also on a part of a plan with a CAD model;
`_calibrate_scenes` completes guided procedures, `_truth` has the true values of a plan.
It must not import screens or commands.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_sim.sources._calibrate_scenes import (
        VirtualSite, acceptance_feed, relocation_by_step, scene_of_tip, scenes_of_known_points,
        scenes_of_tracker, scenes_of_verification, verification_by_step,
    )  # fmt: skip
    from ocmm_sim.sources._feed_makers import part_as_planned, part_text, script_of, segment_of
    from ocmm_sim.sources._specs import GENICAM, NATNET, NDI, PIXELS, QTM, SIMULATED, TRACKER, WIRE
    from ocmm_sim.sources._truth import true_values
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "GENICAM", "NATNET", "NDI", "PIXELS", "QTM", "SIMULATED", "TRACKER", "WIRE", "VirtualSite",
    "acceptance_feed", "part_as_planned", "part_text", "relocation_by_step", "scene_of_tip",
    "scenes_of_known_points", "scenes_of_tracker", "scenes_of_verification", "script_of",
    "segment_of", "true_values", "verification_by_step",
]  # fmt: skip
