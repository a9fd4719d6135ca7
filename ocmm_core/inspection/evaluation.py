"""From the points of a job to features, results and what is seen of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.alignment.datums import part_frame
from ocmm_core.camera.rig import Rig
from ocmm_core.errors import FitError, OcmmError
from ocmm_core.features.actual import ActualFeature, actual_features
from ocmm_core.features.nominal import NominalFeature
from ocmm_core.geometry import RigidTransform
from ocmm_core.inspection.options import SessionOptions
from ocmm_core.inspection.plan import Plan
from ocmm_core.inspection.quarantine import feature_note, with_doubt
from ocmm_core.inspection.single_points import compensate_by_plan
from ocmm_core.inspection.view import FeatureState, FeatureView
from ocmm_core.measuring.point import MeasuredPoint
from ocmm_core.measuring.temperature import reported_points
from ocmm_core.measuring.uncertainty import joint_covariance
from ocmm_core.tolerances.decision import not_measured, not_proven
from ocmm_core.tolerances.result import CharacteristicResult, Verdict
from ocmm_core.tolerances.results import evaluate_all
from ocmm_core.tracking.body import ProbeBody
from ocmm_core.tracking.sensitivity import TipSensitivity

_WORST_FIRST = (
    Verdict.NOT_CONFORM,
    Verdict.NOT_PROVEN,
    Verdict.NOT_MEASURED,
    Verdict.CONFORM,
)


@dataclass(frozen=True, slots=True)
class JobStanding:
    """How far a job has come, and what of it is in doubt.

    Attributes
    ----------
    active
        Feature that takes the next point; empty where none does.
    done
        Features that have what they need.
    held
        Points that are held back, and why.
    unproven
        Why the job proves nothing; empty where it does.
    """

    active: str
    done: frozenset[str]
    held: Mapping[int, str]
    unproven: str


@dataclass(frozen=True, slots=True)
class JobResults:
    """What the points of a job say.

    Attributes
    ----------
    points
        As they are reported.
    actual
        Every feature of the plan as it is, or why it is not known.
    results
        Of all characteristics, whatever is in doubt.
    """

    points: tuple[MeasuredPoint, ...]
    actual: Mapping[str, ActualFeature | FitError]
    results: tuple[CharacteristicResult, ...]

    def judged(self, plan: Plan, standing: JobStanding) -> tuple[CharacteristicResult, ...]:
        """Return the results, those in doubt as not proven."""
        held = standing.held
        results = tuple(with_doubt(result, plan, self.points, held) for result in self.results)
        if standing.unproven:
            results = tuple(not_proven(result, standing.unproven) for result in results)
        return results

    def features_seen(
        self, plan: Plan, results: Sequence[CharacteristicResult], standing: JobStanding
    ) -> tuple[FeatureView, ...]:
        """Return what is seen of every feature; ``results`` are those of `judged`."""
        return tuple(self._seen(nominal, results, standing) for nominal in plan.features)

    def _seen(
        self,
        nominal: NominalFeature,
        results: Sequence[CharacteristicResult],
        standing: JobStanding,
    ) -> FeatureView:
        actual = self.actual[nominal.name]
        state = FeatureState.DONE if nominal.name in standing.done else FeatureState.PENDING
        if nominal.name == standing.active:
            state = FeatureState.ACTIVE
        fitted = isinstance(actual, ActualFeature)
        verdicts = {item.verdict for item in results if nominal.name in item.features}
        return FeatureView(
            name=nominal.name,
            shape=nominal.shape,
            needed=nominal.points,
            state=state,
            points=tuple(point for point in self.points if point.feature == nominal.name),
            fit=actual.fit if isinstance(actual, ActualFeature) else None,
            verdict=next((v for v in _WORST_FIRST if v in verdicts), None) if fitted else None,
            note=(
                actual.what
                if isinstance(actual, FitError)
                else feature_note(nominal.name, self.points, standing.held)
            ),
        )


def evaluate_job(
    plan: Plan,
    points: Sequence[MeasuredPoint],
    sensitivities: Sequence[TipSensitivity],
    rig: Rig,
    body: ProbeBody,
    options: SessionOptions,
    done: frozenset[str],
) -> JobResults:
    """Return features and results of the points of a job.

    Parameters
    ----------
    sensitivities
        Of each point, in their order.
    done
        Features that have all their points.
    """
    reported = reported_points(points, options.climate.part)
    actual = checked_features(plan, reported, options)
    covariance = joint_covariance(
        reported, sensitivities, rig, body, options.contact, options.climate.part
    )
    results = evaluate_all(
        plan.characteristics, plan.alignment, actual, covariance, plan.rule
    )
    # Every further point can only make form worse: a part of them proves nothing.
    judged = tuple(
        not_measured(item, f"Form is judged when {item.features[0]} has all its points.")
        if item.kind == "form" and item.features[0] not in done
        else result
        for item, result in zip(plan.characteristics, results, strict=True)
    )
    return JobResults(tuple(reported), actual, judged)


def checked_features(
    plan: Plan, points: Sequence[MeasuredPoint], options: SessionOptions
) -> dict[str, ActualFeature | FitError]:
    """Return every feature of a plan as the points show it, or why they do not."""
    actual = actual_features(plan.features, points)
    T_part_from_world = frame_of(plan, actual)
    if T_part_from_world is not None:
        actual |= compensate_by_plan(plan.features, points, T_part_from_world)
    for name, feature in actual.items():
        if isinstance(feature, ActualFeature) and feature.fit.form > options.max_form:
            actual[name] = _scattered(feature)
    # What was projected onto a plane that is in doubt is in doubt itself.
    for nominal in plan.features:
        plane = actual.get(nominal.projection)
        if isinstance(plane, FitError):
            actual[nominal.name] = plane
    return actual


def frame_of(
    plan: Plan, actual: Mapping[str, ActualFeature | FitError]
) -> RigidTransform | None:
    """Return the part frame, or None while its datums are not measured."""
    if plan.alignment is None:
        return None
    measured = {k: v for k, v in actual.items() if isinstance(v, ActualFeature)}
    try:
        return part_frame(plan.alignment, measured)
    except OcmmError:
        return None


def _scattered(feature: ActualFeature) -> FitError:
    worst = feature.numbers[int(np.argmax(np.abs(feature.fit.residuals)))]
    return FitError(
        "session.form",
        f"The points of {feature.nominal.name} scatter by {feature.fit.form:.3f} mm; point "
        f"{worst} lies farthest off.",
        "Undo the points that belong elsewhere and take them again.",
    )
