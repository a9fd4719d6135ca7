"""Computation of one Monte Carlo trial: from moved points to elements to values.

Elements are refitted in every trial, with full nonlinearity (`_refit_kernel`); compensation is as
in `features.measured`. Values are angles and distances of elements that hardly move: they are
expanded to second order, with a remainder of some 1e-9 mm for motions of 0.01 mm.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.features.measured import ActualFeature, Touches, solver_start
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
from ocmm_core.tolerances.monte_carlo._refit_kernel import (
    LINE_KIND,
    PLANE_KIND,
    POINT_KIND,
    PROJECTED_KIND,
    refit,
)

_KINDS = {
    Shape.POINT: POINT_KIND,
    Shape.LINE: LINE_KIND,
    Shape.PLANE: PLANE_KIND,
    Shape.CIRCLE: DISC,
    Shape.SPHERE: BALL,
    Shape.CYLINDER: CYLINDER,
    Shape.CONE: CONE,
    Shape.TORUS: TORUS,
}

_STEP = 1e-3
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
    touches: Touches
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


def refits_of(actual: Mapping[str, ActualFeature]) -> tuple[Refit, ...]:
    """Return quick features, planes, then circles by plane first: probed least-squares elements."""
    found = []
    for name, feature in actual.items():
        shape, touches, raw = feature.fit.shape, feature.touches, feature.raw
        if touches is None or raw is None or shape not in _KINDS:
            continue
        if raw.criterion is not Criterion.LEAST_SQUARES or feature.nominal.free:
            continue
        found.append(_refit(name, feature, touches, raw))
    names = {item.name for item in found}
    return tuple(
        sorted(
            (item for item in found if not item.plane or item.plane in names),
            key=lambda item: item.plane != "",
        )
    )


def _refit(name: str, feature: ActualFeature, touches: Touches, raw: Fit) -> Refit:
    centroid = touches.tips.mean(axis=0)
    base = touches.tips - centroid
    size = max(float(np.sqrt(np.mean(np.sum(base**2, axis=1)))), 1.0)
    plane = feature.nominal.projection
    kind = PROJECTED_KIND if plane else _KINDS[raw.shape]
    start = solver_start(raw, centroid, size)
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
    actual: Mapping[str, ActualFeature],
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
    steps = np.eye(k) * _STEP
    ahead = np.array([at(step) for step in steps])
    behind = np.array([at(-step) for step in steps])
    slope = (ahead - behind) / (2.0 * _STEP)
    curvature[np.diag_indices(k)] = (ahead - 2.0 * value + behind) / _STEP**2
    for i in range(k):
        for j in range(i):
            both = at(steps[i] + steps[j]) + at(-steps[i] - steps[j])
            mixed = both - ahead[i] - behind[i] - ahead[j] - behind[j] + 2.0 * value
            curvature[i, j] = curvature[j, i] = mixed / (2.0 * _STEP**2)
    return SecondOrder(tuple(names), flat[columns], columns, value, slope, curvature)
