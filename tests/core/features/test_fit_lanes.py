"""Parallel starts: each ends as it would alone, with its own cost."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.features.search import CONE, CYLINDER, TORUS, best_ends, derivatives, minimise
from ocmm_core.features.search._lanes_kernel import LANES
from ocmm_core.features.search._newton_kernel import descend
from ocmm_core.geometry import Float

pytestmark = pytest.mark.numerics

N, NOISE = 17, 1e-3
SIZES = {CYLINDER: (1.0, 0.0), CONE: (0.3, 1.0), TORUS: (1.2, 0.4)}
KINDS = pytest.mark.parametrize("kind", SIZES, ids=["cylinder", "cone", "torus"])


def _points(kind: int, rng: np.random.Generator) -> Float:
    """Return noisy points (N, 3) about the z axis, of the size one."""
    first, second = SIZES[kind]
    turn, height = rng.uniform(0.0, 2.0 * np.pi, N), rng.uniform(-1.0, 1.0, N)
    around = rng.uniform(0.0, 2.0 * np.pi, N)
    rho = np.full(N, first)
    if kind == CONE:
        rho = (second + height * np.sin(first)) / np.cos(first)
    if kind == TORUS:
        rho, height = first + second * np.cos(around), second * np.sin(around)
    points = np.stack([rho * np.cos(turn), rho * np.sin(turn), height], axis=1)
    return np.asarray(points + rng.normal(0.0, NOISE, points.shape))


def _starts(kind: int, rng: np.random.Generator, count: int, off: float) -> Float:
    """Return starts (count, 8) around the truth, their axes of length one."""
    starts = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 1.0, *SIZES[kind]], (count, 1))
    starts[:, :7] += rng.normal(0.0, off, (count, 7))
    starts[:, 3:6] /= np.linalg.norm(starts[:, 3:6], axis=1)[:, None]
    if kind != TORUS:
        along = np.sum(starts[:, :3] * starts[:, 3:6], axis=1)
        starts[:, :3] -= along[:, None] * starts[:, 3:6]
    return np.ascontiguousarray(starts)


@KINDS
@pytest.mark.parametrize("count", [1, LANES, 3 * LANES + 5])
def test_every_start_nearby_ends_in_the_minimum(kind: int, count: int) -> None:
    """Fewer starts than lanes, an equal number, and more, so that lanes are refilled and run dry.

    30 steps end if one gains less than 1e-4: within a thousandth of the least cost.
    """
    rng = np.random.default_rng(31)
    points = _points(kind, rng)
    starts, costs = _starts(kind, rng, count, 0.02), np.empty(count)
    least = minimise(kind, points, starts[0]).cost
    descend(kind, points, starts, 30, costs)
    assert np.all(costs < least * 1.001)
    assert np.all(costs > least * (1.0 - 1e-9))
    for cost, end in zip(costs, starts, strict=True):
        residuals, _, _ = derivatives(kind, points, end)
        # The same sum in another order.
        assert cost == pytest.approx(residuals @ residuals, rel=1e-9)
        assert np.linalg.norm(end[3:6]) == pytest.approx(1.0, abs=1e-12)


@KINDS
def test_a_start_ends_the_same_among_others_as_alone(kind: int) -> None:
    """No lane takes from its neighbours; operations are the same, hence bit by bit."""
    rng = np.random.default_rng(32)
    points, starts = _points(kind, rng), _starts(kind, rng, LANES + 9, 0.4)
    together, costs = starts.copy(), np.empty(len(starts))
    descend(kind, points, together, 15, costs)
    for start, end, cost in zip(starts, together, costs, strict=True):
        alone, own = start[None].copy(), np.empty(1)
        descend(kind, points, alone, 15, own)
        assert own[0] == pytest.approx(cost, rel=1e-6)
        assert alone[0] == pytest.approx(end, abs=1e-6)


@KINDS
def test_a_start_that_leads_nowhere_harms_no_other(kind: int) -> None:
    rng = np.random.default_rng(33)
    points, starts = _points(kind, rng), _starts(kind, rng, 2 * LANES, 0.02)
    starts[::3, 6] = np.nan
    given, costs = starts.copy(), np.empty(len(starts))
    descend(kind, points, starts, 30, costs)
    least = np.nanmin(costs)
    kept = np.arange(len(starts)) % 3 > 0
    assert np.all(costs[kept] < least * 1.001)
    assert not np.isfinite(costs[~kept]).any()
    assert np.isfinite(best_ends(kind, points, given, 5)).all()
