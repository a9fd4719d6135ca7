"""Scenes of the virtual rig for calibration, verification and tip checks.

In: a true rig, and the remaining steps of a guided procedure. Out: frames of targets, bars and
tips.

Start with `_scenes` (targets, waved probe, bar, nests, pivot, tips), `_motions` (their motion),
`_calibrating` (camera views, frame source). `_made_records` provides finished records.
It imports the procedures that it serves; they do not import it.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_sim.calibration_scenes._calibrating import (
        CalibratingScript, CalibratingSource, CalibrationScenesRig,
    )  # fmt: skip
    from ocmm_sim.calibration_scenes._made_records import (
        RECORDS_MADE, made_camera_record, made_probe_record, made_tip_record, made_verification,
    )  # fmt: skip
    from ocmm_sim.calibration_scenes._motions import SEATS, WAY_S, best_seen, stand_of
    from ocmm_sim.calibration_scenes._scenes import (
        FrameMove, FreeMotionScene, Scene, ScriptedJump, SeatFault, ShowBar, SweepProbe,
        TargetScene, TipFault, TouchSeats, TouchSphere, TouchWithTip,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "RECORDS_MADE", "SEATS", "WAY_S", "CalibratingScript", "CalibratingSource",
    "CalibrationScenesRig", "FrameMove", "FreeMotionScene", "Scene", "ScriptedJump", "SeatFault",
    "ShowBar", "SweepProbe", "TargetScene", "TipFault", "TouchSeats", "TouchSphere", "TouchWithTip",
    "best_seen", "made_camera_record", "made_probe_record", "made_tip_record", "made_verification",
    "stand_of",
]  # fmt: skip
