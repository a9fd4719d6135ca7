"""Common part of circle, ellipse, slots and rectangle: a plane, then the outline.

These are the two steps of NIST and of ISO. The outline is found in coordinates of the plane,
centred and scaled; here it is taken back to space, with its derivatives. A circle is also fitted as
one problem (PTB): the squared distances of the points from the circle in space are minimised,
including those square to its plane.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from ocmm_core.features import search, shapes
from ocmm_core.features.elements._ball import WORST_CONDITION, fit_balls, not_converged
from ocmm_core.features.elements._plane import OwnPlane, own_plane
from ocmm_core.geometry import Float, Points3, perpendicular_pair, unit


@dataclass(frozen=True, slots=True)
class Outline:
    """A closed outline in the plane."""

    centre: Float
    """(2,)."""
    radius: float
    second: float
    """`radius`, `second`: As in the geometry vector; ``second`` is zero for a circle."""
    turn: float | None
    """rad: direction of the length; None for a circle."""
    normals: Float
    """(n, 2): unit vectors, outwards, at the points."""
    residuals: Float
    """(n,): positive outside."""
    gain: Float
    shifts: Float
    """`gain`, `shifts`: (5, k) and (n, k): the first times the second transposed is d(centre, turn,
    radius, second) / d(shift of a point along its normal)."""


_NOTHING = np.zeros((shapes.GEOMETRY_SIZE, 3))

OutlineFit: TypeAlias = Callable[[Float, float], Sequence[Outline]]
"""Finds the outline of centred points (n, 2), given also their size in mm, and its rivals."""


def fit_in_own_plane(
    shape: shapes.Shape, points: Points3, direction_hint: Float | None, outline_fit: OutlineFit
) -> shapes.Fit:
    """Return the outline in the orthogonal-distance plane of points (n, 3), mm, or FitError."""
    points = search.checked_points(shape, points)
    plane = own_plane(shape, points, direction_hint)
    normal = plane.axes[2]
    basis = np.stack([plane.axes[0], _cross(normal, plane.axes[0])])
    found = _in_plane(plane.centroid, plane.about, plane.size, normal, basis, outline_fit)
    return _with_rival([_in_own_plane(shape, plane, placed) for placed in found])


def _in_own_plane(shape: shapes.Shape, plane: OwnPlane, placed: _Placed) -> shapes.Fit:
    normal = plane.axes[2]
    # A tilt of the plane moves a centre that is not the centroid out of it, and takes the direction
    # of the length along; how it shears the points within the plane is of the order of the
    # residuals and left out (`shapes.Fit`).
    tilt = np.zeros((shapes.GEOMETRY_SIZE, 2))
    tilt[shapes.DIRECTION] = plane.tilt
    tilt[shapes.POINT] = -normal[:, None] * (placed.lever @ plane.tilt)
    tilt[shapes.ACROSS] = -normal[:, None] * (placed.geometry[shapes.ACROSS] @ plane.tilt)
    constant = np.zeros((shapes.GEOMETRY_SIZE, 3))
    n = len(plane.about)
    constant[shapes.POINT] = normal[:, None] * (normal / n)
    jacobian = np.empty((shapes.GEOMETRY_SIZE, 3 * n))
    search.spread_alike(tilt[:, :, None] * normal, plane.shifts, constant, jacobian)
    placed.spread(jacobian)
    return shapes.make_fit(shape, placed.geometry, jacobian, plane.size * placed.outline.residuals)


def fit_in_given_plane(
    shape: shapes.Shape, points: Points3, plane_normal: Float, outline_fit: OutlineFit
) -> tuple[shapes.Fit, Float]:
    """Return the outline of ``points`` (n, 3), mm, projected along ``plane_normal``.

    It lies in the plane through the centroid of the points, square to the normal (3,) of any
    length, which is its direction and constant for its jacobian. ``by_normal`` (12, 3) is
    d(geometry) / d(unit normal), for changes square to the normal. FitError if undetermined.
    """
    points = search.checked_points(shape, points)
    normal = unit(np.asarray(plane_normal, dtype=np.float64))
    centroid, about, size = search.centred(shape, points)
    basis = np.stack(perpendicular_pair(normal))
    found = _in_plane(centroid, about, size, normal, basis, outline_fit)
    fits = []
    for item in found:
        jacobian = np.zeros((shapes.GEOMETRY_SIZE, 3 * len(points)))
        constant = normal[:, None] * (normal / len(points))
        jacobian[shapes.POINT] = np.tile(constant, len(points))
        item.spread(jacobian)
        fits.append(shapes.make_fit(shape, item.geometry, jacobian, size * item.outline.residuals))
    placed, fit = found[0], _with_rival(fits)

    # A turn of the normal shifts every projection by its height, and the plane about the centroid.
    height = size * (about @ normal)
    by_normal = -placed.gain @ (placed.outline.shifts.T @ (height[:, None] * placed.outward))
    by_normal[shapes.POINT] -= np.outer(normal, placed.lever)
    by_normal[shapes.ACROSS] -= np.outer(normal, fit.across)
    by_normal[shapes.DIRECTION] = np.eye(3) - np.outer(normal, normal)
    return fit, by_normal


@dataclass(frozen=True, slots=True)
class _Placed:
    """An outline in space."""

    outline: Outline
    geometry: Float
    """(12,)."""
    gain: Float
    """(12, k): d(geometry) / d(shifts of the points in the plane), by the outline's shifts."""
    outward: Float
    """(n, 3): unit normals of the outline at the points."""
    lever: Float
    """(3,), mm: from the centroid of the points to the centre."""

    def spread(self, jacobian: Float) -> None:
        """Add d(geometry) / d(points), the plane being given, to ``jacobian`` (12, 3 n)."""
        search.spread(self.gain, self.outline.shifts, self.outward, _NOTHING, jacobian)


def _with_rival(fits: Sequence[shapes.Fit]) -> shapes.Fit:
    """Return the first fit, with the first of the others that its uncertainty does not cover."""
    first, *others = fits
    return replace(
        first, rival=next((fit for fit in others if not search.covered(first, fit)), None)
    )


def _in_plane(
    centroid: Float, about: Float, size: float, normal: Float, basis: Float, outline_fit: OutlineFit
) -> list[_Placed]:
    flat = np.empty((len(about), 2))
    search.places(about, basis, flat)
    return [_place(centroid, size, normal, basis, item) for item in outline_fit(flat, size)]


def _place(centroid: Float, size: float, normal: Float, basis: Float, outline: Outline) -> _Placed:
    lever = (size * outline.centre) @ basis
    geometry = shapes.element(centroid + lever, normal, size * outline.radius)
    geometry[shapes.SECOND] = size * outline.second
    gain = np.zeros((shapes.GEOMETRY_SIZE, outline.gain.shape[1]))
    gain[shapes.POINT] = basis.T @ outline.gain[0:2]
    gain[shapes.RADIUS] = outline.gain[3]
    if outline.turn is not None:
        gain[shapes.SECOND] = outline.gain[4]
        across = search.oriented(
            np.cos(outline.turn) * basis[0] + np.sin(outline.turn) * basis[1], None
        )
        geometry[shapes.ACROSS] = across
        gain[shapes.ACROSS] = _cross(normal, across)[:, None] * (outline.gain[2] / size)
    return _Placed(outline, geometry, gain, outline.normals @ basis, lever)


def _cross(a: Float, b: Float) -> Float:
    """Return the cross product (3,); numpy's spends twenty times as long on axes."""
    return np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def fit_circle(points: Points3, direction_hint: Float | None = None) -> shapes.Fit:
    """Return the circle in the orthogonal-distance plane of ``points`` (n, 3), mm.

    Residuals are radial, positive outside. FitError if the points do not determine a circle.
    """
    return fit_in_own_plane(shapes.Shape.CIRCLE, points, direction_hint, _outline)


def fit_circle_projected(points: Points3, plane_normal: Float) -> tuple[shapes.Fit, Float]:
    """Return the circle of ``points`` projected along a normal; see `flat.fit_in_given_plane`."""
    return fit_in_given_plane(shapes.Shape.CIRCLE, points, plane_normal, _outline)


def fit_circle_free(points: Points3, direction_hint: Float | None = None) -> shapes.Fit:
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
    if search.same(first, second) or search.covered(first, second):
        return first
    return replace(first, rival=second)


def _free(two_steps: shapes.Fit, points: Points3) -> shapes.Fit:
    """Return the circle in space reached from a two-step one."""
    centroid, about, size = search.centred(shapes.Shape.CIRCLE, points)
    n = len(points)
    centre = (two_steps.point - centroid) / size
    start = np.concatenate([centre, two_steps.direction, [two_steps.radius / size, 0.0]])
    solution = search.minimise(search.RING, about, start)
    if not solution.converged:
        raise not_converged(shapes.Shape.CIRCLE)
    p = solution.parameters
    residuals, jacobian, _ = search.derivatives(search.RING, about, p)
    inverse, condition = search.sensitivity(jacobian)
    if condition > WORST_CONDITION:
        raise search.degenerate(
            shapes.Shape.CIRCLE,
            "they lie on a straight line or too short an arc",
            "Spread the points over more of the feature.",
        )
    axis = p[3:6]
    basis = np.stack([*search.across_axes(axis), axis])
    by_shift = np.zeros((shapes.GEOMETRY_SIZE, 2 * n))
    by_shift[0:3] = -basis.T @ inverse[0:3]
    by_shift[3:6] = -basis[0:2].T @ inverse[3:5] / size
    by_shift[6] = -inverse[5]
    outward = -jacobian[:n, 0:2] @ basis[0:2]
    by_points = by_shift[:, :n, None] * outward + by_shift[:, n:, None] * axis
    geometry = shapes.element(centroid + size * p[0:3], axis, size * p[6])
    away = np.copysign(np.hypot(residuals[:n], residuals[n:]), residuals[:n])
    fit = shapes.make_fit(
        shapes.Shape.CIRCLE, geometry, by_points.reshape(shapes.GEOMETRY_SIZE, 3 * n), size * away
    )
    return replace(fit, free=True)


def _outline(points: Float, _size: float) -> list[Outline]:
    outlines = []
    for ball in fit_balls(shapes.Shape.CIRCLE, points):
        gain = np.zeros((5, ball.gain.shape[1]))
        gain[0:2], gain[3] = ball.gain[0:2], ball.gain[2]
        outlines.append(
            Outline(
                ball.centre, ball.radius, 0.0, None, ball.normals, ball.residuals, gain, ball.shifts
            )
        )
    return outlines
