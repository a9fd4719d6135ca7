"""Circle in space: plane first, then the circle in it, or both as one problem.

The two steps are the convention of NIST and ISO. As one problem (PTB), the squared distances of the
points from the circle in space are minimised, including those square to its plane.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ocmm_core.features.elements._ball import WORST_CONDITION, fit_balls, not_converged
from ocmm_core.features.elements._flat import Outline, fit_in_given_plane, fit_in_own_plane
from ocmm_core.features.search import (
    RING,
    across_axes,
    centred,
    covered,
    degenerate,
    derivatives,
    minimise,
    same,
    sensitivity,
)
from ocmm_core.features.shapes import GEOMETRY_SIZE, Fit, Shape, element, make_fit
from ocmm_core.geometry import Float, Points3


def fit_circle(points: Points3, direction_hint: Float | None = None) -> Fit:
    """Return the circle in the orthogonal-distance plane of ``points`` (n, 3), mm.

    Residuals are radial, positive outside. FitError if the points do not determine a circle.
    """
    return fit_in_own_plane(Shape.CIRCLE, points, direction_hint, _outline)


def fit_circle_projected(points: Points3, plane_normal: Float) -> tuple[Fit, Float]:
    """Return the circle of ``points`` projected along a normal; see `flat.fit_in_given_plane`."""
    return fit_in_given_plane(Shape.CIRCLE, points, plane_normal, _outline)


def fit_circle_free(points: Points3, direction_hint: Float | None = None) -> Fit:
    """Return the circle in space nearest to ``points`` (n, 3), mm, in one problem.

    Residuals are distances from it, including those square to its plane, positive outside the
    cylinder through the circle. FitError if undetermined.
    """
    two_steps = fit_circle(points, direction_hint)
    points = np.ascontiguousarray(points, dtype=np.float64)
    first = _free(two_steps, points)
    if two_steps.rival is None:
        return first
    first, second = sorted((first, _free(two_steps.rival, points)), key=lambda fit: fit.rms)
    if same(first, second) or covered(first, second):
        return first
    return replace(first, rival=second)


def _free(two_steps: Fit, points: Points3) -> Fit:
    """Return the circle in space reached from a two-step one."""
    centroid, about, size = centred(Shape.CIRCLE, points)
    n = len(points)
    centre = (two_steps.point - centroid) / size
    start = np.concatenate([centre, two_steps.direction, [two_steps.radius / size, 0.0]])
    solution = minimise(RING, about, start)
    if not solution.converged:
        raise not_converged(Shape.CIRCLE)
    p = solution.parameters
    residuals, jacobian, _ = derivatives(RING, about, p)
    inverse, condition = sensitivity(jacobian)
    if condition > WORST_CONDITION:
        raise degenerate(
            Shape.CIRCLE,
            "they lie on a straight line or too short an arc",
            "Spread the points over more of the feature.",
        )
    axis = p[3:6]
    basis = np.stack([*across_axes(axis), axis])
    by_shift = np.zeros((GEOMETRY_SIZE, 2 * n))
    by_shift[0:3] = -basis.T @ inverse[0:3]
    by_shift[3:6] = -basis[0:2].T @ inverse[3:5] / size
    by_shift[6] = -inverse[5]
    outward = -jacobian[:n, 0:2] @ basis[0:2]
    by_points = by_shift[:, :n, None] * outward + by_shift[:, n:, None] * axis
    geometry = element(centroid + size * p[0:3], axis, size * p[6])
    away = np.copysign(np.hypot(residuals[:n], residuals[n:]), residuals[:n])
    fit = make_fit(Shape.CIRCLE, geometry, by_points.reshape(GEOMETRY_SIZE, 3 * n), size * away)
    return replace(fit, free=True)


def _outline(points: Float, _size: float) -> list[Outline]:
    outlines = []
    for ball in fit_balls(Shape.CIRCLE, points):
        gain = np.zeros((5, ball.gain.shape[1]))
        gain[0:2], gain[3] = ball.gain[0:2], ball.gain[2]
        outlines.append(
            Outline(
                ball.centre, ball.radius, 0.0, None, ball.normals, ball.residuals, gain, ball.shifts
            )
        )
    return outlines
