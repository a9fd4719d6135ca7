"""Jobs of one plan side by side: trend, control chart and capability of every characteristic."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ocmm_core.errors import InputError, OcmmError
from ocmm_core.geometry import Float
from ocmm_core.inspection.archive._reopen import ReopenedJob, reopen_job
from ocmm_core.inspection.evaluation import NO_REAL_PART, SIMULATED, held_below
from ocmm_core.measuring import COVERAGE_FACTOR
from ocmm_core.tolerances.decisions import (
    CharacteristicResult,
    ControlChart,
    ProcessCapability,
    Verdict,
    capability,
    control_chart,
)
from ocmm_core.tolerances.kinds import spec_of
from ocmm_core.tolerances.zones import Characteristic


@dataclass(frozen=True, slots=True)
class PartValue:
    """One characteristic of one part.

    Attributes
    ----------
    job, serial, created_utc
        Of its job.
    value, uncertainty
        Measured value and U (95 %); None where there is none.
    verdict
        Of the job.
    """

    job: str
    serial: str
    created_utc: str
    value: float | None
    uncertainty: float | None
    verdict: Verdict


@dataclass(frozen=True, slots=True)
class Trend:
    """One characteristic over all parts.

    Attributes
    ----------
    name, kind
        As in the plan.
    low, high
        Limits of the value; infinite where there is none.
    parts
        In the order in which the jobs were begun.
    left_out
        Why parts are not counted, a sentence each; empty where all are.
    chart, capability
        None where there is nothing to say; ``why_not`` then says why.
    why_not
        A sentence, or empty.
    """

    name: str
    kind: str
    low: float
    high: float
    parts: tuple[PartValue, ...]
    left_out: tuple[str, ...]
    chart: ControlChart | None
    capability: ProcessCapability | None
    why_not: str

    @property
    def values(self) -> Float:
        """Return the values that are counted, (n,)."""
        return np.array([part.value for part in self.parts if part.value is not None])


@dataclass(frozen=True, slots=True)
class Comparison:
    """The jobs of a folder side by side.

    Attributes
    ----------
    plan
        Name of the plan that they were measured by.
    jobs
        Names of the jobs, in the order in which they were begun.
    trends
        One for every characteristic.
    left_out
        Why files of the folder are not compared, a sentence each.
    simulated
        What is counted came from a virtual rig.
    """

    plan: str
    jobs: tuple[str, ...]
    trends: tuple[Trend, ...]
    left_out: tuple[str, ...]
    simulated: bool = False


def compare_folder(
    folder: Path,
    progress: Callable[[str, float], None] | None = None,
    probes: Path | None = None,
    calibrations: Path | None = None,
) -> Comparison:
    """Return what the jobs of a folder say together: those by the plan of the latest one.

    Parameters
    ----------
    folder
        Its job files are opened read-only.
    progress
        Told what is read next, and the share that is done.
    probes, calibrations
        Where histories are kept, as for `reopen_job`.

    Raises
    ------
    InputError
        There is no such folder, or it has fewer than two jobs of one plan.
    """
    if not folder.is_dir():
        raise InputError("compare.folder", f"{folder}: folder not found.", "Check the name.")
    opened: list[ReopenedJob] = []
    left_out: list[str] = []
    paths = sorted(folder.glob("*.ocmm"))
    for done, path in enumerate(paths):
        if progress is not None:
            progress(f"Reading {path.name}", done / len(paths))
        try:
            opened.append(reopen_job(path, probes, calibrations=calibrations))
        except OcmmError as error:
            left_out.append(error.what)
    opened.sort(key=lambda job: job.head.created_utc)
    same = [job for job in opened if job.head.plan_text == opened[-1].head.plan_text]
    left_out += [
        f"{job.path.name} was measured with another plan, {job.plan.name}."
        for job in opened
        if all(job is not other for other in same)
    ]
    trends = compare_jobs(same)
    names = tuple(job.path.stem for job in same)
    return Comparison(
        same[0].plan.name, names, trends, tuple(left_out), simulated=all_simulated(same)
    )


def compare_jobs(jobs: Sequence[ReopenedJob]) -> tuple[Trend, ...]:
    """Return what the jobs of one plan say together, characteristic by characteristic.

    A value that rests on points in doubt, or on an uncalibrated machine, is shown and not counted:
    a trend must not be made of it. Nor are values of simulated jobs beside those of real ones.

    Raises
    ------
    InputError
        There are fewer than two jobs, they are of different plans, or two are the same job.
    """
    if len(jobs) < 2:
        raise InputError(
            "compare.too_few",
            f"There {'is 1 job' if jobs else 'is no job'} to compare.",
            "Choose two jobs of one plan or more.",
        )
    first = jobs[0]
    for job in jobs[1:]:
        if job.head.plan_text != first.head.plan_text:
            raise InputError(
                "compare.plan",
                f"{job.path} was measured with another plan than {first.path}.",
                "Compare jobs of one plan; a changed plan counts as another.",
            )
    uuids = [job.head.job_uuid for job in jobs]
    for job in jobs:
        if uuids.count(job.head.job_uuid) > 1:
            raise InputError(
                "compare.twice",
                f"{job.path}: this job is selected twice, possibly as a copy.",
                "Select it once.",
            )
    ordered = sorted(jobs, key=lambda job: job.head.created_utc)
    return tuple(
        _trend(index, item, ordered) for index, item in enumerate(first.plan.characteristics)
    )


def all_simulated(jobs: Sequence[ReopenedJob]) -> bool:
    """Return whether all jobs came from virtual rigs, so that what they say together did, too."""
    return all(job.view.simulated for job in jobs)


def _trend(index: int, item: Characteristic, jobs: Sequence[ReopenedJob]) -> Trend:
    results = [job.view.characteristics[index] for job in jobs]
    left_out = []
    counted = []
    parts = []
    computed = all_simulated(jobs)
    for job, result in zip(jobs, results, strict=True):
        why = _why_not_counted(job, result, simulated=computed)
        stated = None if why else result.stated
        if stated is None:
            left_out.append(f"{job.path.stem}: {why}")
        else:
            counted.append((stated[0], stated[2]))
        parts.append(
            PartValue(
                job=job.path.stem,
                serial=job.head.serial,
                created_utc=job.head.created_utc,
                value=None if stated is None else stated[0],
                uncertainty=None if stated is None else stated[2],
                verdict=result.verdict,
            )
        )
    low = -math.inf if spec_of(item.kind).one_sided else item.nominal + item.lower
    high = item.nominal + item.upper
    chart, able, why_not = None, None, ""
    values = np.array([value for value, _ in counted])
    try:
        chart = control_chart(values)
        middle = float(np.median([u for _, u in counted])) / COVERAGE_FACTOR
        able = capability(values, low, high, middle)
    except OcmmError as error:
        why_not = f"{error.what} {error.remedy}"
    return Trend(
        item.name, item.kind, low, high, tuple(parts), tuple(left_out), chart, able, why_not
    )


def _why_not_counted(job: ReopenedJob, result: CharacteristicResult, *, simulated: bool) -> str:
    """Return why a value is not counted; empty where it is.

    Parameters
    ----------
    simulated
        All jobs are, so that one more is no stranger among them.
    """
    if job.view.simulated and not simulated:
        return f"{SIMULATED}. {NO_REAL_PART} Compare simulated jobs separately."
    if job.doubts:
        return job.doubts[0]
    if job.view.unproven:
        return job.view.unproven
    if result.stated is None:
        return result.note or "Not measured."
    if held_below(result, job.plan, job.view):
        return result.note
    return ""
