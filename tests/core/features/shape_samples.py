"""Points on ideal shapes, for the tests of fits."""

from __future__ import annotations

import numpy as np

from ocmm_core.features.shapes import ACROSS, DIRECTION, POINT, Shape, element
from ocmm_core.features.shapes import HALF_ANGLE as ANGLE_PLACE
from ocmm_core.features.shapes import RADIUS as RADIUS_PLACE
from ocmm_core.geometry import Float, Points3, RigidTransform, rotation_from_vector

ALL_SHAPES = tuple(Shape)
FITTED = ALL_SHAPES[1:]
RADIUS = 12.5
SECOND = 5.0
HALF_ANGLE = 0.3
OUTLINES = (Shape.ELLIPSE, Shape.ROUND_SLOT, Shape.SQUARE_SLOT, Shape.RECTANGLE)
ROUND = (Shape.CIRCLE, Shape.SPHERE, Shape.CYLINDER, Shape.CONE, Shape.TORUS)
UNDIRECTED = (Shape.POINT, Shape.SPHERE)


def ideal_points(
    shape: Shape, rng: np.random.Generator, n: int = 14, arc: float = 2.0 * np.pi
) -> Points3:
    """Return ``n`` exact points (n, 3), mm, of a shape at the origin along z, radius `RADIUS`."""
    # Even turns with a jitter: no sample of a full circle crowds by chance on a short arc.
    turn = (np.arange(n) + rng.uniform(0.2, 0.8, n)) * arc / n
    # Heights in another order than turns, or they would lie on a helix.
    height = rng.permutation((np.arange(n) + rng.uniform(0.2, 0.8, n)) / n * 30.0 - 15.0)
    zero = np.zeros(n)
    match shape:
        case Shape.POINT:
            return np.zeros((n, 3))
        case Shape.LINE:
            return np.stack([zero, zero, height], axis=1)
        case Shape.PLANE:
            return np.stack([rng.uniform(-20, 20, n), rng.uniform(-20, 20, n), zero], axis=1)
        case Shape.CIRCLE:
            return RADIUS * np.stack([np.cos(turn), np.sin(turn), zero], axis=1)
        case Shape.SPHERE:
            z = height / 15.0 * min(1.0, arc / np.pi) * 0.9
            ring = np.sqrt(1.0 - z**2)
            return RADIUS * np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)
        case Shape.CYLINDER:
            return np.stack([RADIUS * np.cos(turn), RADIUS * np.sin(turn), height], axis=1)
        case Shape.CONE:
            radius = RADIUS + np.tan(HALF_ANGLE) * height
            return np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=1)
        case Shape.TORUS:
            tube = rng.permutation((np.arange(n) + rng.uniform(0.2, 0.8, n)) * 2.0 * np.pi / n)
            radius = RADIUS + SECOND * np.cos(tube)
            return np.stack(
                [radius * np.cos(turn), radius * np.sin(turn), SECOND * np.sin(tube)], axis=1
            )
        case Shape.ELLIPSE:
            return np.stack([RADIUS * np.cos(turn), SECOND * np.sin(turn), zero], axis=1)
        case Shape.ROUND_SLOT:
            return _round_slot(turn / arc)
        case Shape.SQUARE_SLOT | Shape.RECTANGLE:
            return _rectangle(turn / arc)


def _round_slot(share: Float) -> Points3:
    """Return points at shares of the length of the outline, from the middle of a side."""
    core, end = RADIUS - SECOND, np.pi * SECOND
    way = share * (4.0 * core + 2.0 * end)
    way = (way + core) % (4.0 * core + 2.0 * end)
    half = way >= 2.0 * core + end
    way = np.where(half, way - 2.0 * core - end, way)
    bend = np.clip(way - 2.0 * core, 0.0, end) / SECOND
    x = np.minimum(way, 2.0 * core) - core + SECOND * np.sin(bend)
    y = -SECOND * np.cos(bend)
    sign = np.where(half, -1.0, 1.0)
    return np.stack([sign * x, sign * y, np.zeros(len(share))], axis=1)


def _rectangle(share: Float) -> Points3:
    """Return points at shares of the length of the outline, from the middle of a side."""
    way = (share * 4.0 * (RADIUS + SECOND) + RADIUS) % (4.0 * (RADIUS + SECOND))
    half = way >= 2.0 * (RADIUS + SECOND)
    way = np.where(half, way - 2.0 * (RADIUS + SECOND), way)
    x = np.minimum(way, 2.0 * RADIUS) - RADIUS
    y = np.maximum(way - 2.0 * RADIUS, 0.0) - SECOND
    sign = np.where(half, -1.0, 1.0)
    return np.stack([sign * x, sign * y, np.zeros(len(share))], axis=1)


def true_geometry(shape: Shape, motion: RigidTransform) -> Float:
    """Return the geometry vector of the shape of `ideal_points` after a motion."""
    return element(
        motion.translation,
        np.zeros(3) if shape in UNDIRECTED else motion.rotation[:, 2],
        RADIUS if shape in ROUND + OUTLINES else 0.0,
        second=SECOND if shape in (*OUTLINES, Shape.TORUS) else 0.0,
        half_angle=HALF_ANGLE if shape is Shape.CONE else 0.0,
        across=motion.rotation[:, 0] if shape in OUTLINES else np.zeros(3),
    )


def somewhere(rng: np.random.Generator, far: float = 500.0) -> RigidTransform:
    """Return a random motion up to ``far`` mm away."""
    return RigidTransform(rotation_from_vector(rng.normal(size=3)), rng.uniform(-far, far, 3))


def geometry_distance(shape: Shape, first: Float, second: Float) -> float:
    """Return the greatest difference of two geometry vectors; directions without sense."""
    second = second.copy()
    for place in (DIRECTION, ACROSS):
        # A cone determines its direction.
        if first[place] @ second[place] < 0.0 and shape is not Shape.CONE:
            second[place] *= -1.0
    axis = first[DIRECTION]
    if shape in (Shape.LINE, Shape.CYLINDER, Shape.CONE):
        along = (second[POINT] - first[POINT]) @ axis
        second[POINT] -= along * axis
        second[RADIUS_PLACE] -= along * np.tan(second[ANGLE_PLACE])
    difference = first - second
    if shape is Shape.PLANE:
        difference[POINT] = (difference[POINT] @ axis) * axis
    return float(np.abs(difference).max())
