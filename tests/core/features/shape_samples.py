"""Points on ideal shapes, for the tests of fits."""

from __future__ import annotations

import numpy as np

from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float, Points3, RigidTransform, rotation_from_vector

ALL_SHAPES = (
    Shape.POINT,
    Shape.LINE,
    Shape.PLANE,
    Shape.CIRCLE,
    Shape.SPHERE,
    Shape.CYLINDER,
)
FITTED = ALL_SHAPES[1:]
RADIUS = 12.5


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


def somewhere(rng: np.random.Generator, far: float = 500.0) -> RigidTransform:
    """Return a random motion up to ``far`` mm away."""
    return RigidTransform(rotation_from_vector(rng.normal(size=3)), rng.uniform(-far, far, 3))


def geometry_distance(shape: Shape, first: Float, second: Float) -> float:
    """Return the greatest difference of two geometry vectors; directions without sense."""
    difference = first - second
    if first[3:6] @ second[3:6] < 0.0:
        difference[3:6] = first[3:6] + second[3:6]
    if shape in (Shape.LINE, Shape.CYLINDER):
        difference[0:3] -= (difference[0:3] @ first[3:6]) * first[3:6]
    if shape is Shape.PLANE:
        difference[0:3] = (difference[0:3] @ first[3:6]) * first[3:6]
    return float(np.abs(difference).max())
