"""How the residuals of a fit move with the points: the base of every statement on form."""

from __future__ import annotations

import numpy as np

from ocmm_core.features.shapes import Fit, Shape
from ocmm_core.geometry import Float, Points3


def residual_jacobian(fit: Fit, points: Points3, jacobian: Float) -> Float:
    """Return d(residuals) / d(coordinates), (n, m), first order in the residuals.

    Parameters
    ----------
    fit
        Fit of ``points``.
    points
        (n, 3), mm.
    jacobian
        (7, m): d(geometry of the fit) / d(coordinates); the first 3 n coordinates are those of
        ``points``, row by row.
    """
    arms = points - fit.point
    along = np.zeros(len(points))
    if fit.shape is Shape.PLANE:
        normals = np.tile(fit.direction, (len(points), 1))
    else:
        if fit.shape in (Shape.LINE, Shape.CIRCLE, Shape.CYLINDER):
            along = arms @ fit.direction
        across = arms - np.outer(along, fit.direction)
        distances = np.linalg.norm(across, axis=1)
        sides = np.where(fit.residuals < 0.0, -1.0, 1.0) if fit.shape is Shape.LINE else 1.0
        # On a line itself the distance has no derivative; zero leaves such a point out.
        normals = across * (sides / np.maximum(distances, 1e-12))[:, None]
    moved: Float = -normals @ jacobian[0:3] - jacobian[6]
    if fit.shape is Shape.PLANE:
        moved += arms @ jacobian[3:6]
    else:
        moved -= along[:, None] * (normals @ jacobian[3:6])
    rows = np.arange(len(points))
    for axis in range(3):
        moved[rows, 3 * rows + axis] += normals[:, axis]
    return moved
