"""The fit that circle and sphere share: a ball in d dimensions, by orthogonal distance.

Start: the algebraic fit of Taubin (IEEE PAMI 13, 1991) in the centred form of N. Chernov,
Circular and Linear Regression, 2010, section 5.9, which is unbiased enough for short arcs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.fit.common import degenerate
from ocmm_core.features.fit.flat_kernel import BALL, DISC
from ocmm_core.features.fit.point_kernel import taubin
from ocmm_core.features.fit.solver import derivatives, gains, minimise
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float

LARGEST_RADIUS = 1e4
"""Radius against the size of the points beyond which they lie on a line or a plane."""

WORST_CONDITION = 1e9
"""Condition number beyond which the points determine nothing."""


@dataclass(frozen=True, slots=True)
class Ball:
    """A circle (d = 2) or sphere (d = 3).

    Attributes
    ----------
    centre
        (d,).
    radius
        Greater than zero.
    normals
        (n, d): unit vectors from the centre to the points.
    residuals
        (n,): positive outside.
    gain, shifts
        (d + 1, k) and (n, k): the first times the second transposed is d(centre, radius) /
        d(shift of a point along its normal).
    """

    centre: Float
    radius: float
    normals: Float
    residuals: Float
    gain: Float
    shifts: Float


def taubin_moments(centred_points: Float) -> tuple[Float, Float]:
    """Return the moments whose smallest eigenvector is Taubin's ball, and the mean square.

    Parameters
    ----------
    centred_points
        (..., n, d), mean zero over n.

    Returns
    -------
    moments
        (..., d + 1, d + 1); its smallest eigenvalue approximates the mean squared distance.
    mean_square
        (...,).
    """
    squares = np.sum(centred_points**2, axis=-1)
    mean_square = squares.mean(axis=-1)
    first = (squares - mean_square[..., None]) / (2.0 * np.sqrt(mean_square))[..., None]
    columns = np.concatenate([first[..., None], centred_points], axis=-1)
    moments = np.swapaxes(columns, -1, -2) @ columns / columns.shape[-2]
    return moments, mean_square


def taubin_centre(eigenvector: Float, mean_square: Float) -> tuple[Float, Float]:
    """Return centre (..., d) and radius (...,) of the eigenvector (..., d + 1)."""
    curvature = eigenvector[..., 0] / (2.0 * np.sqrt(mean_square))
    # A straight solution has no curvature; a far centre lets the callers recognise it.
    curvature = np.where(np.abs(curvature) < 1e-12, 1e-12, curvature)
    centre: Float = -eigenvector[..., 1:] / (2.0 * curvature[..., None])
    radius: Float = np.sqrt(np.sum(centre**2, axis=-1) + mean_square)
    return centre, radius


def fit_ball(shape: Shape, points: Float) -> Ball:
    """Return the ball that fits centred and scaled ``points`` (n, d) best.

    Raises
    ------
    FitError
        The points do not determine it, or the iteration does not converge.
    """
    d = points.shape[1]
    flat = degenerate(
        shape,
        "they lie on a straight line or too short an arc"
        if shape is Shape.CIRCLE
        else "they lie in a plane or on too small a patch",
        "Spread the points over more of the feature.",
    )
    moments = np.empty((d + 1, d + 1))
    mean_square = np.array(taubin(points, moments))
    centre, radius = taubin_centre(np.linalg.eigh(moments)[1][:, 0], mean_square)
    start = np.zeros(8)
    start[:d], start[d] = centre, radius
    kind = DISC if d == 2 else BALL
    solution = minimise(kind, points, start)
    radius_found = float(solution.parameters[d])
    if not 0.0 < radius_found < LARGEST_RADIUS:
        raise flat
    if not solution.converged:
        raise not_converged(shape)
    residuals, jacobian, _ = derivatives(kind, points, solution.parameters)
    gain, shifts, condition = gains(jacobian)
    if condition > WORST_CONDITION:
        raise flat
    normals = -jacobian[:, :d]
    return Ball(solution.parameters[:d], radius_found, normals, residuals, -gain, shifts)


def not_converged(shape: Shape) -> FitError:
    """Return the error for an iteration that found no minimum."""
    return FitError(
        "fit.not_converged",
        f"No {shape.value.lower()} fits the points: the iteration did not come to rest.",
        "Check that the points belong to one feature and spread them over more of it.",
    )
