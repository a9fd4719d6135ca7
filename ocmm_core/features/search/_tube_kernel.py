"""Compiled search for the thinnest cylinder about points along a given axis."""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float

# Factor of a squared distance: points on the circle count as inside despite rounding.
_INSIDE = 1.0 + 1e-14


@compiled()
def narrowest_tube(about: Float, axes: Float) -> float:
    """Return the diameter of the thinnest cylinder along the first axis about points.

    It is the smallest circle about their projections, found from a few points, extended by the
    farthest one outside until none is left; takes a few rounds.
    """
    n = len(about)
    places, few = np.empty((n, 2)), np.empty((n, 2))
    for row in range(n):
        a, b, c = about[row, 0], about[row, 1], about[row, 2]
        # The coordinate along the axis is irrelevant; axes are unit vectors by rows.
        places[row, 0] = a * axes[1, 0] + b * axes[1, 1] + c * axes[1, 2]
        places[row, 1] = a * axes[2, 0] + b * axes[2, 1] + c * axes[2, 2]
    # No circle yet: the first round adds the place farthest from the origin.
    x, y, square = 0.0, 0.0, -1.0
    for count in range(n):
        farthest, worst = 0, -1.0
        for row in range(n):
            dx, dy = places[row, 0] - x, places[row, 1] - y
            distance = dx * dx + dy * dy
            if distance > worst:
                farthest, worst = row, distance
        # Every point is within the smallest circle of some of them, which is a lower bound.
        if count > 0 and worst <= square * _INSIDE:
            break
        few[count] = places[farthest]
        x, y, square = _smallest_circle(few[: count + 1])
    return float(2.0 * np.sqrt(max(square, 0.0)))


@compiled()
def _smallest_circle(places: Float) -> tuple[float, float, float]:
    """Return centre and squared radius of the smallest circle (E. Welzl, 1991)."""
    x, y, square = places[0, 0], places[0, 1], 0.0
    for i in range(1, len(places)):
        # A point outside the smallest circle of its predecessors is on the rim of the next one; so
        # is a second one, and a third closes the circle.
        if not _outside(places, i, x, y, square):
            continue
        x, y, square = places[i, 0], places[i, 1], 0.0
        for j in range(i):
            if not _outside(places, j, x, y, square):
                continue
            x, y, square = _circle_of_two(places, i, j)
            for k in range(j):
                if _outside(places, k, x, y, square):
                    x, y, square = _circle_of_three(places, i, j, k)
    return x, y, square


@compiled()
def _outside(places: Float, row: int, x: float, y: float, square: float) -> bool:
    dx, dy = places[row, 0] - x, places[row, 1] - y
    return bool(dx * dx + dy * dy > square * _INSIDE)


@compiled()
def _circle_of_two(places: Float, i: int, j: int) -> tuple[float, float, float]:
    dx, dy = 0.5 * (places[j, 0] - places[i, 0]), 0.5 * (places[j, 1] - places[i, 1])
    return places[i, 0] + dx, places[i, 1] + dy, dx * dx + dy * dy


@compiled()
def _circle_of_three(places: Float, i: int, j: int, k: int) -> tuple[float, float, float]:
    bx, by = places[j, 0] - places[i, 0], places[j, 1] - places[i, 1]
    cx, cy = places[k, 0] - places[i, 0], places[k, 1] - places[i, 1]
    area = 2.0 * (bx * cy - by * cx)
    # Three collinear places have no circle through them; only by rounding.
    if area == 0.0:
        return _circle_of_two(places, i, j)
    b, c = bx * bx + by * by, cx * cx + cy * cy
    # Intersection of the perpendicular bisectors, relative to the first place: 2 b . d = |b|^2 and
    # 2 c . d = |c|^2, by Cramer.
    dx, dy = (cy * b - by * c) / area, (bx * c - cx * b) / area
    return places[i, 0] + dx, places[i, 1] + dy, dx * dx + dy * dy
