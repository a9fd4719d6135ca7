"""Source of the displayed results: the running job, or a job file opened read-only."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.errors import OcmmError
from ocmm_core.export.report import ReportData, report_of_job
from ocmm_core.inspection.archive import Tell, reopen_job
from ocmm_core.inspection.evaluation import JobView
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import header_words, said, tr
from ocmm_gui.work import Failed


@dataclass(frozen=True, slots=True)
class JobFileData:
    """Data of an opened job file."""

    path: Path
    report: ReportData
    doubts: tuple[str, ...]
    """Findings against the file, in sentences."""
    remarks: tuple[str, ...] = ()
    """Remarks that are no findings."""


def opened_job(
    path: Path, tell: Tell, *, probes: Path | None = None, calibrations: Path | None = None
) -> JobFileData:
    """Return a job from its own file, recalculated; errors and folders as `reopen_job`."""
    job = reopen_job(path, probes, tell, calibrations)
    return JobFileData(path, report_of_job(job), job.doubts, job.remarks)


Ask = Callable[[Callable[[ReportData], None], Failed], None]
"""Requests a report; one callback is called, now or later, on the window's thread."""


@dataclass(frozen=True, slots=True)
class JobSource:
    """A job to view."""

    file: Callable[[], Path]
    view: Callable[[], JobView]
    report: Ask
    """Requests the full report data of its current state."""
    lost: Callable[[], OcmmError | None] = lambda: None
    """Returns why the job is not on the disk under its name; None while it is."""
    read_only: bool = False
    """Opened from its file."""
    calibration: str = ""
    """State of cameras and probe; empty for the running job, for which the station reports it."""
    doubts: tuple[str, ...] = ()
    """Findings against the file, in sentences."""
    remarks: tuple[str, ...] = ()
    """Remarks that are no findings."""

    @property
    def path(self) -> Path:
        return self.file()

    @classmethod
    def of_bridge(cls, bridge: StationBridge) -> JobSource:
        job = bridge.station.job
        return cls(
            lambda: job.path, lambda: bridge.shown.job, bridge.results.report, lambda: job.lost
        )

    @classmethod
    def of_opened(cls, opened: JobFileData) -> JobSource:
        report = opened.report
        return cls(
            lambda: opened.path,
            lambda: report.view,
            lambda done, _failed: done(report),
            read_only=True,
            calibration=tr("Cameras: {cameras}. Probe: {probe}. Plan: {release}.").format(
                cameras=said(report.calibration.label),
                probe=said(report.probe.label),
                release=said(report.release.words),
            ),
            doubts=opened.doubts,
            remarks=opened.remarks,
        )

    def state(self) -> object:
        """Return a value that changes whenever the job does."""
        job = self.view()
        numbers = tuple(point.number for feature in job.features for point in feature.points)
        return (self.path, numbers, job.active)

    def words(self, job: JobView) -> str:
        """Return the displayed job, and findings against it."""
        who = header_words(job)
        if not self.read_only:
            return tr("Current job {job}, part {part}. {who}.").format(
                job=job.job, part=job.part, who=who
            )
        agree = () if self.doubts else (tr("Recomputed from raw data: matches the file."),)
        doubts = " ".join((*self.doubts, *agree, *self.remarks))
        return tr("{name}, read-only, part {part}. {who}. {doubts}").format(
            name=self.path.name, part=job.part, who=who, doubts=doubts
        )
