"""Signed record files, and their recomputation from raw data.

Authors and dates in chain files: register, interim checks, test steps.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from ocmm_core.acceptance import _session_state as log
from ocmm_core.acceptance._guards import climate_reasons
from ocmm_core.acceptance._interim import INTERIM, InterimCheck
from ocmm_core.acceptance._kinds import quantities_of, values_of
from ocmm_core.acceptance._register import REGISTER, ArtefactRegister
from ocmm_core.acceptance._result import AcceptanceRecord, AcceptanceVerdict
from ocmm_core.acceptance._situation import Stage, situation_of, worst_of
from ocmm_core.calibration.guided import from_spots
from ocmm_core.calibration.records import SignedRecord, load_signed, save
from ocmm_core.camera import Rig
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import triple
from ocmm_core.seals import SealState, Signed
from ocmm_core.tracking import ProbeBody, solve

_SAME_MM = 1e-9
_SAME_TIP_MM = 1e-6
"""Poses are iterated; processors differ by some picometres."""


def save_record(folder: Path, record: AcceptanceRecord) -> Path:
    """Write a signed record under its hash; raise CalibrationError on failure."""
    return save(folder, record, Signed.ACCEPTANCE)


def load_signed_record(path: Path) -> SignedRecord[AcceptanceRecord]:
    """Return a record with the state of its signature; errors as `load_signed`."""
    return load_signed(path, AcceptanceRecord, Signed.ACCEPTANCE)


def recompute(record: AcceptanceRecord) -> AcceptanceRecord:
    """Return a record with values, quantities and verdict recomputed."""
    stage = Stage(record.procedure, record.instrument, record.artefacts, record.seed)
    values = tuple(values_of(situation_of(stage, record.plan, record.observations, record.climate)))
    void = tuple(climate_reasons(stage, record.climate))
    verdict = worst_of([one.verdict for one in values if not one.superseded])
    return msgspec.structs.replace(
        record,
        values=values,
        quantities=quantities_of(values),
        void_reasons=void,
        verdict=AcceptanceVerdict.VOID if void else verdict,
    )


def differences(record: AcceptanceRecord, again: AcceptanceRecord) -> list[str]:
    """Return the differences between two records of one test, as sentences."""
    found = []
    if record.verdict is not again.verdict:
        found.append(f"The verdict is {record.verdict.value}, and {again.verdict.value} anew.")
    if len(record.values) != len(again.values):
        found.append(f"{len(record.values)} values are stored, and {len(again.values)} follow.")
    for one, other in zip(record.values, again.values, strict=False):
        if (one.key, one.quantity, one.verdict) != (other.key, other.quantity, other.verdict):
            found.append(f"{one.quantity} at '{one.position}' is judged otherwise.")
        off = max(
            abs(getattr(one, field) - getattr(other, field))
            for field in ("measured_mm", "certified_mm", "error_mm", "expanded_mm", "limit_mm")
        )
        if off > _SAME_MM:
            found.append(
                f"{one.quantity} at '{one.position}', {one.name}, differs by {off:.2e} mm."
            )
    return found


def recompute_tips(record: AcceptanceRecord, rig: Rig, body: ProbeBody) -> Iterator[str]:
    """Yield sentences on centres unlike their spots; CalibrationError for another rig."""
    if record.instrument.calibration and rig.identity != record.instrument.calibration:
        raise CalibrationError(
            "acceptance.other_rig",
            f"Rig '{rig.name}' does not use the calibration of this record.",
            "Give the calibration that was tested.",
        )
    for one in record.observations:
        if one.uv is None:
            continue
        tip = solve(from_spots(one.uv)[None], rig, body, one.sigma_px).tip_world[0]
        off = float(np.linalg.norm(tip - np.array(one.tip)))
        if not off <= _SAME_TIP_MM:
            yield (
                f"Point {one.item + 1} of '{record.plan[one.position].name}': the spots give "
                f"{triple(tip)}, {off:.2e} mm from what is stored."
            )


def chain_history(path: Path) -> tuple[Signed, SealState, tuple[tuple[str, str, str], ...]]:
    """Return kind, signature state and lines (UTC, author, text); errors as `ChainFile`."""
    if path.name == REGISTER:
        register = ArtefactRegister(path.parent)
        return Signed.ARTEFACTS, register.signer, register.changes
    if path.name == INTERIM:
        checks: ChainFile[Any] = ChainFile(
            path, InterimCheck, signed=Signed.INTERIM, remembered=True
        )
        rows = tuple(
            (one.utc, "", f"check of {one.artefact}: {1e3 * one.error_mm:+.1f} µm")
            for one in checks.items
        )
        return Signed.INTERIM, checks.signer, rows
    steps = ChainFile(path, log.Line, signed=Signed.TEST, remembered=True)
    begun = steps.items[0].event if steps.items else None
    who = begun.made_by if isinstance(begun, log.Begun) else ""
    return (
        Signed.TEST,
        steps.signer,
        tuple((one.event.utc, who, type(one.event).__name__) for one in steps.items),
    )
