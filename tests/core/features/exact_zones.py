"""Zones by exhaustion and in 50 digits, for the tests: slow, and built on other formulas."""

from __future__ import annotations

from itertools import combinations

import mpmath as mp
import numpy as np
from scipy.spatial import ConvexHull

from ocmm_core.features.shapes import Fit, Shape
from ocmm_core.geometry import Float, Points3, perpendicular_pair


def narrowest_width(points: Float) -> float:
    """Return the least distance of parallel lines (d = 2) or planes (d = 3) about points (n, d).

    Either a facet of the hull lies in one of them or, in space, an edge in each.
    """
    hull = ConvexHull(points)
    normals = [equation[:-1] for equation in hull.equations]
    if points.shape[1] == 3:
        edges = {
            tuple(sorted(pair))
            for facet in hull.simplices
            for pair in combinations(facet.tolist(), 2)
        }
        arms = np.array([points[b] - points[a] for a, b in sorted(edges)])
        for first, second in combinations(range(len(arms)), 2):
            normal = np.cross(arms[first], arms[second])
            length = float(np.linalg.norm(normal))
            if length > 1e-9:
                normals.append(normal / length)
    return float(np.ptp(points @ np.array(normals).T, axis=0).min())


def equidistant_centres(points: Float) -> Float:
    """Return all centres (m, d) that are equally far from d pairs of points (n, d).

    The smallest zone of circle and sphere belongs to one of these.
    """
    d = points.shape[1]
    pairs = np.array(list(combinations(range(len(points)), 2)))
    normals = points[pairs[:, 1]] - points[pairs[:, 0]]
    squares = np.sum(points**2, axis=1)
    heights = 0.5 * (squares[pairs[:, 1]] - squares[pairs[:, 0]])
    chosen = np.array(list(combinations(range(len(pairs)), d)))
    matrices, rights = normals[chosen], heights[chosen]
    sound = np.abs(np.linalg.det(matrices)) > 1e-9
    centres: Float = np.linalg.solve(matrices[sound], rights[sound][:, :, None])[:, :, 0]
    return centres


def narrowest_ring(points: Float) -> float:
    """Return the least width of two concentric circles or spheres about ``points`` (n, d)."""
    centres = equidistant_centres(points)
    radii = np.linalg.norm(points[None] - centres[:, None], axis=2)
    # A centre too far away to be one of a circle shows nothing but rounding.
    near = np.linalg.norm(centres, axis=1) < 1e5
    return float(np.ptp(radii[near], axis=1).min())


def smallest_around(points: Float) -> float:
    """Return the radius of the smallest circle about ``points`` (n, 2)."""
    best = np.inf
    for pair in combinations(points, 2):
        best = _if_about(points, 0.5 * (pair[0] + pair[1]), best)
    for triple in combinations(points, 3):
        best = _if_about(points, _circumcentre(np.array(triple)), best)
    return best


def _if_about(points: Float, centre: Float, best: float) -> float:
    return min(best, float(np.linalg.norm(points - centre, axis=1).max()))


def _circumcentre(triple: Float) -> Float:
    edges = triple[1:] - triple[0]
    arm: Float = np.linalg.solve(edges, 0.5 * np.sum(edges**2, axis=1))
    centre: Float = triple[0] + arm
    return centre


def largest_inside(points: Float) -> float:
    """Return the radius of the largest circle inside ``points`` (n, 2) that three of them hold."""
    best = 0.0
    for triple in combinations(points, 3):
        corners = np.array(triple)
        centre = _circumcentre(corners)
        shares = np.linalg.solve((corners[1:] - corners[0]).T, centre - corners[0])
        if shares.min() < 0.0 or shares.sum() > 1.0:
            continue
        radii = np.linalg.norm(points - centre, axis=1)
        own = float(np.linalg.norm(corners[0] - centre))
        if radii.min() > own - 1e-9:
            best = max(best, own)
    return best


def in_fifty_digits(fit: Fit, points: Points3) -> tuple[Float, float]:
    """Return geometry (point, direction, radius or apex angle, form) from the contacts.

    Newton's method in 50 digits solves for as many contacts as unknowns, with distances from
    cross products; each contact stays at the bound assigned by the fit.

    Returns
    -------
    geometry
        (12,), as `shapes.element`; the point is the element's nearest to that of the fit.
    form
        mm.
    """
    with mp.workdps(50):
        rows = list(fit.contacts)
        upper = [bool(fit.residuals[i] > 0.0) for i in rows]
        contacts = [mp.matrix([mp.mpf(float(x)) for x in points[i]]) for i in rows]
        axis = mp.matrix(fit.direction.tolist())
        first, second = (mp.matrix(v.tolist()) for v in perpendicular_pair(fit.direction))
        origin = mp.matrix(fit.point.tolist())

        def equations(*unknown: mp.mpf) -> list[mp.mpf]:
            u, v, a, b, *sizes, high, low = unknown
            place = origin + u * first + v * second
            lean = axis + a * first + b * second
            lean = lean / mp.norm(lean)
            gaps = []
            for point, above in zip(contacts, upper, strict=True):
                arm = point - place
                along = sum(arm[i] * lean[i] for i in range(3))
                radius = mp.norm(arm - along * lean)
                distance = radius
                if fit.shape is Shape.CONE:
                    angle = sizes[0]
                    distance = radius * mp.cos(angle) - along * mp.sin(angle)
                if fit.shape is Shape.TORUS:
                    height = along - sizes[0]
                    distance = mp.sqrt((radius - sizes[1]) ** 2 + height**2)
                gaps.append(distance - (high if above else low))
            return gaps

        sizes, middle = [], fit.radius
        if fit.shape is Shape.CONE:
            sizes, middle = [fit.half_angle], fit.radius * np.cos(fit.half_angle)
        if fit.shape is Shape.TORUS:
            sizes, middle = [0.0, fit.radius], fit.second
        guess = [0.0, 0.0, 0.0, 0.0, *sizes, middle + fit.form / 2, middle - fit.form / 2]
        found = mp.findroot(equations, [mp.mpf(float(x)) for x in guess], tol=mp.mpf(10) ** -80)
        u, v, a, b, *sizes, high, low = list(found)
        place = origin + u * first + v * second
        lean = axis + a * first + b * second
        lean = lean / mp.norm(lean)
        radius = (high + low) / 2
        geometry = np.zeros(12)
        if fit.shape is Shape.TORUS:
            place = place + sizes[0] * lean
            geometry[7] = float(radius)
            radius = sizes[1]
        if fit.shape is Shape.CONE:
            radius = radius / mp.cos(sizes[0])
            geometry[8] = float(sizes[0])
        geometry[0:3] = [float(x) for x in place]
        geometry[3:6] = [float(x) for x in lean]
        geometry[6] = float(radius)
        return geometry, float(high - low)
