"""What cone, torus and the circle in space share: the problem, trial axes, the choice of a minimum.

Nothing is known of the axis, and these fits have many local minima. Very many starts descend on a
sample of the points in compiled loops; the best ends are refined on all of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ocmm_core.features.fit.axis_kernel import STEP_SIZE, descend, move, terms
from ocmm_core.features.fit.cylinder import hemisphere, ring
from ocmm_core.features.fit.solver import Solution, minimise
from ocmm_core.geometry import Float

SAMPLE = 60
"""Points on which the starts descend."""
KEPT = 60
"""Starts that descend, the most promising first."""
STEPS = 15
REFINED, REFINED_FEW = 8, 30
"""Ends that are refined; many more where points are so few that minima abound."""
FEW_POINTS = 12
TRIAL_AXES = 80
RINGS = np.deg2rad([1.5, 4.0, 10.0])
SAME = 1e-6
"""Relative difference below which two minima are one."""
EXACT = 1e-10
"""Residual against the size of the points below which an element passes through a point."""


@dataclass(frozen=True, slots=True)
class AxisProblem:
    """Distances of points (n, 3) from an element about an axis; see `axis_kernel`."""

    kind: int
    points: Float

    def derivatives(self, parameters: Float) -> tuple[Float, Float, Float]:
        """Return residuals, their derivatives and their curvature; see `solver.Problem`."""
        k = STEP_SIZE[self.kind]
        rows = len(self.points) * (2 if k == 6 and self.kind else 1)
        residuals, jacobian, curvature = np.empty(rows), np.empty((rows, k)), np.empty((k, k))
        terms(self.kind, self.points, parameters, residuals, jacobian, curvature)
        return residuals, jacobian, curvature

    def move(self, parameters: Float, step: Float) -> Float:
        """Return the parameters (8,) after a step (k,)."""
        moved = np.empty(8)
        move(self.kind, parameters, step, moved)
        return moved


def trial_axes(points: Float) -> Float:
    """Return trial axes (m, 3): the principal ones, rings around them, and a hemisphere."""
    principal = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]
    rings = [ring(principal, k, RINGS) for k in range(3)]
    return np.concatenate([principal, *rings, hemisphere(TRIAL_AXES)])


def sampled(points: Float, count: int) -> Float:
    """Return at most ``count`` of the points (n, 3), evenly from all of them."""
    if len(points) <= count:
        return np.ascontiguousarray(points)
    return np.ascontiguousarray(points[np.linspace(0, len(points) - 1, count).astype(np.int64)])


def minima(
    kind: int, points: Float, starts: Float, possible: Callable[[Float], bool]
) -> list[Solution]:
    """Return the minima that were found from ``starts`` (m, 8), best first, each once.

    Parameters
    ----------
    kind
        Of `axis_kernel`.
    points
        (n, 3), centred and scaled.
    starts
        (m, 8).
    possible
        Whether parameters (8,) are an element at all.
    """
    few = len(points) <= FEW_POINTS
    sample = sampled(points, SAMPLE)
    k = STEP_SIZE[kind]
    starts = np.ascontiguousarray(starts[np.isfinite(starts).all(axis=1)])
    costs = np.empty(len(starts))
    descend(kind, sample, starts, k, 0, costs)
    starts = starts[np.argsort(costs, kind="stable")[: KEPT * (3 if few else 1)]]
    costs = np.empty(len(starts))
    descend(kind, sample, starts, k, STEPS * (3 if few else 1), costs)
    problem = AxisProblem(kind, points)
    found: list[Solution] = []
    tried: list[Float] = []
    for i in np.argsort(costs, kind="stable"):
        if len(tried) >= (REFINED_FEW if few else REFINED):
            break
        if not np.isfinite(costs[i]) or any(_same(starts[i], other, 1e-3) for other in tried):
            continue
        tried.append(starts[i])
        solution = minimise(problem, starts[i])
        if solution.converged and possible(solution.parameters):
            if not any(_same(solution.parameters, other.parameters, SAME) for other in found):
                found.append(solution)
    return sorted(found, key=lambda solution: solution.cost)


def exact(solutions: list[Solution], n: int) -> list[Solution]:
    """Return those of ``solutions`` that pass through all ``n`` points."""
    return [solution for solution in solutions if solution.cost < n * EXACT**2]


def _same(first: Float, second: Float, tolerance: float) -> bool:
    """Return whether two sets of parameters describe one element, their axes without sense."""
    sense = 1.0 if first[3:6] @ second[3:6] > 0.0 else -1.0
    turned = float(np.abs(first[3:6] - sense * second[3:6]).max())
    scale = 1.0 + float(np.abs(first[[0, 1, 2, 6, 7]]).max())
    near = float(np.abs(first[0:3] - second[0:3]).max())
    size = float(np.abs(np.abs(first[6:8]) - np.abs(second[6:8])).max())
    return turned < tolerance and near < tolerance * scale and size < tolerance * scale
