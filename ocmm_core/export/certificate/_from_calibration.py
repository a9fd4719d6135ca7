"""Certificate of a camera calibration: parameters with U, and the state before and after.

Parameters and their covariance are those of the sealed record. The covariance (of a small rotation
and translation in the camera frame, `camera.PARAMETERS`) is propagated to centre and rotation
vector, the quantities of interest, with derivatives by differences of one sigma. A verification of
the cameras is a run of a certificate; it is not judged again.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.calibration.records import (
    CalibrationStore,
    CameraRecord,
    TipRecord,
    VerificationRecord,
    entry_of,
    record_hash,
    rig_from_record,
)
from ocmm_core.camera import N_PARAMETERS, CameraEntry, camera_of
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.export.certificate import _content as content
from ocmm_core.export.template import Paper
from ocmm_core.fieldbus.described import doubts_by_name
from ocmm_core.geometry import Float
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


def verification_run(record: VerificationRecord, status: content.Status) -> content.CertificateRun:
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
    notes = (*repeated, *corners, *objections, *record.notes)
    return run_of(record, status, record.rule, notes)


def run_of(
    record: VerificationRecord | TipRecord, status: content.Status, rule: str,
    notes: tuple[str, ...] = (),
) -> content.CertificateRun:  # fmt: skip
    """Return the run of a record that consists of checks."""
    lines = tuple(
        content.CertificateLine(
            one.name, one.measured_mm, one.certified_mm, one.expanded_mm, one.limit_mm
        )
        for one in record.checks
    )
    return content.CertificateRun(
        status, record.made_utc, record.made_by, record.temperature_c, rule, lines, record.passed,
        record_hash(record), record.data_sha256, notes,
    )  # fmt: skip


_NUMBER_DIGITS = 16
_NEVER_SMALLER = 1e-12
"""Minimum step of a difference: fixed parameters have zero sigma."""

_MM, _RAD, _ONE = "\\milli\\metre", "\\radian", "\\one"
_NO_LENGTHS = ("scale_sigma", "correlation", "scale")
_QUANTITIES = (
    ("projection centre X", _MM), ("projection centre Y", _MM), ("projection centre Z", _MM),
    ("rotation vector x", _RAD), ("rotation vector y", _RAD), ("rotation vector z", _RAD),
    ("focal length", _MM), ("aspect", _ONE), ("principal point u, px", _ONE),
    ("principal point v, px", _ONE), ("distortion k1", "\\milli\\metre\\tothe{-2}"),
    ("distortion k2", "\\milli\\metre\\tothe{-4}"),
    ("distortion p1", "\\milli\\metre\\tothe{-1}"),
    ("distortion p2", "\\milli\\metre\\tothe{-1}"),
)  # fmt: skip
_METHODS = {
    "known points": "Bundle adjustment of all cameras from known points",
    "relocation": "Adjustment of the cameras' poses from a relocated artefact",
    "boards": "Bundle adjustment of all cameras from pictures of a calibration board",
    "tracker": "Noise of markers at rest, and from a rigid body at places all over the volume",
}


def item_of(record: CameraRecord) -> str:
    """Return what was calibrated."""
    if record.method == "tracker":
        return f"Optical tracker {record.rig}"
    return f"Cameras of rig {record.rig}"


def serials_of(record: CameraRecord) -> Iterator[tuple[str, str]]:
    """Yield names and serial numbers of the cameras, or that of the tracker."""
    if not isinstance(record.tracker, msgspec.UnsetType):
        yield "tracker no.", str(record.tracker.serial)
        return
    for camera in record.cameras:
        yield f"camera {camera.name} no.", str(camera.serial)


def certificate_of_calibration(store: CalibrationStore, paper: Paper) -> content.Certificate:
    """Return the certificate of the calibration of the cameras in use.

    The state as found is the last verification of the previous calibration, that after adjustment
    the first one of the current calibration. If one is missing, the certificate states "not
    determined", and the statement of conformity covers the state after adjustment alone.
    InputError: there is no calibration. CalibrationError: a record was changed, or its covariance
    is invalid.
    """
    record = calibration_in(store)
    own, made = record_hash(record), store.verifications()
    before = next((one for one in store.records() if record_hash(one) == record.previous), None)
    found = [one for one in made if record.previous and one.calibration == record.previous][-1:]
    after = [one for one in made if one.calibration == own][:1]
    runs = (
        *(verification_run(one, "beforeAdjustment") for one in found),
        *(verification_run(one, "afterAdjustment") for one in after),
    )
    made_paper = content.Certificate(
        title="Calibration record",
        number=f"C-{own[:_NUMBER_DIGITS]}",
        item=item_of(record),
        identifications=(
            *serials_of(record),
            ("calibration", own),
            ("observations", record.data_sha256),
        ),
        method=_METHODS[record.method],
        norms=(
            *(("thesis of the method, 1.2.3 and 3.1",) if record.method != "tracker" else ()),
            *(("verified as modelled on VDI/VDE 2634 part 1",) if runs else ()),
        ),
        software=record.software,
        runs=runs,
        values=(*_figures(record), *_parameters(record)),
        values_before=() if before is None else tuple(_parameters(before)),
        artefacts=content.once(
            [*record.artefacts, *(use for one in (*found, *after) for use in one.artefacts)]
        ),
        volume=_volume(record),
        begin_utc=record.made_utc,
        end_utc=max([record.made_utc, *(one.made_utc for one in after)]),
        previous=record.previous,
        paper=paper,
        camera_doubts=doubts_by_name(record.cameras[0].device) if record.cameras else (),
        climate=tuple(_climate(record)),
        not_found=_not_found(record, runs),
        not_after=""
        if after
        else ("the calibration was not verified; it must not be measured with until it is"),
    )
    return content.marked(made_paper, record.made_by)  # fmt: skip


def _not_found(record: CameraRecord, runs: Sequence[content.CertificateRun]) -> str:
    if not record.previous:
        return "this is the first calibration of these cameras"
    if any(run.status == "beforeAdjustment" for run in runs):
        return ""
    return "the calibration before has no verification"


def _climate(record: CameraRecord) -> Iterator[tuple[str, float]]:
    if record.temperature_c is not None:
        yield "calibration", record.temperature_c
    for camera, celsius in zip(record.cameras, record.sensor_temperatures_c, strict=False):
        yield f"sensor of {camera.name}", celsius


def _volume(record: CameraRecord) -> str:
    low, high = (
        " ".join(f"{x:g}" for x in corner) for corner in (record.volume_min, record.volume_max)
    )
    volume = f"Volume from ({low}) to ({high}) mm, world."
    return volume if record.method == "tracker" else f"{volume} Rotation from world to camera, rad."


def _figures(record: CameraRecord) -> Iterator[content.CertificateValue]:
    if record.method == "tracker":
        yield content.CertificateValue("Places", float(record.points), _ONE)
        return
    yield content.CertificateValue("RMS of the residuals, px", record.rms_px, _ONE)
    yield content.CertificateValue("Chi square per degree of freedom", record.chi2_per_dof, _ONE)
    yield content.CertificateValue("Reference positions or poses", float(record.points), _ONE)
    yield content.CertificateValue("Left out as outliers", float(len(record.outliers)), _ONE)


def _parameters(record: CameraRecord) -> Iterator[content.CertificateValue]:
    if not isinstance(record.tracker, msgspec.UnsetType):
        for name, value in msgspec.structs.asdict(record.tracker.noise).items():
            if isinstance(value, float):
                unit = _ONE if name in _NO_LENGTHS else _MM
                yield content.CertificateValue(f"noise: {name}", value, unit)
        return
    covariance = rig_from_record(record).parameter_covariance
    for index, entry in enumerate(record.cameras):
        own = slice(index * N_PARAMETERS, (index + 1) * N_PARAMETERS)
        values, sigmas = _stated(entry, covariance[own, own])
        for (name, unit), value, sigma in zip(_QUANTITIES, values, sigmas, strict=True):
            yield content.CertificateValue(
                f"{entry.name}: {name}", float(value), unit, content.K * float(sigma)
            )


def _stated(entry: CameraEntry, covariance: Float) -> tuple[Float, Float]:
    """Return centre, rotation vector and lens with sigmas; `covariance`: (14, 14), `PARAMETERS`."""
    camera, here = camera_of(entry), _numbers(entry)
    jacobian = np.zeros((len(here), N_PARAMETERS))
    steps = np.maximum(np.sqrt(np.diag(covariance)), _NEVER_SMALLER)
    for column, step in enumerate(steps):
        change = np.zeros(N_PARAMETERS)
        change[column] = step
        ends = [
            _numbers(entry_of(camera.perturbed(sign * change), entry.alias), near=here)
            for sign in (1.0, -1.0)
        ]
        jacobian[:, column] = (ends[0] - ends[1]) / (2.0 * step)
    sigmas: Float = np.sqrt(np.maximum(np.diag(jacobian @ covariance @ jacobian.T), 0.0))
    return here, sigmas


def _numbers(entry: CameraEntry, near: Float | None = None) -> Float:
    turn: Float = np.array(entry.rotation_vector)
    angle = float(np.linalg.norm(turn))
    if near is not None and angle > 0.0:
        # v and v (1 - 2 pi / |v|) are the same rotation: near half a turn the sign may jump.
        other = turn * (1.0 - 2.0 * np.pi / angle)
        turn = min((turn, other), key=lambda one: float(np.linalg.norm(one - near[3:6])))
    lens = (
        entry.focal, entry.aspect, entry.u0_px, entry.v0_px, entry.k1, entry.k2, entry.p1, entry.p2
    )  # fmt: skip
    return np.array([*entry.centre, *turn, *lens])
