"""Records of the standard probe with a tip, for tests."""

from __future__ import annotations

from datetime import timedelta

from ocmm_core.calibration.records import (
    CHECK_SCHEMA,
    Check,
    ProbeRecord,
    TipCheckRecord,
    TipRecord,
    record_hash,
)
from ocmm_core.documents import resource
from ocmm_core.tracking import load_probe
from ocmm_sim.calibration_scenes import RECORDS_MADE as MADE
from ocmm_sim.calibration_scenes import made_probe_record as make_probe_record
from ocmm_sim.calibration_scenes import made_tip_record as make_tip_record

__all__ = ["MADE", "PROBE", "make_probe_record", "make_tip_check", "make_tip_record"]

PROBE = load_probe(resource("probes", "standard.toml"))


def make_tip_check(
    calibration: ProbeRecord, qualification: TipRecord, *, passed: bool = True
) -> TipCheckRecord:
    """Return a quick check of a tip."""
    diameter = Check(
        name="diameter", measured_mm=5.999 if passed else 6.05, certified_mm=5.998,
        expanded_mm=0.004, limit_mm=0.02,
    )  # fmt: skip
    return TipCheckRecord(
        schema=CHECK_SCHEMA,
        probe=calibration.probe,
        tip=calibration.tip,
        made_utc=(MADE + timedelta(days=1)).isoformat(),
        made_by="inspector",
        software="1",
        temperature_c=None,
        rig=calibration.rig,
        rig_identity=calibration.rig_identity,
        data_sha256="d" * 64,
        calibration=record_hash(calibration),
        qualification=record_hash(qualification),
        checks=(diameter,),
        artefacts=(),
        passed=passed,
    )
