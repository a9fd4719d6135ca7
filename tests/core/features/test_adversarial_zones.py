"""Sets on which searches failed: scans on a cone, points repeated at one angle, almost no angle."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.features.measured import fit_shape
from ocmm_core.features.shapes import Criterion, Shape
from ocmm_core.features.zones import certificate
from ocmm_core.geometry import Float, Points3
from tests.core.features.exact_zones import narrowest_ring, narrowest_width
from tests.core.features.shape_samples import somewhere

pytestmark = pytest.mark.numerics


def _scan(half_angle: float, n: int, arc: float, length: float) -> Points3:
    """Return points (n, 3) along one curve up a cone of radius 50 mm in the middle."""
    share = np.linspace(0.0, 1.0, n)
    along = length * (share - 0.5)
    radius = 50.0 + along * np.sin(half_angle)
    turn = arc * share
    return np.stack(
        [radius * np.cos(turn), radius * np.sin(turn), along * np.cos(half_angle)], axis=1
    )


@pytest.mark.parametrize(
    ("half_angle", "n", "arc", "length"),
    [
        (np.deg2rad(84.0), 30, np.pi, 98.0),
        (np.deg2rad(20.0), 60, np.pi, 270.0),
        (np.deg2rad(45.0), 20, np.pi, 120.0),
    ],
)
def test_a_scan_along_a_curve_gives_its_cone(
    half_angle: float, n: int, arc: float, length: float
) -> None:
    rng = np.random.default_rng(3)
    motion = somewhere(rng)
    fit = fit_shape(Shape.CONE, motion.apply(_scan(half_angle, n, arc, length)))
    assert fit.rms < 1e-9
    assert fit.half_angle == pytest.approx(half_angle, abs=1e-6)


def _ring(turn: Float, radius: Float) -> Points3:
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), np.zeros(len(turn))], axis=1)


def test_several_turns_of_a_roundness_trace_with_one_high_point() -> None:
    # The high point and the lowest beneath it hold the zone all but alone.
    rng = np.random.default_rng(8)
    turn = np.repeat(np.linspace(0.0, 0.5 * np.pi, 6), 3)
    radius = 20.0 + 1e-5 * rng.normal(size=18)
    radius[7] += 3e-4
    points = _ring(turn, radius)
    fit = fit_shape(Shape.CIRCLE, points, criterion=Criterion.MINIMUM_ZONE)
    assert fit.form == pytest.approx(narrowest_ring(points[:, :2]), abs=1e-10)
    assert certificate(fit, points).certified


def test_a_high_point_right_between_two_low_ones_of_a_grid() -> None:
    # Turning about the two narrows the zone by the cosine alone, until a third one touches.
    grid = np.array([[x, y, 0.0] for x in range(-2, 3) for y in range(-2, 3)], dtype=np.float64)
    rng = np.random.default_rng(9)
    grid[:, 2] = 1e-3 * rng.uniform(0.3, 0.6, 25)
    grid[[0, 24], 2] = 0.0
    grid[12, 2] = 1e-3
    points = somewhere(rng).apply(10.0 * grid)
    fit = fit_shape(Shape.PLANE, points, criterion=Criterion.MINIMUM_ZONE)
    assert fit.form == pytest.approx(narrowest_width(10.0 * grid), abs=1e-10)
    assert certificate(fit, points).certified


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_cone_of_hardly_any_angle_may_open_to_the_other_side(seed: int) -> None:
    rng = np.random.default_rng(seed)
    turn, height = rng.uniform(0.0, 2.0 * np.pi, 40), rng.uniform(-5.0, 5.0, 40)
    radius = 20.0 + 1e-4 * height + rng.normal(0.0, 0.02, 40)
    points = np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=1)
    fit = fit_shape(Shape.CONE, points, criterion=Criterion.MINIMUM_ZONE)
    assert certificate(fit, points).certified
    assert 0.0 < fit.half_angle < 0.05
    arms = points - fit.point
    along = arms @ fit.direction
    across = np.linalg.norm(arms - np.outer(along, fit.direction), axis=1)
    cosine, sine = np.cos(fit.half_angle), np.sin(fit.half_angle)
    outside = (across - fit.radius) * cosine - along * sine
    assert fit.residuals == pytest.approx(outside, abs=1e-12)
    assert np.ptp(outside) <= fit_shape(Shape.CONE, points).form
