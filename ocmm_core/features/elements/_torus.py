"""A torus by orthogonal distance, cold: nothing is known of its axis; see `_torus_starts`."""

from __future__ import annotations

from functools import partial

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.elements._ball import LARGEST_RADIUS, WORST_CONDITION, not_converged
from ocmm_core.features.elements._torus_starts import families, ring_starts
from ocmm_core.features.search import (
    NEAR,
    TORUS,
    Solution,
    across_axes,
    candidates,
    centred_solid,
    checked_points,
    decided,
    degenerate,
    derivatives,
    few_axes,
    gains,
    minima,
    nearest_minimum,
    oriented,
    planned,
    spread,
)
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
        mm, radii of the centre line and of the tube: may decide between rivals, as there are
        through seven points.

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
    expected, asked = None, families(about)
    if sizes_hint is not None:
        sizes = np.array(sizes_hint) / size
        expected = partial(_from_plan, expected=sizes)
        asked = (*asked, planned(asked, slice(6, 8), sizes))
    solutions = found or minima(TORUS, about, asked, _closed)
    if not solutions:
        raise not_converged(Shape.TORUS)
    if not _possible(solutions[0].parameters):
        raise degenerate(
            Shape.TORUS,
            "a tube thicker than its ring fits them better",
            "Take points around the tube at several places of the ring.",
        )
    solutions = [solution for solution in solutions if _possible(solution.parameters)]
    build = partial(
        _fit, centroid=centroid, about=about, size=size, direction_hint=direction_hint, flat=flat
    )
    return decided(candidates(Shape.TORUS, solutions, len(points), expected), build)


def _fit(
    best: Float, *, centroid: Float, about: Float, size: float, direction_hint: Float | None,
    flat: FitError,
) -> Fit:  # fmt: skip
    """Return the fit of parameters (8,); raise ``flat`` where the points do not determine it."""
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
    by_points = np.zeros((GEOMETRY_SIZE, 3 * len(about)))
    spread(gain, shifts, normals, np.zeros((GEOMETRY_SIZE, 3)), by_points)
    geometry = element(
        centroid + size * best[0:3], best[3:6], size * best[6], second=size * float(best[7])
    )
    return make_fit(Shape.TORUS, geometry, by_points, size * residuals)


def _from_plan(parameters: Float, expected: Float) -> float:
    return float(np.max(np.abs(parameters[6:8] - expected) / (NEAR * expected)))


def _possible(parameters: Float) -> bool:
    return 0.0 < float(parameters[7]) < float(parameters[6]) < LARGEST_RADIUS


def _closed(parameters: Float) -> bool:
    """Return whether it is a torus, or one whose tube is thicker than its ring."""
    return 0.0 < float(parameters[7]) < LARGEST_RADIUS and float(parameters[6]) > 0.0


def _certain(points: Float) -> Solution | None:
    """Return the torus that few starts lead to, where no other can be as good, else None.

    Many points that lie close to a torus and determine it well lie close to no other one.
    """
    if len(points) < CERTAIN_POINTS:
        return None
    found = nearest_minimum(TORUS, points, ring_starts(points, few_axes(points)), CERTAIN_KEPT)
    p = found.parameters
    if not found.converged or not _possible(p):
        return None
    if found.cost > len(points) * (CERTAIN_RESIDUAL * p[7]) ** 2:
        return None
    _, _, condition = gains(derivatives(TORUS, points, p)[1])
    return found if condition < CERTAIN_CONDITION else None
