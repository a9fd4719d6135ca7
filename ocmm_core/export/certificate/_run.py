"""A verification of the cameras as a run of a certificate, without judging again."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ocmm_core.calibration.records import (
    CalibrationStore,
    CameraRecord,
    Check,
    VerificationRecord,
    record_hash,
)
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.export.certificate._content import CertificateLine, CertificateRun, Status
from ocmm_core.seals import SealState


def calibration_in(store: CalibrationStore) -> CameraRecord:
    """Return the calibration in use; InputError if missing, or its history is not vouched for."""
    record = store.active()
    if record is None:
        raise InputError(
            "certificate.no_calibration",
            "There is no calibration of these cameras.",
            "Calibrate the cameras and verify the calibration (ocmm calibrate).",
        )
    require_vouched(store.folder, store.signer, store.exchanged)
    return record


def require_vouched(path: Path, signer: SealState, exchanged: OcmmError | None = None) -> None:
    """Raise OcmmError for records without a trusted signature; `exchanged`: if not the newest."""
    if exchanged is not None:
        raise exchanged
    if signer.sound:
        return
    raise InputError(
        "certificate.not_signed",
        f"{path}: a certificate would vouch for this. {signer.fault}",
        "Measure again with this version. For records of another station of yours, compare its "
        "key and trust it: ocmm key trust.",
    )


def verification_run(record: VerificationRecord, status: Status) -> CertificateRun:
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
    objections = [one.what for one in record.objections]
    if record.arose is not None:
        objections.append(record.arose.sentence)
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
    return tuple(
        CertificateLine(one.name, one.measured_mm, one.certified_mm, one.expanded_mm, one.limit_mm)
        for one in checks
    )
