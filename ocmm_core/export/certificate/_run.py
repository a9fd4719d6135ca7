"""A verification of the cameras as a run of a paper: nothing is judged again."""

from __future__ import annotations

from collections.abc import Sequence

from ocmm_core.calibration.records import (
    CalibrationStore,
    CameraRecord,
    Check,
    VerificationRecord,
    record_hash,
)
from ocmm_core.errors import InputError
from ocmm_core.export.certificate._content import CertificateLine, CertificateRun, Status


def calibration_in(store: CalibrationStore) -> CameraRecord:
    """Return the calibration in use; raise InputError where there is none to write of."""
    record = store.active()
    if record is None:
        raise InputError(
            "certificate.no_calibration",
            "There is no calibration of these cameras.",
            "Calibrate the cameras and verify the calibration (ocmm calibrate).",
        )
    return record


def verification_run(record: VerificationRecord, status: Status) -> CertificateRun:
    """Return a verification of the cameras as one run of a paper."""
    corners = (
        f"Corner {corner.name} not reached: {corner.reason or 'no reason given'}."
        for corner in record.corners
        if not corner.reached
    )
    repeated = (
        (f"{len(record.superseded)} lengths of a line that failed were measured again.",)
        if record.superseded
        else ()
    )
    objections = (one.what for one in record.objections)
    return CertificateRun(
        status=status,
        made_utc=record.made_utc,
        made_by=record.made_by,
        temperature_c=record.temperature_c,
        rule=record.rule,
        lines=lines_of(record.checks),
        passed=record.passed,
        record=record_hash(record),
        data_sha256=record.data_sha256,
        notes=(*repeated, *corners, *objections, *record.notes),
    )


def lines_of(checks: Sequence[Check]) -> tuple[CertificateLine, ...]:
    """Return checks of a record as the errors of a paper."""
    return tuple(
        CertificateLine(one.name, one.measured_mm, one.certified_mm, one.expanded_mm, one.limit_mm)
        for one in checks
    )
