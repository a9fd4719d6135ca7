"""A job file opened to be looked at; runs in a process of its own."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ocmm_core.export.report import ReportData, report_of_job
from ocmm_core.inspection.archive import Tell, reopen_job


@dataclass(frozen=True, slots=True)
class OpenedJob:
    """What the window keeps of a job file that was opened."""

    path: Path
    report: ReportData
    """The job as it stands, and all that a report can say about it."""
    doubts: tuple[str, ...]
    """All that speaks against the file, in sentences."""
    remarks: tuple[str, ...] = ()
    """What should be known beside, and speaks against nothing."""


def opened_job(
    path: Path, tell: Tell, *, probes: Path | None = None, calibrations: Path | None = None
) -> OpenedJob:
    """Return a job from its own file, computed anew; errors and folders as `reopen_job`."""
    job = reopen_job(path, probes, tell, calibrations)
    return OpenedJob(path, report_of_job(job), job.doubts, job.remarks)
