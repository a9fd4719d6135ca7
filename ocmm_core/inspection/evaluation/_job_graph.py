"""Features of a job and its values as nodes of a graph, recomputed when their inputs change.

Points lead to features, these and sensitivities to the record of each feature (uncertainty, form),
all of these to frames and values. A node reads only its inputs: see `EvaluationCache`.

Single points are compensated along the direction of the plan once the part frame is known: a point
has only its approach, as straight as the hand, and a slant compensates too little of the ball
radius, always to the same side. A point that came from far off that direction, because the ball
slid into place, gives no number.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace
from functools import partial
from operator import add, attrgetter
from typing import TypeVar

import numpy as np

from ocmm_core.alignment import BoundAlignment, part_frame, settled
from ocmm_core.errors import FitError, OcmmError
from ocmm_core.features.measured import (
    ActualFeature,
    CommandingPoints,
    Construction,
    Touches,
    actual_features,
    constructed_features,
    features_of_touches,
    geometries_of,
    in_order,
    measured_of,
    needed_features,
    nominal_geometries,
)
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float, RigidTransform, unit
from ocmm_core.inspection.evaluation._cache import EvaluationCache, Grouped
from ocmm_core.inspection.evaluation._options import SessionOptions
from ocmm_core.inspection.evaluation._quarantine import (
    SMALLEST_MM,
    UsualScatter,
    commanding_among,
    is_examined,
    scatter_of,
)
from ocmm_core.inspection.plan import Plan
from ocmm_core.measuring import MeasuredPoint, reported_points
from ocmm_core.tolerances.zones import Characteristic

T = TypeVar("T")
_NUMBER = attrgetter("number")

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
    names: tuple[str, ...]
    single: tuple[str, ...]
    """`names`, `single`: of the probed features, and of those that are single points."""
    planes: Mapping[str, Set[str]]
    """Names of a projected feature and of its plane, by its name."""

    @classmethod
    def from_plan(cls, plan: Plan) -> PlanFacts:
        return cls(
            {item.name: item for item in plan.features},
            plan.bound_alignment,
            nominal_geometries(plan.features, plan.constructions),
            in_order(plan.constructions),
            tuple(item.name for item in plan.features),
            tuple(item.name for item in plan.features if item.shape is Shape.POINT),
            {
                item.name: frozenset((item.name, item.projection))
                for item in plan.features
                if item.projection
            },
        )


@dataclass(frozen=True, slots=True)
class Below:
    """Probed features of the characteristics of a plan, by name of the characteristic."""

    rests_on: Mapping[str, Sequence[str]]
    own: Mapping[str, Set[str]]
    """`rests_on`, `own`: All that it depends on, and those that it is about."""
    asked: Mapping[str, Characteristic]
    names: tuple[str, ...]
    """`asked`, `names`: the characteristics by name, and their names in the order of the plan."""
    reads: Mapping[str, Set[str]]
    """As ``rests_on``, without order."""

    @classmethod
    def from_plan(cls, plan: Plan) -> Below:
        bound, asked = plan.bound_alignment, plan.characteristics
        rests_on = {item.name: plan.rests_on(item, bound) for item in asked}
        return cls(
            rests_on,
            {
                item.name: frozenset(found for name in item.features for found in plan.probed(name))
                for item in asked
            },
            {item.name: item for item in asked},
            tuple(rests_on),
            {name: frozenset(below) for name, below in rests_on.items()},
        )


@dataclass(frozen=True, slots=True)
class PointsByFeature:
    """Points of a job by feature, as reported, and their indices in rows of jacobians."""

    points: Mapping[str, tuple[MeasuredPoint, ...]]
    places: Mapping[str, tuple[int, ...]]
    owners: Mapping[int, str]
    """Feature of each index."""


class FeatureGraph:
    """Features, frame and alignment of a job."""

    def __init__(self, plan: Plan, options: SessionOptions, cache: EvaluationCache) -> None:
        self.plan, self.options, self.cache = plan, options, cache
        self.facts = cache.known("plan", (plan,), lambda: PlanFacts.from_plan(plan))

    @property
    def below(self) -> Below:
        return self.cache.known("below", (self.plan,), lambda: Below.from_plan(self.plan))

    def touched(self, points: Sequence[MeasuredPoint]) -> PointsByFeature:
        """Return stored points as reported, indexed by their numbers."""
        cache, part, points = self.cache, self.options.climate.part, tuple(points)
        own = self.grouped("points", points, points)
        raw = own.by_feature
        return PointsByFeature(
            cache.table("reported", (part,), (raw,), lambda name: self._reported(name, raw[name])),
            cache.table("places", (), (raw,), lambda name: tuple(map(_NUMBER, raw[name]))),
            own.owners,
        )

    def grouped(self, key: str, points: Sequence[MeasuredPoint], values: Sequence[T]) -> Grouped[T]:
        """Return values of the points by feature."""
        points, values = tuple(points), tuple(values)
        return self.cache.grown(
            ("grouped", key), lambda before: Grouped.from_points(points, values, before)
        )

    def _reported(self, name: str, own: tuple[MeasuredPoint, ...]) -> tuple[MeasuredPoint, ...]:
        part = self.options.climate.part
        if part.scale == 1.0:
            return own
        return self.cache.appended(
            ("reported", name), (part,), (own,),
            lambda first: tuple(reported_points(own[first:], part)), add,
        )  # fmt: skip

    def features(self, touched: PointsByFeature) -> dict[str, ActualFeature | FitError]:
        """Return every feature of the plan, probed or constructed, or why it is unknown."""
        facts, table = self.facts, self.cache.table
        actual = dict(
            table(
                "feature", (self.plan,), (touched.points,),
                lambda name: self._fitted(name, touched),
                names=facts.names, reads=facts.planes, below=(touched.points,),
            )
        )  # fmt: skip
        rule, known = self.plan.alignment, actual
        if rule is not None and any(name not in actual for name in rule.features):
            known = actual | self._constructed(actual, "of the frame")
        T_part_from_world = self.frame(known)
        if T_part_from_world is not None:
            actual |= table(
                "point", (self.plan, T_part_from_world), (touched.points,),
                lambda name: self._compensated(name, touched, T_part_from_world),
                names=facts.single,
            )  # fmt: skip
        found = actual
        actual = dict(
            table(
                "checked", (self.plan, self.options), (found,),
                lambda name: _checked(found[name], self.options.max_form), names=facts.names,
            )
        )  # fmt: skip
        # Projections onto a suspect plane are suspect.
        for name in facts.planes:
            plane = actual.get(facts.by_name[name].projection)
            if isinstance(plane, FitError):
                actual[name] = plane
        return actual | self._constructed(actual, "constructed")

    def commanding(self, touched: PointsByFeature, actual: Found) -> dict[str, CommandingPoints]:
        """Return the points that command the fit of a probed feature, by its name."""
        sizes = self.cache.table("scatter", (), (actual,), lambda name: scatter_of(actual[name]))
        scatters = {name: size for name, size in sizes.items() if size is not None}
        usual = UsualScatter(scatters)
        found: dict[str, CommandingPoints | None] = {}
        for name, own in touched.points.items():
            if scatters.get(name, np.inf) <= SMALLEST_MM or name not in self.facts.by_name:
                continue
            item = self.facts.by_name[name]
            plane = actual.get(item.projection)
            if is_examined(item, scatters, plane):
                step = usual.lookup(name)
                found[name] = self.cache.known(
                    ("commanding", name),
                    (item, plane, step, *own),
                    partial(commanding_among, item, own, plane, step),
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

    def _fitted(self, name: str, touched: PointsByFeature) -> ActualFeature | FitError:
        by_name = self.facts.by_name
        names = [one for one in (by_name[name].projection, name) if one]
        own = {one: self._touches(one, touched) for one in names if one in touched.points}
        return features_of_touches([by_name[one] for one in names if one in by_name], own)[name]

    def _touches(self, name: str, touched: PointsByFeature) -> Touches:
        points, places = touched.points[name], touched.places[name]
        return self.cache.appended(
            ("touches", name), (), (points, places),
            lambda first: Touches.of(points[first:], places[first:]), Touches.__add__,
        )  # fmt: skip

    def _compensated(
        self, name: str, touched: PointsByFeature, T_part_from_world: RigidTransform
    ) -> ActualFeature | FitError:
        points, places = touched.points.get(name, ()), touched.places.get(name, ())
        nominal = self.facts.by_name[name]
        return compensate_by_plan([nominal], points, T_part_from_world, places)[name]

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


def part_frame_of(bound: BoundAlignment | None, actual: Found) -> RigidTransform | None:
    """Return the part frame; None while its datums are not measured, or without an alignment."""
    try:
        return None if bound is None else part_frame(bound, measured_of(actual))
    except OcmmError:
        return None


def _checked(feature: ActualFeature | FitError, max_form: float) -> ActualFeature | FitError:
    if isinstance(feature, FitError) or feature.fit.form <= max_form:
        return feature
    worst = feature.numbers[int(np.argmax(np.abs(feature.fit.residuals)))]
    return FitError(
        "session.form",
        f"Points of {feature.nominal.name} scatter by {feature.fit.form:.3f} mm; point {worst} "
        "is farthest off.",
        "Undo the points that do not belong here and take them again.",
    )
