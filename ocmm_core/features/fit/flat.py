"""What circle, ellipse, slots and rectangle share: a plane first, then the outline in it.

These are the two steps of NIST and of ISO. The outline is found in coordinates of the plane,
centred and scaled; here it is taken back to space, with its derivatives.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ocmm_core.features.fit.common import centred, checked_points, oriented
from ocmm_core.features.fit.plane import plane_of
from ocmm_core.features.shapes import (
    ACROSS,
    DIRECTION,
    GEOMETRY_SIZE,
    POINT,
    RADIUS,
    SECOND,
    Fit,
    Shape,
    element,
    make_fit,
)
from ocmm_core.geometry import Float, Points3, perpendicular_pair, unit


@dataclass(frozen=True, slots=True)
class Outline:
    """A closed outline in the plane.

    Attributes
    ----------
    centre
        (2,).
    radius, second
        As in the geometry vector; ``second`` is zero for a circle.
    turn
        rad: direction of the length; None for a circle.
    normals
        (n, 2): unit vectors, outwards, at the points.
    residuals
        (n,): positive outside.
    jacobian
        (5, n): d(centre, turn, radius, second) / d(shift of a point along its normal).
    """

    centre: Float
    radius: float
    second: float
    turn: float | None
    normals: Float
    residuals: Float
    jacobian: Float


OutlineFit: TypeAlias = Callable[[Float, float], Outline]
"""Finds the outline of centred points (n, 2), given also their size in mm."""


def fit_in_own_plane(
    shape: Shape, points: Points3, direction_hint: Float | None, outline_fit: OutlineFit
) -> Fit:
    """Return the outline in the orthogonal-distance plane of ``points`` (n, 3), mm.

    Raises
    ------
    FitError
        Too few points, or they do not determine the shape.
    """
    points = checked_points(shape, points)
    plane = plane_of(shape, points, direction_hint)
    fit, _ = _in_plane(shape, points, plane.direction, outline_fit)
    jacobian = fit.jacobian
    tilt = plane.jacobian[DIRECTION]
    jacobian[DIRECTION] = tilt
    # A tilt of the plane moves a centre that is not the centroid out of it, and takes the direction
    # of the length along; how it shears the points within the plane is of the order of the
    # residuals and left out (`shapes.Fit`).
    jacobian[POINT] -= np.outer(plane.direction, (fit.point - plane.point) @ tilt)
    if fit.across.any():
        jacobian[ACROSS] -= np.outer(plane.direction, fit.across @ tilt)
    return fit


def fit_in_given_plane(
    shape: Shape, points: Points3, plane_normal: Float, outline_fit: OutlineFit
) -> tuple[Fit, Float]:
    """Return the outline of ``points`` projected along ``plane_normal``.

    It lies in the plane through the centroid of the points, square to the normal.

    Parameters
    ----------
    shape
        Which of those with an outline.
    points
        (n, 3), mm.
    plane_normal
        (3,), any length; the direction of the result.
    outline_fit
        Finds the outline.

    Returns
    -------
    fit
        Its jacobian takes the normal as given.
    by_normal
        (12, 3): d(geometry) / d(unit normal), for changes square to the normal.

    Raises
    ------
    FitError
        Too few points, or they do not determine the shape.
    """
    points = checked_points(shape, points)
    normal = unit(np.asarray(plane_normal, dtype=np.float64))
    return _in_plane(shape, points, normal, outline_fit)


def _in_plane(
    shape: Shape, points: Points3, normal: Float, outline_fit: OutlineFit
) -> tuple[Fit, Float]:
    n = len(points)
    # Far from the origin a projection would round like a coordinate there.
    corner = points[0]
    basis = np.stack(perpendicular_pair(normal))
    arms = points - corner
    middle, about, size = centred(shape, arms @ basis.T)
    height = arms @ normal
    outline = outline_fit(about, size)

    centroid = corner + middle @ basis + height.mean() * normal
    lever = (size * outline.centre) @ basis
    geometry = element(centroid + lever, normal, size * outline.radius)
    geometry[SECOND] = size * outline.second
    by_shift = np.zeros((GEOMETRY_SIZE, n))
    by_shift[POINT] = basis.T @ outline.jacobian[0:2]
    by_shift[RADIUS] = outline.jacobian[3]
    by_normal = np.zeros((GEOMETRY_SIZE, 3))
    if outline.turn is not None:
        by_shift[SECOND] = outline.jacobian[4]
        across = oriented(
            np.cos(outline.turn) * basis[0] + np.sin(outline.turn) * basis[1], None
        )
        geometry[ACROSS] = across
        by_shift[ACROSS] = np.outer(np.cross(normal, across), outline.jacobian[2] / size)
        by_normal[ACROSS] = -np.outer(normal, across)
    outward = outline.normals @ basis
    jacobian = by_shift[:, :, None] * outward
    jacobian[POINT] += np.outer(normal, normal)[:, None, :] / n

    # A turn of the normal shifts every projection by its height, and the plane about the centroid.
    by_normal -= (by_shift * (height - height.mean())) @ outward
    by_normal[POINT] -= np.outer(normal, lever)
    by_normal[DIRECTION] = np.eye(3) - np.outer(normal, normal)
    fit = make_fit(
        shape, geometry, jacobian.reshape(GEOMETRY_SIZE, 3 * n), size * outline.residuals
    )
    return fit, by_normal
