"""Virtual scene: cameras, operator and part with known truth, down to the pixels.

In: documents of a rig, a probe and a part, a seed. Out: frames as a source, optionally from
rendered pixels, and the true poses of camera, probe and ball.

Start with `_world` (truth) and `_rig` (virtual rig); then `_operator` with `_hand` and
`_touches`, `_surfaces` and `_artefacts`, `_source`. Pixels: `_sensor`,
`_exposure`, `_pixel_frames`. `_kernels` holds the compiled loops; `_probe_study` is the simulation
of the thesis. Truth and documents are separate: the product receives the documents only.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_sim.scene import _exposure as exposure
    from ocmm_sim.scene import _kernels as kernels
    from ocmm_sim.scene import _surfaces as surfaces
    from ocmm_sim.scene._artefacts import (
        Part, PartDocument, PartPose, TrueFeature, TrueTouch, load_part,
    )  # fmt: skip
    from ocmm_sim.scene._hand import attitude_at, rotation_vector, segment_of
    from ocmm_sim.scene._kernels import BUTTON_DOWN_S
    from ocmm_sim.scene._operator import REST_S, Missing, Motion, draw_tremor
    from ocmm_sim.scene._pixel_frames import PixelFrames, PixelScript
    from ocmm_sim.scene._probe_study import ProbeStudy, StudyResult, draw_targets, run_study
    from ocmm_sim.scene._rig import CameraFrames, VirtualRig
    from ocmm_sim.scene._sensor import Sensor, SensorOptions, normal_table
    from ocmm_sim.scene._source import (
        MOST_ROUNDS, LedHand, RigScript, SimulatedSource, decode_script,
    )  # fmt: skip
    from ocmm_sim.scene._surfaces import TouchedEntry
    from ocmm_sim.scene._touches import sample
    from ocmm_sim.scene._world import (
        ScriptedBump, ScriptedNudge, ScriptedOcclusion, SpotPattern, World, WorldOptions, bumped,
        draw_pattern, draw_world, nudged, white_noise,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "BUTTON_DOWN_S", "MOST_ROUNDS", "REST_S", "CameraFrames", "LedHand", "Missing", "Motion",
    "Part", "PartDocument", "PartPose", "PixelFrames", "PixelScript", "ProbeStudy", "RigScript",
    "ScriptedBump", "ScriptedNudge", "ScriptedOcclusion", "Sensor", "SensorOptions",
    "SimulatedSource", "SpotPattern", "StudyResult", "TouchedEntry", "TrueFeature", "TrueTouch",
    "VirtualRig", "World", "WorldOptions", "attitude_at", "bumped", "decode_script", "draw_pattern",
    "draw_targets", "draw_tremor", "draw_world", "exposure", "kernels", "load_part", "normal_table",
    "nudged", "rotation_vector", "run_study", "sample", "segment_of", "surfaces", "white_noise",
]  # fmt: skip
