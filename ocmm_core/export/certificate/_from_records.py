"""Certificates from sealed records, without computing or judging."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ocmm_core.calibration import records
from ocmm_core.errors import InputError
from ocmm_core.export.certificate import _content as content
from ocmm_core.export.certificate import _from_acceptance as from_acceptance
from ocmm_core.export.certificate import _from_calibration as from_calibration
from ocmm_core.export.template import Paper
from ocmm_core.fieldbus.described import doubts_by_name

_NUMBER_DIGITS = 16
_MM, _PX, _ONE = "\\milli\\metre", "\\one", "\\one"
_VDI = "modelled on VDI/VDE 2634 part 1"
_SPHERE = "modelled on ISO 10360-5 and ASME B89.4.22"


def certificate_of_folder(
    folder: Path,
    paper: Paper,
    tip: str = "",
    *,
    calibration: bool = False,
    as_found: Path | None = None,
) -> content.Certificate:
    """Return the certificate of the records in a folder.

    Parameters
    ----------
    folder
        Of the records of one rig or probe; or the file of an acceptance record.
    tip
        Of the probe; empty for cameras.
    calibration
        The calibration of the cameras, not its last verification.
    as_found
        Acceptance record of the state before an adjustment; default: the matching one in the
        folder.

    Raises
    ------
    OcmmError
        There are no such records, they were changed, or no trusted station signed them.
    """
    if folder.is_file():
        record = from_acceptance.vouched_record(folder)
        if as_found is not None:
            return from_acceptance.certificate_of_acceptance(
                record, paper, from_acceptance.vouched_record(as_found)
            )
        if record.condition != from_acceptance.AFTER:
            return from_acceptance.certificate_of_acceptance(record, paper)
        return from_acceptance.certificate_of_acceptance(
            record, paper, *from_acceptance.found_before(record, folder.parent)
        )
    if calibration:
        return from_calibration.certificate_of_calibration(records.CalibrationStore(folder), paper)
    if tip:
        return certificate_of_tip(records.ProbeStore(folder), tip, paper)
    return certificate_of_cameras(records.CalibrationStore(folder), paper)


def certificate_of_cameras(store: records.CalibrationStore, paper: Paper) -> content.Certificate:
    """Return the certificate of the cameras in use: their last verification.

    The run after adjustment is that of the current calibration. If that replaced another one, the
    run as found is the last verification of the other one; a verification of the current
    calibration that is not its first one is a run as found without adjustment. InputError: there is
    no calibration, or it was never verified.
    """
    record = from_calibration.calibration_in(store)
    own = records.record_hash(record)
    made = [one for one in store.verifications() if one.calibration == own]
    if not made:
        raise InputError(
            "certificate.not_verified",
            f"The calibration of rig '{record.rig}' was not verified.",
            "Verify the calibration (ocmm calibrate verify).",
        )
    before = [one for one in store.verifications() if one.calibration == record.previous]
    if len(made) > 1:
        runs = [from_calibration.verification_run(made[-1], "beforeAdjustment")]
    else:
        runs = [from_calibration.verification_run(one, "beforeAdjustment") for one in before[-1:]]
        runs.append(from_calibration.verification_run(made[-1], "afterAdjustment"))
    return _of_cameras(record, made[-1], runs, paper)


def _of_cameras(
    record: records.CameraRecord,
    last: records.VerificationRecord,
    runs: Sequence[content.CertificateRun],
    paper: Paper,
) -> content.Certificate:
    digest = records.record_hash(last)
    low, high = (" ".join(f"{x:g}" for x in corner) for corner in
                 (record.volume_min, record.volume_max))  # fmt: skip
    made_paper = content.Certificate(
        title="Verification record",
        number=f"V-{digest[:_NUMBER_DIGITS]}",
        item=f"Cameras of rig {record.rig}",
        identifications=(
            *((f"camera {camera.name} no.", str(camera.serial)) for camera in record.cameras),
            ("calibration", records.record_hash(record)),
        ),
        method="Lengths and spheres in the measuring volume, independent of the calibration",
        norms=(_VDI,),
        software=last.software,
        runs=tuple(runs),
        values=(
            content.CertificateValue(
                "RMS of the residuals of the calibration, px", record.rms_px, _PX
            ),
            content.CertificateValue("Chi square per degree of freedom", record.chi2_per_dof, _ONE),
            content.CertificateValue("Reference positions or poses", float(record.points), _ONE),
        ),
        artefacts=content.once((*record.artefacts, *last.artefacts)),
        volume=f"Volume from ({low}) to ({high}) mm, world.",
        begin_utc=min([last.made_utc, *(seat.first_utc for seat in last.repeats)]),
        end_utc=last.made_utc,
        previous=record.previous,
        paper=paper,
        camera_doubts=doubts_by_name(record.cameras[0].device) if record.cameras else (),
    )
    return content.marked(made_paper, record.made_by, last.made_by)


def certificate_of_tip(store: records.ProbeStore, tip: str, paper: Paper) -> content.Certificate:
    """Return the qualification certificate of a tip in use; InputError if not qualified."""
    active = store.active(tip)
    found = None if active is None else active.qualification
    if active is None or found is None:
        raise InputError(
            "certificate.not_qualified",
            f"Tip '{tip}' was not qualified; this probe has {', '.join(store.tips) or 'none'}.",
            "Qualify the tip (ocmm calibrate tip), or name another one.",
        )
    from_calibration.require_vouched(store.folder, store.signer, store.exchanged)
    digest = records.record_hash(found)
    run = content.CertificateRun(
        status="afterAdjustment",
        made_utc=found.made_utc,
        made_by=found.made_by,
        temperature_c=found.temperature_c,
        rule="every check of the qualification within its limit",
        lines=from_calibration.lines_of(found.checks),
        passed=found.passed,
        record=digest,
        data_sha256=found.data_sha256,
    )
    made_paper = content.Certificate(
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
            content.CertificateValue(
                "Effective diameter of the ball",
                found.diameter_mm,
                _MM,
                content.K * found.diameter_sigma_mm,
            ),
            content.CertificateValue("Form of the sphere (P_Form)", found.form_mm, _MM),
            content.CertificateValue("Standard deviation of one point", found.point_sigma_mm, _MM),
            content.CertificateValue(
                "Articulation, 2 standard deviations", found.articulation_2s_mm, _MM
            ),
            content.CertificateValue("Articulation, largest", found.articulation_max_mm, _MM),
            content.CertificateValue("Points on the sphere", float(found.points), _ONE),
        ),
        artefacts=content.once(found.artefacts),
        volume=f"Where the sphere stood, in the volume of rig {found.rig}.",
        begin_utc=found.made_utc,
        end_utc=found.made_utc,
        previous="",
        paper=paper,
        camera_doubts=found.camera_doubts or (),
    )
    return content.marked(made_paper, found.made_by)  # fmt: skip
