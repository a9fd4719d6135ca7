"""Facts of finished jobs for corrections, reasons why they prove nothing, and the register.

The register has every change of an offset, signed, chained and undoable. Each line states all
values before and after it, so that files of corrections have absolute values: loading one twice
changes nothing more.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

from ocmm_core.calibration.records import CalibrationStatus
from ocmm_core.errors import OcmmError
from ocmm_core.export.report import report_of_job
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import PARTIAL_PLAN, SIMULATED
from ocmm_core.inspection.finished import ReopenedJob, parts_of_batch, reopen_job, why_not_counted
from ocmm_core.tolerances.decisions import CharacteristicResult, Verdict
from ocmm_core.tolerances.kinds import spec_of
from ocmm_machine._document import CorrectionDocument

_USABLE = (CalibrationStatus.VALID, CalibrationStatus.DUE)


@dataclass(frozen=True, slots=True)
class MeasuredValue:
    """A characteristic of a finished job."""

    result: CharacteristicResult
    axis: str
    """Axis of the part frame, from the plan; empty if none."""
    why: str = ""
    """Reason why its value does not count, as far as known from other results."""

    @property
    def refusal(self) -> str:
        """Return why no correction rests on it, as a sentence; empty if one may."""
        result = self.result
        if self.why:
            return self.why
        if result.verdict not in (Verdict.CONFORM, Verdict.NOT_CONFORM):
            return f"The verdict on {result.name} is {result.verdict.value}."
        if result.stated is None or not np.isfinite(result.stated).all() or result.stated[2] <= 0.0:
            return f"{result.name} has no value with an uncertainty."
        if spec_of(result.kind).one_sided:
            return f"{result.name} is the width of a zone, which has no sign."
        return ""


@dataclass(frozen=True, slots=True)
class PartFacts:
    """A finished job."""

    job: str
    uuid: str
    serial: str
    plan: str
    created: datetime
    simulated: bool
    faults: tuple[str, ...]
    """Why it proves nothing, in sentences; empty for a whole, signed, calibrated job."""
    values: Mapping[str, MeasuredValue]
    """By name of the characteristic."""
    places: Mapping[str, Float]
    """Nominal points (3,) of the features, mm, part frame."""
    aligned: bool
    """Whether the part frame was measured."""


def facts_of(job: ReopenedJob) -> PartFacts:
    data = report_of_job(job)
    words = {one.label.partition(" ")[0] for one in (data.calibration, data.probe)}
    unusable = () if data.view.simulated else sorted(words - set(_USABLE))
    states = [one for one in data.states if one not in (PARTIAL_PLAN, SIMULATED)]
    asked = {one.name: one for one in data.plan.characteristics}
    faults = (
        *job.doubts,
        *(f"The job is {state}." for state in states),
        *(f"Its cameras or its probe were {word}." for word in unusable),
        *(() if data.view.complete else ("The job is not finished.",)),
    )
    return PartFacts(
        job=data.job, uuid=data.head.job_uuid, serial=data.head.serial, plan=data.plan.name,
        created=datetime.fromisoformat(data.head.created_utc), simulated=data.view.simulated,
        faults=faults,
        values={
            one.name: MeasuredValue(
                one, asked[one.name].axis if one.name in asked else "", why_not_counted(job, one)
            )
            for one in data.results
        },
        places={
            one.name: one.nominal_element.point
            for one in data.features
            if one.nominal_element is not None
        },
        aligned=data.T_part_from_world is not None,
    )  # fmt: skip


def read_parts(
    path: Path, since: datetime | None, probes: Path | None = None, calibrations: Path | None = None
) -> tuple[tuple[PartFacts, ...], tuple[str, ...]]:
    """Return a job after the earlier ones of its batch and plan, and sentences on unread ones.

    Jobs are read-only and recomputed; errors of the job itself as of `reopen_job`. ``since``: only
    later jobs are read; None reads the job alone.
    """
    last = reopen_job(path, probes, calibrations=calibrations)
    own, batch = facts_of(last), last.view.header.batch
    parts: list[PartFacts] = []
    unread: list[str] = []
    for one in parts_of_batch(path.parent, batch) if batch and since is not None else ():
        created, same = datetime.fromisoformat(one.created_utc), last.head.plan_identity
        if not (since or created) <= created < own.created or one.plan_identity != same:
            continue
        try:
            parts.append(facts_of(reopen_job(one.path, probes, calibrations=calibrations)))
        except OcmmError as error:
            unread.append(error.what)
    return (*parts, own), tuple(unread)


class CorrectionLine(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One change of a machine's offsets."""

    utc: str
    who: str
    software: str
    what: Literal["corrected", "undone", "stated"]
    """By a job; back to the values before; or read by a person from the control."""
    document: str
    """SHA-256 of the document of corrections."""
    before: dict[str, float]
    after: dict[str, float]
    """`before`, `after`: values of all offsets of the document, mm or degrees."""
    expanded: dict[str, float] = {}
    """U of the changes."""
    job: str = ""
    serial: str = ""
    jobs: tuple[str, ...] = ()
    serials: tuple[str, ...] = ()
    """`job`, `serial`: the source. `jobs`, `serials`: all parts used, by UUID and number."""
    characteristics: tuple[str, ...] = ()
    undoes: int = 0
    """Number of the line that is undone, from 1 on."""
    reason: str = ""

    @property
    def changed(self) -> list[str]:
        """Return the names of the changed offsets."""
        return [one for one, value in self.after.items() if value != self.before.get(one)]


def values_in_force(
    document: CorrectionDocument, lines: Sequence[CorrectionLine]
) -> dict[str, float]:
    """Return the values of all offsets after these lines."""
    values = {one.name: one.present for one in document.offset}
    for line in lines:
        values |= {name: value for name, value in line.after.items() if name in values}
    return values


def count_since(
    document: CorrectionDocument, parts: Sequence[PartFacts], lines: Sequence[CorrectionLine]
) -> Iterator[PartFacts]:
    """Yield the parts that were cut with the values in force now, oldest first."""
    times = [datetime.fromisoformat(line.utc) for line in lines]
    now = values_in_force(document, lines)
    seen: dict[int, int] = {}
    for part in parts:
        before = sum(time <= part.created for time in times)
        seen[before] = seen.get(before, 0) + 1
        dead = document.dead_parts if before else 0
        if seen[before] > dead and values_in_force(document, lines[:before]) == now:
            yield part
