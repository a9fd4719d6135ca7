"""The search for the best minimum of cylinder, cone, torus, ellipse, slot and rectangle.

Nothing is known of their axis or turn, and they have many local minima. Starts come in families
that owe nothing to each other: from trial axes, from curvature, from simpler elements. The best of
a family descend on a sample of the points in compiled loops and are refined on all of them. A
minimum is believed when a second family leads to no better one and to the same; else the next
family follows, and in the end all of them once more with many more and longer ways down.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from ocmm_core.features.search._axis_kernel import RING
from ocmm_core.features.search._newton_kernel import STEP_SIZE, descend, rank
from ocmm_core.features.search._rivals import undecided
from ocmm_core.features.search._solver import Solution, derivatives, gains, minimise
from ocmm_core.geometry import Float

SAMPLE = 60
"""Points on which the starts descend."""
MIDDLE = 200
"""Points on which an end is refined before all points are used."""
STEPS = 15
"""From starts of which only one end is wanted."""
QUICK = ((60, 15), (8, 100))
THOROUGH = ((300, 15), (50, 60), (20, 300))
"""How many starts go on, the most promising first, and how many steps each then takes. Valleys are
long and narrow where arcs are short."""
REFINED, REFINED_MOST = 8, 20
"""Ends that are refined."""
LEAST_REFINED, HOPELESS = 3, 100.0
"""After so many, ends that are still so many times worse on the sample than the best are left."""
EQUAL = 1e-9
"""Relative difference of two costs on the way down below which the ways have met."""
SPARE = 2
"""Points beyond those that determine the element, up to which minima abound: every family is
asked."""
CERTAIN_POINTS, CERTAIN_CONDITION = 30, 30.0
CERTAIN_RESIDUAL, CERTAIN_RESIDUAL_FEWER = 0.01, 0.001
"""Condition number and root mean squared residual below which one family is believed: points that
lie so close to an element and determine it well lie close to no other. Fewer points have to lie
closer."""
VALLEYS, VALLEY = 2, 40
"""Narrow valleys that are followed, and how often the iteration goes on in one."""
OPEN = 1e9
"""Condition number beyond which the points leave a number open."""
WELL, NOISY = 50.0, 0.03
"""Condition number and root mean squared residual below which two families that agree are
believed."""
CLOSE, WELL_CLOSE = 0.003, 1000.0
"""The same where there are many points and they lie close."""
FEW_POINTS = 12
"""So few are never certain."""
SAME = 1e-6
"""Relative difference below which two minima are one."""

Family = Callable[[], Float]
"""Gives starts (m, 8)."""


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


def best_ends(kind: int, points: Float, starts: Float, count: int) -> Float:
    """Return at most ``count`` of the places (m, 8) to which ``starts`` lead, best first."""
    return _ends(kind, points, _ranked(kind, points, starts), ((len(starts), STEPS),))[:count]


def planned(families: Sequence[Family], places: slice, sizes: Float) -> Family:
    """Return the starts of the first two families with the sizes that a plan asks for.

    Through few points pass many elements, and the one of the plan shall not be missing among them.
    """

    def family() -> Float:
        starts = np.concatenate([family() for family in families[:2]])
        starts[:, places] = sizes
        return starts

    return family


def minima(
    kind: int, points: Float, families: Sequence[Family], possible: Callable[[Float], bool],
    sure: Callable[[Solution], bool] | None = None,
) -> list[Solution]:  # fmt: skip
    """Return the minima that were found, best first, each once.

    Parameters
    ----------
    kind
        Of `axis_kernel` or `flat_kernel`.
    points
        (n, d), centred and scaled.
    families
        Independent of each other, the quickest first.
    possible
        Whether parameters (8,) are an element at all.
    sure
        Whether one family is believed; `certain` if not given.
    """
    found: list[Solution] = []
    asked: list[Float] = []
    n, numbers = len(points), STEP_SIZE[kind]
    few = n <= numbers + SPARE
    for family in families:
        starts = _ranked(kind, points, family())
        asked.append(starts)
        own = _refined(kind, points, _ends(kind, points, starts, QUICK), REFINED, possible)
        agreed = bool(own and found) and _one(kind, own[0], found[0])
        found = _joined(kind, found, own)
        if not found or few or not found[0].converged:
            continue
        alone = len(found) == 1 or not undecided(found[0].cost, found[1].cost, n, numbers)
        if alone and (
            (agreed and determined(kind, points, found[0]))
            or (sure or partial(certain, kind, points))(found[0])
        ):
            return found
    for starts in asked:
        ends = _ends(kind, points, starts, THOROUGH)
        found = _joined(kind, found, _refined(kind, points, ends, REFINED_MOST, possible))
    return found


def _ranked(kind: int, points: Float, starts: Float) -> Float:
    """Return the finite ones among ``starts``, the most promising first."""
    starts = np.ascontiguousarray(starts[np.isfinite(starts).all(axis=1)])
    costs = np.empty(len(starts))
    rank(kind, sampled(points, SAMPLE), starts, costs)
    return starts[np.argsort(costs, kind="stable")]


def certain(kind: int, points: Float, found: Solution) -> bool:
    """Return whether no other element can be as near to ``points`` as ``found``."""
    n = len(points)
    if n <= FEW_POINTS:
        return False
    closest = CERTAIN_RESIDUAL if n >= CERTAIN_POINTS else CERTAIN_RESIDUAL_FEWER
    if found.cost > n * closest**2:
        return False
    return gains(derivatives(kind, points, found.parameters)[1])[2] < CERTAIN_CONDITION


def determined(kind: int, points: Float, found: Solution) -> bool:
    """Return whether the points determine an element so well that its rivals are easily found."""
    n = len(points)
    if found.cost > n * NOISY**2:
        return False
    close = n >= CERTAIN_POINTS and found.cost < n * CLOSE**2
    worst = WELL_CLOSE if close else WELL
    return gains(derivatives(kind, points, found.parameters)[1])[2] < worst


def _ends(kind: int, points: Float, starts: Float, schedule: Sequence[tuple[int, int]]) -> Float:
    """Return where ``starts`` (m, 8), best first, lead on a sample of the points, best first."""
    sample = sampled(points, SAMPLE)
    for kept, steps in schedule:
        starts = starts[:kept].copy()
        costs = np.empty(len(starts))
        descend(kind, sample, starts, steps, costs)
        order = np.argsort(costs, kind="stable")
        costs = costs[order]
        apart = np.ones(len(costs), dtype=bool)
        apart[1:] = ~(np.diff(costs) <= EQUAL * costs[1:])
        starts = starts[order][apart & np.isfinite(costs)]
    return starts


def _refined(
    kind: int, points: Float, ends: Float, most: int, possible: Callable[[Float], bool]
) -> list[Solution]:
    """Return the minima at the best ``ends`` (m, 8), best first.

    Also those places where an iteration came to no rest and that lie lower, or where the points
    leave a number open: there the cost has no minimum, and no other one counts that is higher.
    """
    found: list[Solution] = []
    loose: list[Solution] = []
    tried: list[Float] = []
    best = np.inf
    middle = sampled(points, MIDDLE)
    for end in ends:
        if len(middle) < len(points):
            # Steps on fewer points are cheap, and the last ones on all points are then few.
            end = minimise(kind, middle, end).parameters
        signature = _signature(kind, end)
        if any(_same(signature, other, 1e-3) for other in tried):
            continue
        tried.append(signature)
        solution = minimise(kind, points, end)
        if not solution.converged:
            loose.append(solution)
        elif possible(solution.parameters):
            found.append(solution)
            best = min(best, solution.cost)
        if len(tried) >= most:
            break
        if most == REFINED and len(tried) >= LEAST_REFINED and solution.cost > HOPELESS * best:
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
    sample = sampled(points, SAMPLE)
    for _ in range(VALLEY):
        if solution.converged:
            break
        solution = minimise(kind, sample, solution.parameters)
    return solution if len(sample) == len(points) else minimise(kind, points, solution.parameters)


def is_open(kind: int, points: Float, solution: Solution) -> bool:
    """Return whether the points leave a number of an element open."""
    return gains(derivatives(kind, points, solution.parameters)[1])[2] > OPEN


def _joined(kind: int, found: Sequence[Solution], more: Sequence[Solution]) -> list[Solution]:
    """Return the solutions of both, best first, each once."""
    joined: list[Solution] = []
    known: list[Float] = []
    for solution in sorted((*found, *more), key=lambda solution: solution.cost):
        signature = _signature(kind, solution.parameters)
        if not any(_same(signature, other, SAME) for other in known):
            known.append(signature)
            joined.append(solution)
    return joined


def _one(kind: int, first: Solution, second: Solution) -> bool:
    """Return whether two solutions are the same minimum."""
    one, other = _signature(kind, first.parameters), _signature(kind, second.parameters)
    return _same(one, other, 1e-4)


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
