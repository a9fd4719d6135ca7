"""Points that do not determine a shape give a sentence, never a number."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.errors import FitError
from ocmm_core.features.measured import fit_shape
from ocmm_core.features.search import unambiguous
from ocmm_core.features.shapes import MINIMUM_POINTS, Shape
from ocmm_core.features.zones import certificate
from ocmm_core.geometry import Points3
from tests.core.features.shape_samples import ALL_SHAPES, RADIUS, ideal_points, somewhere

pytestmark = pytest.mark.numerics

RNG = np.random.default_rng(17)
ON_A_LINE = np.array([5000.0, -300.0, 20.0]) + np.outer(np.linspace(0.0, 40.0, 12), [0.6, 0.0, 0.8])
IN_A_PLANE = somewhere(RNG).apply(ideal_points(Shape.PLANE, RNG, 12))
ON_A_CIRCLE = somewhere(RNG).apply(ideal_points(Shape.CIRCLE, RNG, 12))
ROUND_CLOUD = RNG.normal(0.0, 1.0, (40, 3))


@pytest.mark.parametrize("shape", ALL_SHAPES)
def test_too_few_points(shape: Shape) -> None:
    few = MINIMUM_POINTS[shape] - 1
    with pytest.raises(
        FitError, match=rf"needs at least {few + 1} points \({few} given\)"
    ) as caught:
        fit_shape(shape, np.zeros((few, 3)))
    assert caught.value.code == "fit.too_few_points"


@pytest.mark.parametrize("shape", ALL_SHAPES)
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_coordinate_that_is_no_number_is_named(shape: Shape, bad: float) -> None:
    points = ideal_points(shape, np.random.default_rng(1), 10)
    points[6, 1] = bad
    with pytest.raises(FitError, match="Point 7 of 10") as caught:
        fit_shape(shape, points)
    assert caught.value.code == "fit.not_finite"


@pytest.mark.parametrize("shape", ALL_SHAPES)
def test_masked_points_are_refused_and_a_mask_without_any_is_none(shape: Shape) -> None:
    points = ideal_points(shape, np.random.default_rng(1), 10)
    far = points.copy()
    far[[3, 6], 2] += 1e5
    mask = np.zeros(points.shape, dtype=bool)
    mask[[3, 6], 2] = True
    masked = np.ma.MaskedArray(far, mask)
    for given in (masked, list(masked)):
        with pytest.raises(FitError, match="the first one is point 4") as caught:
            fit_shape(shape, given)  # type: ignore[arg-type] # a list is no array, and is taken
        assert caught.value.code == "fit.masked"
    fit = fit_shape(shape, points)
    with pytest.raises(FitError, match="masked"):
        certificate(fit, masked)
    same = fit_shape(shape, np.ma.MaskedArray(points))
    np.testing.assert_array_equal(same.geometry, fit.geometry)


@pytest.mark.parametrize("shape", ALL_SHAPES[1:])
def test_points_in_one_place(shape: Shape) -> None:
    with pytest.raises(FitError, match="coincide"):
        fit_shape(shape, np.full((9, 3), 1234.5))


@pytest.mark.parametrize(
    ("shape", "points"),
    [
        (Shape.LINE, ROUND_CLOUD),
        (Shape.PLANE, ON_A_LINE),
        (Shape.PLANE, ROUND_CLOUD),
        (Shape.CIRCLE, ON_A_LINE),
        (Shape.CIRCLE, ROUND_CLOUD),
        (Shape.SPHERE, ON_A_LINE),
        (Shape.SPHERE, IN_A_PLANE),
        (Shape.SPHERE, ON_A_CIRCLE),
        (Shape.CYLINDER, ON_A_LINE),
        (Shape.CYLINDER, IN_A_PLANE),
        (Shape.CYLINDER, ON_A_CIRCLE),
    ],
)
def test_points_that_determine_nothing(shape: Shape, points: Points3) -> None:
    with pytest.raises(FitError, match="do not determine") as caught:
        fit_shape(shape, points)
    assert caught.value.code == "fit.degenerate"
    assert caught.value.remedy


@pytest.mark.parametrize("shape", ALL_SHAPES[1:])
def test_the_same_few_places_again_and_again_determine_nothing(shape: Shape) -> None:
    # A bouncing contact: as many points as the shape needs and more, in two places. Rounding once
    # made the square of an extent negative, and NaN passed the checks.
    rng = np.random.default_rng(5)
    for _ in range(300):
        places = rng.normal(size=(2, 3)) * 10.0 ** rng.uniform(-1.0, 3.0) + rng.normal(size=3) * 100
        count = MINIMUM_POINTS[shape] + int(rng.integers(0, 4))
        points = places[np.append([0, 1], rng.integers(0, 2, count - 2))]
        if shape is Shape.LINE:
            fit = fit_shape(shape, points)
            assert np.isfinite(fit.jacobian).all()
            continue
        with pytest.raises(FitError) as caught:
            fit_shape(shape, points)
        assert "nan" not in caught.value.what


def test_an_arc_that_is_all_but_straight() -> None:
    turn = np.linspace(0.0, 2e-4, 9)
    arc = 1e5 * np.stack([np.cos(turn), np.sin(turn), np.zeros(9)], axis=1)
    with pytest.raises(FitError, match="straight line or too short an arc"):
        fit_shape(Shape.CIRCLE, arc)


def test_wrong_form_of_the_array() -> None:
    with pytest.raises(FitError, match="not \\(n, 3\\)"):
        fit_shape(Shape.PLANE, np.zeros((3, 9)))


def test_several_cylinders_through_five_points_are_not_guessed() -> None:
    rng = np.random.default_rng(2)
    refused, decided = [0, 0], [0, 0]
    for _ in range(20):
        points = ideal_points(Shape.CYLINDER, rng, 5)
        # The nominal diameter decides if one cylinder is near it; two may be.
        for case, hint in enumerate((None, RADIUS + 0.1)):
            try:
                fit = unambiguous(fit_shape(Shape.CYLINDER, points, radius_hint=hint))
            except FitError as error:
                refused[case] += error.code == "fit.ambiguous"
            else:
                assert fit.radius == pytest.approx(RADIUS, abs=1e-6)
                decided[case] += 1
    assert refused[0] + decided[0] == refused[1] + decided[1] == 20
    assert refused[0] > 5
    assert decided[1] > decided[0]
