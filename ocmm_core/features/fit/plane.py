"""A plane: the two greater principal axes of its points span it."""

from __future__ import annotations

import numpy as np

from ocmm_core.features.fit.common import (
    FLAT,
    centred,
    checked_points,
    degenerate,
    oriented,
    principal_axes,
)
from ocmm_core.features.shapes import GEOMETRY_SIZE, Fit, Shape, element, make_fit
from ocmm_core.geometry import Float, Points3

THICKEST = 0.5
"""Third extent against the second beyond which a cloud of points has no plane."""


def fit_plane(points: Points3, direction_hint: Float | None = None) -> Fit:
    """Return the orthogonal-distance plane through ``points`` (n, 3), mm.

    Raises
    ------
    FitError
        Too few points, or they do not determine a plane.
    """
    points = checked_points(Shape.PLANE, points)
    return plane_of(Shape.PLANE, points, direction_hint)


def plane_of(shape: Shape, points: Points3, direction_hint: Float | None) -> Fit:
    """Return the plane through checked ``points``; errors speak of ``shape``."""
    centroid, about, size = centred(shape, points)
    extents, axes = principal_axes(about)
    if extents[1] < FLAT * extents[0]:
        raise degenerate(
            shape, "they lie on a straight line", "Take at least one point beside that line."
        )
    if extents[2] > THICKEST * extents[1]:
        raise degenerate(
            shape,
            "their scatter across the plane is nearly as great as their breadth in it",
            "Take the points further apart, not along one line.",
        )
    normal = oriented(axes[2], direction_hint)

    n = len(points)
    jacobian = np.zeros((GEOMETRY_SIZE, n, 3))
    jacobian[[0, 1, 2], :, [0, 1, 2]] = 1.0 / n
    # How the normal tilts when a point moves along it.
    arms = (about @ axes[:2].T) / (-size * extents[:2] ** 2)
    jacobian[3:6] = (axes[:2].T @ arms.T)[:, :, None] * normal
    geometry = element(centroid, normal)
    return make_fit(
        shape, geometry, jacobian.reshape(GEOMETRY_SIZE, 3 * n), size * (about @ normal)
    )
