"""Signed distances of points from a nominal element: what a profile is made of."""

from __future__ import annotations

import numpy as np

from ocmm_core.features.shapes import ACROSS, DIRECTION, HALF_ANGLE, POINT, RADIUS, SECOND, Shape
from ocmm_core.geometry import Float, Points3

_NEWTON_STEPS = 30
_SMALL = 1e-12


def nominal_distances(shape: Shape, geometry: Float, points: Points3) -> tuple[Float, Points3]:
    """Return the signed distance of every point from an element, and the normal of it there.

    Circle, ellipse, slots and rectangle are seen along their normal: a line in their plane is
    meant, at whatever height it was probed. Corners of a rectangle are none: each point belongs to
    the side that it is nearest to. Points and lines are taken as planes: ``geometry`` must hold the
    normal of their face as its direction.

    Parameters
    ----------
    shape
        Of the element.
    geometry
        (12,), see `features.shapes.element`.
    points
        (n, 3), mm, in the same frame.

    Returns
    -------
    distances
        (n,), mm: positive outside of what is round, and where the normal of a plane points to.
    normals
        (n, 3), unit: towards growing distance.
    """
    direction = geometry[DIRECTION]
    arms = points - geometry[POINT]
    along = arms @ direction
    match shape:
        case Shape.PLANE | Shape.POINT | Shape.LINE:
            return along, np.tile(direction, (len(points), 1))
        case Shape.SPHERE:
            distances = np.maximum(np.linalg.norm(arms, axis=1), _SMALL)
            return distances - geometry[RADIUS], arms / distances[:, None]
        case Shape.CIRCLE | Shape.CYLINDER | Shape.CONE | Shape.TORUS:
            return _round(shape, geometry, arms, along)
        case Shape.ELLIPSE | Shape.ROUND_SLOT | Shape.SQUARE_SLOT | Shape.RECTANGLE:
            basis = np.stack([geometry[ACROSS], np.cross(direction, geometry[ACROSS])])
            flat = arms @ basis.T
            half = np.array([geometry[RADIUS], geometry[SECOND]])
            outline = {
                Shape.ELLIPSE: _ellipse,
                Shape.ROUND_SLOT: _round_slot,
                Shape.SQUARE_SLOT: _box,
                Shape.RECTANGLE: _box,
            }[shape]
            distances, normals = outline(flat, half)
            return distances, normals @ basis


def _round(shape: Shape, geometry: Float, arms: Float, along: Float) -> tuple[Float, Points3]:
    direction = geometry[DIRECTION]
    across = arms - np.outer(along, direction)
    rho = np.maximum(np.linalg.norm(across, axis=1), _SMALL)
    radial = across / rho[:, None]
    if shape is Shape.CONE:
        sine, cosine = np.sin(geometry[HALF_ANGLE]), np.cos(geometry[HALF_ANGLE])
        distances = (rho - geometry[RADIUS]) * cosine - along * sine
        return distances, cosine * radial - sine * direction
    if shape is Shape.TORUS:
        off = np.maximum(np.hypot(rho - geometry[RADIUS], along), _SMALL)
        normals = ((rho - geometry[RADIUS]) / off)[:, None] * radial
        return off - geometry[SECOND], normals + np.outer(along / off, direction)
    return rho - geometry[RADIUS], radial


def _round_slot(flat: Float, half: Float) -> tuple[Float, Float]:
    straight = half[0] - half[1]
    beyond = np.sign(flat[:, 0]) * np.maximum(np.abs(flat[:, 0]) - straight, 0.0)
    arms = np.stack([beyond, flat[:, 1]], axis=1)
    distances = np.maximum(np.linalg.norm(arms, axis=1), _SMALL)
    return distances - half[1], arms / distances[:, None]


def _box(flat: Float, half: Float) -> tuple[Float, Float]:
    outside = np.abs(flat) - half
    side = np.argmin(np.abs(outside), axis=1)
    rows = np.arange(len(flat))
    normals = np.zeros_like(flat)
    normals[rows, side] = np.where(flat[rows, side] < 0.0, -1.0, 1.0)
    return outside[rows, side], normals


def _ellipse(flat: Float, half: Float) -> tuple[Float, Float]:
    """Return distances from an ellipse: Newton's steps on the angle of the foot, in one quadrant.

    The cosine of the angle between arm and tangent has one zero in the quadrant of a point that
    lies nearer to the curve than its centres of curvature do, as probed points do.
    """
    a, b = half
    x, y = np.abs(flat).T
    turn = np.arctan2(a * y, b * x)
    for _ in range(_NEWTON_STEPS):
        sine, cosine = np.sin(turn), np.cos(turn)
        slope = (a * a - b * b) * sine * cosine - x * a * sine + y * b * cosine
        curve = (a * a - b * b) * (cosine**2 - sine**2) - x * a * cosine - y * b * sine
        step = slope / np.where(np.abs(curve) > _SMALL, curve, -_SMALL)
        turn = np.clip(turn - step, 0.0, 0.5 * np.pi)
        if float(np.abs(step).max()) < 1e-15:
            break
    signs = np.where(flat < 0.0, -1.0, 1.0)
    normals = signs * np.stack([b * np.cos(turn), a * np.sin(turn)], axis=1)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    feet = signs * np.stack([a * np.cos(turn), b * np.sin(turn)], axis=1)
    return np.sum((flat - feet) * normals, axis=1), normals
