"""From the points of a job to features, results and what is seen of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.alignment.datums import settled
from ocmm_core.alignment.frame_doubt import doubt_of
from ocmm_core.alignment.precedence import part_frame
from ocmm_core.alignment.rules import BoundAlignment
from ocmm_core.camera.rig import Rig
from ocmm_core.errors import FitError, OcmmError
from ocmm_core.features.actual import ActualFeature, actual_features
from ocmm_core.features.constructed import constructed_features, nominal_geometries
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.inspection.options import SessionOptions
from ocmm_core.inspection.plan import Plan
from ocmm_core.inspection.quarantine import with_doubt
from ocmm_core.inspection.single_points import compensate_by_plan
from ocmm_core.measuring.point import MeasuredPoint
from ocmm_core.measuring.temperature import reported_points
from ocmm_core.measuring.uncertainty import joint_covariance
from ocmm_core.tolerances.characteristic import FORMS, PROFILES, RUNOUTS, Characteristic
from ocmm_core.tolerances.decision import not_measured, not_proven
from ocmm_core.tolerances.result import CharacteristicResult, Verdict
from ocmm_core.tolerances.results import evaluate_all
from ocmm_core.tracking.body import ProbeBody
from ocmm_core.tracking.sensitivity import TipSensitivity


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
    provisional
        Names of the characteristics with a feature that has not all its points yet: they have no
        verdict, and may have a value to look at.
    """

    points: tuple[MeasuredPoint, ...]
    actual: Mapping[str, ActualFeature | FitError]
    results: tuple[CharacteristicResult, ...]
    provisional: frozenset[str]

    def judged(self, plan: Plan, standing: JobStanding) -> tuple[CharacteristicResult, ...]:
        """Return the results, those in doubt as not proven."""
        held = standing.held
        results = tuple(with_doubt(result, plan, self.points, held) for result in self.results)
        if standing.unproven:
            results = tuple(not_proven(result, standing.unproven) for result in results)
        return results


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
    alignment = alignment_of(plan, actual)
    covariance = joint_covariance(
        reported, sensitivities, rig, body, options.contact, options.climate.part,
        doubt_of(alignment),
    )  # fmt: skip
    results = evaluate_all(plan.characteristics, alignment, actual, covariance, plan.rule)
    judged: list[CharacteristicResult] = []
    provisional: set[str] = set()
    for item, result in zip(plan.characteristics, results, strict=True):
        open_ = [name for name in plan.rests_on(item) if name not in done]
        if open_ and result.verdict is not Verdict.NOT_MEASURED:
            provisional.add(item.name)
            judged.append(_without_verdict(item, result, open_[0]))
        else:
            judged.append(result)
    return JobResults(tuple(reported), actual, tuple(judged), frozenset(provisional))


def _without_verdict(
    item: Characteristic, result: CharacteristicResult, feature: str
) -> CharacteristicResult:
    """Return a value while ``feature`` is still being probed: to look at, not to decide by."""
    if item.kind in FORMS | PROFILES | RUNOUTS:
        # Every further point can only make form worse: a part of them says nothing.
        return not_measured(item, f"Form is judged when {feature} has all its points.")
    return replace(
        result,
        verdict=Verdict.NOT_MEASURED,
        note=f"Provisional: {feature} has not all its points yet.",
    )


def checked_features(
    plan: Plan, points: Sequence[MeasuredPoint], options: SessionOptions
) -> dict[str, ActualFeature | FitError]:
    """Return every feature of a plan, probed or constructed, as the points show it, or why not."""
    actual = actual_features(plan.features, points)
    rule, known = plan.alignment, actual
    if rule is not None and any(name not in actual for name in rule.features):
        known = actual | _constructed(plan, actual)
    T_part_from_world = frame_of(plan, known)
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
    return actual | _constructed(plan, actual)


def _constructed(
    plan: Plan, actual: Mapping[str, ActualFeature | FitError]
) -> dict[str, ActualFeature | FitError]:
    if not plan.constructions:
        return {}
    nominals = nominal_geometries(plan.features, plan.constructions)
    return constructed_features(plan.constructions, actual, nominals)


def alignment_of(
    plan: Plan, actual: Mapping[str, ActualFeature | FitError]
) -> BoundAlignment | None:
    """Return the alignment as results are computed with it: bound to nominals, senses settled.

    While its features are not measured the senses are left open.
    """
    bound = plan.bound_alignment
    if bound is None:
        return None
    try:
        return settled(bound, _measured(actual))
    except OcmmError:
        return bound


def frame_of(
    plan: Plan, actual: Mapping[str, ActualFeature | FitError]
) -> RigidTransform | None:
    """Return the part frame, or None while its datums are not measured."""
    bound = plan.bound_alignment
    if bound is None:
        return None
    measured = {k: v for k, v in actual.items() if isinstance(v, ActualFeature)}
    try:
        return part_frame(bound, measured)
    except OcmmError:
        return None


def _measured(actual: Mapping[str, ActualFeature | FitError]) -> dict[str, Float]:
    return {
        name: feature.fit.geometry
        for name, feature in actual.items()
        if isinstance(feature, ActualFeature)
    }


def _scattered(feature: ActualFeature) -> FitError:
    worst = feature.numbers[int(np.argmax(np.abs(feature.fit.residuals)))]
    return FitError(
        "session.form",
        f"The points of {feature.nominal.name} scatter by {feature.fit.form:.3f} mm; point "
        f"{worst} lies farthest off.",
        "Undo the points that belong elsewhere and take them again.",
    )
