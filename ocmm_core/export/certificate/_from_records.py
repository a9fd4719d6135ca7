"""Certificates from sealed records and acceptance tests, without computing or judging."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

from ocmm_core import acceptance
from ocmm_core.calibration import records
from ocmm_core.calibration.records import record_hash
from ocmm_core.documents import files_of_folder
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.export.certificate import _content as content
from ocmm_core.export.certificate import _from_calibration as from_calibration
from ocmm_core.export.certificate._from_calibration import require_vouched
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
        record = vouched_record(folder)
        if as_found is not None:
            return certificate_of_acceptance(record, paper, vouched_record(as_found))
        if record.condition != AFTER:
            return certificate_of_acceptance(record, paper)
        return certificate_of_acceptance(record, paper, *found_before(record, folder.parent))
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
        item=from_calibration.item_of(record),
        identifications=(
            *from_calibration.serials_of(record),
            ("calibration", records.record_hash(record)),
        ),
        method="Lengths and spheres in the measuring volume, independent of the calibration",
        norms=(_VDI,),
        software=last.software,
        runs=tuple(runs),
        values=tuple(_values(record, last)),
        artefacts=content.once((*record.artefacts, *last.artefacts)),
        volume=f"Volume from ({low}) to ({high}) mm, world.",
        begin_utc=min([last.made_utc, *(seat.first_utc for seat in last.repeats)]),
        end_utc=last.made_utc,
        previous=record.previous,
        paper=paper,
        camera_doubts=doubts_by_name(record.cameras[0].device) if record.cameras else (),
    )
    return content.marked(made_paper, record.made_by, last.made_by)


def _values(
    record: records.CameraRecord, last: records.VerificationRecord
) -> Iterator[content.CertificateValue]:
    if last.scale is not None:
        yield content.CertificateValue(
            "Scale error of all lines", last.scale.relative, _ONE, content.K * last.scale.sigma
        )
        return
    yield content.CertificateValue(
        "RMS of the residuals of the calibration, px", record.rms_px, _PX
    )
    yield content.CertificateValue("Chi square per degree of freedom", record.chi2_per_dof, _ONE)
    yield content.CertificateValue("Reference positions or poses", float(record.points), _ONE)


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
    rule = "every check of the qualification within its limit"
    run = from_calibration.run_of(found, "afterAdjustment", rule)
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


_SAME = 1e-9

_JUDGED = {
    acceptance.AcceptanceVerdict.PASS: content.Conformity.CONFORM,
    acceptance.AcceptanceVerdict.FAIL: content.Conformity.NOT_CONFORM,
    acceptance.AcceptanceVerdict.LEANING_IN: content.Conformity.LEANING_IN,
    acceptance.AcceptanceVerdict.LEANING_OUT: content.Conformity.LEANING_OUT,
}


AFTER: Literal["after adjustment"] = "after adjustment"
"""`AcceptanceRecord.condition` of a test after an adjustment."""


def certificate_of_acceptance(
    record: acceptance.AcceptanceRecord,
    paper: Paper,
    found: acceptance.AcceptanceRecord | None = None,
    not_found: str = "no test as found was given",
) -> content.Certificate:
    """Return the certificate of an acceptance test with the verdicts of its procedure.

    It is a calibration certificate only if the procedure names an accreditation, a real machine was
    tested, and the test is not void. `found`: the same test as found, if ``record`` is after an
    adjustment. `not_found`: why there is none. InputError: ``found`` is no earlier test as found of
    the same machine and procedure.
    """
    tested = record.instrument
    void = record.verdict is acceptance.AcceptanceVerdict.VOID
    adjusted = record.condition == AFTER
    if found is not None:
        why = mismatch(record, found)
        if why:
            raise InputError(
                "certificate.pair",
                f"Test {found.number} is not the state before test {record.number}: {why}.",
                "Name the test as found that belongs to it, or none.",
            )
    runs = [_acceptance_run(one) for one in (found, record) if one is not None]
    accredited = record.procedure.accreditation if not (tested.simulated or void) else ""
    words = "Calibration certificate" if accredited else "Test report (in-house)"
    given = paper.given
    asked = replace(
        given, customer=given.customer or record.customer, place=given.place or record.place
    )
    low, high = (" ".join(f"{x:g}" for x in corner)
                 for corner in (tested.volume_min, tested.volume_max))  # fmt: skip
    return content.Certificate(
        title=": ".join((*tested.states, words, record.procedure.title)),
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
        runs=tuple(runs),
        values=tuple(
            content.CertificateValue(
                f"{one.quantity}, worst of {one.count}", one.error_mm, _MM, one.expanded_mm
            )
            for one in record.quantities
        ),
        artefacts=content.once(
            [one.use for test in (found, record) if test is not None for one in test.artefacts]
        ),
        volume=f"Volume from ({low}) to ({high}) mm, world.",
        begin_utc=record.begun_utc if found is None else found.begun_utc,
        end_utc=record.ended_utc,
        previous="" if found is None else record_hash(found),
        paper=replace(paper, given=asked),
        accreditation=accredited,
        simulated=tested.simulated,
        camera_doubts=content.once(
            [why for test in (found, record) if test is not None
             for why in test.instrument.unproven]
        ),
        not_found=not_found if adjusted and found is None else "",
    )  # fmt: skip


def _acceptance_run(record: acceptance.AcceptanceRecord) -> content.CertificateRun:
    void = record.verdict is acceptance.AcceptanceVerdict.VOID
    return content.CertificateRun(
        status="afterAdjustment" if record.condition == AFTER else "beforeAdjustment",
        made_utc=record.ended_utc,
        made_by=record.made_by,
        temperature_c=_mean([one.celsius for one in record.climate]),
        air=record.air or acceptance.RoomAir(),
        rule=f"{record.wording}, rule {record.procedure.rule}",
        lines=tuple(_judged(one) for one in record.values if one.verdict in _JUDGED),
        passed=record.verdict is acceptance.AcceptanceVerdict.PASS,
        record=record_hash(record),
        data_sha256=record.chain_head,
        notes=(
            *record.void_reasons,
            *record.notes,
            *((record.procedure.by_agreement,) if record.procedure.by_agreement else ()),
            *((f"Retests: {record.retests}.",) if record.retests else ()),
        ),
        stated="noPass" if void else _JUDGED[record.verdict],
    )


def mismatch(record: acceptance.AcceptanceRecord, found: acceptance.AcceptanceRecord) -> str:
    """Return why a test is not the state before another one; empty if it is."""
    one, other = found.instrument, record.instrument
    if found.condition == AFTER or record.condition != AFTER:
        return "it must be as found, and the other one after adjustment"
    if not same_test(record, found):
        return "machine or procedure is another one"
    if found.ended_utc > record.begun_utc:
        return "it ended later than the other one began"
    if (one.calibration, one.tip_record) == (other.calibration, other.tip_record):
        return "cameras and tip are calibrated as they were: nothing was adjusted"
    return ""


def same_test(one: acceptance.AcceptanceRecord, other: acceptance.AcceptanceRecord) -> bool:
    """Return whether two tests are of the same machine, by the same procedure."""
    a, b = one.instrument, other.instrument
    return (
        one.procedure_sha256 == other.procedure_sha256
        and (a.rig, a.probe, a.tip, a.simulated) == (b.rig, b.probe, b.tip, b.simulated)
        and sorted(a.cameras) == sorted(b.cameras)
    )


def vouched_record(path: Path) -> acceptance.AcceptanceRecord:
    """Return a record for a certificate; errors as `load_signed_record` and `require_vouched`."""
    found = acceptance.load_signed_record(path)
    require_vouched(path, found.signer)
    return found.record


def found_before(
    record: acceptance.AcceptanceRecord, folder: Path
) -> tuple[acceptance.AcceptanceRecord | None, str]:
    """Return the test as found in the folder of a test after adjustment, or why not.

    The last earlier one of the same machine and procedure, unless that is after an adjustment.
    """
    before, unread = [], 0
    for path in files_of_folder(folder, ".json"):
        try:
            one = vouched_record(path)
        except OcmmError:
            unread += 1
            continue
        if same_test(record, one) and one.ended_utc <= record.begun_utc:
            before.append(one)
    several = f"; {unread} files beside it are no sound records" if unread else ""
    left = "; 1 file beside it is no sound record" if unread == 1 else several
    if not before:
        return None, f"no earlier test of this machine by this procedure lies beside it{left}"
    last = max(before, key=lambda one: one.ended_utc)
    why = mismatch(record, last)
    return (None, f"test {last.number} before it does not show it: {why}") if why else (last, "")


def _judged(value: acceptance.JudgedValue) -> content.CertificateLine:
    # A form is its own error, without a certified value to subtract.
    is_difference = abs(value.measured_mm - value.certified_mm - value.error_mm) < _SAME
    again = ", superseded by a retest" if value.superseded else ""
    return content.CertificateLine(
        name=f"{value.quantity} {value.position}, {value.name}{again}",
        measured=value.measured_mm if is_difference else value.error_mm,
        reference=value.certified_mm if is_difference else 0.0,
        expanded=value.expanded_mm,
        limit=value.limit_mm,
        stated=_JUDGED[value.verdict],
    )


def _mean(values: Sequence[float]) -> float | None:
    return sum(values) / len(values) if values else None
