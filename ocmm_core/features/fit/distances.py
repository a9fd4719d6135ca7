"""How the residuals of a fit move: the base of every statement on form."""

from __future__ import annotations

import numpy as np

from ocmm_core.features.shapes import GEOMETRY_SIZE, Fit, Shape
from ocmm_core.geometry import Float, Points3


def distance_derivatives(fit: Fit, points: Points3) -> tuple[Float, Float]:
    """Return how the signed distance of every point from the element moves, to first order.

    Parameters
    ----------
    fit
        Any fit.
    points
        (n, 3), mm; the points that were fitted, as the side of a line comes from their residuals.

    Returns
    -------
    by_geometry
        (n, 12): d(distance) / d(geometry).
    by_point
        (n, 3): d(distance) / d(the point itself): the normal of the element towards the point.
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
    by_geometry = np.zeros((len(points), GEOMETRY_SIZE))
    by_geometry[:, 0:3] = -normals
    by_geometry[:, 3:6] = arms if fit.shape is Shape.PLANE else -along[:, None] * normals
    has_radius = fit.shape in (Shape.CIRCLE, Shape.SPHERE, Shape.CYLINDER)
    by_geometry[:, 6] = -1.0 if has_radius else 0.0
    return by_geometry, normals
