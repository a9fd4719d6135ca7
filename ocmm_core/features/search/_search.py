"""Global search for cylinder, cone, torus, ellipse, slot and rectangle.

Axis and turn are unknown, and there are many local minima. Starts come in independent families:
from trial axes, from curvature, from simpler elements. The best of a family descend on a sample of
the points in compiled loops and are refined on all of them. A minimum is accepted if a second
family finds the same and none better; otherwise the next family follows, and finally all of them
with many more and longer descents.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.features.search._axis_kernel import RING
from ocmm_core.features.search._newton_kernel import STEP_SIZE, descend, rank
from ocmm_core.features.search._solver import Solution, derivatives, gains, minimise, undecided
from ocmm_core.geometry import Float

SIGNATURE = 14


@compiled()
def _signature(kind: int, p: Float, numbers: Float) -> int:
    """Write numbers that are equal for parameters (8,) of the same element; return how many."""
    if kind > RING:
        # An outline is unchanged by half a turn, and by a quarter with its sizes exchanged.
        turn, longer = p[2], p[3] - p[4]
        numbers[0], numbers[1], numbers[2] = p[0], p[1], p[3] + p[4]
        numbers[3], numbers[4] = longer * np.cos(2.0 * turn), longer * np.sin(2.0 * turn)
        numbers[5], numbers[6] = np.cos(4.0 * turn), np.sin(4.0 * turn)
        return 7
    for i in range(3):
        numbers[i] = p[i]
        # An axis and its opposite have the same products.
        for j in range(3):
            numbers[3 + 3 * i + j] = p[3 + i] * p[3 + j]
    numbers[12], numbers[13] = abs(p[6]), abs(p[7])
    return 14


@compiled()
def seen(kind: int, p: Float, known: Float, tolerance: float) -> bool:
    """Return whether parameters (8,) equal one of the elements ``known`` (m, 8)."""
    own, other = np.empty(SIGNATURE), np.empty(SIGNATURE)
    count = _signature(kind, p, own)
    greatest = 0.0
    for i in range(count):
        greatest = max(greatest, abs(own[i]))
    allowed = tolerance * (1.0 + greatest)
    for row in range(len(known)):
        _signature(kind, known[row], other)
        same = True
        for i in range(count):
            # Written so that NaN equals nothing.
            same = same and abs(own[i] - other[i]) < allowed
        if same:
            return True
    return False


SAMPLE = 60
"""Number of points for the descent of the starts."""
MIDDLE = 200
"""Number of points for refinement before all points are used."""
STEPS = 15
"""Steps from starts if only one end is needed."""
FIRST, MOST = 60, 300
"""Number of starts to descend, the most promising first: in a quick and in a thorough search."""
QUICK = ((8, 100),)
THOROUGH, THOROUGH_AXIS = ((50, 60), (20, 300)), ((80, 60), (32, 300))
"""Number of ends to continue, and steps of each. Valleys are long and narrow for short arcs. More
continue about an axis, as they run in parallel (`_lanes_kernel`).
"""
REFINED, REFINED_MOST = 8, 32
"""Number of ends to refine, and maximum."""
LEAST_REFINED, HOPELESS = 3, 100.0
"""After this number, ends worse than the best on the sample by this factor are dropped."""
FAR = 2.0
"""Factor over the least mean square, on `MIDDLE` points, above which an end is no rival: by noise
alone that is ten standard deviations of the mean square of 200.
"""
EXACT = 1e-10
"""Root mean squared residual of exact points, for which rounding decides nothing."""
EQUAL = 1e-9
"""Relative difference of two costs during descent at which paths count as merged."""
SPARE = 2
"""Redundant points up to which minima abound: every family is tried."""
CERTAIN_POINTS, CERTAIN_CONDITION = 30, 30.0
CERTAIN_RESIDUAL, CERTAIN_RESIDUAL_FEWER = 0.01, 0.001
"""Condition number and root mean squared residual below which one family is accepted: points that
close to a well determined element are close to no other. Fewer points must be closer.
"""
VALLEYS, VALLEY = 2, 40
"""Narrow valleys to follow, and iteration rounds in each."""
STUCK, PATIENCE = 1e-9, 10
"""Relative gain of such a round that is rounding, and number of such rounds that ends the path."""
OPEN = 1e9
"""Condition number beyond which a parameter is undetermined."""
WELL, NOISY = 50.0, 0.03
"""Condition number and RMS residual below which two agreeing families are accepted."""
CLOSE, WELL_CLOSE = 0.003, 1000.0
"""The same for many points at small distance."""
FEW_POINTS = 12
"""Up to this number, certain for axes only, and by `CHANCE`."""
CHANCE = 1e-15
"""RMS residual to the power of the number of redundant points: the order of the probability that
an element passes so close to all of them by chance."""
SAME, ONE, ALIKE = 1e-6, 1e-4, 1e-3
"""Relative difference of equal minima: within a search, of two families, of unrefined ends."""

Family = Callable[[], Float]
"""Returns starts (m, 8)."""


def sampled(points: Float, count: int) -> Float:
    """Return at most ``count`` evenly chosen points (n, 3)."""
    if len(points) <= count:
        return np.ascontiguousarray(points)
    return points[np.arange(count) * (len(points) - 1) // (count - 1)]


def nearest_minimum(kind: int, points: Float, starts: Float, kept: int) -> Solution:
    """Return the minimum reached from the best of ``kept`` promising ``starts`` (m, 8).

    It may not be the global one: callers certify it, or search all `minima`.
    """
    sample = sampled(points, SAMPLE)
    best, costs = _descended(kind, sample, _ranked(kind, points, starts)[:kept], STEPS)
    return minimise(kind, points, best[np.argmin(np.where(np.isfinite(costs), costs, np.inf))])


def best_ends(kind: int, points: Float, starts: Float, count: int) -> Float:
    """Return at most ``count`` ends (m, 8) of the descent from ``starts``, best first."""
    sample = sampled(points, SAMPLE)
    return _best(*_descended(kind, sample, _ranked(kind, points, starts), STEPS))[:count]


def planned(families: Sequence[Family], places: slice, sizes: Float) -> Family:
    """Return the starts of the first two families, with the planned sizes: these must be tried."""

    def family() -> Float:
        starts = np.concatenate([family() for family in families[:2]])
        starts[:, places] = sizes
        return starts

    return family


def minima(
    kind: int, points: Float, families: Sequence[Family], possible: Callable[[Float], bool],
    sure: Callable[[Solution], bool] | None = None,
) -> list[Solution]:  # fmt: skip
    """Return the minima found, best first, each once.

    ``points`` (n, d) are centred and scaled; ``families`` independent, the quickest first;
    ``possible``: whether parameters (8,) define an element; ``sure``: to accept one family.
    """
    found: list[Solution] = []
    asked: list[tuple[Float, Float, Float]] = []
    sample = sampled(points, SAMPLE)
    n, numbers = len(points), STEP_SIZE[kind]
    few = n <= numbers + SPARE
    for family in families:
        starts = _ranked(kind, points, family())
        first, costs = _descended(kind, sample, starts[:FIRST], STEPS)
        asked.append((first, costs, starts[FIRST:]))
        ends = _ends(kind, sample, first, costs, QUICK)
        own = _refined(kind, points, ends, REFINED, possible)
        agreed = bool(own and found) and bool(
            seen(kind, own[0].parameters, found[0].parameters[None], ONE)
        )
        found = _joined(kind, found, own)
        if not found or few or not found[0].converged:
            continue
        alone = len(found) == 1 or not undecided(found[0].cost, found[1].cost, n, numbers)
        if alone and (
            (agreed and determined(kind, points, found[0]))
            or (sure or partial(certain, kind, points))(found[0])
        ):
            return found
    for first, costs, starts in asked:
        more, further = _descended(kind, sample, starts, STEPS)
        more, further = np.concatenate([first, more]), np.concatenate([costs, further])
        schedule = THOROUGH_AXIS if kind < RING else THOROUGH
        ends = _ends(kind, sample, more, further, schedule)
        own = _refined(kind, points, ends, REFINED_MOST, possible)
        found = _joined(kind, found, own)
    return found


def _ranked(kind: int, points: Float, starts: Float) -> Float:
    """Return the `MOST` most promising finite ones among ``starts``, best first."""
    if not np.isfinite(starts).all():
        starts = starts[np.isfinite(starts).all(axis=1)]
    starts = np.ascontiguousarray(starts)
    costs = np.empty(len(starts))
    rank(kind, sampled(points, SAMPLE), starts, costs)
    return starts[np.argsort(costs, kind="stable")[:MOST]]


def certain(kind: int, points: Float, found: Solution) -> bool:
    """Return whether no other element can be as close to ``points`` as ``found``."""
    n, spare = len(points), len(points) - STEP_SIZE[kind]
    if spare <= SPARE or (n <= FEW_POINTS and kind >= RING):
        return False
    closest = CERTAIN_RESIDUAL if n >= CERTAIN_POINTS else CERTAIN_RESIDUAL_FEWER
    if n <= FEW_POINTS:
        closest = min(closest, CHANCE ** (1.0 / spare))
    if found.cost > n * closest**2:
        return False
    return gains(derivatives(kind, points, found.parameters)[1])[2] < CERTAIN_CONDITION


def determined(kind: int, points: Float, found: Solution) -> bool:
    """Return whether the points determine an element well enough to find its rivals easily."""
    n = len(points)
    if found.cost > n * NOISY**2:
        return False
    close = n >= CERTAIN_POINTS and found.cost < n * CLOSE**2
    worst = WELL_CLOSE if close else WELL
    return gains(derivatives(kind, points, found.parameters)[1])[2] < worst


def _descended(kind: int, sample: Float, starts: Float, steps: int) -> tuple[Float, Float]:
    """Return the ends of some steps from all ``starts`` (m, 8), and the costs (m,)."""
    ends, costs = starts.copy(), np.empty(len(starts))
    descend(kind, sample, ends, steps, costs)
    return ends, costs


def _best(ends: Float, costs: Float) -> Float:
    """Return the ``ends`` (m, 8) with finite, distinct costs, best first."""
    order = np.argsort(costs, kind="stable")
    costs = costs[order]
    apart = np.isfinite(costs)
    apart[1:] &= ~(costs[1:] - costs[:-1] <= EQUAL * costs[1:])
    return ends[order[apart]]


def _ends(
    kind: int, sample: Float, ends: Float, costs: Float, schedule: Sequence[tuple[int, int]]
) -> Float:
    """Return the ends reached from the best of ``ends`` (m, 8) on a sample, best first."""
    found = _best(ends, costs)
    for kept, steps in schedule:
        found = _best(*_descended(kind, sample, found[:kept], steps))
    return found


def _refined(
    kind: int, points: Float, ends: Float, most: int, possible: Callable[[Float], bool]
) -> list[Solution]:
    """Return minima at the best ``ends`` (m, 8), best first, with lower unconverged ends."""
    found: list[Solution] = []
    loose: list[Solution] = []
    tried, count = np.empty((most, 8)), 0
    best = np.inf
    middle = sampled(points, MIDDLE)
    for end in ends:
        higher = False
        if len(middle) < len(points):
            # Steps on fewer points are cheap, and few steps on all points then remain.
            on_middle = minimise(kind, middle, end)
            end = on_middle.parameters
            least = FAR * best / len(points) + EXACT**2
            higher = on_middle.cost > len(middle) * least
        if seen(kind, end, tried[:count], ALIKE):
            continue
        tried[count] = end
        count += 1
        if higher:
            continue
        solution = minimise(kind, points, end)
        if not solution.converged:
            loose.append(solution)
        elif possible(solution.parameters):
            found.append(solution)
            best = min(best, solution.cost)
        if count >= most:
            break
        if most == REFINED and count >= LEAST_REFINED and solution.cost > HOPELESS * best:
            break
    n, numbers = len(points), STEP_SIZE[kind]
    loose.sort(key=lambda solution: solution.cost)
    for solution in loose[:VALLEYS]:
        if found and solution.cost > best and not undecided(best, solution.cost, n, numbers):
            break
        end = _followed(kind, points, solution)
        open_end = not end.converged and (end.cost < best or is_open(kind, points, end))
        if (end.converged or open_end) and possible(end.parameters):
            found.append(end)
            best = min(best, end.cost)
    return _joined(kind, [], found)


def _followed(kind: int, points: Float, solution: Solution) -> Solution:
    """Return the end of a long and narrow valley, if it has one."""
    sample, stuck = sampled(points, SAMPLE), 0
    for _ in range(VALLEY):
        if solution.converged or stuck == PATIENCE:
            break
        before = solution
        solution = minimise(kind, sample, before.parameters)
        stuck = stuck + 1 if solution.cost > before.cost * (1.0 - STUCK) else 0
        if np.array_equal(solution.parameters, before.parameters):
            break
    return solution if len(sample) == len(points) else minimise(kind, points, solution.parameters)


def is_open(kind: int, points: Float, solution: Solution) -> bool:
    """Return whether a parameter of an element is undetermined by the points."""
    return gains(derivatives(kind, points, solution.parameters)[1])[2] > OPEN


def _joined(kind: int, found: Sequence[Solution], more: Sequence[Solution]) -> list[Solution]:
    """Return the solutions of both, best first, each once."""
    joined: list[Solution] = []
    known = np.empty((len(found) + len(more), 8))
    for solution in sorted((*found, *more), key=lambda solution: solution.cost):
        if not seen(kind, solution.parameters, known[: len(joined)], SAME):
            known[len(joined)] = solution.parameters
            joined.append(solution)
    return joined
