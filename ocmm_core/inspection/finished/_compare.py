"""Comparison of jobs of one plan: trend, control chart and capability per characteristic."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from ocmm_core.cluster import HERE, Site, run_tasks
from ocmm_core.documents import files_of_folder
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import (
    NO_REAL_PART,
    SIMULATED,
    held_below,
    job_states,
    part_line,
)
from ocmm_core.inspection.finished._batch import SUFFIX
from ocmm_core.inspection.finished._reopen import (
    ReopenedJob,
    Tell,
    content_and_known,
    known_from,
    reopen_content,
    reopen_job,
)
from ocmm_core.measuring import COVERAGE_FACTOR
from ocmm_core.named_file import FileIdentity
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
"""Jobs read before deciding on parallel reading, and the cost of starting processes, s: each loads
libraries and kernels for one to two seconds, on cores that could read meanwhile."""


def compare_folder(
    folder: Path,
    progress: Tell = lambda what, share: None,
    probes: Path | None = None,
    calibrations: Path | None = None,
) -> Comparison:
    """Compare a folder's jobs as `compare_files`; InputError if unreadable, or fewer than two."""
    if not folder.is_dir():
        raise InputError("compare.folder", f"{folder}: folder not found.", "Check the name.")
    return compare_files(files_of_folder(folder, SUFFIX), progress, probes, calibrations)


def compare_files(
    paths: Sequence[Path],
    progress: Tell = lambda what, share: None,
    probes: Path | None = None,
    calibrations: Path | None = None,
    processes: int | None = None,
    site: Site = HERE,
) -> Comparison:
    """Compare jobs: those by the plan of the latest one.

    ``paths`` are read in parallel; unreadable ones are left out and named. ``probes``,
    ``calibrations``: folders of histories, as for `reopen_job`. ``processes``: None for one per
    core, or this one alone for few jobs; not used if ``site`` has workers or a scheduler.
    InputError if there are fewer than two jobs of one plan, or a job occurs twice.
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
            on_done=lambda done: progress(
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
    if len(jobs) < 2 and unread:
        what = f"{len(unread)} of {len(paths)} files are no jobs that can be read: {unread[0]}"
        if not jobs:
            what = f"None of {len(unread)} files is a job that can be read: {unread[0]}"
        raise InputError("compare.unread", what, "Choose two jobs of one plan or more.")
    jobs.sort(key=lambda job: job.created_utc)
    same = [job for job in jobs if job.plan_text == jobs[-1].plan_text]
    others = [
        f"{job.path.name} was measured with another plan, {job.plan}."
        for job in jobs
        if job.plan_text != jobs[-1].plan_text
    ]
    trends = trends_of(same)
    return Comparison(
        plan=same[0].plan,
        jobs=tuple(job.name for job in same),
        words=tuple(job.words for job in same),
        trends=trends,
        unread=tuple(unread),
        left_out=(*unread, *others),
        simulated=all_simulated(same),
        files=tuple(job.file for job in same if job.file is not None),
    )


def _read_content(path: Path, file: bytes, known: bytes) -> PartJob:
    return part_job(reopen_content(path, file, known_from(known)))


def _read_all(
    work: Callable[[Path], PartJob], paths: Sequence[Path], processes: int | None, progress: Tell
) -> Iterator[PartJob | OcmmError]:
    """Yield the result of each file in order, reading in parallel if that pays.

    The time per job (0.03 s with 14 points, 0.2 s with 91) decides more than their number: two are
    read here, the second with everything loaded; processes start if the rest takes longer than they
    do.
    """

    def read(some: Sequence[Path], many: int, before: int) -> Iterator[PartJob | OcmmError]:
        def on_done(done: int) -> None:
            # Earlier files were reported then.
            if done or not before:
                count = before + done
                progress(f"Read {count} of {len(paths)} jobs", count / max(len(paths), 1))

        return side_by_side(work, some, many, lambda path: f"The reading of {path.name}", on_done)

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
    return part_job(reopen_job(path, probes, calibrations=calibrations))


def part_job(job: ReopenedJob) -> PartJob:
    """Return the values of a job; those that do not count with the reason."""
    values = []
    for result in job.view.characteristics:
        why, stated = why_not_counted(job, result), result.stated
        counted = None if why or stated is None else (stated[0], stated[2])
        values.append((counted, why, result.verdict))
    return PartJob(
        path=job.path,
        name=job.view.job,
        uuid=job.head.job_uuid,
        serial=job.head.serial,
        created_utc=job.head.created_utc,
        plan=job.plan.name,
        plan_text=job.head.plan_text,
        characteristics=tuple(job.plan.characteristics),
        values=tuple(values),
        simulated=job.view.simulated,
        words=(*job_states(job.view), part_line(job.view), *job.renamed),
        file=job.identity,
    )


def why_not_counted(job: ReopenedJob, result: CharacteristicResult) -> str:
    """Return the reason for not counting a value; empty if it counts."""
    if job.doubts:
        return job.doubts[0]
    if job.view.unproven:
        return job.view.unproven
    if result.stated is None:
        return result.note or "Not measured."
    return result.note if held_below(result, job.plan, job.view) else ""


_ROOM = 1.12
"""Length of a scale relative to its content."""


@dataclass(frozen=True, slots=True)
class PartValue:
    job: str
    serial: str
    created_utc: str
    value: float | None
    uncertainty: float | None
    """`value`, `uncertainty`: Measured value and U (95 %), or None."""
    verdict: Verdict


@dataclass(frozen=True, slots=True)
class Trend:
    name: str
    kind: str
    low: float
    high: float
    """`low`, `high`: Limits of the value, may be infinite."""
    parts: tuple[PartValue, ...]
    """In the order of the starts of the jobs."""
    left_out: tuple[str, ...]
    """Reasons for not counting parts, a sentence each."""
    chart: ControlChart | None
    capability: ProcessCapability | None
    """`chart`, `capability`: None if not computed; ``why_not`` has the reason."""
    why_not: str
    features: tuple[str, ...] = ()
    """Features of the characteristic, with its datums."""

    @property
    def values(self) -> Float:
        """Return the counted values, (n,)."""
        return np.array([part.value for part in self.parts if part.value is not None])

    @property
    def caution(self) -> str:
        """Return a warning about the indices of a process out of control; empty without one."""
        if self.chart is None or self.capability is None or not self.chart.signals:
            return ""
        return "Not in control: find the causes of the signals before Cp and Cpk are used."

    def span(self) -> tuple[float, float]:
        """Return the ends of an axis for values, their uncertainties, and both kinds of limits."""
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
    """Jobs of one plan side by side."""

    plan: str
    jobs: tuple[str, ...]
    """In the order of their starts."""
    words: tuple[tuple[str, ...], ...]
    """Per job: states and the verdict on the part, each a sentence."""
    trends: tuple[Trend, ...]
    left_out: tuple[str, ...]
    """Reasons for not comparing files, a sentence each."""
    unread: tuple[str, ...]
    """The reasons in ``left_out`` about unreadable files."""
    simulated: bool
    """The counted jobs came from a virtual rig."""
    files: tuple[FileIdentity, ...] = ()

    def require_names(self) -> None:
        """Raise StorageError if a job is not on the disk under its name any more."""
        for file in self.files:
            file.require_name()

    def about(self, feature: str) -> Comparison:
        """Return the trends of a feature, all for an empty name; InputError without any."""
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
    """Data of a job for a comparison; small enough to come from another process."""

    path: Path
    name: str
    uuid: str
    serial: str
    created_utc: str
    plan: str
    plan_text: str
    characteristics: tuple[Characteristic, ...]
    values: tuple[tuple[tuple[float, float] | None, str, Verdict], ...]
    """Per characteristic: value and U (95 %), or None; reason for not counting it; verdict.

    Ignores mixing of simulated and real jobs."""
    simulated: bool
    words: tuple[str, ...]
    file: FileIdentity | None


def trends_of(jobs: Sequence[PartJob]) -> tuple[Trend, ...]:
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


def all_simulated(jobs: Sequence[PartJob]) -> bool:
    """Return whether all jobs, and so their comparison, are simulated."""
    return all(job.simulated for job in jobs)


def _trend(index: int, item: Characteristic, jobs: Sequence[PartJob]) -> Trend:
    left_out = []
    counted = []
    parts = []
    computed = all_simulated(jobs)
    for job in jobs:
        stated, why, verdict = job.values[index]
        if job.simulated and not computed:
            stated = None
            why = f"{SIMULATED}. {NO_REAL_PART} Compare simulated jobs separately."
        if stated is None:
            left_out.append(f"{job.name}: {why}")
        else:
            counted.append(stated)
        parts.append(
            PartValue(
                job=job.name,
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
