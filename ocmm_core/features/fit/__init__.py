"""Orthogonal-distance least-squares fits, one module a shape, all of them started cold."""

from __future__ import annotations

from ocmm_core.features.fit.circle import fit_circle, fit_circle_projected
from ocmm_core.features.fit.cylinder import fit_cylinder
from ocmm_core.features.fit.distances import distance_derivatives
from ocmm_core.features.fit.line import fit_line
from ocmm_core.features.fit.plane import fit_plane
from ocmm_core.features.fit.point import fit_point
from ocmm_core.features.fit.sphere import fit_sphere
from ocmm_core.features.shapes import Fit, Shape
from ocmm_core.geometry import Float, Points3

__all__ = [
    "distance_derivatives",
    "fit_circle",
    "fit_circle_projected",
    "fit_cylinder",
    "fit_line",
    "fit_plane",
    "fit_point",
    "fit_shape",
    "fit_sphere",
]


def fit_shape(
    shape: Shape,
    points: Points3,
    *,
    direction_hint: Float | None = None,
    radius_hint: float | None = None,
) -> Fit:
    """Return the least-squares fit of ``shape`` to ``points``.

    Parameters
    ----------
    shape
        What to fit.
    points
        (n, 3), mm, in any order, anywhere in space.
    direction_hint
        (3,): the direction of the result points along it; without it the largest component is
        positive. It never changes where the element lies.
    radius_hint
        mm: may decide between cylinders that all pass through every point; else not used.

    Raises
    ------
    FitError
        The points do not determine the shape; the sentence says why.
    """
    match shape:
        case Shape.POINT:
            return fit_point(points)
        case Shape.LINE:
            return fit_line(points, direction_hint)
        case Shape.PLANE:
            return fit_plane(points, direction_hint)
        case Shape.CIRCLE:
            return fit_circle(points, direction_hint)
        case Shape.SPHERE:
            return fit_sphere(points)
        case Shape.CYLINDER:
            return fit_cylinder(points, direction_hint, radius_hint)
