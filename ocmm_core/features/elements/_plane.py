"""Points, lines, planes and spheres.

Principal axes give a line, and the two greater ones span a plane; a sphere is the ball in three
dimensions.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.features import search, shapes
from ocmm_core.features.elements._ball import Ball, fit_balls
from ocmm_core.geometry import Float, Points3


def fit_point(points: Points3) -> shapes.Fit:
    """Return the mean of ``points`` (n, 3), mm, with nonnegative residuals; or raise FitError."""
    points = search.checked_points(shapes.Shape.POINT, points)
    n = len(points)
    geometry = np.zeros(shapes.GEOMETRY_SIZE)
    geometry[:3] = points.mean(axis=0)
    jacobian = np.zeros((shapes.GEOMETRY_SIZE, 3 * n))
    jacobian[:3] = np.tile(np.eye(3) / n, n)
    residuals = np.linalg.norm(points - geometry[:3], axis=1)
    return shapes.make_fit(shapes.Shape.POINT, geometry, jacobian, residuals)


ROUNDEST = 0.5
"""Ratio of second to first extent beyond which points have no direction."""


def fit_line(points: Points3, direction_hint: Float | None = None) -> shapes.Fit:
    """Return the orthogonal-distance line through ``points`` (n, 3), mm.

    A line in space has no sides; residuals are signed along the direction of most scatter across
    the line. `Fit.form` is the diameter of the thinnest cylinder along the line about the points,
    an upper bound of the smallest zone. FitError if the points do not determine a direction.
    """
    points = search.checked_points(shapes.Shape.LINE, points)
    centroid, about, size = search.centred(shapes.Shape.LINE, points)
    extents, axes = search.principal_axes(about)
    if len(about) > 2 and extents[1] > ROUNDEST * extents[0]:
        raise search.degenerate(
            shapes.Shape.LINE,
            "they are nearly as broad as they are long",
            "Take the points further apart along the line.",
        )
    axes[0] = search.oriented(axes[0], direction_hint)
    n = len(points)
    along, residuals = np.empty((n, 1)), np.empty(n)
    search.line_distances(about, axes, along[:, 0], residuals)

    # A point moves the direction by its component across the line.
    turning, constant = np.zeros((shapes.GEOMETRY_SIZE, 1, 3)), np.zeros((shapes.GEOMETRY_SIZE, 3))
    turning[shapes.DIRECTION, 0] = axes[1:].T @ axes[1:] / (size * extents[0] ** 2)
    constant[shapes.POINT].flat[::4] = 1.0 / n
    jacobian = np.empty((shapes.GEOMETRY_SIZE, 3 * n))
    search.spread_alike(turning, along, constant, jacobian)
    fit = shapes.make_fit(
        shapes.Shape.LINE, shapes.element(centroid, axes[0]), jacobian, size * residuals
    )
    return replace(fit, form=size * float(search.narrowest_tube(about, axes)))


THICKEST = 0.5
"""Third extent against the second beyond which a cloud of points has no plane."""


def fit_plane(points: Points3, direction_hint: Float | None = None) -> shapes.Fit:
    """Return the orthogonal-distance plane of ``points`` (n, 3), mm; FitError if undetermined."""
    points = search.checked_points(shapes.Shape.PLANE, points)
    plane = own_plane(shapes.Shape.PLANE, points, direction_hint)
    n = len(points)
    normal = plane.axes[2]
    turning, constant = np.zeros((shapes.GEOMETRY_SIZE, 2, 3)), np.zeros((shapes.GEOMETRY_SIZE, 3))
    turning[shapes.DIRECTION] = plane.tilt[:, :, None] * normal
    constant[shapes.POINT].flat[::4] = 1.0 / n
    jacobian = np.empty((shapes.GEOMETRY_SIZE, 3 * n))
    search.spread_alike(turning, plane.shifts, constant, jacobian)
    residuals = plane.about @ (plane.size * normal)
    return shapes.make_fit(
        shapes.Shape.PLANE, shapes.element(plane.centroid, normal), jacobian, residuals
    )


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


def own_plane(shape: shapes.Shape, points: Points3, direction_hint: Float | None) -> OwnPlane:
    """Return the plane through checked ``points``; errors speak of ``shape``."""
    centroid, about, size = search.centred(shape, points)
    extents, axes = search.principal_axes(about)
    if extents[1] < search.FLAT * extents[0]:
        raise search.degenerate(
            shape, "they lie on a straight line", "Take at least one point beside that line."
        )
    if extents[2] > THICKEST * extents[1]:
        raise search.degenerate(
            shape,
            "their scatter across the plane is nearly as large as their extent in it",
            "Take the points further apart, not along one line.",
        )
    axes[2] = search.oriented(axes[2], direction_hint)
    shifts = np.empty((2, len(about))).T
    search.places(about, axes, shifts)
    tilt = axes[:2].T / (-size * extents[:2] ** 2)
    return OwnPlane(centroid, about, size, axes, shifts, tilt)


def fit_sphere(points: Points3) -> shapes.Fit:
    """Return the sphere of ``points`` (n, 3), mm; residuals positive outside; or raise FitError."""
    points = search.checked_points(shapes.Shape.SPHERE, points)
    centroid, about, size = search.centred(shapes.Shape.SPHERE, points)
    fits = [_fit(ball, centroid, size) for ball in fit_balls(shapes.Shape.SPHERE, about)]
    first, *others = fits
    return replace(
        first, rival=next((fit for fit in others if not search.covered(first, fit)), None)
    )


def _fit(ball: Ball, centroid: Float, size: float) -> shapes.Fit:
    n = len(ball.residuals)
    gain = np.zeros((shapes.GEOMETRY_SIZE, ball.gain.shape[1]))
    gain[shapes.POINT], gain[shapes.RADIUS] = ball.gain[:3], ball.gain[3]
    jacobian = np.zeros((shapes.GEOMETRY_SIZE, 3 * n))
    search.spread(gain, ball.shifts, ball.normals, np.zeros((shapes.GEOMETRY_SIZE, 3)), jacobian)
    geometry = shapes.element(centroid + size * ball.centre, radius=size * ball.radius)
    return shapes.make_fit(shapes.Shape.SPHERE, geometry, jacobian, size * ball.residuals)
