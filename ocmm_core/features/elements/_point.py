from __future__ import annotations

import numpy as np

from ocmm_core.features.search import checked_points
from ocmm_core.features.shapes import GEOMETRY_SIZE, Fit, Shape, make_fit
from ocmm_core.geometry import Points3


def fit_point(points: Points3) -> Fit:
    """Return the mean of ``points`` (n, 3), mm, with nonnegative residuals; or raise FitError."""
    points = checked_points(Shape.POINT, points)
    n = len(points)
    geometry = np.zeros(GEOMETRY_SIZE)
    geometry[:3] = points.mean(axis=0)
    jacobian = np.zeros((GEOMETRY_SIZE, 3 * n))
    jacobian[:3] = np.tile(np.eye(3) / n, n)
    residuals = np.linalg.norm(points - geometry[:3], axis=1)
    return make_fit(Shape.POINT, geometry, jacobian, residuals)
