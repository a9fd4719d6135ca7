"""Deviations of all points of a job from the nominal surfaces, and patterns common to features.

A wrong ball, a warm part or a wrong frame moves the points of all features in one pattern: away
from the material, away from one place, rigidly. Features which follow no pattern get little weight
(Geman and McClure's estimator, a weight per feature): one may be the defect of the part.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.features.elements import nominal_distances
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import DIRECTION, NominalFeature, Shape, nominal_geometry
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
    nominal: NominalFeature
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
        if self.nominal.shape is Shape.LINE:
            geometry = geometry.copy()
            along = geometry[DIRECTION]
            seen = T_nominal_from_world.rotation @ self.direction
            beside = seen - (seen @ along) * along
            length = float(np.linalg.norm(beside))
            geometry[DIRECTION] = beside / length if length > _BESIDE else seen
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
        if feature.fit.shape is Shape.PLANE:
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


def _geometry(nominal: NominalFeature) -> Float:
    geometry = nominal_geometry(nominal)
    if nominal.shape is Shape.POINT:
        geometry[DIRECTION] = unit(np.array(nominal.direction))
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
