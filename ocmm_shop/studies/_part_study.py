"""U of a measuring task from a calibrated part, stored with the task, for similar ones only.

Modelled on ISO 15530-3. A study is a sealed record with its results. Users of its U state their
task, and it is refused unless similar by the gate of the procedure: dimension, angle, points,
strategy, stylus, material, clamping and temperature.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from pathlib import Path

import msgspec

from ocmm_core.acceptance import (
    PartTask,
    PartTest,
    PartUncertainty,
    ProcedureDocument,
    dissimilar,
    find_procedure,
    load_procedure,
    part_uncertainty,
)
from ocmm_core.build import build_version
from ocmm_core.calibration.records import SignedRecord, load_signed, save
from ocmm_core.documents import Document, load_document
from ocmm_core.errors import InputError
from ocmm_core.export.audits import AuditedRecord
from ocmm_core.seals import Signed

TASK_SCHEMA = "ocmm.part-task/1"
PART_STUDY_SCHEMA = "ocmm.part-study/1"
_KELVIN = 1.0
"""Default half range about the temperature of use, K."""

_SAME = 1e-12


class TaskDocument(Document, frozen=True, kw_only=True):
    task: PartTask


class PartStudy(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Finished study of one characteristic; mm."""

    schema: str
    procedure: ProcedureDocument
    procedure_sha256: str
    """`procedure`, `procedure_sha256`: Verbatim, and the hash of its file."""
    characteristic: str
    task: PartTask
    certificate: str
    certified: float
    expanded_cal: float
    """`certificate`, `certified`, `expanded_cal`: Of the part: number, value and U (k = 2)."""
    results: tuple[float, ...]
    """One per cycle, in chronological order."""
    temperature_c: float
    temperatures: tuple[float, float]
    """`temperature_c`, `temperatures`: Of use, degrees Celsius, and the valid range of U."""
    u_workpiece: float
    u_expansion: float
    """`u_workpiece`, `u_expansion`: of the parts, mm, and of the expansion, 1/K."""
    expanded_model: float | None
    """U stated by the program for the characteristic; None without."""
    expanded: float
    expanded_uncorrected: float
    bias: float
    made_utc: str
    made_by: str
    software: str
    simulated: bool

    def found(self, dimension: float = 0.0, temperature_c: float | None = None) -> PartUncertainty:
        """Return the result for a dimension, mm, and a temperature of use."""
        grown = max(1.0, abs(dimension) / abs(self.certified)) if self.certified else 1.0
        return part_uncertainty(
            self.results,
            self.certified,
            self.expanded_cal,
            u_workpiece=self.u_workpiece,
            temperature_c=self.temperature_c if temperature_c is None else temperature_c,
            u_expansion=self.u_expansion * grown,
            expanded_model=self.expanded_model,
        )


def load_task(path: Path | str) -> PartTask:
    """Return the task of a document; InputError: malformed, or an empty field (matches all)."""
    task = load_document(path, TaskDocument, TASK_SCHEMA).task
    wrong = [
        name
        for name in ("strategy", "stylus", "material", "clamping")
        if not getattr(task, name).strip()
    ]
    if not (math.isfinite(task.dimension) and task.dimension > 0.0):
        wrong.append("dimension")
    if not math.isfinite(task.angle_deg):
        wrong.append("angle_deg")
    if task.points < 1:
        wrong.append("points")
    if wrong:
        raise InputError(
            "msa.task",
            f"{path}: field 'task.{wrong[0]}' says nothing that could be compared.",
            "Describe the task completely.",
        )
    return task


def part_procedure(name: str = "PART-U") -> tuple[ProcedureDocument, PartTest, str]:
    """Return a procedure for calibrated parts, its numbers and its hash; InputError for another."""
    procedure, digest = load_procedure(find_procedure(name))
    if not isinstance(procedure.test, PartTest):
        raise InputError(
            "msa.procedure",
            f"'{procedure.id}' is no procedure for calibrated parts.",
            'Give PART-U, or a document of your own with kind = "part".',
        )
    return procedure, procedure.test, digest


@dataclass(frozen=True, slots=True)
class CalibratedPart:
    """Certificate and conditions of a calibrated part; see `PartStudy`."""

    certificate: str
    certified: float
    expanded_cal: float
    u_workpiece: float = 0.0
    temperature_c: float = 20.0
    temperatures: tuple[float, float] | None = None
    u_expansion: float = 0.0
    expanded_model: float | None = None


def make_part_study(
    results: Sequence[float],
    task: PartTask,
    part: CalibratedPart,
    *,
    procedure: str = "PART-U",
    characteristic: str,
    made_by: str,
    now: datetime,
    simulated: bool,
) -> PartStudy:
    """Return the study of a part that was reclamped for every result.

    InputError: there are fewer results or cycles than the procedure requires, the part is not the
    task's, or the room was outside the rated temperatures.
    """
    rule, numbers, digest = part_procedure(procedure)
    least = max(numbers.results, numbers.cycles)
    if len(results) < least:
        raise InputError(
            "msa.part_count",
            f"The study has {len(results)} results, one of each cycle; '{rule.id}' asks for "
            f"{numbers.results} results in {numbers.cycles} cycles.",
            "Take the part out, clamp it again and measure it, until there are enough.",
        )
    temperature_c = part.temperature_c
    low, high = part.temperatures or (temperature_c - _KELVIN, temperature_c + _KELVIN)
    climate = rule.climate
    if not climate.low <= low <= temperature_c <= high <= climate.high:
        raise InputError(
            "msa.part_climate",
            f"{low:g} to {high:g} °C with {temperature_c:g} °C of use are not within the rated "
            f"{climate.low:g} to {climate.high:g} °C.",
            "Give the temperatures at which the part was measured.",
        )
    if not (part.expanded_cal > 0.0 and part.u_workpiece >= 0.0 and part.u_expansion >= 0.0):
        raise InputError(
            "msa.part_u",
            "U of the certificate must be above zero, and the other uncertainties not below.",
            "Take them from the certificate of the part.",
        )
    found = part_uncertainty(
        results, part.certified, part.expanded_cal, u_workpiece=part.u_workpiece,
        temperature_c=temperature_c, u_expansion=part.u_expansion,
        expanded_model=part.expanded_model,
    )  # fmt: skip
    return PartStudy(
        **asdict(replace(part, temperatures=(low, high))), schema=PART_STUDY_SCHEMA,
        procedure=rule, procedure_sha256=digest, characteristic=characteristic, task=task,
        results=tuple(float(one) for one in results), expanded=found.expanded,
        expanded_uncorrected=found.expanded_uncorrected, bias=found.bias,
        made_utc=now.isoformat(), made_by=made_by, software=build_version(), simulated=simulated,
    )  # fmt: skip


def save_part_study(folder: Path, study: PartStudy) -> Path:
    """Write a study under its hash, signed; CalibrationError if it cannot be written."""
    return save(folder, study, Signed.STUDY)


def load_part_study(path: Path) -> SignedRecord[PartStudy]:
    """Return a study with the state of its signature; errors as `load_signed`."""
    return load_signed(path, PartStudy, Signed.STUDY)


def uncertainty_for(study: PartStudy, wanted: PartTask, temperature_c: float) -> PartUncertainty:
    """Return the U of a study for another task; InputError if it is not similar."""
    numbers = study.procedure.test
    if not isinstance(numbers, PartTest):
        raise InputError(
            "msa.procedure", "The study has no similarity gate.", "Make a study with PART-U."
        )
    low, high = study.temperatures
    why = dissimilar(study.task, wanted, numbers)
    if not why and not low <= temperature_c <= high:
        why = f"It is {temperature_c:g} °C, and the study holds for {low:g} to {high:g} °C."
    found = study.found(wanted.dimension, temperature_c)
    again = study.found()
    if not why and abs(again.expanded - study.expanded) > _SAME * max(1.0, study.expanded):
        why = "Its results give another U than it states."
    if not why and (again.normalized or 0.0) > 1.0:
        why = (
            f"E_n of the study is {again.normalized:.2f}: result and certificate do not agree "
            "within their uncertainties."
        )
    if why:
        raise InputError(
            "msa.dissimilar",
            f"The U of '{study.characteristic}' does not hold here. {why}",
            "Make a study of a calibrated part that is alike (ocmm msa part), or use the stated U.",
        )
    return found


def _text(study: PartStudy) -> str:
    simulated = "SIMULATED, " if study.simulated else ""
    return f"{simulated}U {study.expanded:.6f} mm of {study.characteristic}"


AUDITED = AuditedRecord("ocmm.part-study", PartStudy, Signed.STUDY, _text)
"""Entry point of the group `ocmm.records`."""
