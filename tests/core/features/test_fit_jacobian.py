"""Derivatives of the fits against finite differences of the whole fit."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.features.elements import distance_derivatives, fit_circle_projected
from ocmm_core.features.measured import fit_shape
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float, Points3
from tests.core.features.shape_samples import ALL_SHAPES, RADIUS, ideal_points, somewhere

STEP = 1e-5


def _differences(shape: Shape, points: Points3) -> tuple[Float, Float]:
    """Return d(geometry) and d(residuals) / d(points) by central differences."""
    start = fit_shape(shape, points)
    hint = start.direction if start.direction.any() else None
    geometry, residuals = [], []
    for i in range(points.size):
        sides = []
        for step in (STEP, -STEP):
            moved = points.copy()
            moved.flat[i] += step
            sides.append(fit_shape(shape, moved, direction_hint=hint))
        geometry.append((sides[0].geometry - sides[1].geometry) / (2.0 * STEP))
        residuals.append((sides[0].residuals - sides[1].residuals) / (2.0 * STEP))
    return np.array(geometry).T, np.array(residuals).T


@pytest.mark.parametrize("shape", ALL_SHAPES)
@pytest.mark.parametrize("arc", [2.0 * np.pi, 1.2])
def test_exact_where_the_residuals_vanish(shape: Shape, arc: float) -> None:
    rng = np.random.default_rng(11)
    points = somewhere(rng, far=200.0).apply(ideal_points(shape, rng, 9, arc))
    differences, _ = _differences(shape, points)
    jacobian = fit_shape(shape, points).jacobian
    # Differences of 1e-5 mm of a fit good to 1e-12 mm, magnified on the short arc.
    assert np.abs(jacobian - differences).max() < 1e-5 * np.abs(differences).max()


@pytest.mark.parametrize("shape", ALL_SHAPES)
def test_first_order_where_they_are_small(shape: Shape) -> None:
    # Noise of 0.02 mm on 12.5 mm: the neglected terms are of that ratio, 0.2 %, some fold.
    rng = np.random.default_rng(12)
    points = somewhere(rng, far=200.0).apply(ideal_points(shape, rng, 12))
    points += rng.normal(0.0, 0.02, points.shape)
    differences, _ = _differences(shape, points)
    jacobian = fit_shape(shape, points).jacobian
    assert np.abs(jacobian - differences).max() < 0.01 * np.abs(differences).max()


@pytest.mark.parametrize("shape", [s for s in ALL_SHAPES if s is not Shape.POINT])
def test_residuals(shape: Shape) -> None:
    rng = np.random.default_rng(13)
    points = somewhere(rng, far=200.0).apply(ideal_points(shape, rng, 12))
    points += rng.normal(0.0, 0.01, points.shape)
    fit = fit_shape(shape, points)
    by_geometry, by_point = distance_derivatives(fit, points)
    derivative = by_geometry @ fit.jacobian
    for i in range(len(points)):
        derivative[i, 3 * i : 3 * i + 3] += by_point[i]
    _, differences = _differences(shape, points)
    # A line's normals turn with its residuals, whose ratio to the steps of the noise is not small.
    tolerance = 0.02 if shape is not Shape.LINE else 0.35
    assert np.abs(derivative - differences).max() < tolerance


def test_a_projected_circle_by_points_and_by_normal() -> None:
    rng = np.random.default_rng(14)
    points = ideal_points(Shape.CIRCLE, rng, 8, arc=3.0)
    points[:, 2] += rng.uniform(-5.0, 5.0, 8)
    motion = somewhere(rng, far=100.0)
    points, normal = motion.apply(points), motion.rotation[:, 2]
    fit, by_normal = fit_circle_projected(points, normal)
    assert fit.radius == pytest.approx(RADIUS)
    for i in range(points.size):
        sides = []
        for step in (STEP, -STEP):
            moved = points.copy()
            moved.flat[i] += step
            sides.append(fit_circle_projected(moved, normal)[0].geometry)
        difference = (sides[0] - sides[1]) / (2.0 * STEP)
        assert fit.jacobian[:, i] == pytest.approx(difference, abs=1e-5)
    for across in motion.rotation[:, 0], motion.rotation[:, 1]:
        sides = [
            fit_circle_projected(points, normal + step * across)[0].geometry
            for step in (STEP, -STEP)
        ]
        difference = (sides[0] - sides[1]) / (2.0 * STEP)
        assert by_normal @ across == pytest.approx(difference, abs=1e-4)


def test_the_spread_of_many_noisy_fits_is_the_propagated_one() -> None:
    rng = np.random.default_rng(15)
    points = ideal_points(Shape.CYLINDER, rng, 12)
    sigma = 0.01
    jacobian = fit_shape(Shape.CYLINDER, points).jacobian
    stated = sigma * np.linalg.norm(jacobian, axis=1)
    fits = np.array(
        [
            fit_shape(
                Shape.CYLINDER,
                points + rng.normal(0.0, sigma, points.shape),
                direction_hint=np.array([0.0, 0.0, 1.0]),
            ).geometry
            for _ in range(400)
        ]
    )
    moving = stated > 1e-6
    # 400 fits show a standard deviation to 3.5 %; four of these.
    assert fits.std(axis=0)[moving] == pytest.approx(stated[moving], rel=0.14)
