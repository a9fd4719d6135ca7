"""Signed distances of points from an element of each shape, and their derivatives.

Functions named slopes write d(distance) / d(geometry) except for the point, whose part is common to
all shapes, and return the normals. `_registry` assigns functions to shapes.
"""

from __future__ import annotations

import numpy as np

from ocmm_core.features.search import ELLIPSE, ROUND_ENDS, SQUARE_ENDS, derivatives
from ocmm_core.features.shapes import ACROSS, DIRECTION, HALF_ANGLE, RADIUS, SECOND, Fit
from ocmm_core.geometry import Float, Points3

ON_CIRCLE = 1e-12
"""Distance from a circle in space, relative to its radius, that counts as zero."""
_NEWTON_STEPS = 30
_SMALL = 1e-12


def point_jacobian(fit: Fit, arms: Float, by_geometry: Float) -> Points3:
    """Return the directions away from a point; writes nothing."""
    return _outward(arms, np.zeros(len(arms)), fit.direction)[1]


def sphere_slopes(fit: Fit, arms: Float, by_geometry: Float) -> Points3:
    by_geometry[:, RADIUS] = -1.0
    return point_jacobian(fit, arms, by_geometry)


def plane_slopes(fit: Fit, arms: Float, by_geometry: Float) -> Points3:
    by_geometry[:, DIRECTION] = arms
    return np.tile(fit.direction, (len(arms), 1))


def line_slopes(fit: Fit, arms: Float, by_geometry: Float) -> Points3:
    """Write derivatives of distances from a line by its direction; return the normals.

    The side of a line in space comes from the residuals; one in a plane has no width.
    """
    if fit.across.any():
        return square_jacobian(fit, arms, by_geometry)
    along = arms @ fit.direction
    normals: Points3 = _outward(arms, along, fit.direction)[1]
    normals *= np.where(fit.residuals < 0.0, -1.0, 1.0)[:, None]
    by_geometry[:, DIRECTION] = -along[:, None] * normals
    return normals


def cylinder_jacobian(fit: Fit, arms: Float, by_geometry: Float) -> Points3:
    along = arms @ fit.direction
    normals: Points3 = _outward(arms, along, fit.direction)[1]
    by_geometry[:, DIRECTION] = -along[:, None] * normals
    by_geometry[:, RADIUS] = -1.0
    return normals


def circle_slopes(fit: Fit, arms: Float, by_geometry: Float) -> Points3:
    """Write derivatives of distances from a circle, planar or in space; return the normals."""
    if fit.free:
        return _from_ring(fit, arms, by_geometry)
    return cylinder_jacobian(fit, arms, by_geometry)


def _outward(arms: Float, along: Float, axis: Float) -> tuple[Float, Float]:
    """Return distances (n,) from an axis and unit vectors (n, 3) away from it."""
    across = arms - np.outer(along, axis)
    distances = np.linalg.norm(across, axis=1)
    # On the axis itself the distance has no derivative; zero excludes such a point.
    return distances, across / np.maximum(distances, 1e-12)[:, None]


def cone_slopes(fit: Fit, arms: Float, by_geometry: Float) -> Points3:
    cosine, sine = np.cos(fit.half_angle), np.sin(fit.half_angle)
    along = arms @ fit.direction
    rho, outward = _outward(arms, along, fit.direction)
    by_geometry[:, DIRECTION] = -(cosine * along)[:, None] * outward - sine * arms
    by_geometry[:, RADIUS] = -cosine
    by_geometry[:, HALF_ANGLE] = -(rho - fit.radius) * sine - along * cosine
    normals: Points3 = cosine * outward - sine * fit.direction
    return normals


def torus_slopes(fit: Fit, arms: Float, by_geometry: Float) -> Points3:
    along = arms @ fit.direction
    rho, outward = _outward(arms, along, fit.direction)
    beyond = rho - fit.radius
    tube = np.maximum(np.hypot(beyond, along), 1e-12)
    radial, lift = beyond / tube, along / tube
    by_geometry[:, DIRECTION] = -(radial * along)[:, None] * outward + lift[:, None] * arms
    by_geometry[:, RADIUS] = -radial
    by_geometry[:, SECOND] = -1.0
    return radial[:, None] * outward + lift[:, None] * fit.direction


def _from_ring(fit: Fit, arms: Float, by_geometry: Float) -> Float:
    along = arms @ fit.direction
    rho, outward = _outward(arms, along, fit.direction)
    beyond = rho - fit.radius
    away = np.copysign(np.hypot(beyond, along), beyond)
    # On the circle itself the distance has no derivative; use the one in the plane.
    on = np.abs(away) < ON_CIRCLE * fit.radius
    away = np.where(on, 1.0, away)
    radial, lift = np.where(on, 1.0, beyond / away), np.where(on, 0.0, along / away)
    by_geometry[:, DIRECTION] = -(radial * along)[:, None] * outward + lift[:, None] * arms
    by_geometry[:, RADIUS] = -radial
    return radial[:, None] * outward + lift[:, None] * fit.direction


def ellipse_slopes(fit: Fit, arms: Float, by_geometry: Float) -> Points3:
    return _from_outline(ELLIPSE, fit, arms, by_geometry)


def round_slopes(fit: Fit, arms: Float, by_geometry: Float) -> Points3:
    return _from_outline(ROUND_ENDS, fit, arms, by_geometry)


def square_jacobian(fit: Fit, arms: Float, by_geometry: Float) -> Points3:
    return _from_outline(SQUARE_ENDS, fit, arms, by_geometry)


def _from_outline(kind: int, fit: Fit, arms: Float, by_geometry: Float) -> Points3:
    beside = np.cross(fit.direction, fit.across)
    flat = np.stack([arms @ fit.across, arms @ beside], axis=1)
    # An ellipse through ball centres is fitted at a distance; its normals are the same.
    p = np.array([0.0, 0.0, 0.0, fit.radius, fit.second, 0.0, 0.0, 0.0])
    _, jacobian, _ = derivatives(kind, flat, p)
    x, y = -jacobian[:, 0:1], -jacobian[:, 1:2]
    by_geometry[:, RADIUS], by_geometry[:, SECOND] = jacobian[:, 3], jacobian[:, 4]
    by_geometry[:, ACROSS] = x * arms + y * np.cross(arms, fit.direction)
    by_geometry[:, DIRECTION] = y * np.cross(fit.across, arms)
    return x * fit.across + y * beside


def signed_plane(geometry: Float, arms: Float) -> tuple[Float, Points3]:
    """Return distances from a plane or the face of a point or line, and its normals."""
    direction = geometry[DIRECTION]
    return arms @ direction, np.tile(direction, (len(arms), 1))


def signed_sphere(geometry: Float, arms: Float) -> tuple[Float, Points3]:
    distances = np.maximum(np.linalg.norm(arms, axis=1), _SMALL)
    return distances - geometry[RADIUS], arms / distances[:, None]


def signed_cylinder(geometry: Float, arms: Float) -> tuple[Float, Points3]:
    """Return distances from a cylinder, or a circle along its normal, and the normals."""
    _, rho, radial = _from_axis(geometry, arms)
    return rho - geometry[RADIUS], radial


def signed_cone(geometry: Float, arms: Float) -> tuple[Float, Points3]:
    along, rho, radial = _from_axis(geometry, arms)
    sine, cosine = np.sin(geometry[HALF_ANGLE]), np.cos(geometry[HALF_ANGLE])
    distances = (rho - geometry[RADIUS]) * cosine - along * sine
    return distances, cosine * radial - sine * geometry[DIRECTION]


def signed_torus(geometry: Float, arms: Float) -> tuple[Float, Points3]:
    along, rho, radial = _from_axis(geometry, arms)
    off = np.maximum(np.hypot(rho - geometry[RADIUS], along), _SMALL)
    normals = ((rho - geometry[RADIUS]) / off)[:, None] * radial
    return off - geometry[SECOND], normals + np.outer(along / off, geometry[DIRECTION])


def _from_axis(geometry: Float, arms: Float) -> tuple[Float, Float, Points3]:
    """Return places along an axis (n,), distances from it (n,), and unit vectors away from it."""
    direction = geometry[DIRECTION]
    along = arms @ direction
    across = arms - np.outer(along, direction)
    rho = np.maximum(np.linalg.norm(across, axis=1), _SMALL)
    return along, rho, across / rho[:, None]


def signed_round_slot(geometry: Float, arms: Float) -> tuple[Float, Points3]:
    """Return distances from a slot with round ends, seen along its normal, and its normals."""
    basis, flat, half = _in_plane(geometry, arms)
    straight = half[0] - half[1]
    beyond = np.sign(flat[:, 0]) * np.maximum(np.abs(flat[:, 0]) - straight, 0.0)
    ways = np.stack([beyond, flat[:, 1]], axis=1)
    distances = np.maximum(np.linalg.norm(ways, axis=1), _SMALL)
    return distances - half[1], ways / distances[:, None] @ basis


def signed_rectangle(geometry: Float, arms: Float) -> tuple[Float, Points3]:
    basis, flat, half = _in_plane(geometry, arms)
    outside = np.abs(flat) - half
    side = np.argmin(np.abs(outside), axis=1)
    rows = np.arange(len(flat))
    normals = np.zeros_like(flat)
    normals[rows, side] = np.where(flat[rows, side] < 0.0, -1.0, 1.0)
    return outside[rows, side], normals @ basis


def signed_ellipse(geometry: Float, arms: Float) -> tuple[Float, Points3]:
    """Return distances from an ellipse, seen along its normal, and its normals.

    Newton's steps on the angle of the foot, in one quadrant. The cosine of the angle between arm
    and tangent has one zero in the quadrant of a point nearer to the curve than its centres of
    curvature, as probed points are.
    """
    basis, flat, (a, b) = _in_plane(geometry, arms)
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
    return np.sum((flat - feet) * normals, axis=1), normals @ basis


def _in_plane(geometry: Float, arms: Float) -> tuple[Float, Float, Float]:
    """Return the basis of an outline's plane (2, 3), places in it (n, 2), and half sizes (2,)."""
    along = geometry[ACROSS]
    basis = np.stack([along, np.cross(geometry[DIRECTION], along)])
    return basis, arms @ basis.T, np.array([geometry[RADIUS], geometry[SECOND]])
