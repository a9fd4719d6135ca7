"""Scenes of the virtual rig for calibration, verification and tip checks.

In: a true rig, and the remaining steps of a guided procedure. Out: frames of targets, bars and
tips.

Start with `_scenes` (targets, waved probe, bar, nests), `_motions` (their motion), `_calibrating`
(camera views) and `_calibrating_source` (frame source); then `_pivot_scenes`, `_tip_scenes`,
and `_resting_spots` (averaged spots without frames, for many runs). `_made_records`
and `_made_probe_records` provide finished records.
It imports the procedures that it serves; they do not import it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_sim.calibration_scenes._calibrating import CalibratingScript, CalibrationScenesRig
    from ocmm_sim.calibration_scenes._calibrating_source import CalibratingSource
    from ocmm_sim.calibration_scenes._made_probe_records import made_probe_record, made_tip_record
    from ocmm_sim.calibration_scenes._made_records import (
        RECORDS_MADE,
        made_camera_record,
        made_verification,
    )
    from ocmm_sim.calibration_scenes._motions import WAY_S
    from ocmm_sim.calibration_scenes._pivot_scenes import ScriptedJump, SeatFault, SweepProbe
    from ocmm_sim.calibration_scenes._resting_spots import (
        SEATS,
        Holds,
        VirtualRests,
        places_of_bar,
        stand_of,
    )
    from ocmm_sim.calibration_scenes._scenes import (
        FrameMove,
        FreeMotionScene,
        Scene,
        ShowBar,
        TargetScene,
        TouchSeats,
        TouchSphere,
    )
    from ocmm_sim.calibration_scenes._tip_scenes import TipFault, TouchWithTip
else:
    __getattr__ = door(
        __name__,
        _calibrating="CalibratingScript CalibrationScenesRig",
        _calibrating_source="CalibratingSource",
        _made_probe_records="made_probe_record made_tip_record",
        _made_records="RECORDS_MADE made_camera_record made_verification",
        _motions="WAY_S",
        _pivot_scenes="ScriptedJump SeatFault SweepProbe",
        _resting_spots="Holds SEATS VirtualRests places_of_bar stand_of",
        _scenes="FrameMove FreeMotionScene Scene ShowBar TargetScene TouchSeats TouchSphere",
        _tip_scenes="TipFault TouchWithTip",
    )

__all__ = [
    "RECORDS_MADE", "SEATS", "WAY_S", "CalibratingScript", "CalibratingSource",
    "CalibrationScenesRig", "FrameMove", "FreeMotionScene", "Holds", "Scene", "ScriptedJump",
    "SeatFault", "ShowBar", "SweepProbe", "TargetScene", "TipFault", "TouchSeats", "TouchSphere",
    "TouchWithTip", "VirtualRests", "made_camera_record", "made_probe_record", "made_tip_record",
    "made_verification", "places_of_bar", "stand_of",
]  # fmt: skip
