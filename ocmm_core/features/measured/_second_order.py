"""Nonlinearity of a fit for moved points: a test of uncertainty propagation.

The jacobian of a fit is a tangent. If an element is poorly determined, as an ellipse by a short
arc, the fit leaves its tangent within the errors of the points, and an uncertainty from the
jacobian is meaningless. Here the points are moved and the minimum is tracked by a few Newton steps
from the present element, so that the test costs far less than the fit.
"""

from __future__ import annotations

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.elements import ELEMENTS, FitPrior
from ocmm_core.features.search import BALL, CONE, DISC, TORUS, minimise
from ocmm_core.features.shapes import (
    ACROSS,
    DIRECTION,
    GEOMETRY_SIZE,
    HALF_ANGLE,
    POINT,
    RADIUS,
    SECOND,
    Fit,
    Shape,
)
from ocmm_core.geometry import Float, Points3


def solver_start(fit: Fit, centroid: Float, size: float) -> Float:
    """Return a sphere, cylinder, cone or torus as parameters (8,) of its solver.

    Relative to ``centroid`` (3,) and divided by ``size``, mm, as the solver's points.
    """
    start = np.zeros(8)
    start[0:3] = (fit.point - centroid) / size
    start[3:6] = fit.direction
    start[6] = fit.radius / size
    match fit.shape:
        case Shape.SPHERE:
            start[3] = fit.radius / size
        case Shape.CONE:
            start[6], start[7] = fit.half_angle, fit.radius / size * np.cos(fit.half_angle)
        case Shape.TORUS:
            start[7] = fit.second / size
        case Shape.POINT | Shape.LINE | Shape.PLANE | Shape.CIRCLE | Shape.CYLINDER:
            pass
        case _:
            raise TypeError(fit.shape)
    return start


def beyond_first_order(fit: Fit, points: Points3, moves: Float, offset: float = 0.0) -> Float:
    """Return the change of the geometry beyond that by its jacobian, (m, 12).

    ``fit`` is the least-squares fit of ``points`` (n, 3), mm; ``moves`` (m, n, 3), mm, of the
    points in every case; ``offset``, mm, the distance of an ellipse from its points.

    In the order of `shapes.element`; NaN if the moved points have no such minimum nearby. Zero for
    point, line and plane, which are linear in their points except for the square of a small turn.
    Motion of an outline's plane is ignored for the same reason.
    """
    spec, kernel = fit.shape.spec, ELEMENTS[fit.shape].kernel
    if not spec.is_curved:
        return np.zeros((len(moves), GEOMETRY_SIZE))
    if kernel is None:
        return _fitted_again(fit, points, moves, offset)
    if spec.is_flat:
        return _flat(kernel, fit, points, moves, offset)
    return _solid(kernel, fit, points, moves)


def _fitted_again(fit: Fit, points: Points3, moves: Float, offset: float) -> Float:
    """Return the same for a shape without a compiled solver: by complete fits."""
    known = FitPrior(
        fit.direction, fit.radius, fit.second, fit.half_angle or None, fit.free, offset
    )
    linear = moves.reshape(len(moves), -1) @ fit.jacobian.T
    beyond = np.full((len(moves), GEOMETRY_SIZE), np.nan)
    for row, move in enumerate(moves):
        try:
            moved = ELEMENTS[fit.shape].fit(points + move, known)
        except FitError:
            continue
        beyond[row] = moved.geometry - fit.geometry - linear[row]
    return beyond


def _scaled(points: Points3) -> tuple[Float, Float, float]:
    centroid = points.mean(axis=0)
    about = points - centroid
    size = float(np.sqrt(np.mean(np.sum(about**2, axis=1))))
    return centroid, about, size


def _solid(kind: int, fit: Fit, points: Points3, moves: Float) -> Float:
    centroid, about, size = _scaled(points)
    start = solver_start(fit, centroid, size)
    linear = moves.reshape(len(moves), -1) @ fit.jacobian.T
    beyond = np.full((len(moves), GEOMETRY_SIZE), np.nan)
    for row, move in enumerate(moves):
        found = minimise(kind, np.ascontiguousarray((about + move) / size), start)
        if not found.converged:
            continue
        p, middle = found.parameters, move.mean(axis=0) / size
        geometry = np.zeros(GEOMETRY_SIZE)
        foot = p[0:3]
        if kind == BALL:
            geometry[RADIUS] = size * p[3]
        else:
            # The axis can only reverse if the fit is far away.
            along = 0.0 if kind == TORUS else float((middle - p[0:3]) @ p[3:6])
            foot = p[0:3] + along * p[3:6]
            geometry[DIRECTION] = p[3:6]
            geometry[RADIUS] = size * p[6]
            if kind == TORUS:
                geometry[SECOND] = size * p[7]
            elif kind == CONE:
                geometry[RADIUS] = size * (p[7] + along * np.sin(p[6])) / np.cos(p[6])
                geometry[HALF_ANGLE] = p[6]
        geometry[POINT] = centroid + size * foot
        beyond[row] = geometry - fit.geometry - linear[row]
    return beyond


def _flat(kind: int, fit: Fit, points: Points3, moves: Float, offset: float) -> Float:
    """Return the same for an outline, with points moved within its plane."""
    first = fit.across if fit.across.any() else _any_across(fit.direction)
    basis = np.stack([first, np.cross(fit.direction, first)])
    flat = (points - fit.point) @ basis.T
    size = float(np.sqrt(np.mean(np.sum(flat**2, axis=1))))
    start = np.zeros(8)
    if kind == DISC:
        start[2] = fit.radius / size
    else:
        start[3], start[4], start[7] = fit.radius / size, fit.second / size, offset / size
    within = moves @ basis.T
    linear = (within @ basis).reshape(len(moves), -1) @ fit.jacobian.T
    beyond = np.full((len(moves), GEOMETRY_SIZE), np.nan)
    for row, move in enumerate(within):
        found = minimise(kind, np.ascontiguousarray((flat + move) / size), start)
        if not found.converged:
            continue
        p = found.parameters
        geometry = fit.geometry.copy()
        geometry[POINT] += size * p[0:2] @ basis
        if kind == DISC:
            geometry[RADIUS] = size * p[2]
        else:
            geometry[RADIUS], geometry[SECOND] = size * p[3], size * p[4]
            geometry[ACROSS] = np.cos(p[2]) * basis[0] + np.sin(p[2]) * basis[1]
        beyond[row] = geometry - fit.geometry - linear[row]
    return beyond


def _any_across(direction: Float) -> Float:
    across = np.zeros(3)
    across[int(np.argmin(np.abs(direction)))] = 1.0
    across -= (across @ direction) * direction
    return across / np.linalg.norm(across)
