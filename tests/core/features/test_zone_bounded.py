"""Inscribed and circumscribed elements: against exhaustive search, and invariants."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.errors import FitError
from ocmm_core.features.measured import fit_shape
from ocmm_core.features.search import narrowest_tube
from ocmm_core.features.shapes import Criterion, Fit, Shape
from ocmm_core.features.zones import certificate
from ocmm_core.geometry import Float, Points3, rotation_from_vector
from tests.core.features.exact_zones import largest_inside, smallest_around
from tests.core.features.shape_samples import somewhere
from tests.core.features.test_zone import sample

pytestmark = pytest.mark.numerics

BOTH = (Criterion.INSCRIBED, Criterion.CIRCUMSCRIBED)
BOUNDED = (Shape.CIRCLE, Shape.SPHERE, Shape.CYLINDER)


def _fit(shape: Shape, points: Points3, criterion: Criterion, hint: Float | None = None) -> Fit:
    return fit_shape(shape, points, criterion=criterion, direction_hint=hint)


@pytest.mark.parametrize("noise", [0.01, 3.0])
def test_circles_are_the_best_of_all_pairs_and_triples(noise: float) -> None:
    for seed in range(6):
        rng = np.random.default_rng(seed)
        points = sample(Shape.CIRCLE, rng, 11, noise)
        points[:, 2] = 0.0
        there = somewhere(rng).apply(points)
        about = _fit(Shape.CIRCLE, there, Criterion.CIRCUMSCRIBED)
        inside = _fit(Shape.CIRCLE, there, Criterion.INSCRIBED)
        assert about.radius == pytest.approx(smallest_around(points[:, :2]), abs=1e-10)
        assert inside.radius == pytest.approx(largest_inside(points[:, :2]), abs=1e-10)


@pytest.mark.parametrize("criterion", BOTH)
@pytest.mark.parametrize("shape", BOUNDED)
def test_certified_with_all_points_on_one_side(shape: Shape, criterion: Criterion) -> None:
    for seed in range(3):
        rng = np.random.default_rng(seed)
        points = somewhere(rng).apply(sample(shape, rng, 40, 0.05))
        fit = _fit(shape, points, criterion)
        proof = certificate(fit, points)
        assert proof.certified, proof.sentence
        assert fit.criterion is criterion
        outward = fit.residuals if criterion is Criterion.INSCRIBED else -fit.residuals
        # Distances are computed twice, each to some 1e-14 mm.
        assert outward.min() > -1e-12
        assert np.abs(fit.residuals[list(fit.contacts)]).max() < 1e-11


@pytest.mark.parametrize("criterion", BOTH)
@pytest.mark.parametrize("shape", BOUNDED)
def test_no_step_away_is_better(shape: Shape, criterion: Criterion) -> None:
    rng = np.random.default_rng(9)
    points = sample(shape, rng, 30, 0.05)
    fit = _fit(shape, points, criterion)
    for size in (1e-6, 1e-4, 1e-2):
        for _ in range(60):
            axis = fit.direction.copy()
            if shape is Shape.CYLINDER:
                axis += size / 15.0 * rng.normal(size=3)
                axis /= np.linalg.norm(axis)
            arms = points - fit.point - size * rng.normal(size=3)
            radii = np.linalg.norm(arms - np.outer(arms @ axis, axis), axis=1)
            if criterion is Criterion.INSCRIBED:
                assert radii.min() <= fit.radius + 1e-12
            else:
                assert radii.max() >= fit.radius - 1e-12


@pytest.mark.parametrize("shape", BOUNDED)
def test_an_arc_of_less_than_half_has_no_inscribed_element(shape: Shape) -> None:
    rng = np.random.default_rng(10)
    turn, height = np.linspace(0.0, 2.8, 40), rng.uniform(-8.0, 8.0, 40)
    radius = np.sqrt(16.0**2 - height**2) if shape is Shape.SPHERE else np.full(40, 16.0)
    if shape is Shape.CIRCLE:
        height[:] = 0.0
    points = np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=1)
    points += rng.normal(0.0, 0.001, points.shape)
    with pytest.raises(FitError, match="more than half of the circumference"):
        _fit(shape, points, Criterion.INSCRIBED)
    assert _fit(shape, points, Criterion.CIRCUMSCRIBED).residuals.max() < 1e-12


def test_a_square_touches_its_circles_with_all_corners() -> None:
    points = np.array([[1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0], [1.0, -1.0, 0.0]])
    sides = 1.2 * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    points = 10.0 * np.concatenate([points, sides])
    about = _fit(Shape.CIRCLE, points, Criterion.CIRCUMSCRIBED)
    inside = _fit(Shape.CIRCLE, points, Criterion.INSCRIBED)
    assert about.radius == pytest.approx(np.sqrt(200.0), abs=1e-12)
    assert inside.radius == pytest.approx(12.0, abs=1e-12)
    assert np.abs(about.point).max() < 1e-12
    assert np.abs(inside.point).max() < 1e-12


@pytest.mark.parametrize("criterion", BOTH)
@pytest.mark.parametrize("shape", BOUNDED)
def test_the_jacobian_is_that_of_differences(shape: Shape, criterion: Criterion) -> None:
    rng = np.random.default_rng(11)
    points = sample(shape, rng, 20, 0.03)
    if shape is Shape.CIRCLE:
        points[:, 2] = 0.0
    points = somewhere(rng, far=100.0).apply(points)
    fit = _fit(shape, points, criterion)
    i, step = fit.contacts[0], 1e-5
    for j in range(3):
        sides = []
        for way in (step, -step):
            moved = points.copy()
            moved[i, j] += way
            sides.append(_fit(shape, moved, criterion, fit.direction).geometry)
        difference = (sides[0] - sides[1]) / (2.0 * step)
        assert fit.jacobian[:, 3 * i + j] == pytest.approx(difference, abs=2e-6)


@pytest.mark.parametrize("shape", [Shape.LINE, Shape.PLANE, Shape.CONE])
def test_other_shapes_are_not_bounded(shape: Shape) -> None:
    rng = np.random.default_rng(12)
    with pytest.raises(FitError, match="not available"):
        _fit(shape, sample(shape, rng, 20, 0.01), Criterion.INSCRIBED)


@pytest.mark.parametrize("n", [3, 4, 7, 30])
def test_the_narrowest_tube_is_the_smallest_circle_seen_along_it(n: int) -> None:
    for seed in range(40):
        rng = np.random.default_rng([n, seed])
        # Wide and narrow clouds: three places close the circle, or two.
        points = rng.normal(size=(n, 3)) * [50.0, 1.0, rng.choice([0.05, 1.0])]
        axes = rotation_from_vector(rng.normal(size=3))
        wanted = 2.0 * smallest_around(points @ axes[1:].T)
        assert narrowest_tube(points, axes) == pytest.approx(wanted, abs=1e-10)
