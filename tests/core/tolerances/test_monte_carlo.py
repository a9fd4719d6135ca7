"""Monte Carlo: elements of the ordinary fits, the right distributions, the same again, an end."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.alignment import DatumAlignment
from ocmm_core.errors import MeasuringError
from ocmm_core.features.measured import ActualFeature, actual_features
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector
from ocmm_core.measuring import MeasuredPoint, factors_of_matrix
from ocmm_core.tolerances.monte_carlo import MonteCarloOptions, Task, simulate, simulate_elsewhere
from ocmm_core.tolerances.monte_carlo._monte_carlo import tolerance_of
from ocmm_core.tolerances.monte_carlo._trials import quick_model, refits_of, slow_trials
from ocmm_core.tolerances.zones import Characteristic
from tests.core.features.exact_touches import (
    flat_touches,
    moved,
    nominal,
    round_touches,
    shape_touches,
    touches,
)
from tests.host import BUSY

T_WORLD_FROM_PART = RigidTransform(
    rotation_from_vector(np.array([0.4, -0.7, 1.1])), np.array([120.0, -80.0, 950.0])
)
RULE = DatumAlignment(primary="top", secondary=("a", "b"), origin="a")
FEATURES = [
    nominal("top", Shape.PLANE),
    nominal("a", Shape.CIRCLE, 12.0, "inner", projection="top"),
    nominal("b", Shape.CIRCLE, 8.0, "inner", projection="top"),
    nominal("free", Shape.CIRCLE, 30.0),
    nominal("ball", Shape.SPHERE, 20.0),
    nominal("pin", Shape.CYLINDER, 16.0),
    nominal("dot", Shape.POINT),
    nominal("edge", Shape.LINE),
    nominal("cone", Shape.CONE, 40.0),
    nominal("ring", Shape.TORUS, 60.0),
]


def _at(x: float, y: float, z: float) -> RigidTransform:
    return T_WORLD_FROM_PART.compose(RigidTransform(np.eye(3), np.array([x, y, z])))


def _points() -> list[MeasuredPoint]:
    points = flat_touches("top", _at(30.0, 10.0, 0.0))
    for name, x, diameter in (("a", 0.0, 12.0), ("b", 60.0, 8.0)):
        points += round_touches(name, Shape.CIRCLE, diameter, "inner", _at(x, 0.0, -2.0), n=7)
    points += round_touches("free", Shape.CIRCLE, 30.0, "outer", _at(0.0, 90.0, 5.0), n=9)
    points += round_touches("ball", Shape.SPHERE, 20.0, "outer", _at(25.0, 40.0, 30.0))
    points += round_touches("pin", Shape.CYLINDER, 16.0, "outer", _at(-50.0, 20.0, 15.0))
    axes = T_WORLD_FROM_PART.rotation.T
    points += touches("dot", _at(5.0, 6.0, 7.0).translation[None], axes[2:])
    along = np.array([[t, -30.0, 0.0] for t in (0.0, 20.0, 50.0, 80.0)])
    points += touches("edge", T_WORLD_FROM_PART.apply(along), np.tile(-axes[1], (4, 1)))
    points += shape_touches("cone", Shape.CONE, "outer", _at(0.0, 0.0, 200.0))
    points += shape_touches("ring", Shape.TORUS, "outer", _at(200.0, 0.0, 0.0))
    rng = np.random.default_rng(7)
    rough = moved(points, rng.normal(0.0, 0.01, (len(points), 3)))
    return [replace(point, number=i + 1) for i, point in enumerate(rough)]


POINTS = _points()


def _actual(points: Sequence[MeasuredPoint], features: Sequence[NominalFeature]) -> dict[
    str, ActualFeature
]:  # fmt: skip
    found = actual_features(features, points)
    assert all(isinstance(item, ActualFeature) for item in found.values())
    return {name: item for name, item in found.items() if isinstance(item, ActualFeature)}


def _deviations(count: int, sigma: float) -> Float:
    return np.random.default_rng(3).normal(0.0, sigma, (count, 3 * len(POINTS) + 1))


def test_every_trial_fits_what_the_ordinary_fit_does() -> None:
    deviations = _deviations(3, 0.02)
    fitted: dict[str, Float] = {}
    for item in refits_of(_actual(POINTS, FEATURES)):
        found, ranges, failed = item.geometries(deviations, fitted)
        assert failed == 0
        fitted[item.name] = found
        for trial, by in enumerate(deviations):
            points = [
                replace(
                    point,
                    tip_world=point.tip_world + by[3 * i : 3 * i + 3],
                    tip_radius=point.tip_radius + by[-1],
                )
                for i, point in enumerate(POINTS)
            ]
            ordinary = _actual(points, FEATURES)[item.name].fit
            # Two Newton steps from 0.02 mm away on some mm, and a square of the last one's rest.
            assert found[trial] == pytest.approx(ordinary.geometry, abs=1e-8), item.name
            if ordinary.shape is not Shape.LINE:
                assert ranges[trial] == pytest.approx(ordinary.form, abs=1e-8), item.name
    assert set(fitted) == {feature.name for feature in FEATURES}


def _asked(name: str, kind: str, features: list[str], **more: object) -> Characteristic:
    fields = {"name": name, "kind": kind, "features": features, "lower": -0.1, "upper": 0.1}
    return Characteristic(**{**fields, **more})  # type: ignore[arg-type]


ASKED = (
    _asked("bore", "diameter", ["a"]),
    _asked("pitch", "distance", ["a", "b"]),
    _asked("height", "coordinate", ["ball"], axis="z"),
    _asked("across", "coordinate", ["pin"], axis="x"),
    _asked("round", "roundness", ["free"], association="least squares"),
    _asked("place", "position", ["ball"]),
)
SLOW = _asked("flat", "flatness", ["top"])
NAMES = ("top", "a", "b", "free", "ball", "pin")
JOB_FEATURES = [
    replaced
    for item in FEATURES
    if item.name in NAMES
    for replaced in (
        NominalFeature(
            name=item.name, shape=item.shape, points=1, diameter=item.diameter, side=item.side,
            projection=item.projection,
            point={"a": (0.0, 0.0, 0.0), "b": (60.0, 0.0, 0.0), "ball": (25.0, 40.0, 30.0)}.get(
                item.name, (0.0, 0.0, 0.0)
            ),
        ),
    )
]  # fmt: skip


def _task(asked: Sequence[Characteristic], sigma: float = 0.004) -> Task:
    n = 3 * len(POINTS) + 1
    # What all points share moves no size and no distance; the ball's radius moves sizes.
    shared = np.kron(np.ones((n // 3 + 1,) * 2), np.eye(3))[:n, :n]
    covariance = sigma**2 * (np.eye(n) + 2.0 * shared)
    covariance[-1], covariance[:, -1] = 0.0, 0.0
    covariance[-1, -1] = (0.5 * sigma) ** 2
    form = np.zeros((len(POINTS), 3, 3))
    factors = factors_of_matrix(covariance)
    return Task(tuple(asked), RULE, tuple(POINTS), _actual(POINTS, JOB_FEATURES), factors, form)


def test_quick_trials_are_the_slow_ones() -> None:
    task = _task(ASKED)
    model = quick_model(task)
    assert list(model.values) == [item.name for item in ASKED]
    deviations = task.factors.draws()(np.random.default_rng(5), 3)
    quick, failed = model.trials(deviations)
    slow, lost = slow_trials(task, [item.name for item in ASKED], deviations)
    assert (failed, lost) == (0, 0)
    # Third order in 0.01 mm over some 10 mm; the vector of the position second order.
    assert quick[:, :-1] == pytest.approx(slow[:, :-1], abs=1e-8)
    assert quick[:, -1] == pytest.approx(slow[:, -1], abs=1e-5)


def test_small_noise_gives_what_linear_propagation_says() -> None:
    report = simulate(_task(ASKED[:4]), MonteCarloOptions(max_trials=60_000, batch=6_000, digits=1))
    assert report.failed == 0
    for item in report.values:
        # Sixty thousand trials know sigma to 0.3 %.
        assert item.sigma == pytest.approx(item.standard, rel=0.01)
        assert item.mean == pytest.approx(item.value, abs=0.02 * item.standard)
        assert item.settled
        assert item.validated
        low, high = item.shortest
        assert high - low <= item.symmetric[1] - item.symmetric[0]
        assert high - low == pytest.approx(4.0 * item.standard, rel=0.02)


def test_a_length_near_zero_is_not_normal_and_the_report_says_so() -> None:
    # The position of a centre at its nominal place, in noise: 2 |e|, never negative.
    place = _asked("place", "position", ["ball"])
    options = MonteCarloOptions(max_trials=20_000, batch=2_000, digits=1)
    report = simulate(_task([place], sigma=0.05), options)
    (item,) = report.values
    assert item.symmetric[0] > 0.0
    assert item.shortest[1] - item.shortest[0] < 0.98 * (item.symmetric[1] - item.symmetric[0])
    assert not item.validated


def test_it_ends_when_the_tolerance_is_met_and_needs_more_for_two_digits() -> None:
    task = _task(ASKED[:1])
    options = MonteCarloOptions(max_trials=60_000, batch=2_000, digits=1)
    one = simulate(task, options).values[0]
    two = simulate(task, replace(options, digits=2)).values[0]
    assert 20_000 <= one.trials < two.trials
    assert one.settled
    # JCGM 101 (7.9.2), example: 0.035 to two digits has a tolerance of 0.0005.
    assert tolerance_of(0.035, 2) == pytest.approx(0.0005)
    assert tolerance_of(0.035, 1) == pytest.approx(0.005)


def test_the_same_seed_gives_the_same_numbers_with_any_number_of_threads() -> None:
    task = _task([*ASKED[:2], SLOW])
    options = MonteCarloOptions(
        max_trials=4_000, batch=1_000, max_slow_trials=4, slow_batch=2, adaptive=False
    )
    first = simulate(task, options)
    again = simulate(task, replace(options, threads=1))
    other = simulate(task, replace(options, seed=2))
    assert first.values == again.values
    assert first.values != other.values
    assert [item.trials for item in first.values] == [4_000, 4_000, 4]


@pytest.mark.slow
@pytest.mark.timing
def test_another_process_gives_the_same_numbers_tells_and_ends_when_asked() -> None:
    task = _task(ASKED[:2])
    options = MonteCarloOptions(max_trials=20_000, adaptive=False)
    shares: list[float] = []
    there = simulate_elsewhere(task, options, lambda what, share: shares.append(share))
    assert there.values == simulate(task, options).values
    assert shares == sorted(shares)
    assert shares[-1] == 1.0

    enough = threading.Event()
    begun = time.monotonic()
    long = replace(options, max_trials=20_000_000)
    with pytest.raises(MeasuringError, match="cancelled"):
        simulate_elsewhere(task, long, lambda what, share: enough.set(), enough.is_set)
    # Starting takes seconds on a busy computer; a run to the end would take minutes.
    assert time.monotonic() - begun < BUSY * 3.0


def test_giving_up_ends_it_between_blocks() -> None:
    asked = 0

    def given_up() -> bool:
        nonlocal asked
        asked += 1
        return asked > 5

    with pytest.raises(MeasuringError, match="cancelled"):
        simulate(_task(ASKED[:1]), MonteCarloOptions(max_trials=10_000_000), given_up=given_up)
    assert asked < 30


def test_trials_without_a_result_are_counted_and_left_out() -> None:
    task = _task([_asked("pin size", "diameter", ["pin"], association="minimum zone")])
    # A ball that may be larger than pin and ball together leaves no pin in about half the trials.
    ball = np.zeros((len(task.factors.shared), 1))
    ball[-1] = 1e4
    unsure = replace(task.factors, shared=np.hstack([task.factors.shared, ball]))
    options = MonteCarloOptions(max_slow_trials=12, slow_batch=3, adaptive=False)
    report = simulate(replace(task, factors=unsure), options)
    assert 0 < report.failed < 12
    assert report.values[0].trials == 12 - report.failed
