"""Statements about values that cannot be negative, and about all kinds of results, hold their word.

The full tables, 100,000 values at their limits, are those of `benchmarks.decisions`.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal, ncx2

from benchmarks.decision_parts import GROUPS
from benchmarks.decisions import run
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float
from ocmm_core.measuring import factors_of_matrix
from ocmm_core.tolerances.decisions._decision import PROBABILITY
from ocmm_core.tolerances.kinds import evaluate
from ocmm_core.tolerances.uncertainty import Normal, expanded, form_samples, spreads_of
from ocmm_core.tolerances.uncertainty._interval import Length, Rank, within
from ocmm_core.tolerances.uncertainty._spread import Extent
from ocmm_core.tolerances.zones import Association
from tests.core.tolerances.known_part import PLACES, KnownPart, asked, motion, ring


@pytest.mark.parametrize("k", [1, 2, 3])
@pytest.mark.parametrize(("radius", "length"), [(0.5, 0.0), (2.0, 1.0), (3.0, 5.0), (40.0, 41.0)])
def test_a_round_zone_holds_what_the_noncentral_distribution_says(
    k: int, radius: float, length: float
) -> None:
    mean = np.zeros(k)
    mean[-1] = 0.7 * length
    expected = ncx2.cdf((radius / 0.7) ** 2, k, max(length**2, 1e-12))
    assert within(radius, mean, 0.7**2 * np.eye(k)) == pytest.approx(expected, abs=1e-9)


def test_a_zone_of_unequal_errors_holds_what_is_counted() -> None:
    rng = np.random.default_rng(0)
    covariance = np.array([[4.0, 1.0, 0.01], [1.0, 1.0, 0.0], [0.01, 0.0, 1e-4]])
    mean = np.array([1.0, -0.5, 0.3])
    drawn = multivariate_normal(mean, covariance).rvs(400_000, random_state=rng)
    for radius in (0.5, 1.5, 4.0):
        share = float(np.mean(np.linalg.norm(drawn, axis=1) <= radius))
        # Three standard errors of 400,000.
        assert within(radius, mean, covariance) == pytest.approx(share, abs=0.0025)


@pytest.mark.statistics
@pytest.mark.parametrize("length", [0.0, 0.5, 2.0, 8.0])
@pytest.mark.parametrize("sigmas", [(1.0, 1.0), (1.0, 0.3)])
def test_positions_from_none_to_far(length: float, sigmas: tuple[float, float]) -> None:
    rng = np.random.default_rng(1)
    covariance = np.diag(np.square(sigmas))
    draws = 250
    covered = accepted = rejected = 0
    for _ in range(draws):
        turn = rng.uniform(0.0, 2.0 * np.pi)
        true = length * np.array([np.cos(turn), np.sin(turn)])
        spread = Length(true + rng.normal(size=2) * sigmas, covariance)
        covered += abs(spread.value - length) <= expanded(spread, spread.value)
        accepted += spread.inside(0.0, length) >= PROBABILITY
        rejected += spread.beyond(0.0, length) >= PROBABILITY
    # Three standard errors: 3.7 % at 96 %, 3.0 % at 2.5 %. Near zero U holds a little more.
    assert covered / draws > 0.94 - 0.037
    assert covered / draws < (0.99 if length < 3.0 else 0.97 + 0.03)
    assert accepted / draws < 0.025 + 0.03
    assert rejected / draws < 0.025 + 0.03


def _form(kind: str, n: int, rng: np.random.Generator) -> Float:
    turn = 2.0 * np.pi * np.arange(n) / n
    match kind:
        case "none":
            return np.zeros(n)
        case "lobes":
            return np.asarray(3.0 * np.sin(3.0 * turn + rng.uniform(0.0, 7.0)))
        case "rough":
            return rng.normal(size=n)
    found = np.zeros(n)
    found[rng.integers(n)] = 6.0
    return found


@pytest.mark.statistics
@pytest.mark.parametrize("kind", ["none", "lobes", "rough", "spike"])
def test_forms_of_all_sorts(kind: str) -> None:
    rng = np.random.default_rng(2)
    n, draws = 12, 100
    turn = 2.0 * np.pi * np.arange(n) / n
    design = np.column_stack([np.cos(turn), np.sin(turn), np.ones(n)])
    rest = np.eye(n) - design @ np.linalg.pinv(design)
    covered = accepted = rejected = 0
    for _ in range(draws):
        true = rest @ _form(kind, n, rng)
        measured = true + rest @ rng.normal(size=n)
        high, low = int(np.argmax(measured)), int(np.argmin(measured))
        sigma = float(np.linalg.norm(rest[high] - rest[low]))
        spread = Extent(float(np.ptp(measured)), sigma, measured, rest @ rest.T)
        form = float(np.ptp(true))
        covered += abs(spread.value - form) <= expanded(spread, spread.value)
        accepted += spread.inside(0.0, form) >= PROBABILITY
        rejected += spread.beyond(0.0, form) >= PROBABILITY
    # Three standard errors of 100: 6.5 % at 95 %, 4.7 % at 2.5 %.
    assert covered / draws > 0.94 - 0.065
    assert accepted / draws < 0.025 + 0.047
    assert rejected / draws < 0.025 + 0.047


@pytest.mark.statistics
@pytest.mark.parametrize(
    ("kind", "greatest"), [("none", True), ("none", False), ("rough", True), ("spike", False)]
)
def test_the_greatest_and_the_smallest_of_many_sizes(kind: str, greatest: bool) -> None:
    rng = np.random.default_rng(3)
    n, draws = 8, 50
    covered = accepted = rejected = plain = 0
    for _ in range(draws):
        true = _form(kind, n, rng) * (1.0 if greatest else -1.0)
        sizes = true + rng.normal(size=n)
        real, value = (true.max(), sizes.max()) if greatest else (true.min(), sizes.min())
        spread = Rank(float(value), 1.0, sizes, np.eye(n), greatest)
        covered += abs(value - real) <= expanded(spread, spread.value)
        plain += abs(value - real) <= 2.0
        far = -1e3 if greatest else 1e3
        # The limit beyond the true value on one side, then on the other.
        for low, high in (sorted((far, real)), sorted((-far, real))):
            accepted += spread.inside(low, high) >= PROBABILITY
            rejected += spread.beyond(low, high) >= PROBABILITY
    # Three standard errors of 50: 9 % at 95 %, and at the 5 % of both limits together.
    assert covered / draws > 0.94 - 0.09
    assert accepted / draws < 2.0 * 0.025 + 0.09
    assert rejected / draws < 2.0 * 0.025 + 0.09
    if kind == "none":
        # Eight sizes that are all the same: one of them is off by 2 u far too often.
        assert plain / draws < 0.9


def test_a_two_point_size_is_not_uncertain_by_the_form_that_belongs_to_it() -> None:
    part = KnownPart(PLACES[0])
    out = ring(motion(50, -90, 3), 15.0, bulge=lambda t: 0.02 * np.cos(2 * t), inner=True)
    part.add("oval", Shape.CIRCLE, out, point=(50, -90, 3), diameter=30.0, side="inner")
    oval = part.actual()
    coordinates = 3 * len(part.points) + 1
    covariance = 0.002**2 * np.eye(coordinates)
    covariance[-1, -1] = 0.0
    factors = factors_of_matrix(covariance)
    samples = form_samples(oval, factors)
    # Out of round by 0.02 mm, with points good to 0.002 mm.
    assert samples[0].variance > 0.01**2

    def sigma(association: Association) -> float:
        item = asked("diameter", "oval", association=association)
        found = evaluate(item, oval, None)
        spread = spreads_of(item, found, oval, factors, samples).of_value
        assert isinstance(spread, Rank) == association.endswith("mum")
        return spread.sigma

    # Two points, each good to 0.002 mm.
    assert sigma("two-point maximum") == pytest.approx(0.002 * np.sqrt(2.0), rel=0.02)
    assert sigma("two-point minimum") == pytest.approx(0.002 * np.sqrt(2.0), rel=0.02)
    assert sigma("two-point mean") < 0.002
    # The fitted diameter does depend on the touched places of the form.
    assert sigma("least squares") > 0.004


def test_only_what_cannot_be_negative_has_a_wider_interval() -> None:
    assert expanded(Normal(0.0, 1.0), 0.0) == 2.0
    # Zero deviation: the measured value is noise alone, and the interval reaches down to zero.
    near = Length(np.array([2.3, 0.0]), np.eye(2))
    assert expanded(near, near.value) == pytest.approx(2.3)
    far = Length(np.array([20.0, 0.0]), np.eye(2))
    assert expanded(far, far.value) == pytest.approx(2.0, abs=1e-3)


@pytest.mark.slow
@pytest.mark.statistics
def test_sizes_and_places_of_parts_with_and_without_form() -> None:
    parts = 60
    covered = accepted = rejected = total = 0
    for count in run(GROUPS[0], 3, parts).values():
        assert count.failed == 0
        total += count.parts
        covered += count.covered
        accepted += count.accepted["iso14253-1"][0]
        rejected += count.rejected["iso14253-1"][0]
        # Three standard errors of 30: 12 % at 95 %.
        assert count.covered / count.parts > 0.94 - 0.12
    # Nine values of a part are not independent: 540 of them count like some 200.
    assert 0.94 - 0.045 < covered / total < 0.97 + 0.03
    assert accepted / total < 0.025 + 0.033
    assert rejected / total < 0.025 + 0.033
