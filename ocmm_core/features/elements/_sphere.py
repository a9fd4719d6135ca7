from __future__ import annotations

from dataclasses import replace

import numpy as np

from ocmm_core.features.elements._ball import Ball, fit_balls
from ocmm_core.features.search import centred, checked_points, covered, spread
from ocmm_core.features.shapes import GEOMETRY_SIZE, POINT, RADIUS, Fit, Shape, element, make_fit
from ocmm_core.geometry import Float, Points3


def fit_sphere(points: Points3) -> Fit:
    """Return the sphere of ``points`` (n, 3), mm; residuals positive outside; or raise FitError."""
    points = checked_points(Shape.SPHERE, points)
    centroid, about, size = centred(Shape.SPHERE, points)
    fits = [_fit(ball, centroid, size) for ball in fit_balls(Shape.SPHERE, about)]
    first, *others = fits
    return replace(first, rival=next((fit for fit in others if not covered(first, fit)), None))


def _fit(ball: Ball, centroid: Float, size: float) -> Fit:
    n = len(ball.residuals)
    gain = np.zeros((GEOMETRY_SIZE, ball.gain.shape[1]))
    gain[POINT], gain[RADIUS] = ball.gain[:3], ball.gain[3]
    jacobian = np.zeros((GEOMETRY_SIZE, 3 * n))
    spread(gain, ball.shifts, ball.normals, np.zeros((GEOMETRY_SIZE, 3)), jacobian)
    geometry = element(centroid + size * ball.centre, radius=size * ball.radius)
    return make_fit(Shape.SPHERE, geometry, jacobian, size * ball.residuals)
