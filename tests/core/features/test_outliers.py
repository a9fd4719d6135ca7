"""Outliers are found, counted rightly and never guessed from too few points."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.features.elements import distance_derivatives
from ocmm_core.features.measured import fit_shape, outliers
from ocmm_core.features.shapes import Shape
from tests.core.features.shape_samples import ideal_points, somewhere

NOISE = 0.01


@pytest.mark.parametrize("shape", [Shape.LINE, Shape.PLANE, Shape.CIRCLE, Shape.CONE, Shape.TORUS])
def test_one_point_in_twenty_that_lies_far_off(shape: Shape) -> None:
    rng = np.random.default_rng(51)
    for _ in range(5):
        motion = somewhere(rng)
        points = motion.apply(ideal_points(shape, rng, 20) + rng.normal(0.0, NOISE, (20, 3)))
        _, normals = distance_derivatives(fit_shape(shape, points), points)
        row = int(rng.integers(20))
        points[row] += 20.0 * NOISE * normals[row]
        assert row in outliers(fit_shape(shape, points), points)


def test_two_outliers_beside_each_other_do_not_hide_one_another() -> None:
    rng = np.random.default_rng(52)
    points = ideal_points(Shape.PLANE, rng, 15) + rng.normal(0.0, NOISE, (15, 3))
    points[[3, 4], :2] = [[18.0, 18.0], [18.0, 17.0]]
    points[[3, 4], 2] = 0.5
    assert outliers(fit_shape(Shape.PLANE, points), points) == (3, 4)


def test_false_alarms_are_as_rare_as_promised() -> None:
    rng = np.random.default_rng(53)
    alarms = 0
    for _ in range(400):
        points = ideal_points(Shape.CIRCLE, rng, 8) + rng.normal(0.0, NOISE, (8, 3))
        alarms += bool(outliers(fit_shape(Shape.CIRCLE, points), points))
    # One in a hundred; 12 of 400 would be four standard deviations more.
    assert alarms <= 12


def test_few_points_exact_points_and_uncertain_ones_are_left_alone() -> None:
    rng = np.random.default_rng(54)
    points = ideal_points(Shape.CIRCLE, rng, 4)
    points[0] *= 1.1
    assert outliers(fit_shape(Shape.CIRCLE, points), points) == ()
    points = somewhere(rng, far=1e4).apply(ideal_points(Shape.SPHERE, rng, 30))
    assert outliers(fit_shape(Shape.SPHERE, points), points) == ()

    points = ideal_points(Shape.CIRCLE, rng, 12) + rng.normal(0.0, NOISE, (12, 3))
    points[5, :2] *= 1.02
    fit = fit_shape(Shape.CIRCLE, points)
    assert outliers(fit, points) == (5,)
    covariances = np.tile(NOISE**2 * np.eye(3), (12, 1, 1))
    assert outliers(fit, points, covariances) == (5,)
    # A point with an uncertainty of a quarter of a millimetre is no outlier at that distance.
    covariances[5] = 0.25**2 * np.eye(3)
    assert outliers(fit, points, covariances) == ()
    assert outliers(fit, points, smallest=1.0) == ()
