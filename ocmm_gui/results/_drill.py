"""Computations from a job file for the drill-down, run in a side process."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from ocmm_core.alignment import AlignmentReport
from ocmm_core.errors import MeasuringError
from ocmm_core.geometry import Float
from ocmm_core.inspection import evaluation
from ocmm_core.inspection.archive import ReopenedJob, reopen_job
from ocmm_core.inspection.causes import Explanation, explanations_of
from ocmm_core.tolerances.monte_carlo import MonteCarloOptions, MonteCarloValue, simulate
from ocmm_core.tolerances.uncertainty import Budget
from ocmm_gui.kit import later
from ocmm_gui.views import upright
from ocmm_gui.work import Tell


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
            asked = replace(task, characteristics=own)
            return simulate(asked, MonteCarloOptions(), tell).values[0]
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
