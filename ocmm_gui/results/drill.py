"""What is computed from a job file for the drill-down; runs in a process of its own."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.errors import OcmmError
from ocmm_core.features.actual import ActualFeature
from ocmm_core.inspection.evaluation import checked_features
from ocmm_core.inspection.reopen import reopen_job
from ocmm_core.measuring.contributions import contributions
from ocmm_core.measuring.temperature import reported_points
from ocmm_core.measuring.uncertainty import sum_of
from ocmm_core.tolerances.budget import Budget, budget_of
from ocmm_core.tolerances.evaluate import evaluate, involved_features
from ocmm_core.tolerances.sampling import form_samples
from ocmm_gui.maintain.side_process import Tell


@dataclass(frozen=True, slots=True)
class Trials:
    """What trials say about one result, in sentences."""

    name: str
    words: str


def budgets_of_file(path: Path, tell: Tell) -> dict[str, Budget]:
    """Return the budgets of all results of a job file that have one, by name.

    Raises
    ------
    OcmmError
        The file cannot be read.
    """
    tell("Reading the job", 0.1)
    job = reopen_job(path)
    points = reported_points(job.points, job.climate.part)
    tell("Computing what each point is worth", 0.5)
    parts = contributions(
        points, job.sensitivities, job.rig, job.body, job.contact, job.climate.part
    )
    covariance = sum_of(parts, len(points))
    actual = checked_features(job.plan, points, job.options)
    samples = form_samples(actual, covariance)
    measured = {k: v for k, v in actual.items() if isinstance(v, ActualFeature)}
    tell("Computing the budgets", 0.8)
    found: dict[str, Budget] = {}
    alignment = job.plan.bound_alignment
    for item in job.plan.characteristics:
        if any(name not in measured for name in involved_features(item, alignment)):
            continue
        # Why there is no value stands in the result already.
        with contextlib.suppress(OcmmError):
            evaluation = evaluate(item, measured, alignment)
            found[item.name] = budget_of(item, evaluation, measured, parts, covariance, samples)
    return found


def trials_of_file(path: Path, name: str, tell: Tell) -> Trials:
    """Return what trials say about one result of a job file."""
    raise NotImplementedError
