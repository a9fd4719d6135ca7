"""Open a job file for viewing; runs in a side process."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ocmm_core.export.report import ReportData, report_of_job
from ocmm_core.inspection.archive import Tell, reopen_job


@dataclass(frozen=True, slots=True)
class OpenedJob:
    """Data of an opened job file."""

    path: Path
    report: ReportData
    doubts: tuple[str, ...]
    """Findings against the file, in sentences."""
    remarks: tuple[str, ...] = ()
    """Remarks that are no findings."""


def opened_job(
    path: Path, tell: Tell, *, probes: Path | None = None, calibrations: Path | None = None
) -> OpenedJob:
    """Return a job from its own file, recalculated; errors and folders as `reopen_job`."""
    job = reopen_job(path, probes, tell, calibrations)
    return OpenedJob(path, report_of_job(job), job.doubts, job.remarks)
