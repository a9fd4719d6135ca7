"""A straight line in space: the principal axis of its points."""

from __future__ import annotations

import numpy as np

from ocmm_core.features.fit.common import (
    centred,
    checked_points,
    degenerate,
    oriented,
    principal_axes,
)
from ocmm_core.features.fit.point_kernel import spread
from ocmm_core.features.shapes import (
    DIRECTION,
    GEOMETRY_SIZE,
    POINT,
    Fit,
    Shape,
    element,
    make_fit,
)
from ocmm_core.geometry import Float, Points3

NOTHING = np.zeros((GEOMETRY_SIZE, 3))
ROUNDEST = 0.5
"""Second extent against the first beyond which a cloud of points has no direction."""


def fit_line(points: Points3, direction_hint: Float | None = None) -> Fit:
    """Return the orthogonal-distance line through ``points`` (n, 3), mm.

    A distance from a line in space has no side; residuals take theirs from the direction in
    which the points scatter most across the line, so that `Fit.form` is the width of the points
    there.

    Raises
    ------
    FitError
        Too few points, or they do not determine a direction.
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
    direction = oriented(axes[0], direction_hint)
    along = about @ direction
    across = about - along[:, None] * direction
    sides = np.where(across @ axes[1] < 0.0, -1.0, 1.0)

    n = len(points)
    # A point moves the direction by its part across the line, whichever way that points.
    gain, constant = np.zeros((GEOMETRY_SIZE, 1)), np.zeros((GEOMETRY_SIZE, 3))
    constant[POINT] = np.eye(3) / n
    jacobian = np.zeros((GEOMETRY_SIZE, 3 * n))
    spread(gain, along[:, None], direction[None], constant, jacobian)
    arms = (along / (size * (along @ along)))[:, None]
    for beside in axes[1:]:
        gain[DIRECTION, 0] = beside
        spread(gain, arms, beside[None], NOTHING, jacobian)
    geometry = element(centroid, direction)
    residuals = size * sides * np.sqrt(np.einsum("nk,nk->n", across, across))
    return make_fit(Shape.LINE, geometry, jacobian, residuals)
