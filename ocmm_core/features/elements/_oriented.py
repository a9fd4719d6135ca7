"""Elements with a given direction, or one that turns about a given axis.

A secondary datum is associated with its points under the orientation left by the primary one (ISO
5459): a face square to another one only turns about that one's normal. The remaining tilt of the
points stays in the residuals, which are then not small; planes and lines are therefore solved with
full curvature, also in their derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.elements._ball import WORST_CONDITION
from ocmm_core.features.elements._oriented_search import (
    STEPS,
    OrientedSearch,
    small_turning,
    unsettled,
)
from ocmm_core.features.search import centred, checked_points, degenerate
from ocmm_core.features.shapes import (
    DIRECTION,
    GEOMETRY_SIZE,
    POINT,
    Criterion,
    Fit,
    Shape,
    element,
    make_fit,
)
from ocmm_core.geometry import Float, Points3, rotation_from_vector

_SETTLED = 1e-12
"""Rotation, rad, at convergence."""


@dataclass(frozen=True, slots=True)
class Turned:
    """A direction optimised by rotation about an axis."""

    direction: Float
    """(3,), unit."""
    by_points: Float
    """(3, 3 n): d(direction) / d(points)."""
    by_turn: Float
    """(3, 3): d(direction) / d(small rotation of the axis and all directions, rad)."""


def fixed_direction(direction: Float, count: int) -> Turned:
    """Return a direction independent of the points."""
    return Turned(direction, np.zeros((3, 3 * count)), small_turning(direction))


def turned_direction(
    shape: Shape, points: Points3, start: Float, about: Float, *, along: bool = False
) -> Turned:
    """Return the direction of least, or most, scatter of points as it turns about an axis.

    ``start`` (3,), unit, rotated about ``about`` (3,), unit, gives all permitted directions;
    ``along``: it is that of a line, not the normal of a plane. FitError if undetermined.
    """
    _, about_middle, size = centred(shape, points)
    direction = start
    for _ in range(STEPS):
        y, across = about_middle @ direction, np.cross(about, direction)
        v = about_middle @ across
        # The second derivative of a rotating direction points back to the axis.
        bent = about_middle @ np.cross(about, across)
        slope, curvature = float(y @ v), float(v @ v + y @ bent)
        if (-curvature if along else curvature) <= len(y) / WORST_CONDITION:
            raise degenerate(
                shape,
                "they do not determine its rotation about the preceding datums",
                "Take the points further apart, square to the direction of those datums.",
            )
        step = -slope / curvature
        direction = rotation_from_vector(step * about) @ direction
        if abs(step) < _SETTLED:
            break
    else:
        raise unsettled(shape)
    y, across = about_middle @ direction, np.cross(about, direction)
    v = about_middle @ across
    curvature = float(v @ v + y @ (about_middle @ np.cross(about, across)))
    by_points = -(np.outer(v, direction) + np.outer(y, across)).ravel() / (size * curvature)
    # A small rotation of the whole family: its slope changes via both factors.
    by_family = v @ np.cross(direction, about_middle) + y @ np.cross(across, about_middle)
    by_turn = small_turning(direction) - np.outer(across, by_family) / curvature
    return Turned(direction, np.outer(across, by_points), by_turn)


def fit_oriented(
    start: Fit, points: Points3, direction: Float, about: Float | None
) -> tuple[Fit, Float]:
    """Return the element of points with a direction that is fixed or turns about an axis.

    Parameters
    ----------
    start
        Unconstrained element of the same points, with shape and criterion to keep. Plane, line,
        circle, cylinder, cone or torus.
    points
        (n, 3), mm.
    direction
        (3,), unit: the direction, or a permitted one near that of ``start``.
    about
        (3,), unit: axis of free rotation; None if fixed.

    Returns
    -------
    fit
        Its jacobian treats the constraint as constant.
    by_turn
        (12, 3): d(geometry) / d(small rotation of the constraint, rad).

    Raises
    ------
    FitError
        The points do not determine the element, or a line has another criterion than least squares.
    """
    points = checked_points(start.shape, points)
    if start.shape is Shape.LINE or (
        start.shape is Shape.PLANE and start.criterion is Criterion.LEAST_SQUARES
    ):
        return _flat_or_straight(start, points, direction, about)
    if start.shape is Shape.CIRCLE and about is not None:
        # The plane of a circle comes first, for any criterion in it.
        turned = turned_direction(start.shape, points, direction, about)
        fit, by_turn = fit_oriented(start, points, turned.direction, None)
        # Motion of the direction acts on the circle like a rotation of the constraint.
        turning = np.cross(turned.direction, turned.by_points, axis=0)
        jacobian = fit.jacobian + by_turn @ turning
        carried = by_turn @ np.cross(turned.direction, turned.by_turn, axis=0)
        return replace(fit, jacobian=jacobian), carried
    return OrientedSearch(start, points, direction, about).found()


def _flat_or_straight(
    start: Fit, points: Points3, direction: Float, about: Float | None
) -> tuple[Fit, Float]:
    shape, n = start.shape, len(points)
    if start.criterion is not Criterion.LEAST_SQUARES:
        raise FitError(
            "fit.oriented_criterion",
            f"A {shape.value.lower()} with a given direction supports least squares only.",
            "Choose least squares for that feature.",
        )
    turned = fixed_direction(direction, n)
    if about is not None:
        turned = turned_direction(shape, points, direction, about, along=shape is Shape.LINE)
    jacobian, by_turn = np.zeros((GEOMETRY_SIZE, 3 * n)), np.zeros((GEOMETRY_SIZE, 3))
    jacobian[POINT] = np.tile(np.eye(3) / n, n)
    jacobian[DIRECTION], by_turn[DIRECTION] = turned.by_points, turned.by_turn
    middle = points.mean(axis=0)
    arms = points - middle
    along = arms @ turned.direction
    residuals = along
    if shape is Shape.LINE:
        across = arms - np.outer(along, turned.direction)
        widest = np.linalg.svd(across, full_matrices=False)[2][0]
        residuals = np.linalg.norm(across, axis=1) * np.where(across @ widest < 0.0, -1.0, 1.0)
    fit = make_fit(shape, element(middle, turned.direction), jacobian, residuals)
    return fit, by_turn
