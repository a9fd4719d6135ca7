"""Budgets of a job, and the tasks of its simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.alignment import Relocation, SavedFrame, saved_frame_in
from ocmm_core.calibration.probe_design import load_design
from ocmm_core.camera import Rig
from ocmm_core.errors import MeasuringError
from ocmm_core.features.measured import ActualFeature, nominal_geometries
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation._evaluated import EvaluatedJob, evaluated_job
from ocmm_core.inspection.evaluation._evaluation import alignment_of, checked_features, noise_of_job
from ocmm_core.inspection.evaluation._options import SessionOptions
from ocmm_core.inspection.plan import Plan
from ocmm_core.leftovers import scratch_folder
from ocmm_core.measuring import MeasuredPoint, ProbeState, joint_factors, reported_points
from ocmm_core.tolerances.monte_carlo import Task
from ocmm_core.tolerances.uncertainty import (
    Budget,
    FormSample,
    budget_of,
    form_samples,
    of_own_form,
    widened,
)
from ocmm_core.tolerances.zones import Characteristic, Frames
from ocmm_core.tracking import ProbeBody, TipSensitivity


@dataclass(frozen=True, slots=True)
class JobUncertainty:
    """Uncertainty budgets of a job."""

    budgets: Mapping[str, Budget]
    """By name of the characteristic, in the order of the plan."""
    missing: Mapping[str, str]
    """Why a characteristic has none."""
    tasks: tuple[Task, ...]
    """Of a simulation: values in which form is an uncertainty, and those in which it is the
    measurand. Empty if nothing can be simulated."""


def job_uncertainty(
    plan: Plan,
    points: Sequence[MeasuredPoint],
    sensitivities: Sequence[TipSensitivity],
    rig: Rig,
    body: ProbeBody,
    options: SessionOptions,
) -> JobUncertainty:
    """Return budgets and tasks; see `evaluation.evaluate_job` for the arguments."""
    job = evaluated_job(plan, points, sensitivities, rig, body, options, probe_state(options, body))
    return uncertainty_of(job)


def uncertainty_of(job: EvaluatedJob) -> JobUncertainty:
    plan, actual, factors = job.plan, job.actual, job.factors
    samples = {sample.feature: sample for sample in job.samples}
    budgets: dict[str, Budget] = {}
    missing = dict(job.missing)
    plain: list[Characteristic] = []
    of_form: list[Characteristic] = []
    for item in plan.characteristics:
        evaluation = job.evaluations.get(item.name)
        if evaluation is not None:
            try:
                # Others have no influence, and a large job has many.
                names = (*item.features, *(job.points[k].feature for k in evaluation.places))
                below = {name: actual[name] for name in names if name in actual}
                own = [samples[name] for name in below if name in samples]
                budgets[item.name] = budget_of(item, evaluation, below, job.parts, factors, own)
            except MeasuringError as error:
                missing[item.name] = error.what
            (of_form if of_own_form(item, actual) else plain).append(item)
    nominals = nominal_geometries(plan.features, plan.constructions)
    tasks = tuple(
        Task(
            tuple(group), job.alignment, job.points, actual, factors,
            _of_surfaces(taken, len(job.points)), tuple(plan.constructions), nominals,
        )
        for group, taken in ((plain, job.samples), (of_form, ()))
        if group
    )  # fmt: skip
    return JobUncertainty(budgets, missing, tasks)


def frame_covariance(
    plan: Plan,
    points: Sequence[MeasuredPoint],
    sensitivities: Sequence[TipSensitivity],
    rig: Rig,
    body: ProbeBody,
    options: SessionOptions,
) -> Float | None:
    """Return the covariance of the frame of the nominals that a job would save, (6, 6).

    Of a small rotation, rad, about the axes of the frame through its origin, and a shift, mm, along
    them: from the errors of the points, and the form of the features if shown. None for a reused
    frame of unknown uncertainty: control points, and fits that only start at a saved frame.
    OcmmError if the features do not determine the pose.
    """
    climate = options.climate
    reported = reported_points(points, climate.part)
    found = checked_features(plan, reported, options)
    alignment = alignment_of(plan, found)
    if isinstance(plan.alignment, SavedFrame):
        return np.array(plan.alignment.covariance) if plan.alignment.covariance else None
    if saved_frame_in(alignment) is not None or isinstance(plan.alignment, Relocation):
        return None
    _, rig = noise_of_job(points, rig, body)
    factors = joint_factors(reported, sensitivities, rig, body, options.contact, climate.part)
    actual = {k: v for k, v in found.items() if isinstance(v, ActualFeature)}
    jacobian = Frames(actual, alignment).of_part(plan.name).by_coordinates
    tips = np.array([point.tip_world for point in reported])
    # Rotations are scaled by the size of the part, mm, to be comparable to shifts.
    arm = max(float(np.linalg.norm(np.ptp(tips, axis=0))), 1.0)
    scale = np.array([arm] * 3 + [1.0] * 3)
    samples = form_samples(found, factors)
    moved = widened(np.diag(scale) @ jacobian, factors, samples).covariance
    of_frame: Float = moved / np.outer(scale, scale)
    return 0.5 * (of_frame + of_frame.T)


def _of_surfaces(samples: Sequence[FormSample], count: int) -> Float:
    """Return the variance of surface form per point, (N, 3, 3), mm^2."""
    added = np.zeros((count, 3, 3))
    for sample in samples:
        squares = np.einsum("nij,nkj->nik", sample.normals, sample.normals)
        added[sample.places] += max(sample.variance, 0.0) * squares
    return added


def probe_state(options: SessionOptions, body: ProbeBody) -> ProbeState | None:
    """Return the effect of temperature and weight on the probe; None if its design is unknown."""
    text = options.climate.probe_design
    if not text:
        return None
    with scratch_folder("document") as folder:
        file = folder / "design.toml"
        file.write_bytes(text.encode("utf-8"))
        return ProbeState(load_design(file, body), options.climate.probe)
