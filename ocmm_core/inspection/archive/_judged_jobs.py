"""Verdicts of recent jobs for a list, computed from their files as `reopen_job` does."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.errors import OcmmError
from ocmm_core.inspection.archive._reopen import reopen_job
from ocmm_core.inspection.evaluation import JobView


@dataclass(frozen=True, slots=True)
class JudgedJob:
    """One job of a list with its verdict."""

    path: Path
    view: JobView | None = None
    """The job as its page of results shows it; None with a fault."""
    doubts: tuple[str, ...] = ()
    """As `ReopenedJob.doubts`."""
    fault: OcmmError | None = None


def judge_jobs(
    paths: Sequence[Path],
    give: Callable[[JudgedJob], None],
    probes: Path | None = None,
    calibrations: Path | None = None,
) -> None:
    """Give each job with its verdict, in this order; folders as `reopen_job`."""
    for path in paths:
        try:
            job = reopen_job(path, probes, calibrations=calibrations)
        except OcmmError as fault:
            give(JudgedJob(path, fault=fault))
        else:
            give(JudgedJob(path, job.view, job.doubts))
