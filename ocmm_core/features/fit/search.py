"""The search for the best minimum of cylinder, cone, torus, slot and rectangle.

Nothing is known of their axis or turn, and they have many local minima. Very many starts descend on
a sample of the points in compiled loops; the best ends are refined on all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.fit.axis_kernel import RING
from ocmm_core.features.fit.newton_kernel import descend, rank
from ocmm_core.features.fit.solver import Solution, derivatives, gains, minimise
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float

SAMPLE = 60
"""Points on which the starts descend."""
KEPT = 60
"""Starts that descend, the most promising first; more for few points, most where none leads."""
KEPT_FEW, KEPT_MOST = 180, 600
STEPS, STEPS_MOST = 15, 300
"""Greatest number; the most where valleys are long and narrow."""
REFINED, REFINED_FEW = 8, 30
"""Ends that are refined; many more where points are so few that minima abound."""
FEW_POINTS = 12
LEAST_REFINED, HOPELESS = 3, 100.0
"""After so many, ends that are still so many times worse on the sample than the best are left."""
CERTAIN_POINTS, CERTAIN_CONDITION = 30, 30.0
CERTAIN_RESIDUAL, CERTAIN_RESIDUAL_FEWER = 0.01, 0.001
"""Condition number and root mean squared residual below which the quick search is believed: points
that lie so close to an element and determine it well lie close to no other. Fewer points have to
lie closer."""
SAME = 1e-6
"""Relative difference below which two minima are one."""
NEAR = 0.05
"""Relative difference from what the plan says that an element through few points may show."""
EXACT = 1e-10
"""Residual against the size of the points below which an element passes through a point."""


def sampled(points: Float, count: int) -> Float:
    """Return at most ``count`` of the points (n, 3), evenly from all of them."""
    if len(points) <= count:
        return np.ascontiguousarray(points)
    return points[np.arange(count) * (len(points) - 1) // (count - 1)]


def nearest_minimum(kind: int, points: Float, starts: Float, kept: int) -> Solution:
    """Return the minimum to which the best of ``kept`` promising ``starts`` (m, 8) leads.

    It may not be the best of all: whoever asks certifies it, or looks for all `minima`.
    """
    sample = sampled(points, SAMPLE)
    costs = np.empty(len(starts))
    rank(kind, sample, starts, costs)
    # A start that is not a number sorts last.
    best = starts[np.argsort(costs)[:kept]]
    costs = np.empty(len(best))
    descend(kind, sample, best, STEPS, costs)
    return minimise(kind, points, best[np.argmin(np.where(np.isfinite(costs), costs, np.inf))])


def minima(
    kind: int,
    points: Float,
    starts: Float,
    possible: Callable[[Float], bool],
    more: Callable[[], Float] | None = None,
) -> list[Solution]:
    """Return the minima that were found from ``starts`` (m, 8), best first, each once.

    Parameters
    ----------
    kind
        Of `axis_kernel` or `flat_kernel`.
    points
        (n, d), centred and scaled.
    starts
        (m, 8).
    possible
        Whether parameters (8,) are an element at all.
    more
        Gives further starts (m, 8) where the first ones leave a doubt.
    """
    few = len(points) <= FEW_POINTS
    starts = _ranked(kind, points, starts)
    found = _minima(kind, points, starts[: KEPT_FEW if few else KEPT], few, possible)
    if found and (more is None or (not few and _certain(kind, points, found[0]))):
        return found
    if more is not None:
        starts = _ranked(kind, points, np.concatenate([starts, more()]))
    return _minima(kind, points, starts[:KEPT_MOST], True, possible, found)


def _ranked(kind: int, points: Float, starts: Float) -> Float:
    """Return the finite ones among ``starts``, the most promising first."""
    starts = np.ascontiguousarray(starts[np.isfinite(starts).all(axis=1)])
    costs = np.empty(len(starts))
    rank(kind, sampled(points, SAMPLE), starts, costs)
    return starts[np.argsort(costs, kind="stable")]


def _certain(kind: int, points: Float, found: Solution) -> bool:
    """Return whether no other element can be as near to ``points`` as this one."""
    n = len(points)
    closest = CERTAIN_RESIDUAL if n >= CERTAIN_POINTS else CERTAIN_RESIDUAL_FEWER
    if found.cost > n * closest**2:
        return False
    return gains(derivatives(kind, points, found.parameters)[1])[2] < CERTAIN_CONDITION


def _minima(
    kind: int, points: Float, starts: Float, thorough: bool, possible: Callable[[Float], bool],
    before: Sequence[Solution] = (),
) -> list[Solution]:  # fmt: skip
    """Return the minima of ``before`` and those from ``starts``, best first, each once."""
    costs = np.empty(len(starts))
    starts = starts.copy()
    descend(kind, sampled(points, SAMPLE), starts, STEPS_MOST if thorough else STEPS, costs)
    found = list(before)
    known = [_signature(kind, solution.parameters) for solution in found]
    tried: list[Float] = []
    order = np.argsort(costs, kind="stable")
    hopeless = HOPELESS * costs[order[0]] if len(order) else 0.0
    for i in order:
        if not thorough and len(tried) >= LEAST_REFINED and costs[i] > hopeless:
            break
        if len(tried) >= (REFINED_FEW if thorough else REFINED):
            break
        signature = _signature(kind, starts[i])
        if not np.isfinite(costs[i]) or any(_same(signature, other, 1e-3) for other in tried):
            continue
        tried.append(signature)
        solution = minimise(kind, points, starts[i])
        if not solution.converged or not possible(solution.parameters):
            continue
        signature = _signature(kind, solution.parameters)
        if not any(_same(signature, other, SAME) for other in known):
            known.append(signature)
            found.append(solution)
    return sorted(found, key=lambda solution: solution.cost)


def chosen(
    shape: Shape, solutions: list[Solution], n: int, expected: Callable[[Float], bool] | None
) -> Float:
    """Return the parameters (8,) of the best solution, in an array of their own.

    Parameters
    ----------
    shape
        For the sentence of the error.
    solutions
        Best first.
    n
        Number of points.
    expected
        Whether parameters are near what the plan says; decides only where several solutions pass
        through all points, as they do through few. None takes any one of them.

    Raises
    ------
    FitError
        Several pass through all points, and not just one of them is as expected.
    """
    through = [solution for solution in solutions if solution.cost < n * EXACT**2]
    if len(through) < 2 or expected is None:
        return solutions[0].parameters.copy()
    near = [solution for solution in through if expected(solution.parameters)]
    if len(near) == 1:
        return near[0].parameters.copy()
    raise FitError(
        "fit.ambiguous",
        f"{len(through)} different shapes pass through the {n} points of a {shape.value.lower()}.",
        "Take more points.",
    )


def near_sizes(p: Float, expected: tuple[float, float]) -> bool:
    """Return whether the two sizes among parameters (8,) of an outline are about as expected."""
    sizes = np.sort(p[3:5])[::-1]
    return bool(np.all(np.abs(sizes - expected) < NEAR * np.asarray(expected)))


def _signature(kind: int, p: Float) -> Float:
    """Return numbers that are equal where parameters (8,) describe one element."""
    if kind <= RING:
        return np.concatenate([p[0:3], np.outer(p[3:6], p[3:6]).ravel(), np.abs(p[6:8])])
    # An outline is the same after half a turn, and with its sizes changed after a quarter.
    turn, longer = p[2], p[3] - p[4]
    turns = [longer * np.cos(2.0 * turn), longer * np.sin(2.0 * turn)]
    quarters = [np.cos(4.0 * turn), np.sin(4.0 * turn)]
    return np.array([p[0], p[1], p[3] + p[4], *turns, *quarters])


def _same(first: Float, second: Float, tolerance: float) -> bool:
    return bool(np.all(np.abs(first - second) < tolerance * (1.0 + np.abs(first).max())))
