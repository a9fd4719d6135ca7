"""Where the shown results come from: the job that is measured, or a job file opened read-only."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.export.report_data import ReportData, report_of_job
from ocmm_core.inspection.reopen import reopen_job
from ocmm_core.inspection.view import JobView
from ocmm_core.station.station import MeasuringStation
from ocmm_gui.words import header_words


@dataclass(frozen=True, slots=True)
class JobSource:
    """One job to look at.

    Attributes
    ----------
    file
        Gives its file.
    view, report
        Give the job as it stands, and all that a report can say about it.
    read_only
        It was opened from its file.
    calibration
        How cameras and probe stood; empty for the running job, of which the station tells.
    doubts
        All that speaks against the file, in sentences.
    """

    file: Callable[[], Path]
    view: Callable[[], JobView]
    report: Callable[[], ReportData]
    read_only: bool = False
    calibration: str = ""
    doubts: tuple[str, ...] = ()

    @property
    def path(self) -> Path:
        """Return its file."""
        return self.file()

    @classmethod
    def of_station(cls, station: Callable[[], MeasuringStation]) -> JobSource:
        """Return the job that a station measures."""
        return cls(
            lambda: station().job_path, lambda: station().job(), lambda: station().report()
        )

    @classmethod
    def of_file(cls, path: Path) -> JobSource:
        """Return the job of a file; raise OcmmError as `reopen_job`."""
        job = reopen_job(path)
        report = report_of_job(job)
        return cls(
            lambda: path,
            lambda: job.view,
            lambda: report,
            read_only=True,
            calibration=f"Cameras: {report.calibration.label}. Probe: {report.probe.label}.",
            doubts=job.doubts,
        )

    def state(self) -> object:
        """Return what changes whenever the job does."""
        job = self.view()
        numbers = tuple(point.number for feature in job.features for point in feature.points)
        return (self.path, numbers, job.active)

    def words(self, job: JobView) -> str:
        """Return which job is shown, and what speaks against it."""
        who = header_words(job)
        if not self.read_only:
            return f"Running job {job.job}, part {job.part}. {who}."
        doubts = " ".join(self.doubts) or "Computed anew from its points: the numbers agree."
        return f"{self.path.name}, read-only, part {job.part}. {who}. {doubts}"
