"""Common fit of circle and sphere: a ball in d dimensions, by orthogonal distance.

Start: the algebraic fit of Taubin (IEEE PAMI 13, 1991) in the centred form of N. Chernov, Circular
and Linear Regression, 2010, section 5.9, with a bias small enough for short arcs. If the scatter of
the points is as large as their extent there are several minima, and Taubin's need not be the best;
centres all around the points are then tried as well.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features import search
from ocmm_core.features.shapes import MINIMUM_POINTS, Shape
from ocmm_core.geometry import Float

LARGEST_RADIUS = 1e4
"""Radius, relative to the size of the points, beyond which they are on a line or a plane."""

WORST_CONDITION = 1e9
"""Condition number beyond which the ball is undetermined."""

NEAREST_OTHER = 0.2
"""Least root mean squared residual of a second minimum, relative to the size of the points. The
nearest of 1,000 sets was at 0.31 (`benchmarks/hard_balls.py`); smaller first ones are accepted.
"""
DISTANCES = np.array([0.15, 0.4, 1.0, 2.5, 8.0, 40.0])
"""Distances of further trial centres from the middle of the points, relative to their size."""
TURNS = 24
"""Directions of these in a plane."""
SAMPLE = 60
"""Points used for their descent."""
SAME = 1e-5
"""Relative difference of centres below which two minima are the same."""


@dataclass(frozen=True, slots=True)
class Ball:
    """A circle (d = 2) or sphere (d = 3)."""

    centre: Float
    """(d,)."""
    radius: float
    normals: Float
    """(n, d): unit vectors from the centre to the points."""
    residuals: Float
    """(n,): positive outside."""
    gain: Float
    shifts: Float
    """`gain`, `shifts`: (d + 1, k) and (n, k): the first times the second transposed is d(centre,
    radius) / d(shift of a point along its normal)."""


def taubin_ball(points: Float) -> tuple[Float, float, float]:
    """Return centre (d,) and radius of Taubin's ball of centred points (n, d), and their size."""
    d = points.shape[1]
    moments = np.empty((d + 1, d + 1))
    mean_square = float(search.taubin(points, moments))
    smallest = np.linalg.eigh(moments)[1][:, 0]
    curvature = float(smallest[0] / np.sqrt(mean_square))
    # A straight solution has none; a far centre lets the callers recognise it.
    centre: Float = -smallest[1:] / (
        curvature if abs(curvature) >= search.STRAIGHT else search.STRAIGHT
    )
    return centre, float(np.sqrt(centre @ centre + mean_square)), mean_square


def fit_balls(shape: Shape, points: Float) -> list[Ball]:
    """Return the ball of centred, scaled ``points`` (n, d), and its rivals; or raise FitError."""
    n, d = points.shape
    flat = search.degenerate(
        shape,
        "they lie on a straight line or too short an arc"
        if shape is Shape.CIRCLE
        else "they lie in a plane or on too small a patch",
        "Spread the points over more of the feature.",
    )
    centre, radius, mean_square = taubin_ball(points)
    start = np.zeros(8)
    start[:d], start[d] = centre, radius
    solutions = [search.minimise(search.DISC if d == 2 else search.BALL, points, start)]
    least_other = n * mean_square * NEAREST_OTHER**2
    if n > MINIMUM_POINTS[shape] and search.undecided(
        solutions[0].cost, least_other, n, MINIMUM_POINTS[shape]
    ):
        solutions = _minima(points, solutions[0])
    if not 0.0 < float(solutions[0].parameters[d]) < LARGEST_RADIUS:
        raise flat
    if not solutions[0].converged:
        raise not_converged(shape)
    return [_ball(points, item, flat) for item in search.candidates(shape, solutions, n, None)]


def _ball(points: Float, solution: search.Solution, flat: FitError) -> Ball:
    d = points.shape[1]
    residuals, jacobian, _ = search.derivatives(
        search.DISC if d == 2 else search.BALL, points, solution.parameters
    )
    gain, shifts, condition = search.gains(jacobian)
    if condition > WORST_CONDITION:
        raise flat
    centre, radius = solution.parameters[:d], float(solution.parameters[d])
    return Ball(centre, radius, -jacobian[:, :d], residuals, -gain, shifts)


def _minima(points: Float, first: search.Solution) -> list[search.Solution]:
    """Return ``first`` and the minima around ``points``, best first, without flat ones."""
    d = points.shape[1]
    kind = search.DISC if d == 2 else search.BALL
    sample = search.sampled(points, SAMPLE)
    turns = np.arange(TURNS) * 2.0 * np.pi / TURNS
    ways = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    if d == 3:
        axes = search.few_axes(points)
        ways = np.concatenate([axes, -axes])
    size = np.sqrt(np.mean(np.sum(points**2, axis=1)))
    centres = (size * DISTANCES[:, None, None] * ways).reshape(-1, d)
    ends: list[search.Solution] = []
    for centre in (np.zeros(d), *centres):
        start = np.zeros(8)
        start[:d], start[d] = centre, np.linalg.norm(sample - centre, axis=1).mean()
        end = search.minimise(kind, sample, start)
        if end.converged and not _known(end, ends, d):
            ends.append(end)
    found = [first]
    for end in ends:
        solution = (
            search.minimise(kind, points, end.parameters) if len(sample) < len(points) else end
        )
        usable = solution.converged and 0.0 < solution.parameters[d] < LARGEST_RADIUS
        if usable and not _known(solution, found, d):
            found.append(solution)
    return sorted(found, key=lambda solution: solution.cost)


def _known(solution: search.Solution, others: list[search.Solution], d: int) -> bool:
    """Return whether one of the others has the same centre."""
    centre = solution.parameters[:d]
    reach = SAME * (1.0 + float(np.abs(centre).max()))
    return any(bool(np.all(np.abs(item.parameters[:d] - centre) < reach)) for item in others)


def not_converged(shape: Shape) -> FitError:
    return FitError(
        "fit.not_converged",
        f"No {shape.value.lower()} fits the points: the iteration did not converge.",
        "Check that the points belong to one feature and spread them over more of it.",
    )
