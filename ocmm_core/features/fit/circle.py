"""A circle in space: a plane first, then the circle in it (the two steps of NIST and of ISO)."""

from __future__ import annotations

import numpy as np

from ocmm_core.features.fit.ball import fit_ball
from ocmm_core.features.fit.common import centred, checked_points
from ocmm_core.features.fit.plane import plane_of
from ocmm_core.features.shapes import GEOMETRY_SIZE, Fit, Shape, element, make_fit
from ocmm_core.geometry import Float, Points3, perpendicular_pair, unit


def fit_circle(points: Points3, direction_hint: Float | None = None) -> Fit:
    """Return the circle in the orthogonal-distance plane of ``points`` (n, 3), mm.

    Residuals are radial, in the plane, positive outside.

    Raises
    ------
    FitError
        Too few points, or they do not determine a circle.
    """
    points = checked_points(Shape.CIRCLE, points)
    plane = plane_of(Shape.CIRCLE, points, direction_hint)
    fit, _ = _circle_in_plane(points, plane.direction)
    jacobian = fit.jacobian.copy()
    jacobian[3:6] = plane.jacobian[3:6]
    # A tilt of the plane moves a centre that is not the centroid out of it; how it shears the
    # points within the plane is of the order of the residuals and left out (`shapes.Fit`).
    lift = -np.outer(plane.direction, fit.point - plane.point)
    jacobian[0:3] += lift @ plane.jacobian[3:6]
    return make_fit(Shape.CIRCLE, fit.geometry, jacobian, fit.residuals)


def fit_circle_projected(points: Points3, plane_normal: Float) -> tuple[Fit, Float]:
    """Return the circle of ``points`` projected along ``plane_normal``.

    The circle lies in the plane through the centroid of the points, square to the normal.

    Parameters
    ----------
    points
        (n, 3), mm.
    plane_normal
        (3,), any length; the direction of the result.

    Returns
    -------
    fit
        Its jacobian takes the normal as given.
    by_normal
        (12, 3): d(geometry) / d(unit normal), for changes square to the normal.

    Raises
    ------
    FitError
        Too few points, or they do not determine a circle.
    """
    points = checked_points(Shape.CIRCLE, points)
    return _circle_in_plane(points, unit(np.asarray(plane_normal, dtype=np.float64)))


def _circle_in_plane(points: Points3, normal: Float) -> tuple[Fit, Float]:
    n = len(points)
    centroid = points.mean(axis=0)
    arms = points - centroid
    heights = arms @ normal
    basis = np.stack(perpendicular_pair(normal))
    middle, about, size = centred(Shape.CIRCLE, arms @ basis.T)
    ball = fit_ball(Shape.CIRCLE, about)

    centre = centroid + (middle + size * ball.centre) @ basis
    geometry = element(centre, normal, size * ball.radius)
    radial = ball.normals @ basis
    jacobian = np.zeros((GEOMETRY_SIZE, n, 3))
    by_shift = np.zeros((GEOMETRY_SIZE, n))
    by_shift[0:3] = basis.T @ ball.jacobian[:2]
    by_shift[6] = ball.jacobian[2]
    jacobian += by_shift[:, :, None] * radial
    jacobian[0:3] += np.outer(normal, normal)[:, None, :] / n

    # A turn of the normal shifts every projection by its height, and the plane about the centroid.
    by_normal = -(by_shift * heights) @ radial
    by_normal[0:3] -= np.outer(normal, centre - centroid)
    by_normal[3:6] = np.eye(3) - np.outer(normal, normal)
    fit = make_fit(
        Shape.CIRCLE, geometry, jacobian.reshape(GEOMETRY_SIZE, 3 * n), size * ball.residuals
    )
    return fit, by_normal
