"""From draws of points to draws of values: quickly if possible, else singly.

Sizes, distances, coordinates and angles of least-squares elements, places of centres, and
least-squares form are quick: compiled loops refit their elements. Others (minimum zones,
constructions, zones about datums) are fully evaluated in every trial, which takes some milliseconds
and is done for fewer trials.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ocmm_core.alignment import AnyAlignment
from ocmm_core.errors import OcmmError
from ocmm_core.features import measured
from ocmm_core.features.search import BALL, CONE, CYLINDER, DISC, TORUS
from ocmm_core.features.shapes import (
    DIRECTION,
    GEOMETRY_SIZE,
    HALF_ANGLE,
    POINT,
    RADIUS,
    SECOND,
    Criterion,
    Fit,
    Shape,
)
from ocmm_core.geometry import Float, Int
from ocmm_core.measuring import MeasuredPoint, PointFactors
from ocmm_core.tolerances import kinds
from ocmm_core.tolerances.monte_carlo._refit_kernel import (
    LINE_KIND,
    PLANE_KIND,
    POINT_KIND,
    PROJECTED_KIND,
    refit,
)
from ocmm_core.tolerances.zones import Characteristic, Evaluation

_KINDS = {
    Shape.POINT: POINT_KIND, Shape.LINE: LINE_KIND, Shape.PLANE: PLANE_KIND, Shape.CIRCLE: DISC,
    Shape.SPHERE: BALL, Shape.CYLINDER: CYLINDER, Shape.CONE: CONE, Shape.TORUS: TORUS,
}  # fmt: skip

_CURVATURE_STEP = 1e-3
"""Step of the second differences, in units of a size for directions and mm for all else."""


@dataclass(frozen=True, slots=True)
class Refit:
    """One probed feature, prepared for refitting."""

    name: str
    kind: int
    centroid: Float
    base: Float
    size: float
    """`centroid`, `base`, `size`: ball centres: centroid (3,), about it (n, 3), and scale, mm."""
    places: Int
    """(n,): of its points among all."""
    start: Float
    """(8,): the element of the measured points."""
    plane: str
    """Feature whose normal the points are projected along, or empty."""
    touches: measured.Touches
    outer: bool
    """`touches`, `outer`: For compensation."""

    def geometries(
        self, deviations: Float, fitted: Mapping[str, Float]
    ) -> tuple[Float, Float, int]:
        """Return compensated geometry (m, 12), range of the residuals (m,), failed trials.

        ``deviations`` (m, 3 N + 1), mm, are of all ball centres and the tip radius; ``fitted`` are
        geometries of the preceding features, world.
        """
        count = len(deviations)
        geometry, ranges = np.empty((count, GEOMETRY_SIZE)), np.empty(count)
        normals = fitted[self.plane][:, DIRECTION] if self.plane else np.empty((0, 3))
        failed = refit(
            self.kind, self.base, self.size, self.places, deviations, self.start,
            np.ascontiguousarray(normals), geometry, ranges,
        )  # fmt: skip
        geometry[:, POINT] += self.centroid
        self._take_ball_off(geometry, self.touches.tip_radius + deviations[:, -1])
        return geometry, ranges, failed

    def _take_ball_off(self, geometry: Float, radius: Float) -> None:
        sign = 1.0 if self.outer else -1.0
        mean = self.touches.directions.mean(axis=0)
        direction = geometry[:, DIRECTION]
        if self.kind == POINT_KIND:
            geometry[:, POINT] -= radius[:, None] * mean
        elif self.kind == PLANE_KIND:
            geometry[:, POINT] -= radius[:, None] * direction
        elif self.kind == LINE_KIND:
            beside = mean - (direction @ mean)[:, None] * direction
            beside /= np.linalg.norm(beside, axis=1)[:, None]
            geometry[:, POINT] -= radius[:, None] * beside
        elif self.kind == CONE:
            geometry[:, RADIUS] -= sign * radius / np.cos(geometry[:, HALF_ANGLE])
        elif self.kind == TORUS:
            geometry[:, SECOND] -= sign * radius
        else:
            geometry[:, RADIUS] -= sign * radius


def refits_of(actual: Mapping[str, measured.ActualFeature]) -> tuple[Refit, ...]:
    """Return quick features, planes, then circles by plane first: probed least-squares elements."""
    found = []
    for name, feature in actual.items():
        shape, touches, raw = feature.fit.shape, feature.touches, feature.raw
        if touches is None or raw is None or shape not in _KINDS:
            continue
        if raw.criterion is not Criterion.LEAST_SQUARES or feature.nominal.free:
            continue
        if shape is Shape.LINE and feature.nominal.projection:
            continue
        found.append(_refit(name, feature, touches, raw))
    names = {item.name for item in found}
    return tuple(
        sorted(
            (item for item in found if not item.plane or item.plane in names),
            key=lambda item: item.plane != "",
        )
    )


def _refit(
    name: str, feature: measured.ActualFeature, touches: measured.Touches, raw: Fit
) -> Refit:
    centroid = touches.tips.mean(axis=0)
    base = touches.tips - centroid
    size = max(float(np.sqrt(np.mean(np.sum(base**2, axis=1)))), 1.0)
    plane = feature.nominal.projection
    kind = PROJECTED_KIND if plane else _KINDS[raw.shape]
    start = measured.solver_start(raw, centroid, size)
    return Refit(
        name, kind, centroid, np.ascontiguousarray(base), size,
        np.array(touches.places, dtype=np.int64), start, plane, touches,
        feature.nominal.side == "outer",
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class SecondOrder:
    """Second-order expansion of a value by the geometry of measured elements."""

    names: tuple[str, ...]
    at: Float
    """(k,): measured geometry, moving entries only."""
    columns: Int
    """(k,): of those entries in the concatenated geometries."""
    value: float
    slope: Float
    curvature: Float
    """`value`, `slope`, `curvature`: Of the value, (k,) and (k, k)."""

    def values(self, geometries: Mapping[str, Float]) -> Float:
        all_of_them = np.hstack([geometries[name] for name in self.names])
        moved = all_of_them[:, self.columns] - self.at
        bent = np.einsum("mk,mk->m", moved @ self.curvature, moved)
        values: Float = self.value + moved @ self.slope + 0.5 * bent
        return values


def second_order(
    function: Callable[[Mapping[str, Float]], float],
    names: Sequence[str],
    actual: Mapping[str, measured.ActualFeature],
) -> SecondOrder:
    """Return the expansion of a function of geometries about the measured ones."""
    flat = np.concatenate([actual[name].fit.geometry for name in names])
    moving = np.concatenate([actual[name].jacobian.moving() for name in names])
    columns = np.flatnonzero(moving)
    whole = {name: feature.fit.geometry for name, feature in actual.items()}

    def at(step: Float) -> float:
        moved = flat.copy()
        moved[columns] += step
        parts = np.split(moved, len(names))
        return function({**whole, **dict(zip(names, parts, strict=True))})

    k = len(columns)
    value = at(np.zeros(k))
    slope, curvature = np.zeros(k), np.zeros((k, k))
    steps = np.eye(k) * _CURVATURE_STEP
    ahead = np.array([at(step) for step in steps])
    behind = np.array([at(-step) for step in steps])
    slope = (ahead - behind) / (2.0 * _CURVATURE_STEP)
    curvature[np.diag_indices(k)] = (ahead - 2.0 * value + behind) / _CURVATURE_STEP**2
    for i in range(k):
        for j in range(i):
            both = at(steps[i] + steps[j]) + at(-steps[i] - steps[j])
            mixed = both - ahead[i] - behind[i] - ahead[j] - behind[j] + 2.0 * value
            curvature[i, j] = curvature[j, i] = mixed / (2.0 * _CURVATURE_STEP**2)
    return SecondOrder(tuple(names), flat[columns], columns, value, slope, curvature)


_CENTRED = (Shape.POINT, Shape.CIRCLE, Shape.SPHERE)
_STEP = 1e-5
_FAR = 30.0
"""Least distance of a distance or angle from its fold, in standard uncertainties."""


@dataclass(frozen=True, slots=True)
class Task:
    """Simulation task; can be sent to another process."""

    characteristics: tuple[Characteristic, ...]
    alignment: AnyAlignment | None
    points: tuple[MeasuredPoint, ...]
    """As reported, in the order of ``factors``."""
    actual: Mapping[str, measured.ActualFeature]
    """Features as measured, at least those of the characteristics."""
    factors: PointFactors
    form: Float
    """(N, 3, 3), mm^2: contribution of surface form to each point."""
    constructions: tuple[measured.Construction, ...] = ()
    nominals: Mapping[str, Float] = field(default_factory=dict)
    """`constructions`, `nominals`: Of the plan, and required nominal geometry by name."""

    def only(self, characteristics: tuple[Characteristic, ...]) -> Task:
        return replace(self, characteristics=characteristics)


@dataclass(frozen=True, slots=True)
class Range:
    """Form of a least-squares element."""

    feature: str


@dataclass(frozen=True, slots=True)
class Vector:
    """Length of a vector with components linear in the geometry of features."""

    names: tuple[str, ...]
    at: Float
    """(12 n,): measured geometry."""
    components: Float
    slopes: Float
    """`components`, `slopes`: (k,) and (k, 12 n)."""

    def values(self, geometries: Mapping[str, Float]) -> Float:
        moved = np.hstack([geometries[name] for name in self.names]) - self.at
        lengths: Float = np.linalg.norm(self.components + moved @ self.slopes.T, axis=1)
        return lengths


@dataclass(frozen=True, slots=True)
class QuickModel:
    """Model of all values computed by compiled loops."""

    refits: tuple[Refit, ...]
    values: Mapping[str, SecondOrder | Vector | Range]

    def trials(self, deviations: Float) -> tuple[Float, int]:
        """Return the values (m, k) of trials with ``deviations`` (m, 3 N + 1), and failed fits."""
        geometries: dict[str, Float] = {}
        ranges: dict[str, Float] = {}
        failed = 0
        for item in self.refits:
            found, spread, lost = item.geometries(deviations, geometries)
            geometries[item.name], ranges[item.name] = found, spread
            failed += lost
        columns = [
            ranges[value.feature] if isinstance(value, Range) else value.values(geometries)
            for value in self.values.values()
        ]
        return np.column_stack(columns), failed


def quick_model(task: Task) -> QuickModel:
    """Return the model of all characteristics of a task that can be simulated quickly."""
    refits = {item.name: item for item in refits_of(task.actual)}
    values: dict[str, SecondOrder | Vector | Range] = {}
    needed: set[str] = set()
    for item in task.characteristics:
        names = kinds.involved_features(item, task.alignment)
        if not set(names) <= set(refits):
            continue
        found = _quick_value(item, task, names)
        if found is not None:
            values[item.name] = found
            needed |= set(names)
    needed |= {refits[name].plane for name in needed if refits[name].plane}
    return QuickModel(tuple(item for name, item in refits.items() if name in needed), values)


def _quick_value(
    item: Characteristic, task: Task, names: Sequence[str]
) -> SecondOrder | Vector | Range | None:
    involved = {name: task.actual[name] for name in names}
    spec = kinds.spec_of(item.kind)
    if spec.monte_carlo is kinds.MonteCarlo.EVALUATED:
        return None
    if kinds.taken_again(item, involved, task.alignment):
        # A datum oriented by others depends on more than its own element.
        return None
    first = task.actual[item.features[0]]
    evaluation = kinds.evaluate(item, involved, task.alignment)
    if spec.monte_carlo is kinds.MonteCarlo.RANGE:
        least_squares = item.association == "least squares" and first.fit.shape is not Shape.LINE
        return Range(item.features[0]) if least_squares else None
    if spec.monte_carlo is kinds.MonteCarlo.VECTOR:
        centred = first.fit.shape in _CENTRED and len(item.features) == 1
        if not centred or evaluation.components is None or evaluation.bonus_gradient is not None:
            return None
        return _vector(item, task, involved, evaluation)
    if item.association not in ("", kinds.own_association(first)):
        # The element of the association, or opposite points, not the element itself.
        return None
    sigma = float(np.sqrt(task.factors.covariance_of(evaluation.gradient[None])[0, 0]))
    if spec.folds and evaluation.value < _FAR * sigma:
        return None
    shapes = {name: feature.fit.shape for name, feature in involved.items()}

    def value(geometries: Mapping[str, Float]) -> float:
        return kinds.geometry_value(item, geometries, shapes, task.alignment)

    return second_order(value, names, involved)


def _vector(
    item: Characteristic,
    task: Task,
    involved: Mapping[str, measured.ActualFeature],
    evaluation: Evaluation,
) -> Vector | None:
    names = tuple(involved)
    at = np.concatenate([involved[name].fit.geometry for name in names])
    components = evaluation.components
    if components is None:
        return None
    slopes = np.zeros((len(components), len(at)))
    for index, name in enumerate(names):
        feature = involved[name]
        for k in range(GEOMETRY_SIZE):
            if not feature.jacobian[k].moving():
                continue
            sides = []
            for step in (_STEP, -_STEP):
                geometry = feature.fit.geometry.copy()
                geometry[k] += step
                moved = replace(feature, fit=replace(feature.fit, geometry=geometry))
                found = kinds.evaluate(item, {**involved, name: moved}, task.alignment).components
                if found is None or len(found) != len(components):
                    return None
                sides.append(found)
            slopes[:, GEOMETRY_SIZE * index + k] = (sides[0] - sides[1]) / (2.0 * _STEP)
    return Vector(names, at, components, slopes)


def slow_trials(task: Task, names: Sequence[str], deviations: Float) -> tuple[Float, int]:
    """Return values (m, k) of the named characteristics, fully evaluated in each trial."""
    asked = {item.name: item for item in task.characteristics}
    wanted = [asked[name] for name in names]
    needed = {name for item in wanted for name in kinds.involved_features(item, task.alignment)}
    probed = {name: item for name, item in task.actual.items() if item.touches is not None}
    if needed <= set(probed):
        needed |= {probed[name].nominal.projection for name in needed} - {""}
    else:
        needed = set(probed)
    nominals = [probed[name].nominal for name in probed if name in needed]
    points = [_sided(point, task.actual) for point in task.points]
    values = np.full((len(deviations), len(wanted)), np.nan)
    failed = 0
    for trial, moved in enumerate(deviations):
        found = measured.actual_features(nominals, _moved(points, moved))
        if task.constructions:
            found |= measured.constructed_features(task.constructions, found, task.nominals)
        actual = {k: v for k, v in found.items() if isinstance(v, measured.ActualFeature)}
        for column, item in enumerate(wanted):
            try:
                values[trial, column] = kinds.evaluate(item, actual, task.alignment).value
            except OcmmError:
                failed += 1
    return values, failed


def _sided(point: MeasuredPoint, actual: Mapping[str, measured.ActualFeature]) -> MeasuredPoint:
    """Return a single point with its compensation direction."""
    feature = actual.get(point.feature)
    if feature is None or feature.touches is None or feature.fit.shape is not Shape.POINT:
        return point
    row = feature.touches.numbers.index(point.number)
    return replace(point, direction=feature.touches.directions[row])


def _moved(points: Sequence[MeasuredPoint], deviations: Float) -> list[MeasuredPoint]:
    by_point = deviations[:-1].reshape(-1, 3)
    return [
        replace(point, tip_world=point.tip_world + by, tip_radius=point.tip_radius + deviations[-1])
        for point, by in zip(points, by_point, strict=True)
    ]
