"""A sphere by orthogonal distance."""

from __future__ import annotations

import numpy as np

from ocmm_core.features.fit.ball import fit_ball
from ocmm_core.features.fit.common import centred, checked_points
from ocmm_core.features.fit.point_kernel import spread
from ocmm_core.features.shapes import (
    GEOMETRY_SIZE,
    POINT,
    RADIUS,
    Fit,
    Shape,
    element,
    make_fit,
)
from ocmm_core.geometry import Points3


def fit_sphere(points: Points3) -> Fit:
    """Return the sphere through ``points`` (n, 3), mm; residuals are positive outside.

    Raises
    ------
    FitError
        Too few points, or they do not determine a sphere.
    """
    points = checked_points(Shape.SPHERE, points)
    centroid, about, size = centred(Shape.SPHERE, points)
    ball = fit_ball(Shape.SPHERE, about)
    n = len(points)
    gain = np.zeros((GEOMETRY_SIZE, ball.gain.shape[1]))
    gain[POINT], gain[RADIUS] = ball.gain[:3], ball.gain[3]
    jacobian = np.zeros((GEOMETRY_SIZE, 3 * n))
    spread(gain, ball.shifts, ball.normals, np.zeros((GEOMETRY_SIZE, 3)), jacobian)
    geometry = element(centroid + size * ball.centre, radius=size * ball.radius)
    return make_fit(Shape.SPHERE, geometry, jacobian, size * ball.residuals)
