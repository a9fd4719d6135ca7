"""Deviations of all points of a job from the nominal surfaces, and patterns common to features.

A wrong ball, a warm part or a wrong frame moves the points of all features in one pattern: away
from the material, away from one place, rigidly. Features which follow no pattern get little weight
(Geman and McClure's estimator, a weight per feature): one may be the defect of the part.

Points of one feature may be contradicted by the others: one, two, or a group of neighbours. Points
on a burr support each other, so `features.outliers` can miss them. Here groups are judged as a
whole, by the decrease of the sum of squared residuals without them (R. D. Cook and S. Weisberg,
Residuals and Influence in Regression, 1982, 2.2.2), with Bonferroni's bound over all groups of that
size.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import scipy

from ocmm_core.errors import FitError
from ocmm_core.features import shapes
from ocmm_core.features.elements import distance_derivatives, nominal_distances
from ocmm_core.features.measured import ActualFeature, fit_shape
from ocmm_core.features.search import unambiguous
from ocmm_core.geometry import Float, Int, RigidTransform, rotation_from_vector, unit

"""One-sided shapes, without inside."""

LEAST_SCALE_MM = 0.008
"""Features nearer to a pattern than this follow it: no part is made better."""

_STEPS = 15
_FAR_MM = 20.0
"""Initial scale of the estimator, so that a frame that is far off is also found."""
_BESIDE = 0.2
_RIDGE = 1e-9


@dataclass(frozen=True, slots=True)
class TouchedSurface:
    """Touches of one feature against its nominal surface."""

    name: str
    nominal: shapes.NominalFeature
    """From the plan; the direction of a line is the normal of its face."""
    geometry: Float
    """(12,), frame of the nominals."""
    places: Int
    """(n,): indices of its points among all of the job."""
    tips: Float
    """(n, 3), mm, world: ball centres."""
    tip_radius: float
    """mm."""
    direction: Float
    """(3,), unit, world: mean direction from the material as probed."""

    def lies(self, T_nominal_from_world: RigidTransform) -> tuple[Float, Float, Float]:
        """Return deviations (n,), mm, positive outside; normals (n, 3), out; balls (n, 3), mm.

        In the frame of the nominals; balls are their centres.
        """
        balls = T_nominal_from_world.apply(self.tips)
        geometry = self.geometry
        if self.nominal.shape is shapes.Shape.LINE:
            geometry = geometry.copy()
            along = geometry[shapes.DIRECTION]
            seen = T_nominal_from_world.rotation @ self.direction
            beside = seen - (seen @ along) * along
            length = float(np.linalg.norm(beside))
            geometry[shapes.DIRECTION] = beside / length if length > _BESIDE else seen
        distances, normals = nominal_distances(self.nominal.shape, geometry, balls)
        inner = self.nominal.shape.spec.is_curved and self.nominal.side == "inner"
        sign = -1.0 if inner else 1.0
        return sign * distances - self.tip_radius, sign * normals, balls


@dataclass(frozen=True, slots=True)
class CommonPattern:
    """A pattern common to all features."""

    T_nominal_from_world: RigidTransform
    amount: float
    sigma: float
    """`amount`, `sigma`: Amount in addition to the rigid motion, and its standard uncertainty by
    the scatter of the features: mm for a ball, dimensionless for a scale. Zero without a pattern.
    """
    misfits: Mapping[str, float]
    """mm, root mean square, per feature name."""

    def scale(self) -> float:
        """Return the usual misfit of a feature that follows the pattern, mm."""
        values = np.array(list(self.misfits.values()))
        return max(1.5 * float(np.median(values)), LEAST_SCALE_MM) if len(values) else 0.0

    def unexplained(self, scale: float) -> float:
        """Return the number of features that do not follow, fractions included."""
        ratios = np.array(list(self.misfits.values())) / scale
        return float(np.sum(ratios**2 / (1.0 + ratios**2)))


def surfaces_of(
    actual: Mapping[str, ActualFeature], leave_out: Collection[int] = ()
) -> tuple[TouchedSurface, ...]:
    """Return the probed features without the points whose indices are in ``leave_out``."""
    found = []
    for name, feature in actual.items():
        touches = feature.touches
        if touches is None:
            continue
        kept = [row for row, place in enumerate(touches.places) if place not in leave_out]
        if not kept:
            continue
        direction = touches.directions.mean(axis=0)
        direction = direction / max(float(np.linalg.norm(direction)), 1e-9)
        if feature.fit.shape is shapes.Shape.PLANE:
            direction = feature.fit.direction
        found.append(
            TouchedSurface(
                name=name,
                nominal=feature.nominal,
                geometry=_geometry(feature.nominal),
                places=np.array([touches.places[row] for row in kept], dtype=np.int64),
                tips=touches.tips[kept],
                tip_radius=touches.tip_radius,
                direction=direction,
            )
        )
    return tuple(found)


def _geometry(nominal: shapes.NominalFeature) -> Float:
    geometry = shapes.nominal_geometry(nominal)
    if nominal.shape is shapes.Shape.POINT:
        geometry[shapes.DIRECTION] = unit(np.array(nominal.direction))
    return geometry


def rigid(surfaces: Sequence[TouchedSurface], start: RigidTransform) -> CommonPattern:
    """Return the pose of the nominals by all features that agree."""
    return _fitted(surfaces, start, None)


def with_ball(surfaces: Sequence[TouchedSurface], start: RigidTransform) -> CommonPattern:
    """Return the same with a ball larger than assumed by ``amount``, mm."""
    return _fitted(surfaces, start, lambda normals, contacts: np.ones(len(normals)))


def with_growth(surfaces: Sequence[TouchedSurface], start: RigidTransform) -> CommonPattern:
    """Return the same with a part larger than its nominals by the share ``amount``."""
    middle = np.mean([surface.geometry[:3] for surface in surfaces], axis=0)

    def grown(normals: Float, contacts: Float) -> Float:
        along: Float = np.sum(normals * (contacts - middle), axis=1)
        return along

    return _fitted(surfaces, start, grown)


def misfits_in(surfaces: Sequence[TouchedSurface], T: RigidTransform) -> dict[str, float]:
    """Return the misfit of each feature with the nominals at ``T``, mm."""
    return {item.name: float(np.sqrt(np.mean(item.lies(T)[0] ** 2))) for item in surfaces}


def _fitted(
    surfaces: Sequence[TouchedSurface],
    start: RigidTransform,
    pattern: Callable[[Float, Float], Float] | None,
) -> CommonPattern:
    """Return motion and amount of a pattern, by Gauss-Newton with a weight per feature.

    `pattern`: from normals and contact points, (n, 3) each, frame of the nominals, to the change of
    the deviations per unit of the amount, (n,).
    """
    T, amount, sigma = start, 0.0, 0.0
    owner = np.repeat(np.arange(len(surfaces)), [len(item.tips) for item in surfaces])
    counts = np.bincount(owner)

    def seen(T: RigidTransform) -> tuple[Float, Float]:
        rows, off = [], []
        for surface in surfaces:
            deviations, normals, balls = surface.lies(T)
            row = [np.cross(balls, normals), normals]
            if pattern is not None:
                contacts = balls - surface.tip_radius * normals
                row.append(-pattern(normals, contacts)[:, None])
            rows.append(np.hstack(row))
            off.append(deviations)
        return np.vstack(rows), np.concatenate(off)

    for step in range(_STEPS):
        matrix, off = seen(T)
        left = off + amount * matrix[:, 6] if pattern is not None else off
        own = np.sqrt(np.bincount(owner, left**2) / counts)
        calm = max(1.5 * float(np.median(own)), LEAST_SCALE_MM)
        scale = max(_FAR_MM * 0.25**step, calm)
        weights = (1.0 / (1.0 + (own / (2.0 * scale)) ** 2) ** 2 / counts)[owner]
        arms = 1.0 / np.maximum(np.linalg.norm(matrix, axis=0), _RIDGE)
        design = matrix * arms
        inverse = np.linalg.inv(
            design.T @ (weights[:, None] * design) + _RIDGE * np.eye(matrix.shape[1])
        )
        change = -arms * (inverse @ (design.T @ (weights * off)))
        T = RigidTransform(rotation_from_vector(change[:3]), change[3:6]).compose(T)
        if pattern is not None:
            amount = float(change[6])
            # Points of one feature share its error: count features (a sandwich of clusters); the
            # pattern has one degree of freedom.
            pulls = np.zeros((len(surfaces), matrix.shape[1]))
            np.add.at(pulls, owner, design * (weights * left)[:, None])
            spread = inverse @ pulls.T @ pulls @ inverse
            share = len(surfaces) / max(len(surfaces) - 1.0, 1.0)
            sigma = float(arms[6] * np.sqrt(max(spread[6, 6], 0.0) * share))
    matrix, off = seen(T)
    left = off + amount * matrix[:, 6] if pattern is not None else off
    own = np.sqrt(np.bincount(owner, left**2) / counts)
    names = [surface.name for surface in surfaces]
    return CommonPattern(T, amount, sigma, dict(zip(names, own.tolist(), strict=True)))


SMALLEST_MM = 0.02
"""Smaller deviations are no suspects: form explains them."""

FALSE_ALARM = 0.01
_MOST_POINTS = 3
_ALL_PAIRS = 40
"""Number of points up to which all pairs are tried, else neighbours only."""
_PRIOR = 8.0
_NEIGHBOUR = 1.5
"""Neighbours are closer than this multiple of the usual distance to the nearest point."""


@dataclass(frozen=True, slots=True)
class Suspects:
    """Points contradicted by the others of their feature."""

    feature: str
    numbers: tuple[int, ...]
    off: tuple[float, ...]
    """mm, in the same order: distance out of the material shown by the others."""
    together: bool
    """They are neighbours."""

    @property
    def is_burr(self) -> bool:
        """Return whether neighbouring points protrude from the material."""
        return self.together and len(self.numbers) > 1 and min(self.off) > 0.0


def suspects_of(
    feature: ActualFeature, noise: float, usual: float | None = None
) -> Suspects | None:
    """Return the points of a feature contradicted by the others; None if all agree.

    `noise`, mm^2: mean square of a residual by the noise of the points; less scatter is chance.
    `usual`, mm^2: that of the other features of the job; one that scatters no more without some
    points gets a prior of `_PRIOR` degrees of freedom, as few remaining points are weak evidence.
    """
    touches = feature.touches
    fit = _least_squares(feature)
    if fit is None or touches is None or fit.shape is shapes.Shape.POINT:
        return None
    tips, residuals = touches.tips, fit.residuals
    n = len(tips)
    by_geometry, normals = distance_derivatives(fit, tips)
    blocks = np.einsum("kni,ni->kn", fit.jacobian.reshape(-1, n, 3), normals)
    kept = by_geometry @ blocks + np.diag(np.sum(normals**2, axis=1))
    kept = 0.5 * (kept + kept.T)
    freedom = round(float(np.trace(kept)))
    most = min(_MOST_POINTS, freedom - (2 if usual is None else 1), n // 2)
    squares = float(residuals @ residuals)
    near = _neighbours(tips)
    chosen: tuple[int, ...] = ()
    gained = 0.0
    for size in range(1, most + 1):
        groups = _groups(n, size, near)
        if not groups:
            continue
        loss, best = max((_loss(group, kept, residuals), group) for group in groups)
        left = freedom - size
        scatter, degrees = max((squares - loss) / left, noise), float(left)
        if usual is not None and scipy.special.fdtrc(left, _PRIOR, scatter / usual) > FALSE_ALARM:
            scatter = (left * scatter + _PRIOR * usual) / (left + _PRIOR)
            degrees += _PRIOR
        more = size - len(chosen)
        ratio = max(loss - gained, 0.0) / more / scatter
        chance = float(scipy.special.fdtrc(more, degrees, ratio)) * len(groups)
        if chance < FALSE_ALARM:
            chosen, gained = best, loss
    if not chosen:
        return None
    rows = list(chosen)
    off = np.linalg.solve(kept[np.ix_(rows, rows)], residuals[rows])
    if float(np.abs(off).min()) < SMALLEST_MM:
        return None
    inner = fit.shape.spec.is_curved and feature.nominal.side == "inner"
    together = len(rows) == 1 or _connected(rows, near)
    signed = -off if inner else off
    return Suspects(
        feature.nominal.name,
        tuple(feature.numbers[row] for row in rows),
        tuple(float(value) for value in signed),
        together,
    )


def _least_squares(feature: ActualFeature) -> shapes.Fit | None:
    if feature.raw is None or feature.touches is None:
        return None
    if feature.raw.criterion is shapes.Criterion.LEAST_SQUARES:
        return feature.raw
    try:
        fit = fit_shape(
            feature.raw.shape, feature.touches.tips, direction_hint=feature.raw.direction
        )
        return unambiguous(fit)
    except FitError:
        return None


def _loss(group: Sequence[int], kept: Float, residuals: Float) -> float:
    """Return the decrease of the sum of squares without these points; zero if all rests on them."""
    rows = list(group)
    own = kept[np.ix_(rows, rows)]
    if float(np.linalg.eigvalsh(own)[0]) < 1e-3:
        return 0.0
    return float(residuals[rows] @ np.linalg.solve(own, residuals[rows]))


def _neighbours(tips: Float) -> Float:
    apart = np.linalg.norm(tips[:, None] - tips[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    usual = float(np.median(apart.min(axis=1)))
    found: Float = (apart < _NEIGHBOUR * usual).astype(np.float64)
    return found


def _groups(n: int, size: int, near: Float) -> list[tuple[int, ...]]:
    if size == 1:
        return [(i,) for i in range(n)]
    pairs: list[tuple[int, ...]] = [
        pair for pair in combinations(range(n), 2) if near[pair] or n <= _ALL_PAIRS
    ]
    if size == 2:
        return pairs
    side_by_side = [pair for pair in pairs if near[pair]]
    found = {
        tuple(sorted((*pair, third)))
        for pair in side_by_side
        for third in np.flatnonzero(near[list(pair)].any(axis=0)).tolist()
        if third not in pair
    }
    return sorted(found)


def _connected(rows: Sequence[int], near: Float) -> bool:
    reached, rest = {rows[0]}, set(rows[1:])
    while rest:
        further = {row for row in rest if any(near[row, other] for other in reached)}
        if not further:
            return False
        reached |= further
        rest -= further
    return True
