"""Seeded random sets of points on which a fit may end in a wrong minimum.

Short arcs, few points and much noise: sizes from 1 to 200 mm, arcs of 5 to 360 degrees, from as few
points as the shape needs to 60, noise from 1e-6 to 0.2 of the size, places up to 10 m off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.features.shapes import MINIMUM_POINTS, Shape
from ocmm_core.geometry import Float, Points3, rotation_from_vector

SHAPES = (
    Shape.TORUS, Shape.CONE, Shape.CYLINDER, Shape.ELLIPSE, Shape.ROUND_SLOT, Shape.SQUARE_SLOT,
)  # fmt: skip
MOST_POINTS, FARTHEST_MM = 60, 10_000.0


@dataclass(frozen=True, slots=True)
class HardSet:
    """Points (n, 3), mm, of a shape, and how they were made.

    Attributes
    ----------
    arc
        rad.
    noise
        mm: standard deviation of every coordinate.
    rotation, place
        (3, 3) and (3,): the shape's own frame in space; z is its axis or normal.
    sizes
        As the reference solver wants them: R; half angle, s; R, r; a, b.
    """

    shape: Shape
    points: Points3
    arc: float
    noise: float
    rotation: Float
    place: Float
    sizes: Float


def hard_set(shape: Shape, seed: int, number: int) -> HardSet:
    """Return set ``number`` of a shape; the same numbers give the same set."""
    rng = np.random.default_rng([seed, list(Shape).index(shape), number])
    n = round(float(np.exp(rng.uniform(np.log(MINIMUM_POINTS[shape]), np.log(MOST_POINTS)))))
    size = 10.0 ** rng.uniform(0.0, 2.3)
    arc = float(np.exp(rng.uniform(np.log(np.deg2rad(5.0)), np.log(2.0 * np.pi))))
    noise = size * 10.0 ** rng.uniform(-6.0, np.log10(0.2))
    turn = rng.uniform(0.0, arc, n) + rng.uniform(0.0, 2.0 * np.pi)
    local, sizes = _on(shape, rng, turn, arc, size)
    rotation = rotation_from_vector(rng.normal(size=3))
    place = rng.uniform(-FARTHEST_MM, FARTHEST_MM, 3)
    points = (local + rng.normal(0.0, noise, local.shape)) @ rotation.T + place
    return HardSet(shape, points, arc, noise, rotation, place, sizes)


def _on(
    shape: Shape, rng: np.random.Generator, turn: Float, arc: float, size: float
) -> tuple[Points3, Float]:
    n, zero = len(turn), np.zeros(len(turn))
    x, y = np.cos(turn), np.sin(turn)
    match shape:
        case Shape.TORUS:
            tube = size * rng.uniform(0.05, 0.95)
            around = rng.uniform(0.0, rng.uniform(0.5 * np.pi, 2.0 * np.pi), n)
            around += rng.uniform(0.0, 2.0 * np.pi)
            rho = size + tube * np.cos(around)
            return np.stack([rho * x, rho * y, tube * np.sin(around)], axis=1), np.array(
                [size, tube]
            )
        case Shape.CYLINDER:
            height = size * 10.0 ** rng.uniform(-1.0, 0.7) * rng.uniform(-0.5, 0.5, n)
            return np.stack([size * x, size * y, height], axis=1), np.array([size])
        case Shape.CONE:
            angle = np.deg2rad(rng.uniform(2.0, 80.0))
            long = size * min(10.0 ** rng.uniform(-1.0, 0.7), 1.8 / np.sin(angle))
            slant = long * rng.uniform(-0.5, 0.5, n)
            rho = size + np.sin(angle) * slant
            points = np.stack([rho * x, rho * y, np.cos(angle) * slant], axis=1)
            return points, np.array([angle, size * np.cos(angle)])
        case Shape.ELLIPSE:
            short = size * rng.uniform(0.1, 0.97)
            return np.stack([size * x, short * y, zero], axis=1), np.array([size, short])
        case _:
            half = size * rng.uniform(0.1, 0.9)
            share = (rng.uniform(0.0, 1.0) + rng.uniform(0.0, arc / (2.0 * np.pi), n)) % 1.0
            flat = _around(shape is Shape.ROUND_SLOT, share, size, half)
            return np.column_stack([flat, zero]), np.array([size, half])


def _around(round_ends: bool, share: Float, a: float, b: float) -> Float:
    """Return places (n, 2) at shares of the outline of half length ``a`` and half width ``b``."""
    turn = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 2000)
    if round_ends:
        right = np.stack([a - b + b * np.cos(turn), b * np.sin(turn)], axis=1)
        outline = np.concatenate([right, -right, right[:1]])
    else:
        outline = np.array([[a, -b], [a, b], [-a, b], [-a, -b], [a, -b]])
    ways = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(outline, axis=0), axis=1))])
    at = share * ways[-1]
    return np.stack([np.interp(at, ways, outline[:, k]) for k in range(2)], axis=1)
