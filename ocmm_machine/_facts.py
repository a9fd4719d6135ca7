"""Facts of a finished job that corrections rest on, and reasons why it proves nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np

from ocmm_core.calibration.records import CalibrationStatus
from ocmm_core.errors import OcmmError
from ocmm_core.export.report import report_of_job
from ocmm_core.geometry import Float
from ocmm_core.inspection.archive import ReopenedJob, parts_of_batch, reopen_job, why_not_counted
from ocmm_core.inspection.evaluation import PARTIAL_PLAN, SIMULATED
from ocmm_core.tolerances.decisions import CharacteristicResult, Verdict
from ocmm_core.tolerances.kinds import spec_of

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
