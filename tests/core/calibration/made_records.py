"""Records as a calibration and a verification make them, for tests."""

from __future__ import annotations

from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_sim.calibration_scenes import RECORDS_MADE as MADE
from ocmm_sim.calibration_scenes import made_camera_record as make_record
from ocmm_sim.calibration_scenes import made_verification as make_verification

__all__ = ["MADE", "RIG", "make_record", "make_verification"]

RIG = load_rig(resource("rigs", "recommended.toml"))
