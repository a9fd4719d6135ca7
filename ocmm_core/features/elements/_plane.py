"""A plane: the two greater principal axes of its points span it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.features.search import (
    FLAT,
    centred,
    checked_points,
    degenerate,
    oriented,
    places,
    principal_axes,
    spread_alike,
)
from ocmm_core.features.shapes import DIRECTION, GEOMETRY_SIZE, POINT, Fit, Shape, element, make_fit
from ocmm_core.geometry import Float, Points3

THICKEST = 0.5
"""Third extent against the second beyond which a cloud of points has no plane."""


def fit_plane(points: Points3, direction_hint: Float | None = None) -> Fit:
    """Return the orthogonal-distance plane of ``points`` (n, 3), mm; FitError if undetermined."""
    points = checked_points(Shape.PLANE, points)
    plane = own_plane(Shape.PLANE, points, direction_hint)
    n = len(points)
    normal = plane.axes[2]
    turning, constant = np.zeros((GEOMETRY_SIZE, 2, 3)), np.zeros((GEOMETRY_SIZE, 3))
    turning[DIRECTION] = plane.tilt[:, :, None] * normal
    constant[POINT].flat[::4] = 1.0 / n
    jacobian = np.empty((GEOMETRY_SIZE, 3 * n))
    spread_alike(turning, plane.shifts, constant, jacobian)
    residuals = plane.about @ (plane.size * normal)
    return make_fit(Shape.PLANE, element(plane.centroid, normal), jacobian, residuals)


@dataclass(frozen=True, slots=True)
class OwnPlane:
    """The plane of some points."""

    centroid: Float
    """(3,), mm."""
    about: Float
    """(n, 3): points about it, divided by their size."""
    size: float
    """mm."""
    axes: Float
    """(3, 3), by rows: the two greater principal axes, and the oriented normal."""
    shifts: Float
    """(n, 2): places of the points along the two axes."""
    tilt: Float
    """(3, 2): d(normal) / d(shifts of the points along the normal), by ``shifts``."""


def own_plane(shape: Shape, points: Points3, direction_hint: Float | None) -> OwnPlane:
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
            "their scatter across the plane is nearly as large as their extent in it",
            "Take the points further apart, not along one line.",
        )
    axes[2] = oriented(axes[2], direction_hint)
    shifts = np.empty((2, len(about))).T
    places(about, axes, shifts)
    tilt = axes[:2].T / (-size * extents[:2] ** 2)
    return OwnPlane(centroid, about, size, axes, shifts, tilt)
