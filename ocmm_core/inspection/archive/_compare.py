"""Jobs of one plan side by side: trend, control chart and capability of every characteristic."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from ocmm_core.cluster import HERE, Site, run_tasks
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.geometry import Float
from ocmm_core.inspection.archive._batch import SUFFIX
from ocmm_core.inspection.archive._known import content_and_known, known_from
from ocmm_core.inspection.archive._reopen import ReopenedJob, Tell, reopen_job
from ocmm_core.inspection.archive._stored_documents import named
from ocmm_core.inspection.evaluation import (
    NO_REAL_PART,
    SIMULATED,
    held_below,
    job_states,
    part_line,
)
from ocmm_core.leftovers import scratch_folder
from ocmm_core.measuring import COVERAGE_FACTOR
from ocmm_core.processes import processes_for, side_by_side
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

_TRIED, _START_S = 2, 4.0
"""Jobs that are read before it is decided how, and what the start of processes costs, s: they load
libraries and kernels for one to two seconds each, on cores that would read meanwhile."""

_ROOM = 1.12
"""A scale is so much longer than what it shows."""


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
    features
        That the characteristic is about, with its datums.
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
    features: tuple[str, ...] = ()

    @property
    def values(self) -> Float:
        """Return the values that are counted, (n,)."""
        return np.array([part.value for part in self.parts if part.value is not None])

    @property
    def caution(self) -> str:
        """Return what must be known before the indices are used; empty where nothing must."""
        if self.chart is None or self.capability is None or not self.chart.signals:
            return ""
        return "Not in control: find the causes of the signals before Cp and Cpk are used."

    def span(self) -> tuple[float, float]:
        """Return the ends of a scale for values, their uncertainties, and both kinds of limits."""
        ends = [value for value in (self.low, self.high) if math.isfinite(value)]
        if self.chart is not None:
            ends += [self.chart.low, self.chart.high]
        for part in self.parts:
            if part.value is not None and part.uncertainty is not None:
                ends += [part.value - part.uncertainty, part.value + part.uncertainty]
        middle = 0.5 * (min(ends) + max(ends))
        half = _ROOM * 0.5 * max(max(ends) - min(ends), 1e-6)
        return middle - half, middle + half


@dataclass(frozen=True, slots=True)
class Comparison:
    """Jobs of one plan side by side.

    Attributes
    ----------
    plan
        Name of the plan that they were measured by.
    jobs
        Names of the jobs, in the order in which they were begun.
    words
        What each of them is and what its part is.
    trends
        One for every characteristic.
    left_out
        Why files are not compared, a sentence each.
    unread
        Those of them about files that could not be read.
    simulated
        What is counted came from a virtual rig.
    """

    plan: str
    jobs: tuple[str, ...]
    words: tuple[str, ...]
    trends: tuple[Trend, ...]
    left_out: tuple[str, ...]
    unread: tuple[str, ...]
    simulated: bool

    def about(self, feature: str) -> Comparison:
        """Return what is about a feature; everything where its name is empty.

        Raises
        ------
        InputError
            No characteristic is about it.
        """
        if not feature:
            return self
        found = tuple(trend for trend in self.trends if feature in trend.features)
        if not found:
            known = sorted({name for trend in self.trends for name in trend.features})
            raise InputError(
                "compare.feature",
                f"No characteristic is about feature {feature!r}.",
                f"Choose from {', '.join(known)}.",
            )
        return replace(self, trends=found)


@dataclass(frozen=True, slots=True)
class PartJob:
    """What a comparison takes of a job; little enough to come from another process.

    Attributes
    ----------
    path, uuid, serial, created_utc, plan, plan_text
        Of the job and its plan.
    characteristics
        Of the plan.
    values
        For each of them value and U (95 %), or None; why it is not counted, or nothing; its
        verdict. Whether the job is simulated beside real ones is not looked at here.
    simulated
        It came from a virtual rig.
    words
        What the job is and what its part is, in a line.
    """

    path: Path
    uuid: str
    serial: str
    created_utc: str
    plan: str
    plan_text: str
    characteristics: tuple[Characteristic, ...]
    values: tuple[tuple[tuple[float, float] | None, str, Verdict], ...]
    simulated: bool
    words: str


def compare_folder(
    folder: Path,
    progress: Tell = lambda what, share: None,
    probes: Path | None = None,
    calibrations: Path | None = None,
) -> Comparison:
    """Return what the jobs of a folder say together; as `compare_files`.

    Raises
    ------
    InputError
        There is no such folder, or it has fewer than two jobs of one plan.
    """
    if not folder.is_dir():
        raise InputError("compare.folder", f"{folder}: folder not found.", "Check the name.")
    return compare_files(sorted(folder.glob(f"*{SUFFIX}")), progress, probes, calibrations)


def compare_files(
    paths: Sequence[Path],
    progress: Tell = lambda what, share: None,
    probes: Path | None = None,
    calibrations: Path | None = None,
    processes: int | None = None,
    site: Site = HERE,
) -> Comparison:
    """Return what jobs say together: those by the plan of the latest one.

    Parameters
    ----------
    paths
        Job files; they are opened read-only, many of them in processes side by side. One that
        cannot be read is left out and named.
    progress
        Told how far it is, and the share that is done.
    probes, calibrations
        Where histories are kept, as for `reopen_job`.
    processes
        Of this computer that read; None for one a core, or this one alone where there are few
        jobs.
    site
        Where jobs are computed; one that names neither workers nor a scheduler leaves it to
        ``processes``.

    Raises
    ------
    InputError
        There are fewer than two jobs of one plan, or a job is there twice.
    """
    jobs: list[PartJob] = []
    unread: list[str] = []
    if site.scheduler or site.workers is not None:
        read = run_tasks(
            _read_content,
            paths,
            lambda path: f"The reading of {path.name}",
            site=site,
            contents=partial(content_and_known, probes=probes, calibrations=calibrations),
            told=lambda done: progress(
                f"Read {done} of {len(paths)} jobs", done / max(len(paths), 1)
            ),
        )
    else:
        read = _read_all(
            partial(_read, probes=probes, calibrations=calibrations), paths, processes, progress
        )
    for found in read:
        if isinstance(found, PartJob):
            jobs.append(found)
        else:
            unread.append(found.what)
    if not jobs and unread:
        raise InputError(
            "compare.unread",
            f"None of {len(unread)} files is a job that can be read: {unread[0]}",
            "Choose two jobs of one plan or more.",
        )
    jobs.sort(key=lambda job: job.created_utc)
    same = [job for job in jobs if job.plan_text == jobs[-1].plan_text]
    others = [
        f"{job.path.name} was measured with another plan, {job.plan}."
        for job in jobs
        if job.plan_text != jobs[-1].plan_text
    ]
    trends = _trends(same)
    return Comparison(
        plan=same[0].plan,
        jobs=tuple(job.path.stem for job in same),
        words=tuple(job.words for job in same),
        trends=trends,
        unread=tuple(unread),
        left_out=(*unread, *others),
        simulated=_all_simulated(same),
    )


def compare_jobs(jobs: Sequence[ReopenedJob]) -> tuple[Trend, ...]:
    """Return what the jobs of one plan say together, characteristic by characteristic.

    For scripts that hold jobs open, and for tests; commands and the window read files
    (`compare_files`). A value that rests on points in doubt, or on an uncalibrated machine, is
    shown and not counted: a trend must not be made of it. Nor are values of simulated jobs beside
    those of real ones.

    Raises
    ------
    InputError
        There are fewer than two jobs, they are of different plans, or two are the same job.
    """
    return _trends([_part_job(job) for job in jobs])


def _read_content(path: Path, file: bytes, log: bytes, known: bytes) -> PartJob:
    """Return what a comparison takes of a job, on whichever computer."""
    with scratch_folder("compare") as folder:
        copy = folder / "job.ocmm"
        copy.write_bytes(file)
        if log:
            copy.with_name(f"{copy.name}-wal").write_bytes(log)
        try:
            job = reopen_job(copy, known=known_from(known))
        except OcmmError as error:
            raise named(error, str(copy), str(path)) from error
    return _part_job(replace(job, path=path))


def _read_all(
    work: Callable[[Path], PartJob], paths: Sequence[Path], processes: int | None, progress: Tell
) -> Iterator[PartJob | OcmmError]:
    """Give what came of each file, in their order; others read with it where that pays.

    How long a job takes (0.03 s with 14 points, 0.2 s with 91 and thirteen characteristics) decides
    more than how many there are: two are read here, the second one with everything loaded, and
    processes are started where what is left takes longer than their start.
    """

    def read(some: Sequence[Path], many: int, before: int) -> Iterator[PartJob | OcmmError]:
        def told(done: int) -> None:
            # What was read before was told of then.
            if done or not before:
                count = before + done
                progress(f"Read {count} of {len(paths)} jobs", count / max(len(paths), 1))

        return side_by_side(work, some, many, lambda path: f"The reading of {path.name}", told)

    if processes is not None:
        yield from read(paths, processes, 0)
        return
    first, left = paths[:_TRIED], paths[_TRIED:]
    began = time.perf_counter()
    for found in read(first, 1, 0):
        took, began = time.perf_counter() - began, time.perf_counter()
        yield found
    if left:
        pays = took * len(left) > _START_S
        yield from read(left, processes_for(len(paths)) if pays else 1, len(first))


def _read(path: Path, probes: Path | None, calibrations: Path | None) -> PartJob:
    return _part_job(reopen_job(path, probes, calibrations=calibrations))


def _part_job(job: ReopenedJob) -> PartJob:
    values = []
    for result in job.view.characteristics:
        why, stated = why_not_counted(job, result), result.stated
        counted = None if why or stated is None else (stated[0], stated[2])
        values.append((counted, why, result.verdict))
    return PartJob(
        path=job.path,
        uuid=job.head.job_uuid,
        serial=job.head.serial,
        created_utc=job.head.created_utc,
        plan=job.plan.name,
        plan_text=job.head.plan_text,
        characteristics=tuple(job.plan.characteristics),
        values=tuple(values),
        simulated=job.view.simulated,
        words="; ".join((*job_states(job.view), part_line(job.view))),
    )


def _trends(jobs: Sequence[PartJob]) -> tuple[Trend, ...]:
    if len(jobs) < 2:
        raise InputError(
            "compare.too_few",
            f"There {'is 1 job' if jobs else 'is no job'} to compare.",
            "Choose two jobs of one plan or more.",
        )
    first = jobs[0]
    for job in jobs[1:]:
        if job.plan_text != first.plan_text:
            raise InputError(
                "compare.plan",
                f"{job.path} was measured with another plan than {first.path}.",
                "Compare jobs of one plan; a changed plan counts as another.",
            )
    seen: set[str] = set()
    for job in jobs:
        if job.uuid in seen:
            raise InputError(
                "compare.twice",
                f"{job.path}: this job is selected twice, possibly as a copy.",
                "Select it once.",
            )
        seen.add(job.uuid)
    ordered = sorted(jobs, key=lambda job: job.created_utc)
    return tuple(_trend(index, item, ordered) for index, item in enumerate(first.characteristics))


def _all_simulated(jobs: Sequence[PartJob]) -> bool:
    """Return whether all jobs came from virtual rigs, so that what they say together did, too."""
    return all(job.simulated for job in jobs)


def _trend(index: int, item: Characteristic, jobs: Sequence[PartJob]) -> Trend:
    left_out = []
    counted = []
    parts = []
    computed = _all_simulated(jobs)
    for job in jobs:
        stated, why, verdict = job.values[index]
        if job.simulated and not computed:
            stated = None
            why = f"{SIMULATED}. {NO_REAL_PART} Compare simulated jobs separately."
        if stated is None:
            left_out.append(f"{job.path.stem}: {why}")
        else:
            counted.append(stated)
        parts.append(
            PartValue(
                job=job.path.stem,
                serial=job.serial,
                created_utc=job.created_utc,
                value=None if stated is None else stated[0],
                uncertainty=None if stated is None else stated[1],
                verdict=verdict,
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
        item.name, item.kind, low, high, tuple(parts), tuple(left_out), chart, able, why_not,
        tuple(dict.fromkeys((*item.features, *item.datums))),
    )  # fmt: skip


def why_not_counted(job: ReopenedJob, result: CharacteristicResult) -> str:
    """Return what speaks against counting a value; empty where nothing does."""
    if job.doubts:
        return job.doubts[0]
    if job.view.unproven:
        return job.view.unproven
    if result.stated is None:
        return result.note or "Not measured."
    if held_below(result, job.plan, job.view):
        return result.note
    return ""
