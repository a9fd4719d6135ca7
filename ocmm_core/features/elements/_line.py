"""A straight line in space: the principal axis of its points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ocmm_core.features.search import (
    centred,
    checked_points,
    degenerate,
    line_distances,
    narrowest_tube,
    oriented,
    principal_axes,
    spread_alike,
)
from ocmm_core.features.shapes import DIRECTION, GEOMETRY_SIZE, POINT, Fit, Shape, element, make_fit
from ocmm_core.geometry import Float, Points3

ROUNDEST = 0.5
"""Ratio of second to first extent beyond which points have no direction."""


def fit_line(points: Points3, direction_hint: Float | None = None) -> Fit:
    """Return the orthogonal-distance line through ``points`` (n, 3), mm.

    A line in space has no sides; residuals are signed along the direction of most scatter across
    the line. `Fit.form` is the diameter of the thinnest cylinder along the line about the points,
    an upper bound of the smallest zone. FitError if the points do not determine a direction.
    """
    points = checked_points(Shape.LINE, points)
    centroid, about, size = centred(Shape.LINE, points)
    extents, axes = principal_axes(about)
    if len(about) > 2 and extents[1] > ROUNDEST * extents[0]:
        raise degenerate(
            Shape.LINE,
            "they are nearly as broad as they are long",
            "Take the points further apart along the line.",
        )
    axes[0] = oriented(axes[0], direction_hint)
    n = len(points)
    along, residuals = np.empty((n, 1)), np.empty(n)
    line_distances(about, axes, along[:, 0], residuals)

    # A point moves the direction by its component across the line.
    turning, constant = np.zeros((GEOMETRY_SIZE, 1, 3)), np.zeros((GEOMETRY_SIZE, 3))
    turning[DIRECTION, 0] = axes[1:].T @ axes[1:] / (size * extents[0] ** 2)
    constant[POINT].flat[::4] = 1.0 / n
    jacobian = np.empty((GEOMETRY_SIZE, 3 * n))
    spread_alike(turning, along, constant, jacobian)
    fit = make_fit(Shape.LINE, element(centroid, axes[0]), jacobian, size * residuals)
    return replace(fit, form=size * float(narrowest_tube(about, axes)))
