"""The iteration behind circle, sphere and cylinder: derivatives, convergence, global minimum."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.features.fit import fit_cylinder
from ocmm_core.features.fit.ball import BallProblem
from ocmm_core.features.fit.cylinder import CylinderProblem
from ocmm_core.features.fit.solver import Problem, minimise
from ocmm_core.geometry import Float

RNG = np.random.default_rng(21)
NEAR_A_BALL = RNG.normal(size=(9, 3))
NEAR_A_CYLINDER = RNG.normal(size=(9, 3))


def _problems() -> list[tuple[Problem, Float]]:
    axis = np.array([0.6, 0.0, 0.8])
    foot = np.array([0.4, 0.3, -0.3])
    return [
        (BallProblem(NEAR_A_BALL[:, :2]), np.array([0.2, -0.1, 1.1])),
        (BallProblem(NEAR_A_BALL), np.array([0.2, -0.1, 0.3, 1.1])),
        (CylinderProblem(NEAR_A_CYLINDER), np.concatenate([foot, axis, [0.9]])),
    ]


@pytest.mark.parametrize("index", range(3), ids=["circle", "sphere", "cylinder"])
def test_first_and_second_derivatives(index: int) -> None:
    # Far from any minimum, where residuals are large and every term counts.
    problem, parameters = _problems()[index]
    residuals, jacobian, curvature = problem.derivatives(parameters)
    k = jacobian.shape[1]

    def moved(step: Float) -> Float:
        return problem.derivatives(problem.move(parameters, step))[0]

    def cost(step: Float) -> float:
        return 0.5 * float(np.sum(moved(step) ** 2))

    h = 1e-4
    units = h * np.eye(k)
    hessian = np.empty((k, k))
    for i in range(k):
        first = (moved(units[i]) - moved(-units[i])) / (2.0 * h)
        assert jacobian[:, i] == pytest.approx(first, abs=1e-6)
        for j in range(k):
            plus = cost(units[i] + units[j]) + cost(-units[i] - units[j])
            minus = cost(units[i] - units[j]) + cost(units[j] - units[i])
            hessian[i, j] = (plus - minus) / (4.0 * h * h)
    assert np.abs(residuals).max() > 0.2
    assert jacobian.T @ jacobian + curvature == pytest.approx(hessian, abs=1e-5)


def test_a_cold_start_is_never_worse_than_one_from_the_truth() -> None:
    # Few points, short arcs and a form of 2 % of the radius: where local minima abound.
    rng = np.random.default_rng(22)
    for n, arc, length in [(9, 1.0, 1.0), (10, 2.0, 0.3), (12, 0.5, 4.0), (16, 6.28, 1.0)] * 10:
        turn = rng.uniform(0.0, arc, n)
        points = np.stack([np.cos(turn), np.sin(turn), rng.uniform(0.0, length, n)], axis=1)
        points += rng.normal(0.0, 0.02, points.shape)
        middle = points.mean(axis=0)
        foot = np.array([-middle[0], -middle[1], 0.0])
        truth = np.concatenate([foot, [0.0, 0.0, 1.0], [1.0]])
        solution = minimise(CylinderProblem(points - middle), truth)
        assert np.sum(fit_cylinder(points).residuals ** 2) <= solution.cost * (1.0 + 1e-9)
