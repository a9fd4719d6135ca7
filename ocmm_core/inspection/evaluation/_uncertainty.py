"""Budgets of a job, and the tasks of its simulation.

They use the job with all its intermediate quantities, as do the causes, also with modified points.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ocmm_core import measuring
from ocmm_core.alignment import AnyAlignment, BoundAlignment, Relocation, SavedFrame, saved_frame_in
from ocmm_core.calibration.probe_design import load_design
from ocmm_core.camera import Rig
from ocmm_core.cleanup import scratch_folder
from ocmm_core.errors import FitError, MeasuringError, OcmmError
from ocmm_core.features.measured import ActualFeature, nominal_geometries
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation._evaluation import alignment_of, checked_features, noise_of_job
from ocmm_core.inspection.evaluation._options import SessionOptions
from ocmm_core.inspection.plan import Plan
from ocmm_core.tolerances import uncertainty
from ocmm_core.tolerances.decisions import CharacteristicResult, evaluate_all
from ocmm_core.tolerances.kinds import evaluate, involved_features
from ocmm_core.tolerances.monte_carlo import Task
from ocmm_core.tolerances.zones import Characteristic, Evaluation, Frames
from ocmm_core.tracking import ProbeBody, TipSensitivity


@dataclass(frozen=True, slots=True)
class EvaluatedJob:
    """A job with all intermediate quantities of its results."""

    plan: Plan
    options: SessionOptions
    points: tuple[measuring.MeasuredPoint, ...]
    """N points as reported."""
    found: Mapping[str, ActualFeature | FitError]
    """Every feature, or why it is unknown."""
    alignment: BoundAlignment | None
    """Bound and settled; None without one."""
    parts: tuple[measuring.Contribution, ...]
    factors: measuring.PointFactors
    """`parts`, `factors`: Parts of the joint uncertainty of the points, and their sum."""
    samples: tuple[uncertainty.FormSample, ...]
    evaluations: Mapping[str, Evaluation]
    missing: Mapping[str, str]
    """`evaluations`, `missing`: Values with gradients by name of the characteristic, and why others
    have none."""
    noise: measuring.DayCheck
    """Noise of the spots against the stated one; ``parts`` are widened by it."""

    @property
    def actual(self) -> dict[str, ActualFeature]:
        """Return the known features."""
        return {k: v for k, v in self.found.items() if isinstance(v, ActualFeature)}

    def results_of(
        self,
        items: Sequence[Characteristic],
        points: Sequence[measuring.MeasuredPoint] | None = None,
    ) -> tuple[CharacteristicResult, ...]:
        """Return results of characteristics, for as many ``points`` as the job has, or its own."""
        if points is None:
            found, alignment = self.found, self.alignment
        else:
            found = checked_features(self.plan, points, self.options)
            alignment = alignment_of(self.plan, found)
        return evaluate_all(items, alignment, found, self.factors, self.plan.rule)

    def results_without(
        self, items: Sequence[Characteristic], numbers: Collection[int]
    ) -> tuple[CharacteristicResult, ...]:
        kept = [i for i, point in enumerate(self.points) if point.number not in numbers]
        found = checked_features(self.plan, [self.points[i] for i in kept], self.options)
        alignment = alignment_of(self.plan, found)
        return evaluate_all(items, alignment, found, self.factors.kept(kept), self.plan.rule)

    def results_in(
        self, items: Sequence[Characteristic], alignment: AnyAlignment
    ) -> tuple[CharacteristicResult, ...]:
        """Return the results of characteristics in another part frame."""
        return evaluate_all(items, alignment, self.found, self.factors, self.plan.rule)

    def moved(self, by: Float) -> tuple[measuring.MeasuredPoint, ...]:
        """Return the points with ball centres moved by (N, 3), mm."""
        return tuple(
            replace(point, tip_world=point.tip_world + shift)
            for point, shift in zip(self.points, by, strict=True)
        )


def evaluated_job(
    plan: Plan,
    points: Sequence[measuring.MeasuredPoint],
    sensitivities: Sequence[TipSensitivity],
    rig: Rig,
    body: ProbeBody,
    options: SessionOptions,
    probe: measuring.ProbeState | None = None,
) -> EvaluatedJob:
    """Return a job with all intermediate quantities; arguments as `evaluation.evaluate_job`.

    ``probe`` separates temperature and weight of the probe from its calibration; None joins them.
    """
    noise, rig = noise_of_job(points, rig, body)
    reported = tuple(measuring.reported_points(points, options.climate.part))
    found = checked_features(plan, reported, options)
    actual = {k: v for k, v in found.items() if isinstance(v, ActualFeature)}
    alignment = alignment_of(plan, found)
    parts = measuring.contributions(
        reported, sensitivities, rig, body, options.contact, options.climate.part, probe,
        plan.common_uncertainties,
    )  # fmt: skip
    factors = measuring.factors_of(parts, len(reported))
    frames = Frames(actual, alignment)
    evaluations: dict[str, Evaluation] = {}
    missing: dict[str, str] = {}
    for item in plan.characteristics:
        try:
            for name in involved_features(item, alignment):
                require_measured(name, found)
            evaluations[item.name] = evaluate(item, actual, alignment, frames)
        except OcmmError as error:
            missing[item.name] = error.what
    return EvaluatedJob(
        plan, options, reported, found, alignment, parts, factors,
        uncertainty.form_samples(found, factors), evaluations, missing, noise,
    )  # fmt: skip


def require_measured(name: str, found: Mapping[str, ActualFeature | FitError]) -> ActualFeature:
    feature = found.get(name)
    if isinstance(feature, ActualFeature):
        return feature
    if feature is not None:
        raise feature
    raise FitError("uncertainty.feature", f"{name} is not measured.", f"Measure {name}.")


@dataclass(frozen=True, slots=True)
class JobUncertainty:
    """Uncertainty budgets of a job."""

    budgets: Mapping[str, uncertainty.Budget]
    """By name of the characteristic, in the order of the plan."""
    missing: Mapping[str, str]
    """Why a characteristic has none."""
    tasks: tuple[Task, ...]
    """Of a simulation: values in which form is an uncertainty, and those in which it is the
    measurand. Empty if nothing can be simulated."""


def job_uncertainty(
    plan: Plan,
    points: Sequence[measuring.MeasuredPoint],
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
    budgets: dict[str, uncertainty.Budget] = {}
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
                budgets[item.name] = uncertainty.budget_of(
                    item, evaluation, below, job.parts, factors, own
                )
            except MeasuringError as error:
                missing[item.name] = error.what
            (of_form if uncertainty.of_own_form(item, actual) else plain).append(item)
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
    points: Sequence[measuring.MeasuredPoint],
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
    reported = measuring.reported_points(points, climate.part)
    found = checked_features(plan, reported, options)
    alignment = alignment_of(plan, found)
    if isinstance(plan.alignment, SavedFrame):
        return np.array(plan.alignment.covariance) if plan.alignment.covariance else None
    if saved_frame_in(alignment) is not None or isinstance(plan.alignment, Relocation):
        return None
    _, rig = noise_of_job(points, rig, body)
    factors = measuring.joint_factors(
        reported, sensitivities, rig, body, options.contact, climate.part, plan.common_uncertainties
    )
    actual = {k: v for k, v in found.items() if isinstance(v, ActualFeature)}
    jacobian = Frames(actual, alignment).of_part(plan.name).by_coordinates
    tips = np.array([point.tip_world for point in reported])
    # Rotations are scaled by the size of the part, mm, to be comparable to shifts.
    arm = max(float(np.linalg.norm(np.ptp(tips, axis=0))), 1.0)
    scale = np.array([arm] * 3 + [1.0] * 3)
    samples = uncertainty.form_samples(found, factors)
    moved = uncertainty.widened(np.diag(scale) @ jacobian, factors, samples).covariance
    of_frame: Float = moved / np.outer(scale, scale)
    return 0.5 * (of_frame + of_frame.T)


def surface_covariances(
    plan: Plan,
    points: Sequence[measuring.MeasuredPoint],
    sensitivities: Sequence[TipSensitivity],
    rig: Rig,
    body: ProbeBody,
    options: SessionOptions,
) -> dict[int, Float]:
    """Return the covariances (3, 3), mm^2, world, of compensated surface points by number.

    Arguments as `evaluated_job`. The compensation direction counts as exact.
    """
    if not points:
        return {}
    _, rig = noise_of_job(points, rig, body)
    blocks, by_radius, radius = measuring.joint_factors(
        measuring.reported_points(points, options.climate.part), sensitivities, rig, body,
        options.contact, options.climate.part, plan.common_uncertainties,
    ).blocks(np.arange(len(points)))  # fmt: skip
    normals = np.array([point.direction for point in points])
    mixed = np.einsum("ni,nj->nij", 0.5 * radius * normals - by_radius, normals)
    found = blocks + mixed + mixed.transpose(0, 2, 1)
    return {point.number: one for point, one in zip(points, found, strict=True)}


def _of_surfaces(samples: Sequence[uncertainty.FormSample], count: int) -> Float:
    """Return the variance of surface form per point, (N, 3, 3), mm^2."""
    added = np.zeros((count, 3, 3))
    for sample in samples:
        squares = np.einsum("nij,nkj->nik", sample.normals, sample.normals)
        added[sample.places] += max(sample.variance, 0.0) * squares
    return added


def probe_state(options: SessionOptions, body: ProbeBody) -> measuring.ProbeState | None:
    """Return the effect of temperature and weight on the probe; None if its design is unknown."""
    text = options.climate.probe_design
    if not text:
        return None
    with scratch_folder("document") as folder:
        file = folder / "design.toml"
        file.write_bytes(text.encode("utf-8"))
        return measuring.ProbeState(load_design(file, body), options.climate.probe)
