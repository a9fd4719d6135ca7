"""How the residuals of a fit move: the base of every statement on form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ocmm_core.features.search import ELLIPSE, ROUND_ENDS, SQUARE_ENDS, derivatives
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

ON_CIRCLE = 1e-12
"""Distance from a circle in space, against its radius, that is none."""


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
    by_geometry = np.zeros((len(points), GEOMETRY_SIZE))
    if fit.across.any():
        normals = _from_outline(fit, arms, by_geometry)
    elif fit.shape is Shape.PLANE:
        normals = np.tile(fit.direction, (len(points), 1))
        by_geometry[:, DIRECTION] = arms
    elif fit.shape is Shape.CONE:
        normals = _from_cone(fit, arms, by_geometry)
    elif fit.shape is Shape.TORUS:
        normals = _from_torus(fit, arms, by_geometry)
    elif fit.free:
        normals = _from_ring(fit, arms, by_geometry)
    else:
        has_axis = fit.shape in (Shape.LINE, Shape.CIRCLE, Shape.CYLINDER)
        along = arms @ fit.direction if has_axis else np.zeros(len(points))
        _, normals = _outward(arms, along, fit.direction)
        if fit.shape is Shape.LINE:
            normals *= np.where(fit.residuals < 0.0, -1.0, 1.0)[:, None]
        by_geometry[:, DIRECTION] = -along[:, None] * normals
        has_radius = fit.shape in (Shape.CIRCLE, Shape.SPHERE, Shape.CYLINDER)
        by_geometry[:, RADIUS] = -1.0 if has_radius else 0.0
    by_geometry[:, POINT] = -normals
    return by_geometry, normals


def surface_normals(fit: Fit, points: Points3) -> Points3:
    """Return the normals (n, 3) of the surface that an element stands for, towards the outside.

    A circle is the rim of a bore or pin, whose normals lie in its plane, also where the distances
    of a circle in space do not.
    """
    return distance_derivatives(replace(fit, free=False), points)[1]


def _outward(arms: Float, along: Float, axis: Float) -> tuple[Float, Float]:
    """Return distances (n,) from an axis and unit vectors (n, 3) away from it."""
    across = arms - np.outer(along, axis)
    distances = np.linalg.norm(across, axis=1)
    # On the axis itself the distance has no derivative; zero leaves such a point out.
    return distances, across / np.maximum(distances, 1e-12)[:, None]


def _from_cone(fit: Fit, arms: Float, by_geometry: Float) -> Float:
    cosine, sine = np.cos(fit.half_angle), np.sin(fit.half_angle)
    along = arms @ fit.direction
    rho, outward = _outward(arms, along, fit.direction)
    by_geometry[:, DIRECTION] = -(cosine * along)[:, None] * outward - sine * arms
    by_geometry[:, RADIUS] = -cosine
    by_geometry[:, HALF_ANGLE] = -(rho - fit.radius) * sine - along * cosine
    normals: Float = cosine * outward - sine * fit.direction
    return normals


def _from_torus(fit: Fit, arms: Float, by_geometry: Float) -> Float:
    along = arms @ fit.direction
    rho, outward = _outward(arms, along, fit.direction)
    beyond = rho - fit.radius
    tube = np.maximum(np.hypot(beyond, along), 1e-12)
    radial, lift = beyond / tube, along / tube
    by_geometry[:, DIRECTION] = -(radial * along)[:, None] * outward + lift[:, None] * arms
    by_geometry[:, RADIUS] = -radial
    by_geometry[:, SECOND] = -1.0
    normals: Float = radial[:, None] * outward + lift[:, None] * fit.direction
    return normals


def _from_ring(fit: Fit, arms: Float, by_geometry: Float) -> Float:
    along = arms @ fit.direction
    rho, outward = _outward(arms, along, fit.direction)
    beyond = rho - fit.radius
    away = np.copysign(np.hypot(beyond, along), beyond)
    # On the circle itself the distance has no derivative; the one in the plane stands for it.
    on = np.abs(away) < ON_CIRCLE * fit.radius
    away = np.where(on, 1.0, away)
    radial, lift = np.where(on, 1.0, beyond / away), np.where(on, 0.0, along / away)
    by_geometry[:, DIRECTION] = -(radial * along)[:, None] * outward + lift[:, None] * arms
    by_geometry[:, RADIUS] = -radial
    normals: Float = radial[:, None] * outward + lift[:, None] * fit.direction
    return normals


def _from_outline(fit: Fit, arms: Float, by_geometry: Float) -> Float:
    beside = np.cross(fit.direction, fit.across)
    flat = np.stack([arms @ fit.across, arms @ beside], axis=1)
    # An ellipse through the centres of a ball is fitted at a distance; its normals are the same.
    p = np.array([0.0, 0.0, 0.0, fit.radius, fit.second, 0.0, 0.0, 0.0])
    kind = {Shape.ELLIPSE: ELLIPSE, Shape.ROUND_SLOT: ROUND_ENDS}.get(fit.shape, SQUARE_ENDS)
    _, jacobian, _ = derivatives(kind, flat, p)
    x, y = -jacobian[:, 0:1], -jacobian[:, 1:2]
    by_geometry[:, RADIUS], by_geometry[:, SECOND] = jacobian[:, 3], jacobian[:, 4]
    by_geometry[:, ACROSS] = x * arms + y * np.cross(arms, fit.direction)
    by_geometry[:, DIRECTION] = y * np.cross(fit.across, arms)
    normals: Float = x * fit.across + y * beside
    return normals
