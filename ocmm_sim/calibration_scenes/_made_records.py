"""Records of cameras, the standard probe and a tip, without simulating the calibration."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import msgspec

from ocmm_core.calibration import records
from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.tracking import load_probe

RECORDS_MADE = datetime(2026, 3, 1, 8, 0, tzinfo=UTC)
_RIG = load_rig(resource("rigs", "recommended.toml"))


def made_camera_record(**changes: object) -> records.CameraRecord:
    """Return the record of a calibration that reproduced the rig document."""
    empty = records.ResidualMap(columns=1, rows=1, mean_u_px=(0.0,), mean_v_px=(0.0,), count=(0,))
    record = records.CameraRecord(
        schema=records.SCHEMA,
        rig=_RIG.name,
        method="known points",
        made_utc=RECORDS_MADE.isoformat(),
        valid_until_utc=(RECORDS_MADE + timedelta(days=365)).isoformat(),
        made_by="technician",
        software="1",
        temperature_c=20.5,
        frame_rate_hz=_RIG.frame_rate_hz,
        noise=_RIG.noise,
        cameras=tuple(
            records.entry_of(c, a) for c, a in zip(_RIG.cameras, _RIG.aliases, strict=True)
        ),
        covariance=tuple(tuple(row) for row in _RIG.parameter_covariance.tolist()),
        volume_min=(-200.0, -100.0, -200.0),
        volume_max=(200.0, 100.0, 200.0),
        hull=((0.0, 0.0, 0.0),),
        residual_maps=(empty, empty),
        rms_px=0.0105,
        chi2_per_dof=1.0,
        points=400,
        outliers=(),
        data_sha256="a" * 64,
        artefacts=(),
        previous="",
    )
    return msgspec.structs.replace(record, **changes)


def made_verification(
    record: records.CameraRecord, *, passed: bool = True
) -> records.VerificationRecord:
    """Return a verification of ``record`` with one length."""
    return records.VerificationRecord(
        schema=records.VERIFICATION_SCHEMA,
        calibration=records.record_hash(record),
        made_utc=RECORDS_MADE.isoformat(),
        made_by="technician",
        software="1",
        temperature_c=20.5,
        rule="every length within its limit",
        checks=(
            records.Check(
                name="line 1",
                measured_mm=400.01,
                certified_mm=400.0,
                expanded_mm=0.002,
                limit_mm=0.02,
            ),
        ),
        artefacts=(),
        data_sha256="b" * 64,
        passed=passed,
    )


_PROBE = load_probe(resource("probes", "standard.toml"))
_NOTHING = (0.0, 0.0, 0.0)


def made_probe_record(**changes: object) -> records.ProbeRecord:
    """Return the record of a sweep that reproduced the probe document."""
    x, y, z = _PROBE.tip_probe.tolist()
    record = records.ProbeRecord(
        schema=records.PROBE_SCHEMA,
        probe=_PROBE.name,
        tip="6 mm",
        made_utc=RECORDS_MADE.isoformat(),
        valid_until_utc=(RECORDS_MADE + timedelta(days=365)).isoformat(),
        made_by="technician",
        software="1",
        temperature_c=20.5,
        rig="recommended",
        rig_identity="b" * 64,
        data_sha256="a" * 64,
        probe_identity=_PROBE.identity,
        leds_mm=tuple((a, b, c) for a, b, c in _PROBE.leds_probe.tolist()),
        tip_mm=(x, y, z),
        covariance=tuple(tuple(row) for row in _PROBE.geometry_covariance.tolist()),
        frames=1000,
        left_out=0,
        ranges_deg=(45.0, 45.0, 20.0),
        attitudes=400,
        rms_px=0.0105,
        chi2_per_dof=1.0,
        thesis_tip_mm=(x, y, z),
        thesis_spread_mm=0.005,
        validation=records.PivotCheck(
            difference_mm=_NOTHING,
            sigma_mm=(0.002, 0.002, 0.002),
            led_difference_mm=0.002,
            place_mm=60.0,
            attitude_deg=20.0,
            articulation_2s_mm=0.005,
            articulation_max_mm=0.006,
        ),
        change_mm=None,
        change_reason="",
        warnings=(),
        forced=False,
        artefacts=(),
        previous="",
    )
    return msgspec.structs.replace(record, **changes)


def made_tip_record(
    calibration: records.ProbeRecord, *, passed: bool = True, days: float = 30.0, **changes: object
) -> records.TipRecord:
    """Return a qualification of the tip of ``calibration``."""
    made = datetime.fromisoformat(calibration.made_utc) + timedelta(hours=1)
    record = records.TipRecord(
        schema=records.TIP_SCHEMA,
        probe=calibration.probe,
        tip=calibration.tip,
        made_utc=made.isoformat(),
        valid_until_utc=(made + timedelta(days=days)).isoformat(),
        made_by="technician",
        software="1",
        temperature_c=20.5,
        rig=calibration.rig,
        rig_identity=calibration.rig_identity,
        data_sha256="c" * 64,
        calibration=records.record_hash(calibration),
        diameter_mm=5.998,
        diameter_sigma_mm=0.002,
        form_mm=0.018,
        points=25,
        point_sigma_mm=0.005,
        articulation_2s_mm=0.006,
        articulation_max_mm=0.007,
        attitudes=5,
        checks=(_check("form", 0.018 if passed else 0.06, 0.0, 0.03),),
        artefacts=(),
        passed=passed,
    )
    return msgspec.structs.replace(record, **changes)


def _check(name: str, measured: float, certified: float, limit: float) -> records.Check:
    return records.Check(
        name=name, measured_mm=measured, certified_mm=certified, expanded_mm=0.004, limit_mm=limit
    )
