"""Features of a job and its values as nodes of a graph, recomputed when their inputs change.

Points lead to features, these and sensitivities to the record of each feature (uncertainty, form),
all of these to frames and values. A node reads only its inputs: see `EvaluationCache`.

Single points are compensated along the direction of the plan once the part frame is known: a point
has only its approach, as straight as the hand, and a slant compensates too little of the ball
radius, always to the same side. A point that came from far off that direction, because the ball
slid into place, gives no number.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ocmm_core.alignment import BoundAlignment, part_frame, settled
from ocmm_core.errors import FitError, OcmmError
from ocmm_core.features.measured import (
    ActualFeature,
    CommandingPoints,
    Construction,
    actual_features,
    constructed_features,
    geometries_of,
    in_order,
    measured_of,
    needed_features,
    nominal_geometries,
)
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float, RigidTransform, unit
from ocmm_core.inspection.evaluation._cache import EvaluationCache
from ocmm_core.inspection.evaluation._options import SessionOptions
from ocmm_core.inspection.evaluation._quarantine import (
    commanding_among,
    is_examined,
    scatters_of,
    usual_scatter,
)
from ocmm_core.inspection.plan import Plan
from ocmm_core.measuring import MeasuredPoint, PartTemperature, reported_points

MAX_SLANT_DEG = 30.0
"""A point approached further off the direction of the plan is not compensated."""


def compensate_by_plan(
    nominals: Sequence[NominalFeature],
    points: Sequence[MeasuredPoint],
    T_part_from_world: RigidTransform,
    places: Sequence[int] | None = None,
) -> dict[str, ActualFeature | FitError]:
    """Return the single points of a plan, compensated along its directions, by name.

    Other shapes are ignored. `points`: of the job, or those of these features.
    """
    single = [item for item in nominals if item.shape is Shape.POINT]
    to_world = T_part_from_world.rotation.T
    directions = {item.name: to_world @ unit(np.array(item.direction)) for item in single}
    turned = [
        replace(point, direction=directions[point.feature])
        if point.feature in directions
        else point
        for point in points
    ]
    actual = actual_features(single, turned, places)
    for name, direction in directions.items():
        slant = max(
            (_slant_deg(point, direction) for point in points if point.feature == name), default=0.0
        )
        if slant > MAX_SLANT_DEG:
            actual[name] = FitError(
                "session.slant",
                f"{name} was approached {slant:.0f}° off the planned direction.",
                "Undo it and touch again, square to the surface.",
            )
    return actual


def _slant_deg(point: MeasuredPoint, direction_world: Float) -> float:
    cosine = float(np.clip(point.direction @ direction_world, -1.0, 1.0))
    return float(np.degrees(np.arccos(cosine)))


Found = Mapping[str, ActualFeature | FitError]


@dataclass(frozen=True, slots=True)
class PlanFacts:
    """Quantities that follow from a plan alone."""

    by_name: Mapping[str, NominalFeature]
    bound: BoundAlignment | None
    nominals: Mapping[str, Float]
    """Geometry vectors (12,) of all features, by name."""
    constructions: Sequence[Construction]
    """Each after its inputs."""

    @classmethod
    def of(cls, plan: Plan) -> PlanFacts:
        return cls(
            {item.name: item for item in plan.features},
            plan.bound_alignment,
            nominal_geometries(plan.features, plan.constructions),
            in_order(plan.constructions),
        )


@dataclass(frozen=True, slots=True)
class Below:
    """Probed features of the characteristics of a plan, by name of the characteristic."""

    rests_on: Mapping[str, Sequence[str]]
    own: Mapping[str, Set[str]]
    """`rests_on`, `own`: All that it depends on, and those that it is about."""

    @classmethod
    def of(cls, plan: Plan) -> Below:
        bound, asked = plan.bound_alignment, plan.characteristics
        return cls(
            {item.name: plan.rests_on(item, bound) for item in asked},
            {
                item.name: frozenset(found for name in item.features for found in plan.probed(name))
                for item in asked
            },
        )


@dataclass(frozen=True, slots=True)
class PointsByFeature:
    """Points of a job by feature, as reported, and their indices in rows of jacobians."""

    points: Mapping[str, tuple[MeasuredPoint, ...]]
    places: Mapping[str, tuple[int, ...]]

    @classmethod
    def of(cls, points: Sequence[MeasuredPoint], places: Sequence[int]) -> PointsByFeature:
        """Return the points by feature; indices must be unique."""
        if len(set(places)) < len(points):
            raise ValueError("two points have the same number")
        own: defaultdict[str, list[MeasuredPoint]] = defaultdict(list)
        numbers: defaultdict[str, list[int]] = defaultdict(list)
        for point, place in zip(points, places, strict=True):
            own[point.feature].append(point)
            numbers[point.feature].append(place)
        return cls(
            {name: tuple(found) for name, found in own.items()},
            {name: tuple(found) for name, found in numbers.items()},
        )

    def of_features(self, names: Sequence[str]) -> tuple[list[MeasuredPoint], list[int]]:
        points: list[MeasuredPoint] = []
        places: list[int] = []
        for name in names:
            points += self.points.get(name, ())
            places += self.places.get(name, ())
        return points, places


class FeatureGraph:
    """Features, frame and alignment of a job."""

    def __init__(self, plan: Plan, options: SessionOptions, cache: EvaluationCache) -> None:
        self.plan, self.options, self.cache = plan, options, cache
        self.facts = cache.known("plan", (plan,), lambda: PlanFacts.of(plan))

    @property
    def below(self) -> Below:
        return self.cache.known("below", (self.plan,), lambda: Below.of(self.plan))

    def touched(self, points: Sequence[MeasuredPoint]) -> PointsByFeature:
        """Return stored points as reported, indexed by their numbers."""
        part = self.options.climate.part
        raw = PointsByFeature.of(points, [point.number for point in points])
        return PointsByFeature(
            {name: self._reported(name, own, part) for name, own in raw.points.items()}, raw.places
        )

    def _reported(
        self, name: str, own: tuple[MeasuredPoint, ...], part: PartTemperature
    ) -> tuple[MeasuredPoint, ...]:
        return self.cache.known(
            ("reported", name), (part, *own), lambda: tuple(reported_points(own, part))
        )

    def features(self, touched: PointsByFeature) -> dict[str, ActualFeature | FitError]:
        """Return every feature of the plan, probed or constructed, or why it is unknown."""
        actual = {item.name: self._fitted(item, touched) for item in self.plan.features}
        rule, known = self.plan.alignment, actual
        if rule is not None and any(name not in actual for name in rule.features):
            known = actual | self._constructed(actual, "of the frame")
        T_part_from_world = self.frame(known)
        if T_part_from_world is not None:
            for item in self.plan.features:
                if item.shape is Shape.POINT:
                    actual[item.name] = self._compensated(item, touched, T_part_from_world)
        for name, feature in actual.items():
            if isinstance(feature, ActualFeature) and feature.fit.form > self.options.max_form:
                actual[name] = self._scattered(name, feature)
        # Projections onto a suspect plane are suspect.
        for nominal in self.plan.features:
            plane = actual.get(nominal.projection)
            if isinstance(plane, FitError):
                actual[nominal.name] = plane
        return actual | self._constructed(actual, "constructed")

    def commanding(self, touched: PointsByFeature, actual: Found) -> dict[str, CommandingPoints]:
        """Return the points that command the fit of a probed feature, by its name."""
        scatters = scatters_of(actual)
        found: dict[str, CommandingPoints | None] = {}
        for item in self.plan.features:
            own, plane = touched.points.get(item.name), actual.get(item.projection)
            if own is None or not is_examined(item, scatters, plane):
                continue
            usual = usual_scatter(item.name, scatters)
            found[item.name] = self.cache.known(
                ("commanding", item.name),
                (item, plane, usual, *own),
                partial(commanding_among, item, own, plane, usual),
            )
        return {name: one for name, one in found.items() if one is not None}

    def frame(self, actual: Found) -> RigidTransform | None:
        """Return the part frame; None while its datums are not measured, or without one."""
        bound = self.facts.bound
        return self.cache.watched(
            "frame", (bound,), actual, lambda watch: part_frame_of(bound, watch)
        )

    def alignment(self, actual: Found) -> BoundAlignment | None:
        """Return the alignment used for results: senses settled, if possible."""
        bound = self.facts.bound
        if bound is None:
            return None

        def settling(watch: Found) -> int | None:
            try:
                return settled(bound, geometries_of(watch)).choice
            except OcmmError:
                return None

        choice = self.cache.watched("choice", (bound,), actual, settling)
        return self.cache.known(
            ("alignment", choice), (bound,), lambda: replace(bound, choice=choice)
        )

    def _fitted(
        self, nominal: NominalFeature, touched: PointsByFeature
    ) -> ActualFeature | FitError:
        names = [name for name in (nominal.projection, nominal.name) if name]
        points, places = touched.of_features(names)

        def made() -> ActualFeature | FitError:
            known = [self.facts.by_name[name] for name in names if name in self.facts.by_name]
            return actual_features(known, points, places)[nominal.name]

        # The plan is an input because it contains the plane of projection.
        return self.cache.known(("feature", nominal.name), (self.plan, nominal, *points), made)

    def _compensated(
        self, nominal: NominalFeature, touched: PointsByFeature, T_part_from_world: RigidTransform
    ) -> ActualFeature | FitError:
        points, places = touched.of_features([nominal.name])
        return self.cache.known(
            ("point", nominal.name),
            (nominal, T_part_from_world, *points),
            lambda: compensate_by_plan([nominal], points, T_part_from_world, places)[nominal.name],
        )

    def _constructed(self, actual: Found, stage: str) -> dict[str, ActualFeature | FitError]:
        known: dict[str, ActualFeature | FitError] = dict(actual)
        found: dict[str, ActualFeature | FitError] = {}
        for item in self.facts.constructions:
            known[item.name] = found[item.name] = self._made(item, known, stage)
        return {item.name: found[item.name] for item in self.plan.constructions}

    def _made(self, item: Construction, known: Found, stage: str) -> ActualFeature | FitError:
        below = {name: known[name] for name in needed_features(item)}
        return self.cache.known(
            (stage, item.name),
            (self.plan, item, *below.values()),
            lambda: constructed_features([item], below, self.facts.nominals)[item.name],
        )

    def _scattered(self, name: str, feature: ActualFeature) -> FitError:
        return self.cache.known(("scattered", name), (feature,), lambda: _scattered(feature))


def part_frame_of(bound: BoundAlignment | None, actual: Found) -> RigidTransform | None:
    """Return the part frame; None while its datums are not measured, or without an alignment."""
    try:
        return None if bound is None else part_frame(bound, measured_of(actual))
    except OcmmError:
        return None


def _scattered(feature: ActualFeature) -> FitError:
    worst = feature.numbers[int(np.argmax(np.abs(feature.fit.residuals)))]
    return FitError(
        "session.form",
        f"Points of {feature.nominal.name} scatter by {feature.fit.form:.3f} mm; point {worst} "
        "is farthest off.",
        "Undo the points that do not belong here and take them again.",
    )
