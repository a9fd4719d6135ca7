"""Changes that must not alter a fit, and results of ideal points."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ocmm_core.features.elements import fit_circle_projected
from ocmm_core.features.measured import fit_shape
from ocmm_core.features.shapes import MINIMUM_POINTS, Shape
from tests.core.features.shape_samples import (
    ALL_SHAPES,
    FITTED,
    RADIUS,
    geometry_distance,
    ideal_points,
    somewhere,
    true_geometry,
)

pytestmark = pytest.mark.numerics

AT_10_M = 1e-9
"""mm: a double resolves 2e-12 mm at 10 m; partial arcs magnify it by up to some hundreds."""

seeds = st.integers(0, 2**31)


@pytest.mark.parametrize("shape", ALL_SHAPES)
@settings(max_examples=15, deadline=None, derandomize=True)
@given(seed=seeds, n=st.integers(6, 40))
def test_ideal_points_give_the_ideal_shape_anywhere(shape: Shape, seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    motion = somewhere(rng, far=10_000.0)
    if shape in (Shape.CONE, Shape.TORUS):
        # Several of them pass through as few points as they need, and through one more.
        n = max(n, MINIMUM_POINTS[shape] + 2)
    fit = fit_shape(shape, motion.apply(ideal_points(shape, rng, n)))
    assert geometry_distance(shape, fit.geometry, true_geometry(shape, motion)) < AT_10_M
    assert fit.rms < AT_10_M
    assert fit.form < AT_10_M


@pytest.mark.parametrize("shape", FITTED)
@settings(max_examples=10, deadline=None, derandomize=True)
@given(seed=seeds)
def test_motion_and_order_of_noisy_points_move_the_fit_along(shape: Shape, seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = ideal_points(shape, rng, 20) + rng.normal(0.0, 0.05, (20, 3))
    here = fit_shape(shape, points)
    motion = somewhere(rng, far=1000.0)
    order = rng.permutation(20)
    there = fit_shape(shape, motion.apply(points)[order])

    expected = here.geometry.copy()
    expected[0:3] = motion.apply(here.geometry[0:3])
    expected[3:6] = motion.rotation @ here.geometry[3:6]
    expected[9:12] = motion.rotation @ here.geometry[9:12]
    # The minimum of a noisy fit is found to the rounding of the coordinates, magnified.
    assert geometry_distance(shape, there.geometry, expected) < 1e-9
    assert there.rms == pytest.approx(here.rms, rel=1e-9)
    assert np.abs(there.residuals) == pytest.approx(np.abs(here.residuals[order]), abs=1e-9)


@pytest.mark.parametrize("shape", FITTED)
def test_the_point_is_the_foot_of_the_centroid(shape: Shape) -> None:
    rng = np.random.default_rng(4)
    points = somewhere(rng).apply(ideal_points(shape, rng, arc=2.0))
    points += rng.normal(0.0, 0.02, points.shape)
    fit = fit_shape(shape, points)
    arm = points.mean(axis=0) - fit.point
    if shape in (Shape.LINE, Shape.CYLINDER):
        assert abs(arm @ fit.direction) < 1e-10
    if shape in (Shape.LINE, Shape.PLANE):
        assert np.abs(arm).max() < 1e-10


@pytest.mark.parametrize("arc_degrees", [20.0, 45.0, 120.0, 360.0])
@pytest.mark.parametrize("shape", [Shape.CIRCLE, Shape.SPHERE, Shape.CYLINDER])
def test_short_arcs_are_fitted_cold(shape: Shape, arc_degrees: float) -> None:
    rng = np.random.default_rng(int(arc_degrees))
    for _ in range(10):
        motion = somewhere(rng)
        points = motion.apply(ideal_points(shape, rng, 25, np.deg2rad(arc_degrees)))
        fit = fit_shape(shape, points)
        assert geometry_distance(shape, fit.geometry, true_geometry(shape, motion)) < 1e-8


@pytest.mark.parametrize("shape", [Shape.CIRCLE, Shape.SPHERE, Shape.CYLINDER])
def test_no_step_away_from_the_fit_is_better(shape: Shape) -> None:
    # Form of 4 % of the radius on a third of the circumference: far from the ideal shape.
    rng = np.random.default_rng(8)
    points = ideal_points(shape, rng, 30, arc=2.1)
    points += rng.normal(0.0, 0.04 * RADIUS, points.shape)
    fit = fit_shape(shape, points)
    cost = np.sum(fit.residuals**2)
    for size in (1e-4, 1e-2, 0.3):
        for _ in range(50):
            moved = fit.geometry + size * rng.normal(size=12)
            if shape is Shape.CIRCLE:
                # Its plane is not part of the second step.
                moved[3:6] = fit.direction
            axis = moved[3:6] / np.linalg.norm(moved[3:6]) if shape is not Shape.SPHERE else None
            arms = points - moved[0:3]
            if axis is not None:
                arms = arms - np.outer(arms @ axis, axis)
            residuals = np.linalg.norm(arms, axis=1) - moved[6]
            assert np.sum(residuals**2) >= cost * (1.0 - 1e-12)


def test_a_projected_circle_is_the_circle_seen_along_the_normal() -> None:
    rng = np.random.default_rng(3)
    motion = somewhere(rng)
    flat = ideal_points(Shape.CIRCLE, rng, 9)
    deep = flat + np.outer(rng.uniform(-4.0, 4.0, 9), [0.0, 0.0, 1.0])
    fit, _ = fit_circle_projected(motion.apply(deep), 3.0 * motion.rotation[:, 2])
    centre = motion.inverse().apply(fit.point)
    assert centre[:2] == pytest.approx([0.0, 0.0], abs=1e-10)
    assert centre[2] == pytest.approx(deep[:, 2].mean(), abs=1e-10)
    assert fit.radius == pytest.approx(RADIUS, abs=1e-10)
    assert fit.direction == pytest.approx(motion.rotation[:, 2], abs=1e-14)


@pytest.mark.parametrize("shape", [Shape.LINE, Shape.PLANE, Shape.CIRCLE, Shape.CYLINDER])
def test_directions_follow_the_hint_else_their_largest_component(shape: Shape) -> None:
    rng = np.random.default_rng(5)
    for _ in range(10):
        points = somewhere(rng).apply(ideal_points(shape, rng))
        free = fit_shape(shape, points)
        assert free.direction[np.argmax(np.abs(free.direction))] > 0.0
        hint = rng.normal(size=3)
        assert fit_shape(shape, points, direction_hint=hint).direction @ hint > 0.0


@pytest.mark.parametrize("shape", [Shape.POINT, Shape.LINE, Shape.PLANE, Shape.SPHERE])
def test_as_few_points_as_the_shape_needs_are_met_exactly(shape: Shape) -> None:
    rng = np.random.default_rng(6)
    for _ in range(10):
        points = rng.normal(0.0, 10.0, (MINIMUM_POINTS[shape], 3))
        assert np.abs(fit_shape(shape, points).residuals).max() < 1e-7
