"""From draws of points to draws of values: quickly if possible, else singly.

Sizes, distances, coordinates and angles of least-squares elements, places of centres, and
least-squares form are quick: compiled loops refit their elements. Others (minimum zones,
constructions, zones about datums) are fully evaluated in every trial, which takes some milliseconds
and is done for fewer trials.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ocmm_core.alignment import AnyAlignment
from ocmm_core.errors import OcmmError
from ocmm_core.features.measured import (
    ActualFeature,
    Construction,
    actual_features,
    constructed_features,
)
from ocmm_core.features.shapes import GEOMETRY_SIZE, Shape
from ocmm_core.geometry import Float
from ocmm_core.measuring import MeasuredPoint, PointFactors
from ocmm_core.tolerances.kinds import (
    MonteCarlo,
    evaluate,
    geometry_value,
    involved_features,
    own_association,
    spec_of,
    taken_again,
)
from ocmm_core.tolerances.monte_carlo._model import Refit, SecondOrder, refits_of, second_order
from ocmm_core.tolerances.zones import Characteristic, Evaluation

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
    actual: Mapping[str, ActualFeature]
    """Features as measured, at least those of the characteristics."""
    factors: PointFactors
    form: Float
    """(N, 3, 3), mm^2: contribution of surface form to each point."""
    constructions: tuple[Construction, ...] = ()
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
        names = involved_features(item, task.alignment)
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
    spec = spec_of(item.kind)
    if spec.monte_carlo is MonteCarlo.EVALUATED:
        return None
    if taken_again(item, involved, task.alignment):
        # A datum oriented by others depends on more than its own element.
        return None
    first = task.actual[item.features[0]]
    evaluation = evaluate(item, involved, task.alignment)
    if spec.monte_carlo is MonteCarlo.RANGE:
        least_squares = item.association == "least squares" and first.fit.shape is not Shape.LINE
        return Range(item.features[0]) if least_squares else None
    if spec.monte_carlo is MonteCarlo.VECTOR:
        centred = first.fit.shape in _CENTRED and len(item.features) == 1
        if not centred or evaluation.components is None or evaluation.bonus_gradient is not None:
            return None
        return _vector(item, task, involved, evaluation)
    if item.association not in ("", own_association(first)):
        # The element of the association, or opposite points, not the element itself.
        return None
    gradient = evaluation.gradient
    sigma = float(np.sqrt(task.factors.of(gradient[None])[0, 0]))
    if spec.folds and evaluation.value < _FAR * sigma:
        return None
    shapes = {name: feature.fit.shape for name, feature in involved.items()}

    def value(geometries: Mapping[str, Float]) -> float:
        return geometry_value(item, geometries, shapes, task.alignment)

    return second_order(value, names, involved)


def _vector(
    item: Characteristic, task: Task, involved: Mapping[str, ActualFeature], evaluation: Evaluation
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
                found = evaluate(item, {**involved, name: moved}, task.alignment).components
                if found is None or len(found) != len(components):
                    return None
                sides.append(found)
            slopes[:, GEOMETRY_SIZE * index + k] = (sides[0] - sides[1]) / (2.0 * _STEP)
    return Vector(names, at, components, slopes)


def slow_trials(task: Task, names: Sequence[str], deviations: Float) -> tuple[Float, int]:
    """Return values (m, k) of the named characteristics, fully evaluated in each trial."""
    asked = {item.name: item for item in task.characteristics}
    wanted = [asked[name] for name in names]
    needed = {name for item in wanted for name in involved_features(item, task.alignment)}
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
        found = actual_features(nominals, _moved(points, moved))
        if task.constructions:
            found |= constructed_features(task.constructions, found, task.nominals)
        actual = {k: v for k, v in found.items() if isinstance(v, ActualFeature)}
        for column, item in enumerate(wanted):
            try:
                values[trial, column] = evaluate(item, actual, task.alignment).value
            except OcmmError:
                failed += 1
    return values, failed


def _sided(point: MeasuredPoint, actual: Mapping[str, ActualFeature]) -> MeasuredPoint:
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
