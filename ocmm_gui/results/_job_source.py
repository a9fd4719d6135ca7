"""Source of the displayed results: the running job, or a job file opened read-only.

Also computations from a job file, for the drill-down; they run in a side process.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from ocmm_core.alignment import AlignmentReport
from ocmm_core.errors import MeasuringError, OcmmError
from ocmm_core.export.report import ReportData, report_of_job
from ocmm_core.geometry import Float
from ocmm_core.inspection import evaluation
from ocmm_core.inspection.causes import Explanation, explanations_of
from ocmm_core.inspection.evaluation import JobView
from ocmm_core.inspection.finished import ReopenedJob, Tell, reopen_job
from ocmm_core.tolerances.monte_carlo import MonteCarloOptions, MonteCarloValue, simulate
from ocmm_core.tolerances.uncertainty import Budget
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import header_words, later, said, tr
from ocmm_gui.views import upright
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
                release=said(report.release.summary),
            ),
            doubts=opened.doubts,
            remarks=opened.remarks,
        )

    def state(self) -> object:
        """Return a value that changes whenever the job does."""
        job = self.view()
        numbers = tuple(point.number for feature in job.features for point in feature.points)
        return (self.path, numbers, job.active)

    def title(self, job: JobView) -> str:
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


@dataclass(frozen=True, slots=True)
class Budgets:
    """Details of a job's results, by the name of the characteristic."""

    found: Mapping[str, Budget]
    missing: Mapping[str, str]
    """`found`, `missing`: Budgets, and why others have none."""
    explained: Mapping[str, Explanation] = field(default_factory=dict)
    """Reasons and remedies of NOT CONFORM or NOT PROVEN."""
    up: Float | None = None
    """(3,), unit, world: upright by the cameras of the job; None if unknown."""


def budgets_of_file(path: Path, tell: Tell) -> Budgets:
    """Return budgets and explanations of a job file; OcmmError if unreadable."""
    job, evaluated = _evaluated(path, tell)
    known = evaluation.uncertainty_of(evaluated)
    tell(later("Looking for causes"), 0.7)
    explained = {item.characteristic: item for item in explanations_of(evaluated, job.view)}
    return Budgets(dict(known.budgets), dict(known.missing), explained, upright(job.rig))


def trials_of_file(path: Path, name: str, tell: Tell) -> MonteCarloValue:
    """Return the trials of one result of a job file; OcmmError if unreadable or without value."""
    for task in evaluation.uncertainty_of(_evaluated(path, tell)[1]).tasks:
        own = tuple(item for item in task.characteristics if item.name == name)
        if own:
            return simulate(replace(task, characteristics=own), MonteCarloOptions(), tell).values[0]
    raise MeasuringError(
        "monte_carlo.no_value",
        f"{name} has no value to simulate yet.",
        "Measure the features it depends on.",
    )


def alignment_of_file(path: Path, tell: Tell) -> AlignmentReport:
    """Return the alignment of a job file; OcmmError if unreadable or without one."""
    tell(later("Reading the job"), 0.2)
    job = reopen_job(path)
    tell(later("Calculating the alignment"), 0.6)
    return evaluation.alignment_of_points(
        job.plan, job.points, job.sensitivities, job.rig, job.body, job.options
    )


def _evaluated(path: Path, tell: Tell) -> tuple[ReopenedJob, evaluation.EvaluatedJob]:
    tell(later("Reading the job"), 0.1)
    job = reopen_job(path)
    tell(later("Calculating the uncertainties"), 0.5)
    probe = evaluation.probe_state(job.options, job.body)
    return job, evaluation.evaluated_job(
        job.plan, job.points, job.sensitivities, job.rig, job.body, job.options, probe
    )
