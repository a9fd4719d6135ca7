"""Comparison of jobs of one plan: trend, control chart and capability per characteristic."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

from ocmm_core.cluster import HERE, Site, run_tasks
from ocmm_core.documents import files_of_folder
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.inspection.archive._batch import SUFFIX
from ocmm_core.inspection.archive._comparison import (
    Comparison,
    PartJob,
    Trend,
    all_simulated,
    trends_of,
)
from ocmm_core.inspection.archive._known import content_and_known, known_from
from ocmm_core.inspection.archive._reopen import ReopenedJob, Tell, reopen_content, reopen_job
from ocmm_core.inspection.evaluation import held_below, job_states, part_line
from ocmm_core.processes import processes_for, side_by_side
from ocmm_core.tolerances.decisions import CharacteristicResult

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


def compare_jobs(jobs: Sequence[ReopenedJob]) -> tuple[Trend, ...]:
    """Compare open jobs of one plan, characteristic by characteristic; for scripts and tests.

    Values with suspect points or from an uncalibrated machine are shown but not counted, nor are
    simulated values in a comparison with real ones. InputError if there are fewer than two jobs,
    they are of different plans, or two are the same job.
    """
    return trends_of([_part_job(job) for job in jobs])


def _read_content(path: Path, file: bytes, known: bytes) -> PartJob:
    return _part_job(reopen_content(path, file, known_from(known)))


def _read_all(
    work: Callable[[Path], PartJob], paths: Sequence[Path], processes: int | None, progress: Tell
) -> Iterator[PartJob | OcmmError]:
    """Yield the result of each file in order, reading in parallel if that pays.

    The time per job (0.03 s with 14 points, 0.2 s with 91) decides more than their number: two are
    read here, the second with everything loaded; processes start if the rest takes longer than they
    do.
    """

    def read(some: Sequence[Path], many: int, before: int) -> Iterator[PartJob | OcmmError]:
        def told(done: int) -> None:
            # Earlier files were reported then.
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
    if held_below(result, job.plan, job.view):
        return result.note
    return ""
