"""Orthogonal-distance least-squares fits, one module a shape, all of them started cold."""

from __future__ import annotations

from dataclasses import replace

from ocmm_core.features.elements import (
    distance_derivatives,
    fit_circle,
    fit_circle_free,
    fit_circle_projected,
    fit_cone,
    fit_cylinder,
    fit_ellipse,
    fit_ellipse_projected,
    fit_line,
    fit_plane,
    fit_point,
    fit_slot,
    fit_slot_projected,
    fit_sphere,
    fit_torus,
    surface_normals,
)
from ocmm_core.features.search import sizes_in_words, unambiguous, with_rival
from ocmm_core.features.shapes import Criterion, Fit, Shape
from ocmm_core.features.zones import (
    Certificate,
    certificate,
    fit_bounded,
    fit_zone,
    fit_zone_line_in_plane,
)
from ocmm_core.geometry import Float, Points3

__all__ = [
    "Certificate",
    "associate",
    "certificate",
    "distance_derivatives",
    "fit_bounded",
    "fit_circle",
    "fit_circle_free",
    "fit_circle_projected",
    "fit_cone",
    "fit_cylinder",
    "fit_ellipse",
    "fit_ellipse_projected",
    "fit_line",
    "fit_plane",
    "fit_point",
    "fit_shape",
    "fit_slot",
    "fit_slot_projected",
    "fit_sphere",
    "fit_torus",
    "fit_zone",
    "fit_zone_line_in_plane",
    "sizes_in_words",
    "surface_normals",
    "unambiguous",
]


def fit_shape(
    shape: Shape,
    points: Points3,
    *,
    direction_hint: Float | None = None,
    radius_hint: float | None = None,
    second_hint: float | None = None,
    half_angle_hint: float | None = None,
    criterion: Criterion = Criterion.LEAST_SQUARES,
    free: bool = False,
) -> Fit:
    """Return ``shape`` associated with ``points``.

    Parameters
    ----------
    shape
        What to fit.
    points
        (n, 3), mm, in any order, anywhere in space.
    direction_hint
        (3,): the direction of the result points along it; without it the largest component is
        positive. It never changes where the element lies. A cone has a direction of its own.
    radius_hint, second_hint, half_angle_hint
        mm, mm, rad: may decide between rivals (`Fit.rival`); else not used.
    criterion
        How the element is associated; every other one starts from least squares.
    free
        Circle only: in space as one problem, not plane first.

    Returns
    -------
    The best element, and in `Fit.rival` another one that the points do not rule out. `unambiguous`
    refuses such a fit.

    Raises
    ------
    FitError
        The points do not determine the shape, or the criterion is not offered for it; the
        sentence says why.
    """
    if criterion is not Criterion.LEAST_SQUARES:
        start = fit_shape(
            shape, points, direction_hint=direction_hint, radius_hint=radius_hint,
            second_hint=second_hint, half_angle_hint=half_angle_hint, free=free,
        )  # fmt: skip
        return associate(start, points, criterion)
    sizes = None
    if radius_hint is not None and second_hint is not None:
        sizes = (radius_hint, second_hint)
    match shape:
        case Shape.POINT:
            return fit_point(points)
        case Shape.LINE:
            return fit_line(points, direction_hint)
        case Shape.PLANE:
            return fit_plane(points, direction_hint)
        case Shape.CIRCLE:
            fit = fit_circle_free if free else fit_circle
            return fit(points, direction_hint)
        case Shape.SPHERE:
            return fit_sphere(points)
        case Shape.CYLINDER:
            return fit_cylinder(points, direction_hint, radius_hint)
        case Shape.ELLIPSE:
            return fit_ellipse(points, direction_hint)
        case Shape.ROUND_SLOT | Shape.SQUARE_SLOT | Shape.RECTANGLE:
            return fit_slot(shape, points, direction_hint, sizes)
        case Shape.CONE:
            return fit_cone(points, half_angle_hint)
        case Shape.TORUS:
            return fit_torus(points, direction_hint, sizes)


def associate(start: Fit, points: Points3, criterion: Criterion, offset: float = 0.0) -> Fit:
    """Return the element of another criterion, from a least-squares fit and from its rival.

    Parameters
    ----------
    start
        Least squares.
    points
        (n, 3), mm.
    criterion
        Any but least squares.
    offset
        As for `fit_zone`.

    Raises
    ------
    FitError
        See `fit_zone` and `fit_bounded`.
    """
    if start.rival is not None:
        first = associate(replace(start, rival=None), points, criterion, offset)
        return with_rival(first, associate(start.rival, points, criterion, offset))
    if criterion is Criterion.MINIMUM_ZONE:
        return fit_zone(start, points, offset)
    return fit_bounded(start, points, criterion)
