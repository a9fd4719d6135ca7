"""A job with all intermediate quantities, for budgets and causes, also with modified points."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from ocmm_core.alignment import AnyAlignment, BoundAlignment, doubt_of
from ocmm_core.camera import Rig
from ocmm_core.errors import FitError, OcmmError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation._evaluation import alignment_of, checked_features, noise_of_job
from ocmm_core.inspection.evaluation._options import SessionOptions
from ocmm_core.inspection.plan import Plan
from ocmm_core.measuring import (
    Contribution,
    DayCheck,
    MeasuredPoint,
    PointFactors,
    ProbeState,
    contributions,
    factors_of,
    reported_points,
)
from ocmm_core.tolerances.decisions import CharacteristicResult, evaluate_all
from ocmm_core.tolerances.kinds import evaluate, involved_features
from ocmm_core.tolerances.uncertainty import FormSample, form_samples
from ocmm_core.tolerances.zones import Characteristic, Evaluation, Frames
from ocmm_core.tracking import ProbeBody, TipSensitivity


@dataclass(frozen=True, slots=True)
class EvaluatedJob:
    """A job with all intermediate quantities of its results."""

    plan: Plan
    options: SessionOptions
    points: tuple[MeasuredPoint, ...]
    """N points as reported."""
    found: Mapping[str, ActualFeature | FitError]
    """Every feature, or why it is unknown."""
    alignment: BoundAlignment | None
    """Bound and settled; None without one."""
    parts: tuple[Contribution, ...]
    factors: PointFactors
    """`parts`, `factors`: Parts of the joint uncertainty of the points, and their sum."""
    samples: tuple[FormSample, ...]
    evaluations: Mapping[str, Evaluation]
    missing: Mapping[str, str]
    """`evaluations`, `missing`: Values with gradients by name of the characteristic, and why others
    have none."""
    noise: DayCheck
    """Noise of the spots against the stated one; ``parts`` are widened by it."""

    @property
    def actual(self) -> dict[str, ActualFeature]:
        """Return the known features."""
        return {k: v for k, v in self.found.items() if isinstance(v, ActualFeature)}

    def results_of(
        self, items: Sequence[Characteristic], points: Sequence[MeasuredPoint] | None = None
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

    def moved(self, by: Float) -> tuple[MeasuredPoint, ...]:
        """Return the points with ball centres moved by (N, 3), mm."""
        return tuple(
            replace(point, tip_world=point.tip_world + shift)
            for point, shift in zip(self.points, by, strict=True)
        )


def evaluated_job(
    plan: Plan,
    points: Sequence[MeasuredPoint],
    sensitivities: Sequence[TipSensitivity],
    rig: Rig,
    body: ProbeBody,
    options: SessionOptions,
    probe: ProbeState | None = None,
) -> EvaluatedJob:
    """Return a job with all intermediate quantities; arguments as `evaluation.evaluate_job`.

    ``probe`` separates temperature and weight of the probe from its calibration; None joins them.
    """
    noise, rig = noise_of_job(points, rig, body)
    reported = tuple(reported_points(points, options.climate.part))
    found = checked_features(plan, reported, options)
    actual = {k: v for k, v in found.items() if isinstance(v, ActualFeature)}
    alignment = alignment_of(plan, found)
    parts = contributions(
        reported, sensitivities, rig, body, options.contact, options.climate.part, probe,
        doubt_of(alignment),
    )  # fmt: skip
    factors = factors_of(parts, len(reported))
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
        form_samples(found, factors), evaluations, missing, noise,
    )  # fmt: skip


def require_measured(name: str, found: Mapping[str, ActualFeature | FitError]) -> ActualFeature:
    feature = found.get(name)
    if isinstance(feature, ActualFeature):
        return feature
    if feature is not None:
        raise feature
    raise FitError("uncertainty.feature", f"{name} is not measured.", f"Measure {name}.")
