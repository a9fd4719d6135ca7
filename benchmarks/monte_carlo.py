"""A million trials of a job of five features, and how much faster that is than a plain loop.

    python -m benchmarks.monte_carlo [--trials N]

Plane, two bores projected onto it, sphere and cylinder: 54 points, seven characteristics, one of
them in the frame of the part. Every trial fits all five anew. The loop beside it does the same with
numpy and scipy's least squares, warm as well. Ends with 1 if a million trials take more than ten
seconds of two processors, or if linear propagation is not what the trials say.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from typing import Literal

import numpy as np
from scipy.optimize import least_squares

from ocmm_core.alignment import DatumAlignment
from ocmm_core.blas import use_one_thread
from ocmm_core.features.measured import ActualFeature, actual_features
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float, perpendicular_pair, unit
from ocmm_core.measuring import MeasuredPoint, factors_of_matrix
from ocmm_core.tolerances.monte_carlo import (
    MonteCarloOptions,
    MonteCarloReport,
    Task,
    simulate_elsewhere,
)
from ocmm_core.tolerances.zones import Characteristic

LIMIT_S = 10.0
TIP = 3.0
WHITE_MM, COMMON_MM = 0.004, 0.006
_RULE = DatumAlignment(primary="TOP", secondary=("A", "B"), origin="A")
_LOOP_TRIALS = 200


def job(seed: int) -> Task:
    """Return the measured job: 54 noisy touches of an oblique part."""
    rng = np.random.default_rng(seed)
    axis = unit(np.array([0.2, -0.3, 0.9]))
    u, v = perpendicular_pair(axis)
    basis = np.stack([u, v, axis])
    tips: list[Float] = []
    sides: list[Float] = []
    names: list[str] = []

    def add(name: str, local: Float, normals: Float) -> None:
        names.extend([name] * len(local))
        tips.extend(local @ basis + np.array([100.0, -50.0, 900.0]))
        sides.extend(normals @ basis)

    grid = np.stack(np.meshgrid([-40.0, 0.0, 40.0], [-30.0, 0.0, 30.0]), axis=-1).reshape(-1, 2)
    add("TOP", np.column_stack([grid, np.full(9, TIP)]), np.tile([0.0, 0.0, 1.0], (9, 1)))
    for name, x in (("A", -25.0), ("B", 25.0)):
        turn = np.arange(8) * 2.0 * np.pi / 8
        ring = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(8)])
        add(name, (10.0 - TIP) * ring + np.array([x, 0.0, -3.0]), -ring)
    directions = unit(rng.normal(size=(17, 3)) + np.array([0.0, 0.0, 1.0]))
    add("BALL", (10.0 + TIP) * directions + np.array([0.0, 80.0, 20.0]), directions)
    turn = np.arange(12) * 2.0 * np.pi / 6 + 0.2
    ring = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(12)])
    heights = np.repeat([0.0, 25.0], 6)[:, None] * np.array([0.0, 0.0, 1.0])
    add("PIN", (15.0 + TIP) * ring + heights + np.array([80.0, 0.0, 5.0]), ring)

    n = len(tips)
    moved = np.array(tips) + WHITE_MM * rng.normal(size=(n, 3))
    points = [
        MeasuredPoint(
            number=i + 1, feature=names[i], time_s=float(i), first_frame=0, last_frame=9,
            n_frames=10, tip_world=moved[i], random_covariance=WHITE_MM**2 * np.eye(3),
            direction=sides[i], tip_radius=TIP, rotation_world_from_probe=np.eye(3),
            spots=np.full((2, 4, 2), np.nan), chi2_per_dof=1.0, approach="trail",
        )
        for i in range(n)
    ]  # fmt: skip
    actual = {k: v for k, v in actual_features(_features(), points).items()
              if isinstance(v, ActualFeature)}  # fmt: skip
    covariance = np.zeros((3 * n + 1, 3 * n + 1))
    covariance[:-1, :-1] = np.kron(np.full((n, n), COMMON_MM**2), np.eye(3))
    covariance[:-1, :-1] += WHITE_MM**2 * np.eye(3 * n)
    covariance[-1, -1] = 0.001**2
    factors = factors_of_matrix(covariance)
    return Task(characteristics(), _RULE, tuple(points), actual, factors, np.zeros((n, 3, 3)))


def _features() -> list[NominalFeature]:
    return [
        NominalFeature(name="TOP", shape=Shape.PLANE, points=9, point=(0.0, 0.0, 0.0)),
        NominalFeature(name="A", shape=Shape.CIRCLE, points=8, point=(-25.0, 0.0, 0.0),
                       diameter=20.0, side="inner", projection="TOP"),
        NominalFeature(name="B", shape=Shape.CIRCLE, points=8, point=(25.0, 0.0, 0.0),
                       diameter=20.0, side="inner", projection="TOP"),
        NominalFeature(name="BALL", shape=Shape.SPHERE, points=17, point=(0.0, 80.0, 20.0),
                       diameter=20.0),
        NominalFeature(name="PIN", shape=Shape.CYLINDER, points=12, point=(80.0, 0.0, 5.0),
                       diameter=30.0),
    ]  # fmt: skip


def characteristics() -> tuple[Characteristic, ...]:
    """Return the simulated characteristics."""
    return (
        _asked("Bore A", "diameter", ["A"], 20.0),
        _asked("Bore B", "diameter", ["B"], 20.0),
        _asked("Pitch", "distance", ["A", "B"], 50.0),
        _asked("Ball", "diameter", ["BALL"], 20.0),
        _asked("Pin", "diameter", ["PIN"], 30.0),
        _asked("Ball height", "coordinate", ["BALL"], 20.0, "z"),
        _asked("Pin x", "coordinate", ["PIN"], 105.0, "x"),
    )


def _asked(
    name: str, kind: str, features: list[str], nominal: float, axis: Literal["", "x", "z"] = ""
) -> Characteristic:
    return Characteristic(
        name=name, kind=kind, features=features, nominal=nominal, lower=-0.1, upper=0.1, axis=axis
    )


def loop_seconds(task: Task, trials: int) -> float:
    """Return the processor time of one trial in a plain loop of numpy and scipy, s."""
    draws = task.factors.draws()
    rng = np.random.default_rng(0)
    tips = {name: item.touches.tips for name, item in task.actual.items() if item.touches}
    places = {name: item.touches.places for name, item in task.actual.items() if item.touches}
    begun = time.process_time()
    for _ in range(trials):
        by = draws(rng, 1)[0, :-1].reshape(-1, 3)
        moved = {name: points + by[list(places[name])] for name, points in tips.items()}
        top = moved["TOP"] - moved["TOP"].mean(axis=0)
        normal = np.linalg.svd(top, full_matrices=False)[2][2]
        basis = np.stack(perpendicular_pair(normal))
        for name in ("A", "B"):
            _ball(moved[name] @ basis.T, 7.0)
        _ball(moved["BALL"], 13.0)
        _cylinder(moved["PIN"], task.actual["PIN"].fit.direction, 18.0)
    return (time.process_time() - begun) / trials


def _ball(points: Float, radius: float) -> Float:
    def residuals(p: Float) -> Float:
        return np.asarray(np.linalg.norm(points - p[:-1], axis=1) - p[-1])

    start = np.append(points.mean(axis=0), radius)
    return np.asarray(least_squares(residuals, start, method="lm").x)


def _cylinder(points: Float, direction: Float, radius: float) -> Float:
    e1, e2 = perpendicular_pair(direction)
    middle = points.mean(axis=0)

    def residuals(p: Float) -> Float:
        axis = unit(direction + p[2] * e1 + p[3] * e2)
        arms = points - middle - p[0] * e1 - p[1] * e2
        return np.asarray(np.linalg.norm(arms - np.outer(arms @ axis, axis), axis=1) - p[4])

    return np.asarray(least_squares(residuals, [0.0, 0.0, 0.0, 0.0, radius], method="lm").x)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table and return 0, or 1 beyond a limit."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=1_000_000)
    trials = parser.parse_args(arguments).trials
    use_one_thread()
    task = job(1)
    warm = MonteCarloOptions(max_trials=20_000, adaptive=False)
    simulate_elsewhere(task, warm)
    report = simulate_elsewhere(task, MonteCarloOptions(max_trials=trials, adaptive=False))
    _print(report)
    a_trial = report.processor_s / trials
    loop = loop_seconds(task, _LOOP_TRIALS)
    print(f"{trials} trials in {report.seconds:.2f} s ({report.processor_s:.2f} of processors)")
    print(f"{1e6 * a_trial / 2.0:.2f} s a million on two of them (limit {LIMIT_S:.0f})")
    print(f"numpy and scipy: {1e3 * loop:.2f} ms a trial, {loop / a_trial:.0f} times as much")
    adaptive = simulate_elsewhere(task, MonteCarloOptions(digits=1))
    print(f"adaptive, one digit of u: {adaptive.values[0].trials} trials, {adaptive.seconds:.2f} s")
    wrong = [item.name for item in report.values if abs(item.sigma / item.standard - 1.0) > 0.01]
    return int(0.5e6 * a_trial > LIMIT_S or bool(wrong) or report.failed > 0)


def _print(report: MonteCarloReport) -> None:
    print(f"{'value':<14}{'u lin um':>10}{'u MC um':>10}{'low um':>10}{'high um':>10}{'tol um':>8}"
          f"{'GUM':>9}")  # fmt: skip
    for item in report.values:
        low, high = (1e3 * (end - item.value) for end in item.symmetric)
        print(f"{item.name:<14}{1e3 * item.standard:>10.3f}{1e3 * item.sigma:>10.3f}{low:>10.3f}"
              f"{high:>10.3f}{1e3 * item.tolerance:>8.3f}"
              f"{'valid' if item.validated else 'differs':>9}")  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
