"""What the sealed records know of a paper: nothing is computed anew, and nothing is judged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ocmm_core.acceptance import AcceptanceRecord, JudgedValue, Verdict, load_record
from ocmm_core.calibration.records import (
    ArtefactUse,
    CalibrationStore,
    CameraRecord,
    Check,
    ProbeStore,
    VerificationRecord,
    record_hash,
)
from ocmm_core.errors import InputError
from ocmm_core.export.certificate._content import (
    Certificate,
    CertificateLine,
    CertificateRun,
    CertificateValue,
    Conformity,
    K,
    Status,
)
from ocmm_core.export.report import Paper

_NUMBER_DIGITS = 16
_SAME = 1e-9
_MM, _PX, _ONE = "\\milli\\metre", "\\one", "\\one"
_VDI = "modelled on VDI/VDE 2634 part 1"
_SPHERE = "modelled on ISO 10360-5 and ASME B89.4.22"


def certificate_of_folder(folder: Path, paper: Paper, tip: str = "") -> Certificate:
    """Return the paper of what the records in a folder are about.

    Parameters
    ----------
    folder
        Of the records of one rig or probe; or the file of an acceptance record.
    tip
        Of the probe; empty for cameras.

    Raises
    ------
    OcmmError
        There are no such records, or they were changed.
    """
    if folder.is_file():
        return certificate_of_acceptance(load_record(folder), paper)
    if tip:
        return certificate_of_tip(ProbeStore(folder), tip, paper)
    return certificate_of_cameras(CalibrationStore(folder), paper)


def certificate_of_cameras(store: CalibrationStore, paper: Paper) -> Certificate:
    """Return the paper of the cameras that are in use: their last verification.

    The run after adjustment is that of the calibration in use. Where that calibration replaced
    another one, the run as found is the last verification of the other one; a verification of the
    calibration in use that is not its first one is a run as found with nothing adjusted.

    Raises
    ------
    InputError
        There is no calibration, or it was never verified.
    """
    record = store.active()
    if record is None:
        raise InputError(
            "certificate.no_calibration",
            "There is no calibration of these cameras.",
            "Calibrate the cameras and verify the calibration (ocmm calibrate).",
        )
    own = record_hash(record)
    made = [one for one in store.verifications() if one.calibration == own]
    if not made:
        raise InputError(
            "certificate.not_verified",
            f"The calibration of rig '{record.rig}' was not verified.",
            "Verify the calibration (ocmm calibrate verify).",
        )
    before = [one for one in store.verifications() if one.calibration == record.previous]
    if len(made) > 1:
        runs = [_run(made[-1], "beforeAdjustment")]
    else:
        runs = [_run(one, "beforeAdjustment") for one in before[-1:]]
        runs.append(_run(made[-1], "afterAdjustment"))
    return _of_cameras(record, made[-1], runs, paper)


def _of_cameras(
    record: CameraRecord, last: VerificationRecord, runs: Sequence[CertificateRun], paper: Paper
) -> Certificate:
    digest = record_hash(last)
    low, high = (" ".join(f"{x:g}" for x in corner) for corner in
                 (record.volume_min, record.volume_max))  # fmt: skip
    return Certificate(
        title="Verification record",
        number=f"V-{digest[:_NUMBER_DIGITS]}",
        item=f"Cameras of rig {record.rig}",
        identifications=(
            *((f"camera {camera.name} no.", str(camera.serial)) for camera in record.cameras),
            ("calibration", record_hash(record)),
        ),
        method="Lengths and spheres in the measuring volume, independent of the calibration",
        norms=(_VDI,),
        software=last.software,
        runs=tuple(runs),
        values=(
            CertificateValue("RMS of the residuals of the calibration, px", record.rms_px, _PX),
            CertificateValue("Chi square per degree of freedom", record.chi2_per_dof, _ONE),
            CertificateValue("Reference positions or poses", float(record.points), _ONE),
        ),
        artefacts=_once((*record.artefacts, *last.artefacts)),
        volume=f"Volume from ({low}) to ({high}) mm, world.",
        begin_utc=min([last.made_utc, *(seat.first_utc for seat in last.repeats)]),
        end_utc=last.made_utc,
        previous=record.previous,
        paper=paper,
    )


def certificate_of_tip(store: ProbeStore, tip: str, paper: Paper) -> Certificate:
    """Return the paper of a tip that is in use: its qualification.

    Raises
    ------
    InputError
        The tip was not qualified.
    """
    active = store.active(tip)
    found = None if active is None else active.qualification
    if active is None or found is None:
        raise InputError(
            "certificate.not_qualified",
            f"Tip '{tip}' was not qualified; this probe has {', '.join(store.tips) or 'none'}.",
            "Qualify the tip (ocmm calibrate tip), or name another one.",
        )
    digest = record_hash(found)
    run = CertificateRun(
        status="afterAdjustment",
        made_utc=found.made_utc,
        made_by=found.made_by,
        temperature_c=found.temperature_c,
        rule="every check of the qualification within its limit",
        lines=_lines(found.checks),
        passed=found.passed,
        record=digest,
        data_sha256=found.data_sha256,
    )
    return Certificate(
        title="Test report (in-house): qualification of a tip",
        number=f"T-{digest[:_NUMBER_DIGITS]}",
        item=f"Probe {found.probe}, tip {found.tip}",
        identifications=(
            ("rig", found.rig),
            ("cameras", found.rig_identity),
            ("calibration of the probe", found.calibration),
        ),
        method="Points on a calibrated sphere; articulation in a cone",
        norms=(_SPHERE,),
        software=found.software,
        runs=(run,),
        values=(
            CertificateValue(
                "Effective diameter of the ball", found.diameter_mm, _MM,
                K * found.diameter_sigma_mm,
            ),
            CertificateValue("Form of the sphere (P_Form)", found.form_mm, _MM),
            CertificateValue("Standard deviation of one point", found.point_sigma_mm, _MM),
            CertificateValue("Articulation, 2 standard deviations", found.articulation_2s_mm, _MM),
            CertificateValue("Articulation, largest", found.articulation_max_mm, _MM),
            CertificateValue("Points on the sphere", float(found.points), _ONE),
        ),
        artefacts=_once(found.artefacts),
        volume=f"Where the sphere stood, in the volume of rig {found.rig}.",
        begin_utc=found.made_utc,
        end_utc=found.made_utc,
        previous="",
        paper=paper,
    )  # fmt: skip


_JUDGED = {
    Verdict.PASS: Conformity.CONFORM,
    Verdict.FAIL: Conformity.NOT_CONFORM,
    Verdict.LEANING_IN: Conformity.LEANING_IN,
    Verdict.LEANING_OUT: Conformity.LEANING_OUT,
}


def certificate_of_acceptance(record: AcceptanceRecord, paper: Paper) -> Certificate:
    """Return the paper of an acceptance test: every verdict is that of its procedure.

    It is a calibration certificate only where the procedure names an accreditation, a real machine
    was tested, and the test is not void.
    """
    digest, tested = record_hash(record), record.instrument
    void = record.verdict is Verdict.VOID
    run = CertificateRun(
        status="afterAdjustment" if record.condition == "after adjustment" else "beforeAdjustment",
        made_utc=record.ended_utc,
        made_by=record.made_by,
        temperature_c=_mean([one.celsius for one in record.climate]),
        rule=f"{record.wording}, rule {record.procedure.rule}",
        lines=tuple(_judged(one) for one in record.values if one.verdict in _JUDGED),
        passed=record.verdict is Verdict.PASS,
        record=digest,
        data_sha256=record.chain_head,
        notes=(
            *record.void_reasons,
            *record.notes,
            *((record.procedure.by_agreement,) if record.procedure.by_agreement else ()),
            *((f"Retests: {record.retests}.",) if record.retests else ()),
        ),
        stated="noPass" if void else _JUDGED[record.verdict],
    )
    accredited = record.procedure.accreditation if not (tested.simulated or void) else ""
    words = "Calibration certificate" if accredited else "Test report (in-house)"
    given = paper.given
    asked = replace(
        given, customer=given.customer or record.customer, place=given.place or record.place
    )
    low, high = (" ".join(f"{x:g}" for x in corner)
                 for corner in (tested.volume_min, tested.volume_max))  # fmt: skip
    return Certificate(
        title=f"{'SIMULATED: ' if tested.simulated else ''}{words}: {record.procedure.title}",
        number=f"A-{record.number}",
        item=f"Rig {tested.rig}, probe {tested.probe}, tip {tested.tip}",
        identifications=(
            *(("camera", camera) for camera in tested.cameras),
            ("calibration", tested.calibration or tested.calibration_status),
            ("tip", tested.tip_record or "as its document"),
            ("procedure", record.procedure_sha256),
        ),
        method=record.procedure.title,
        norms=(record.wording,),
        software=tested.software,
        runs=(run,),
        values=tuple(
            CertificateValue(
                f"{one.quantity}, worst of {one.count}", one.error_mm, _MM, one.expanded_mm
            )
            for one in record.quantities
        ),
        artefacts=_once([one.use for one in record.artefacts]),
        volume=f"Volume from ({low}) to ({high}) mm, world.",
        begin_utc=record.begun_utc,
        end_utc=record.ended_utc,
        previous="",
        paper=replace(paper, given=asked),
        accreditation=accredited,
        simulated=tested.simulated,
    )


def _judged(value: JudgedValue) -> CertificateLine:
    # A form is its own error: there is nothing certified that it would be a difference from.
    is_difference = abs(value.measured_mm - value.certified_mm - value.error_mm) < _SAME
    again = ", superseded by a retest" if value.superseded else ""
    return CertificateLine(
        name=f"{value.quantity} {value.position}, {value.name}{again}",
        measured=value.measured_mm if is_difference else value.error_mm,
        reference=value.certified_mm if is_difference else 0.0,
        expanded=value.expanded_mm,
        limit=value.limit_mm,
        stated=_JUDGED[value.verdict],
    )


def _mean(values: Sequence[float]) -> float | None:
    return sum(values) / len(values) if values else None


def _run(record: VerificationRecord, status: Status) -> CertificateRun:
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
        lines=_lines(record.checks),
        passed=record.passed,
        record=record_hash(record),
        data_sha256=record.data_sha256,
        notes=(*repeated, *corners, *objections, *record.notes),
    )


def _lines(checks: Sequence[Check]) -> tuple[CertificateLine, ...]:
    return tuple(
        CertificateLine(one.name, one.measured_mm, one.certified_mm, one.expanded_mm, one.limit_mm)
        for one in checks
    )


def _once(items: Sequence[ArtefactUse]) -> tuple[ArtefactUse, ...]:
    """Return artefacts in their order, each once."""
    return tuple(dict.fromkeys(items))
