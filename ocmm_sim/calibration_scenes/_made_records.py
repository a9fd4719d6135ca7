"""Records of calibration and verification without simulating them."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import msgspec

from ocmm_core.calibration.records import (
    SCHEMA,
    VERIFICATION_SCHEMA,
    CameraRecord,
    Check,
    ResidualMap,
    VerificationRecord,
    entry_of,
    record_hash,
)
from ocmm_core.camera import load_rig
from ocmm_core.documents import resource

RECORDS_MADE = datetime(2026, 3, 1, 8, 0, tzinfo=UTC)
_RIG = load_rig(resource("rigs", "recommended.toml"))


def made_camera_record(**changes: object) -> CameraRecord:
    """Return the record of a calibration that reproduced the rig document."""
    empty = ResidualMap(columns=1, rows=1, mean_u_px=(0.0,), mean_v_px=(0.0,), count=(0,))
    record = CameraRecord(
        schema=SCHEMA,
        rig=_RIG.name,
        method="known points",
        made_utc=RECORDS_MADE.isoformat(),
        valid_until_utc=(RECORDS_MADE + timedelta(days=365)).isoformat(),
        made_by="technician",
        software="1",
        temperature_c=20.5,
        frame_rate_hz=_RIG.frame_rate_hz,
        noise=_RIG.noise,
        cameras=tuple(entry_of(c, a) for c, a in zip(_RIG.cameras, _RIG.aliases, strict=True)),
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


def made_verification(record: CameraRecord, *, passed: bool = True) -> VerificationRecord:
    """Return a verification of ``record`` with one length."""
    return VerificationRecord(
        schema=VERIFICATION_SCHEMA,
        calibration=record_hash(record),
        made_utc=RECORDS_MADE.isoformat(),
        made_by="technician",
        software="1",
        temperature_c=20.5,
        rule="every length within its limit",
        checks=(
            Check(
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
