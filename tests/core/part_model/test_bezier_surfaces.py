"""Points of spline surfaces against exact values."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import BSpline

from ocmm_core.geometry import Float
from ocmm_core.part_model import SplineSurface, bezier_surface, derivatives_at, places_at


def quarter_of_a_cylinder() -> SplineSurface:
    half = np.sqrt(0.5)
    ring = np.array([[10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])
    poles = np.zeros((3, 2, 3))
    poles[:, :, :2], poles[:, 1, 2] = ring[:, None], 30.0
    weights = np.repeat([[1.0], [half], [1.0]], 2, axis=1)
    return SplineSurface(poles, weights, np.repeat([0.0, 1.0], 3), np.repeat([0.0, 30.0], 2), 2, 1)


def uneven(rng: np.random.Generator) -> SplineSurface:
    return SplineSurface(
        rng.uniform(-10.0, 10.0, (6, 5, 3)), rng.uniform(0.5, 2.0, (6, 5)),
        np.array([0, 0, 0, 0, 0.4, 0.7, 1, 1, 1, 1.0]), np.array([0, 0, 0, 1, 2, 3, 3, 3.0]), 3, 2,
    )  # fmt: skip


def by_scipy(spline: SplineSurface, uv: Float) -> Float:
    """Return points by the basis functions of scipy, with weights (The NURBS Book, 4.4)."""
    u = BSpline.design_matrix(uv[:, 0], spline.knots_u, spline.degree_u).toarray()
    v = BSpline.design_matrix(uv[:, 1], spline.knots_v, spline.degree_v).toarray()
    weights = spline.weights[..., None]
    poles = np.concatenate([spline.poles * weights, weights], axis=2)
    top = np.einsum("nu,nv,uvk->nk", u, v, poles)
    return np.asarray(top[:, :3] / top[:, 3:])


def test_points_are_those_of_another_evaluation() -> None:
    rng = np.random.default_rng(3)
    spline = uneven(rng)
    uv = rng.uniform([0.0, 0.0], [1.0, 3.0], (300, 2))
    # A few roundings of numbers up to 40.
    np.testing.assert_allclose(
        places_at(bezier_surface(spline), uv), by_scipy(spline, uv), atol=1e-12
    )


def test_a_quarter_of_a_cylinder_is_one_exactly() -> None:
    uv = np.random.default_rng(1).uniform([0.0, 0.0], [1.0, 30.0], (200, 2))
    points = places_at(bezier_surface(quarter_of_a_cylinder()), uv)
    # A few roundings of numbers up to 30.
    np.testing.assert_allclose(np.hypot(points[:, 0], points[:, 1]), 10.0, atol=1e-13)
    np.testing.assert_allclose(points[:, 2], uv[:, 1], atol=1e-13)


def test_slopes_are_those_of_small_steps() -> None:
    rng = np.random.default_rng(2)
    surface = bezier_surface(uneven(rng))
    uv = rng.uniform([0.05, 0.05], [0.95, 2.95], (300, 2))
    # Not across a knot, at which the second derivative jumps.
    uv = uv[(np.abs(uv[:, 1:] - [1.0, 2.0]) > 1e-3).all(axis=1)]
    found = derivatives_at(surface, uv)
    step = 1e-5
    for axis, slope in enumerate((found.u, found.v)):
        away = np.zeros(2)
        away[axis] = step
        steps = places_at(surface, uv + away) - places_at(surface, uv - away)
        # Third derivatives of some 1e4, times a square of 1e-10 over 6.
        np.testing.assert_allclose(slope, steps / (2.0 * step), atol=1e-5, rtol=1e-5)
    ends = np.array([[1.0, 30.0], [0.0, 0.0]])
    found = derivatives_at(bezier_surface(quarter_of_a_cylinder()), ends)
    np.testing.assert_allclose(found.v, [[0.0, 0.0, 1.0]] * 2, atol=1e-13)
    assert found.u[0] @ [1.0, 0.0, 0.0] < -1.0
