"""What the virtual rig shows while it is calibrated, verified, or its tip is checked.

In: a true rig, and what a guided procedure still lacks. Out: frames of targets, bars and tips.

Read `_scenes` (targets at known points, a waved probe, a bar, nests), `_motions` (how they move),
`_calibrating` (what the cameras see of them), `_calibrating_source` (as a source of frames),
`_pivot_scenes`, `_tip_scenes`, `_verifying`, and `_resting_spots` (averaged spots without the
frames, for many runs).
`_made_records` and `_made_probe_records` are what comes of it, for whoever needs only records.
It knows the procedures that it serves; they do not know it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.simulation.calibration_scenes._calibrating import (
        CalibratingScript,
        CalibrationScenesRig,
    )
    from ocmm_core.simulation.calibration_scenes._calibrating_source import CalibratingSource
    from ocmm_core.simulation.calibration_scenes._made_probe_records import (
        made_probe_record,
        made_tip_check,
        made_tip_record,
    )
    from ocmm_core.simulation.calibration_scenes._made_records import (
        RECORDS_MADE,
        made_camera_record,
        made_verification,
    )
    from ocmm_core.simulation.calibration_scenes._motions import WAY_S
    from ocmm_core.simulation.calibration_scenes._pivot_scenes import ScriptedJump, SweepProbe
    from ocmm_core.simulation.calibration_scenes._resting_spots import (
        Holds,
        VirtualRests,
        places_of_bar,
    )
    from ocmm_core.simulation.calibration_scenes._scenes import (
        FrameMove,
        FreeMotionScene,
        Scene,
        ShowBar,
        TargetScene,
        TouchSeats,
        TouchSphere,
    )
    from ocmm_core.simulation.calibration_scenes._tip_scenes import TipFault, TouchWithTip
    from ocmm_core.simulation.calibration_scenes._verifying import (
        FRAMES,
        SEATS,
        nudge,
        stand_of,
        verify_at_once,
    )
else:
    __getattr__ = door(
        __name__,
        _calibrating="CalibratingScript CalibrationScenesRig",
        _calibrating_source="CalibratingSource",
        _made_probe_records="made_probe_record made_tip_check made_tip_record",
        _made_records="RECORDS_MADE made_camera_record made_verification",
        _motions="WAY_S",
        _pivot_scenes="ScriptedJump SweepProbe",
        _resting_spots="Holds VirtualRests places_of_bar",
        _scenes="FrameMove FreeMotionScene Scene ShowBar TargetScene TouchSeats TouchSphere",
        _tip_scenes="TipFault TouchWithTip",
        _verifying="FRAMES SEATS nudge stand_of verify_at_once",
    )

__all__ = [
    "FRAMES",
    "RECORDS_MADE",
    "SEATS",
    "WAY_S",
    "CalibratingScript",
    "CalibratingSource",
    "CalibrationScenesRig",
    "FrameMove",
    "FreeMotionScene",
    "Holds",
    "Scene",
    "ScriptedJump",
    "ShowBar",
    "SweepProbe",
    "TargetScene",
    "TipFault",
    "TouchSeats",
    "TouchSphere",
    "TouchWithTip",
    "VirtualRests",
    "made_camera_record",
    "made_probe_record",
    "made_tip_check",
    "made_tip_record",
    "made_verification",
    "nudge",
    "places_of_bar",
    "stand_of",
    "verify_at_once",
]
