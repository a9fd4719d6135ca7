"""Judge whether artefacts of a verification are independent of the calibration."""

from __future__ import annotations

from collections.abc import Sequence

from ocmm_core.calibration.records import ArtefactUse, CameraRecord, Finding, same_serial


def judge_independence(
    uses: Sequence[ArtefactUse], calibration: CameraRecord | None
) -> list[Finding]:
    """Return objections to artefacts (by serial or certificate) that scaled the calibration."""
    known = () if calibration is None else calibration.artefacts
    same = [use for use in uses if any(_is_same(use, one) for one in known)]
    return [
        Finding(
            "verification.same_artefact",
            f"The cameras were calibrated with the same '{use.name}' (serial {use.serial}): a "
            "certificate error would go unnoticed, so this is not an independent check.",
            "Verify with another certified length: a second bar, or a bar whose nests are those "
            "of a certified ball bar. If you have only one, keep it for verifications and "
            "borrow another for the calibration.",
            refuses=True,
        )
        for use in dict.fromkeys(same)
    ]


def _is_same(one: ArtefactUse, other: ArtefactUse) -> bool:
    if same_serial(one.serial, other.serial):
        return True
    return bool(one.certificate_sha256) and one.certificate_sha256 == other.certificate_sha256
