"""Budgets add up to the uncertainty of the result for all kinds of values; form counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ocmm_core.features.measured import ActualFeature
from ocmm_core.measuring import (
    CAMERAS,
    IMAGE_NOISE,
    TIP_RADIUS,
    Contribution,
    MeasuredPoint,
    Rows,
    factors_of,
    factors_of_matrix,
)
from ocmm_core.tolerances.decisions import evaluate_all
from ocmm_core.tolerances.kinds import evaluate
from ocmm_core.tolerances.uncertainty import Budget, FormSample, budget_of, form_samples, widened
from ocmm_core.tolerances.zones import Characteristic
from tests.core.tolerances.test_monte_carlo import ASKED, JOB_FEATURES, POINTS, RULE, SLOW, _actual

pytestmark = pytest.mark.numerics

N = len(POINTS)


def parts(noise: float) -> tuple[Contribution, ...]:
    """Return noise of each point, an error that all share, and the ball."""
    shared = np.vstack([np.tile(np.eye(3), (N, 1)), np.zeros((1, 3))])
    radius = np.zeros((3 * N + 1, 1))
    radius[-1] = 1.0
    scale = np.append(np.concatenate([p.tip_world for p in POINTS]), 0.0)[:, None]
    return (
        Contribution(IMAGE_NOISE, own=np.tile(noise**2 * np.eye(3), (N, 1, 1))),
        Contribution(CAMERAS, np.hstack([shared, 1e-3 * scale]), 0.006**2 * np.eye(4)),
        Contribution(TIP_RADIUS, radius, np.array([[0.001**2]])),
    )


@cache
def measured() -> dict[str, ActualFeature]:
    """Return the features of all tests here."""
    return _actual(POINTS, JOB_FEATURES)


def budget(item: Characteristic, noise: float) -> tuple[Budget, float]:
    """Return the budget, and U of the result."""
    actual = measured()
    found = parts(noise)
    factors = factors_of(found, N)
    samples = form_samples(actual, factors)
    evaluation = evaluate(item, actual, RULE)
    result = evaluate_all([item], RULE, actual, factors, "iso14253-1")[0]
    assert result.uncertainty is not None
    return budget_of(item, evaluation, actual, found, factors, samples), result.uncertainty


@pytest.mark.parametrize("noise", [0.001, 0.02])
@pytest.mark.parametrize("item", [*ASKED, SLOW], ids=lambda item: item.name)
def test_the_squares_add_up(item: Characteristic, noise: float) -> None:
    found, uncertainty = budget(item, noise)
    squares = sum(row.standard**2 for row in found.rows)
    assert squares == pytest.approx(found.standard**2, rel=1e-9)
    assert sum(row.share for row in found.rows) == pytest.approx(1.0)
    assert [row.standard for row in found.rows] == sorted(
        (row.standard for row in found.rows), reverse=True
    )
    # The same sums, of forms in another order.
    assert found.expanded == pytest.approx(uncertainty, rel=1e-12)
    assert found.expanded >= 2.0 * found.standard * (1.0 - 1e-12)


def test_a_surface_that_scatters_more_than_its_points_do_counts() -> None:
    # The points have 0.010 mm of scatter: stated noise of 0.001 leaves it to the form.
    bore = ASKED[0]
    rough, _ = budget(bore, 0.001)
    by_name = {row.name: row for row in rough.rows}
    assert by_name["Form of a"].kind == "A"
    assert by_name["Form of a"].share > 0.5
    assert rough.degrees < 20.0
    smooth, _ = budget(bore, 0.03)
    assert "Form of a" not in {row.name for row in smooth.rows}
    assert smooth.degrees == np.inf


def test_the_form_itself_is_not_uncertain_by_its_form() -> None:
    found, _ = budget(SLOW, 0.001)
    assert "Form of top" not in {row.name for row in found.rows}


def test_form_is_what_noise_does_not_explain() -> None:
    rng = np.random.default_rng(11)
    of_ball = [p for p in POINTS if p.feature == "ball"]
    ball = [item for item in JOB_FEATURES if item.name == "ball"]

    def scatter(points: Sequence[MeasuredPoint]) -> float:
        size = 3 * len(points) + 1
        (sample,) = form_samples(_actual(points, ball), factors_of_matrix(0.004**2 * np.eye(size)))
        return sample.scatter

    drawn = []
    for _ in range(60):
        moved = [
            replace(p, tip_world=p.tip_world + 0.005 * rng.normal() * p.direction) for p in of_ball
        ]
        drawn.append(scatter(moved))
    own = scatter(of_ball)
    # Twelve points, four numbers of a ball, sixty draws: a standard error of 6 %.
    assert np.mean(drawn) == pytest.approx(own + 0.005**2, rel=0.25)


@pytest.mark.parametrize(("degrees", "t"), [(1, 13.968), (4, 2.869), (20, 2.133)])
def test_what_is_known_from_few_points_is_widened_as_student_says(degrees: int, t: float) -> None:
    sample = FormSample(
        feature="f",
        places=np.array([0]),
        normals=np.array([[[1.0], [0.0], [0.0]]]),
        scatter=0.01**2,
        variance=0.01**2,
        degrees=degrees,
    )
    gradients = Rows.of_dense(np.array([[1.0, 0.0, 0.0, 0.0]]))
    alone = widened(gradients, factors_of_matrix(1e-18 * np.eye(4)), [sample])
    # t for 95.45 % (GUM, table G.2): U = 2 u is then t times the standard deviation.
    assert 2.0 * np.sqrt(alone.covariance[0, 0]) == pytest.approx(t * 0.01, rel=1e-3)
    assert alone.degrees == pytest.approx(degrees, rel=1e-6)
    assert alone.of_form["f"][0, 0] == pytest.approx(alone.covariance[0, 0], rel=1e-6)
    # Added to a far greater well-determined variance it hardly counts.
    beside = widened(gradients, factors_of_matrix(0.1**2 * np.eye(4)), [sample])
    assert beside.covariance[0, 0] == pytest.approx(0.1**2 + 0.01**2, rel=0.01)


def test_forms_add_up_before_they_are_held_against_zero() -> None:
    def sample(name: str, place: int, variance: float) -> FormSample:
        normals = np.array([[[1.0], [0.0], [0.0]]])
        return FormSample(name, np.array([place]), normals, 0.01**2, variance, 5)

    gradients = Rows.of_dense(np.array([[1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]]))
    factors = factors_of_matrix(0.01**2 * np.eye(7))
    rough, smooth = sample("rough", 0, 5e-5), sample("smooth", 1, -2e-5)
    alone = widened(gradients, factors, [rough])
    both = widened(gradients, factors, [rough, smooth])
    # Noise below the stated one is subtracted from the excess, before the widening.
    total, doubt = 2e-4 + 5e-5 - 2e-5, 2.0 * 0.01**4 / 5
    assert both.degrees == pytest.approx(total**2 / doubt)
    assert alone.degrees == pytest.approx((2e-4 + 5e-5) ** 2 / (doubt / 2.0))
    assert list(both.of_form) == ["rough"]
    assert both.covariance[0, 0] == pytest.approx(2e-4 + both.of_form["rough"][0, 0])
    # Together not beyond the noise: nothing is added, and nothing taken off.
    less = widened(gradients, factors, [rough, sample("smooth", 1, -6e-5)])
    assert less.of_form == {}
    assert less.covariance[0, 0] == pytest.approx(2e-4)
