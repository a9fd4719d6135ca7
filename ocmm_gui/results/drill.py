"""What is computed from a job file for the drill-down; runs in a process of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from ocmm_core.alignment.report import AlignmentReport
from ocmm_core.errors import MeasuringError
from ocmm_core.inspection.alignment_preview import alignment_of_points
from ocmm_core.inspection.reopen import ReopenedJob, reopen_job
from ocmm_core.inspection.uncertainty import JobUncertainty, job_uncertainty
from ocmm_core.tolerances.budget import Budget
from ocmm_core.tolerances.monte_carlo import MonteCarloOptions, MonteCarloValue, simulate
from ocmm_gui.maintain.side_process import Tell


@dataclass(frozen=True, slots=True)
class Budgets:
    """The budgets of a job by the name of the characteristic, and why others have none."""

    found: Mapping[str, Budget]
    missing: Mapping[str, str]


def budgets_of_file(path: Path, tell: Tell) -> Budgets:
    """Return the budgets of all results of a job file; OcmmError where it cannot be read."""
    known = _uncertainty(path, tell)
    return Budgets(dict(known.budgets), dict(known.missing))


def trials_of_file(path: Path, name: str, tell: Tell) -> MonteCarloValue:
    """Return what trials say about one result of a job file.

    Raises
    ------
    OcmmError
        The file cannot be read, or the result has no value that could be tried.
    """
    for task in _uncertainty(path, tell).tasks:
        own = tuple(item for item in task.characteristics if item.name == name)
        if own:
            asked = replace(task, characteristics=own)
            return simulate(asked, MonteCarloOptions(), tell).values[0]
    raise MeasuringError(
        "monte_carlo.no_value",
        f"{name} has no value yet that could be tried.",
        "Measure the features that it rests on.",
    )


def alignment_of_file(path: Path, tell: Tell) -> AlignmentReport:
    """Return how the part of a job file lies.

    Raises
    ------
    OcmmError
        The file cannot be read, or its plan has no alignment.
    """
    tell("Reading the job", 0.2)
    job = reopen_job(path)
    tell("Computing the alignment", 0.6)
    return alignment_of_points(
        job.plan, job.points, job.sensitivities, job.rig, job.body, job.options
    )


def _uncertainty(path: Path, tell: Tell) -> JobUncertainty:
    tell("Reading the job", 0.1)
    job: ReopenedJob = reopen_job(path)
    tell("Computing the uncertainties", 0.5)
    return job_uncertainty(
        job.plan, job.points, job.sensitivities, job.rig, job.body, job.options
    )
