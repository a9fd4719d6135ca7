"""Where the shown results come from: the job that is measured, or a job file opened read-only."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.errors import OcmmError
from ocmm_core.export.report import ReportData
from ocmm_core.inspection.evaluation import JobView
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import header_words, said, tr
from ocmm_gui.results._opening import OpenedJob
from ocmm_gui.work import Failed

Ask = Callable[[Callable[[ReportData], None], Failed], None]
"""Asks for a report; one of both is told, at once or later, on the window's thread."""


@dataclass(frozen=True, slots=True)
class JobSource:
    """One job to look at."""

    file: Callable[[], Path]
    """Gives its file."""
    view: Callable[[], JobView]
    """Gives the job as it was shown last."""
    report: Ask
    """Gives all that a report can say about it as it stands."""
    lost: Callable[[], OcmmError | None] = lambda: None
    """Gives why the job is no longer on the disk under its name; None while it is."""
    read_only: bool = False
    """It was opened from its file."""
    calibration: str = ""
    """How cameras and probe stood; empty for the running job, of which the station tells."""
    doubts: tuple[str, ...] = ()
    """All that speaks against the file, in sentences."""
    remarks: tuple[str, ...] = ()
    """What should be known beside, and speaks against nothing."""

    @property
    def path(self) -> Path:
        """Return its file."""
        return self.file()

    @classmethod
    def of_bridge(cls, bridge: StationBridge) -> JobSource:
        """Return the job that is measured."""
        job = bridge.station.job
        return cls(
            lambda: job.path, lambda: bridge.shown.job, bridge.results.report, lambda: job.lost
        )

    @classmethod
    def of_opened(cls, opened: OpenedJob) -> JobSource:
        """Return a job that was opened from its file."""
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
        """Return what changes whenever the job does."""
        job = self.view()
        numbers = tuple(point.number for feature in job.features for point in feature.points)
        return (self.path, numbers, job.active)

    def words(self, job: JobView) -> str:
        """Return which job is shown, and what speaks against it."""
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
