"""From the points of a job to features, results and what is seen of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.alignment import BoundAlignment, doubt_of, part_frame, settled
from ocmm_core.camera import Rig
from ocmm_core.errors import FitError, OcmmError
from ocmm_core.features.measured import (
    ActualFeature,
    actual_features,
    constructed_features,
    nominal_geometries,
)
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.inspection.evaluation._options import SessionOptions
from ocmm_core.inspection.evaluation._quarantine import with_doubt
from ocmm_core.inspection.evaluation._single_points import compensate_by_plan
from ocmm_core.inspection.plan import Plan
from ocmm_core.measuring import MeasuredPoint, joint_factors, reported_points
from ocmm_core.tolerances.decisions import (
    CharacteristicResult,
    evaluate_all,
    not_measured,
    not_proven,
    provisional,
)
from ocmm_core.tolerances.kinds import spec_of
from ocmm_core.tolerances.zones import Characteristic
from ocmm_core.tracking import ProbeBody, TipSensitivity


@dataclass(frozen=True, slots=True)
class JobStatus:
    """What of a job is in doubt.

    Attributes
    ----------
    held
        Points that are held back, and why.
    unproven
        Why the job proves nothing; empty where it does.
    """

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

    def judged(self, plan: Plan, status: JobStatus) -> tuple[CharacteristicResult, ...]:
        """Return the results, those in doubt as not proven."""
        held = status.held
        results = tuple(with_doubt(result, plan, self.points, held) for result in self.results)
        if status.unproven:
            results = tuple(not_proven(result, status.unproven) for result in results)
        return results


def evaluate_job(
    plan: Plan,
    points: Sequence[MeasuredPoint],
    sensitivities: Sequence[TipSensitivity],
    rig: Rig,
    body: ProbeBody,
    options: SessionOptions,
    done: frozenset[str],
    skipped: frozenset[str] = frozenset(),
) -> JobResults:
    """Return features and results of the points of a job.

    Parameters
    ----------
    sensitivities
        Of each point, in their order.
    done, skipped
        Features that have all their points, and those that were left out.
    """
    reported = reported_points(points, options.climate.part)
    actual = checked_features(plan, reported, options)
    alignment = alignment_of(plan, actual)
    factors = joint_factors(
        reported, sensitivities, rig, body, options.contact, options.climate.part,
        doubt_of(alignment),
    )  # fmt: skip
    results = evaluate_all(plan.characteristics, alignment, actual, factors, plan.rule)
    touched = {point.feature for point in points}
    judged = tuple(
        _as_far_as_probed(plan, item, result, done, skipped, touched, actual)
        for item, result in zip(plan.characteristics, results, strict=True)
    )
    return JobResults(tuple(reported), actual, judged)


def _as_far_as_probed(
    plan: Plan,
    item: Characteristic,
    result: CharacteristicResult,
    done: frozenset[str],
    skipped: frozenset[str],
    touched: set[str],
    actual: Mapping[str, ActualFeature | FitError],
) -> CharacteristicResult:
    """Return a result without a verdict where something that it rests on is not done.

    It is PROVISIONAL once one of its own features has points: what there is may be looked at. It is
    NOT MEASURED before that, and where a feature was left out or is done without a number: nothing
    more will come by itself.
    """
    below = plan.rests_on(item)
    open_ = [name for name in below if name not in done]
    if not open_:
        return result
    for name in below:
        fault = actual[name]
        if name in done and isinstance(fault, FitError):
            return not_measured(item, fault.what)
        if name in skipped:
            return not_measured(item, f"{name} was skipped.")
    own = {probed for name in item.features for probed in plan.probed(name)}
    if not own & touched:
        return result if result.measured is None else not_measured(item, f"Waits for {open_[0]}.")
    if spec_of(item.kind).own_form:
        # Every further point can only make form worse: a part of them says nothing.
        waits = not_measured(item, "")
        return provisional(waits, f"Form is evaluated when {open_[0]} is complete.")
    if result.measured is None:
        # The feature itself may be what has no number yet; its own reason is the better one.
        why = result.note if open_[0] in own else f"Waits for {open_[0]}."
        return provisional(result, why)
    return provisional(result, f"Provisional: {open_[0]} is incomplete.")


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


def frame_of(plan: Plan, actual: Mapping[str, ActualFeature | FitError]) -> RigidTransform | None:
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
        f"Points of {feature.nominal.name} scatter by {feature.fit.form:.3f} mm; point {worst} "
        "is farthest off.",
        "Undo the points that do not belong here and take them again.",
    )
