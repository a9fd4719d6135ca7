"""Explain inconsistent reference points: one moved, two exchanged, or wrong scale."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.special import chdtrc

from ocmm_core.geometry import Float, Points3, rigid_fit

LEAST_CHANCE = 1e-3
"""Least probability of the remaining misfit for an explanation to be accepted."""


@dataclass(frozen=True, slots=True)
class PointsExplained:
    """One way in which the points fit."""

    what: str
    names: tuple[str, ...]


def explain_points(
    names: Sequence[str], found: Points3, listed: Points3, sigmas: Float
) -> tuple[PointsExplained, ...]:
    """Return all explanations by which the found points match the list.

    Two names exchanged, one point moved, or a list of wrong scale. Points: mm in any two frames;
    ``sigmas`` (n,): mm per axis, of the difference.
    """
    return tuple(
        explained
        for explained, square, dof in _ways(names, found, listed, sigmas)
        if dof > 0 and chdtrc(dof, square) > LEAST_CHANCE
    )


def _ways(
    names: Sequence[str], found: Points3, listed: Points3, sigmas: Float
) -> Iterator[tuple[PointsExplained, float, int]]:
    n = len(names)
    for first, second in combinations(range(n), 2):
        order = np.arange(n)
        order[[first, second]] = second, first
        pair = names[first], names[second]
        yield (
            PointsExplained(f"'{pair[0]}' and '{pair[1]}' were swapped", pair),
            _misfit(found, listed[order], sigmas),
            3 * n - 6,
        )
    for one in range(n):
        kept = np.arange(n) != one
        # Two remaining points determine only their distance.
        yield (
            PointsExplained(f"'{names[one]}' has moved", (names[one],)),
            _misfit(found[kept], listed[kept], sigmas[kept]),
            max(3 * (n - 1) - 6, 1) if n > 2 else 0,
        )
    ratio, _ = scale_between(found, listed, sigmas)
    what = "farther from" if ratio > 1.0 else "nearer to"
    amount = f"{1e6 * abs(ratio - 1.0):.0f} um/m"
    yield (
        PointsExplained(f"all of them are {amount} {what} each other than listed", tuple(names)),
        _misfit(found, ratio * listed, sigmas),
        3 * n - 7,
    )


def scale_between(found: Points3, listed: Points3, sigmas: Float) -> tuple[float, float]:
    """Return the scale of the found points relative to the list, and its sigma."""
    rotation, shift = rigid_fit(listed, found)
    carried = listed @ rotation.T + shift
    weights = sigmas**-2.0
    arms = carried - np.average(carried, axis=0, weights=weights)
    inertia = float(np.sum(weights[:, None] * arms**2))
    off = float(np.sum(weights[:, None] * arms * (found - carried)))
    return 1.0 + off / inertia, inertia**-0.5


def _misfit(found: Points3, listed: Points3, sigmas: Float) -> float:
    rotation, shift = rigid_fit(listed, found)
    off = found - listed @ rotation.T - shift
    return float(np.sum((off / sigmas[:, None]) ** 2))
