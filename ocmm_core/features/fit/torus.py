"""A torus by orthogonal distance, cold: nothing is known of its axis.

Two kinds of starts: where points surround the axis, Taubin's circle seen along a trial axis gives
the centre, and the circle in the half plane of distance from the axis and height the rest. A short
piece of a torus is a bent tube: centres are tried in all directions and at some distances.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from ocmm_core.features.fit.axes import across_axes, few_axes, trial_axes
from ocmm_core.features.fit.axis_kernel import TORUS, tubes
from ocmm_core.features.fit.ball import (
    LARGEST_RADIUS,
    WORST_CONDITION,
    not_converged,
    taubin_centre,
    taubin_moments,
)
from ocmm_core.features.fit.common import (
    centred_solid,
    checked_points,
    degenerate,
    oriented,
)
from ocmm_core.features.fit.point_kernel import spread
from ocmm_core.features.fit.search import NEAR, chosen, minima, nearest_minimum, sampled
from ocmm_core.features.fit.solver import Solution, derivatives, gains
from ocmm_core.features.shapes import (
    DIRECTION,
    GEOMETRY_SIZE,
    POINT,
    RADIUS,
    SECOND,
    Fit,
    Shape,
    element,
    make_fit,
)
from ocmm_core.geometry import Float, Points3

RANKING_POINTS = 60
BENT = np.array([0.7, 2.0, 6.0])
"""Distances of trial centres against the size of the points."""
WAYS = 8
"""Directions around a trial axis."""
CERTAIN_POINTS, CERTAIN_KEPT = 30, 16
"""Points from which on a torus may be certain from so many starts."""
CERTAIN_RESIDUAL, CERTAIN_CONDITION = 0.01, 30.0
"""Root mean squared residual against the radius of the tube, and condition number, below which."""


def fit_torus(
    points: Points3,
    direction_hint: Float | None = None,
    sizes_hint: tuple[float, float] | None = None,
) -> Fit:
    """Return the torus of ``points`` (n, 3), mm; residuals are positive outside the tube.

    Parameters
    ----------
    points
        (n, 3), mm.
    direction_hint
        (3,): orients the axis.
    sizes_hint
        mm, radii of the centre line and of the tube: decide only where several tori pass through
        all points, as they do through seven; where they do not, FitError. Without a hint any one
        of them is given.

    Raises
    ------
    FitError
        Too few points, or they do not determine a torus whose tube is thinner than its ring.
    """
    points = checked_points(Shape.TORUS, points)
    flat = degenerate(
        Shape.TORUS,
        "they lie in a plane, on one circle, on a ball or on a straight tube",
        "Take points around the tube at several places of the ring.",
    )
    centroid, about, size = centred_solid(Shape.TORUS, points, flat)
    certain = _certain(about)
    found = [] if certain is None else [certain]
    solutions = found or minima(TORUS, about, _starts(about, trial_axes(about)), _possible)
    if not solutions:
        raise not_converged(Shape.TORUS)
    expected = None
    if sizes_hint is not None:
        hint = np.array(sizes_hint) / size
        expected = partial(_near, expected=hint)
    best = chosen(Shape.TORUS, solutions, len(points), expected)
    best[3:6] = oriented(best[3:6], direction_hint)
    residuals, jacobian, _ = derivatives(TORUS, about, best)
    inverse, shifts, condition = gains(jacobian)
    if condition > WORST_CONDITION:
        raise flat
    basis = np.stack([*across_axes(best[3:6]), best[3:6]])
    gain = np.zeros((GEOMETRY_SIZE, inverse.shape[1]))
    gain[POINT] = -basis.T @ inverse[0:3]
    gain[DIRECTION] = -basis[0:2].T @ inverse[3:5] / size
    gain[RADIUS], gain[SECOND] = -inverse[5], -inverse[6]
    # The distance falls by as much as the centre moves along the normal.
    normals = -jacobian[:, 0:3] @ basis
    by_points = np.zeros((GEOMETRY_SIZE, 3 * len(points)))
    spread(gain, shifts, normals, np.zeros((GEOMETRY_SIZE, 3)), by_points)
    geometry = element(
        centroid + size * best[0:3], best[3:6], size * best[6], second=size * float(best[7])
    )
    return make_fit(Shape.TORUS, geometry, by_points, size * residuals)


def _near(parameters: Float, expected: Float) -> bool:
    return bool(np.all(np.abs(parameters[6:8] - expected) < NEAR * expected))


def _possible(parameters: Float) -> bool:
    return 0.0 < float(parameters[7]) < float(parameters[6]) < LARGEST_RADIUS


def _certain(points: Float) -> Solution | None:
    """Return the torus that few starts lead to, where no other can be as good, else None.

    Many points that lie close to a torus and determine it well lie close to no other one.
    """
    if len(points) < CERTAIN_POINTS:
        return None
    found = nearest_minimum(TORUS, points, _starts(points, few_axes(points)), CERTAIN_KEPT)
    p = found.parameters
    if not found.converged or not _possible(p):
        return None
    if found.cost > len(points) * (CERTAIN_RESIDUAL * p[7]) ** 2:
        return None
    _, _, condition = gains(derivatives(TORUS, points, p)[1])
    return found if condition < CERTAIN_CONDITION else None


def _starts(points: Float, axes: Float) -> Float:
    sample = sampled(points, RANKING_POINTS)
    frames = np.stack(across_axes(axes), axis=1)
    flat = sample @ frames.reshape(-1, 3).T
    x = np.ascontiguousarray(flat.reshape(len(sample), len(axes), 2).swapaxes(0, 1))
    middle = x.mean(axis=1)
    moments, mean_square = taubin_moments(x - middle[:, None, :])
    centres, _ = taubin_centre(np.linalg.eigh(moments)[1][..., 0], mean_square)
    turns = np.arange(WAYS) * 2.0 * np.pi / WAYS
    ways = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    bent = (BENT[:, None, None] * ways).reshape(-1, 1, 2)
    across = np.concatenate([(centres + middle)[None], np.tile(bent, (1, len(axes), 1))])
    feet = np.einsum("wmk,mkx->wmx", across, frames)
    starts = np.zeros((*feet.shape[:2], 8))
    starts[..., 0:3], starts[..., 3:6] = feet, axes
    starts = starts.reshape(-1, 8)
    tubes(sample, starts)
    return starts
