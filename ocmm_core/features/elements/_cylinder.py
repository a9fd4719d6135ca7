"""Cylinder by orthogonal distance, cold start by Taubin's circle along every trial axis."""

from __future__ import annotations

from functools import cache, partial

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features import search
from ocmm_core.features.elements._ball import LARGEST_RADIUS, WORST_CONDITION, not_converged
from ocmm_core.features.shapes import GEOMETRY_SIZE, Fit, Shape, element, make_fit
from ocmm_core.geometry import Float, Points3

RANKING_POINTS = 120
"""Points used for the circle of a trial axis."""
BETWEEN, LEANS = 12, (-10.0, -3.0, 0.0, 3.0, 10.0)
"""Axes along the patch of the points, and degrees of tilt out of it."""


def fit_cylinder(
    points: Points3, direction_hint: Float | None = None, radius_hint: float | None = None
) -> Fit:
    """Return the cylinder of ``points`` (n, 3), mm; residuals are positive outside.

    ``direction_hint`` (3,) orients the axis; ``radius_hint``, mm, may decide between rivals, of
    which up to six pass through five points. FitError if the points do not determine one cylinder.
    """
    points = search.checked_points(Shape.CYLINDER, points)
    flat = search.degenerate(
        Shape.CYLINDER,
        "they lie in a plane, on one circle or on too small a patch",
        "Take points around the cylinder at two heights or more.",
    )
    centroid, about, size = search.centred_solid(Shape.CYLINDER, points, flat)
    expected, asked = None, _families(about)
    if radius_hint:
        radius = radius_hint / size
        expected = partial(_from_plan, expected=radius)
        asked = (*asked, search.planned(asked, slice(6, 7), np.array([radius])))
    solutions = search.minima(search.CYLINDER, about, asked, _possible)
    if not solutions:
        raise not_converged(Shape.CYLINDER)
    build = partial(
        _fit, centroid=centroid, about=about, size=size, direction_hint=direction_hint, flat=flat
    )
    return search.decided(
        search.candidates(Shape.CYLINDER, solutions, len(points), expected), build
    )


def _fit(
    best: Float, *, centroid: Float, about: Float, size: float, direction_hint: Float | None,
    flat: FitError,
) -> Fit:  # fmt: skip
    """Return the fit of parameters (8,); raise ``flat`` if undetermined."""
    best[3:6] = search.oriented(best[3:6], direction_hint)
    residuals, jacobian, _ = search.derivatives(search.CYLINDER, about, best)
    inverse, condition = search.sensitivity(jacobian)
    if condition > WORST_CONDITION:
        raise flat
    geometry = element(centroid + size * best[0:3], best[3:6], size * best[6])
    by_points = _by_points(best, about, -inverse, jacobian)
    by_points[3:6] /= size
    return make_fit(Shape.CYLINDER, geometry, by_points, size * residuals)


def _from_plan(parameters: Float, expected: float) -> float:
    return abs(float(parameters[6]) - expected) / (search.NEAR * expected)


def _possible(parameters: Float) -> bool:
    return 0.0 < float(parameters[6]) < LARGEST_RADIUS


def _families(points: Float) -> tuple[search.Family, ...]:
    quadrics = cache(partial(search.quadric_axes, points))
    return (
        lambda: starts(points, search.trial_axes(points)),
        lambda: starts(points, np.concatenate([quadrics(), _bent_axes(points)])),
        lambda: starts(points, np.concatenate([quadrics(), search.many_axes(points)])),
    )


def _bent_axes(points: Float) -> Float:
    """Return curvature directions of the patch, and directions between and next to them, (m, 3)."""
    patch = search.curved_patch(points)
    turns = np.arange(BETWEEN) * np.pi / BETWEEN
    leans = np.deg2rad(LEANS)[:, None, None]
    across = np.cos(turns)[:, None] * patch.directions[0]
    across = across + np.sin(turns)[:, None] * patch.directions[1]
    axes: Float = np.cos(leans) * across + np.sin(leans) * patch.normal
    return axes.reshape(-1, 3)


def starts(points: Float, axes: Float) -> Float:
    """Return start parameters (m, 8), one for every trial axis."""
    found = np.empty((len(axes), 8))
    search.circles(search.sampled(points, RANKING_POINTS), axes, found)
    return found


def _by_points(parameters: Float, points: Float, inverse: Float, jacobian: Float) -> Float:
    """Return d(geometry) / d(points), (12, 3 n), of the centred and scaled cylinder."""
    n = len(points)
    axis = parameters[3:6]
    basis = np.stack(search.across_axes(axis))
    by_shift = np.zeros((GEOMETRY_SIZE, n))
    by_shift[0:3] = basis.T @ inverse[0:2]
    by_shift[3:6] = basis.T @ inverse[2:4]
    by_shift[6] = inverse[4]
    # A rotation of the axis moves the foot of a centroid off the axis.
    by_shift[0:3] += np.outer(axis, -parameters[0:3] @ by_shift[3:6])
    radial = -jacobian[:, 0:2] @ basis
    by_points = by_shift[:, :, None] * radial
    by_points[0:3] += np.outer(axis, axis)[:, None, :] / n
    return by_points.reshape(GEOMETRY_SIZE, 3 * n)
