"""Records of the standard probe with a tip, for tests."""

from __future__ import annotations

from ocmm_core.documents import resource
from ocmm_core.simulation.calibration_scenes import RECORDS_MADE as MADE
from ocmm_core.simulation.calibration_scenes import made_probe_record as make_probe_record
from ocmm_core.simulation.calibration_scenes import made_tip_check as make_tip_check
from ocmm_core.simulation.calibration_scenes import made_tip_record as make_tip_record
from ocmm_core.tracking import load_probe

__all__ = ["MADE", "PROBE", "make_probe_record", "make_tip_check", "make_tip_record"]

PROBE = load_probe(resource("probes", "standard.toml"))
