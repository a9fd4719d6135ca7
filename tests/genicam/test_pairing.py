"""Exposures of cameras without a common clock, whose images come late or whose clocks drift."""

from __future__ import annotations

from collections import deque

import numpy as np
import pytest

from ocmm_genicam._grabber import Spots
from ocmm_genicam._source import ExposurePairing

_PERIOD_S = 3.3e-3
_LATENCY_S = 1.1e-3


def _heard(exposure: int, late_s: float, drift: float = 0.0) -> Spots:
    heard_s = exposure * _PERIOD_S * (1.0 + drift) + _LATENCY_S + late_s
    return Spots(exposure, 0, 0, np.zeros((1, 2)), exposure, heard_s)


def _pairs(late_s: np.ndarray, drift: float = 0.0) -> list[tuple[int, int]]:
    """Return the pairs of two cameras; ``late_s`` (n, 2): delay of every image on its way."""
    pairing = ExposurePairing(round(_PERIOD_S * 1e9))
    queues: tuple[deque[Spots], deque[Spots]] = (deque(), deque())
    found = []
    for number, (one_s, other_s) in enumerate(late_s.tolist(), 1):
        queues[0].append(_heard(number, one_s))
        queues[1].append(_heard(number, other_s, drift))
        found += [(one.exposure, other.exposure) for one, other in pairing.join(queues)]
    return found


@pytest.mark.parametrize("seed", range(5))
def test_images_that_are_late_for_seconds_stay_with_their_exposure(seed: int) -> None:
    draws = np.random.default_rng(seed)
    late_s = draws.exponential(0.2e-3, (6000, 2))
    # One camera waits for lost packets, most of its images, for 2.6 s.
    late_s[1000:1800, 1] += np.where(draws.random(800) < 0.95, 5.0 * _PERIOD_S, 0.0)
    assert _pairs(late_s) == [(number, number) for number in range(26, 6001)]


def test_first_images_that_were_late_are_paired_again() -> None:
    late_s = np.zeros((3000, 2))
    late_s[:25, 1] = _PERIOD_S
    pairs = _pairs(late_s)
    assert pairs[-1] == (3000, 3000)
    assert sum(one != other for one, other in pairs) < 1100


def test_clocks_that_drift_by_a_period_are_paired_again() -> None:
    drift = 1e-4
    pairs = _pairs(np.zeros((20000, 2)), drift)
    numbers = np.array(pairs)
    apart = numbers[:, 1] * (1.0 + drift) - numbers[:, 0]
    assert np.abs(apart).max() < 1.0
    assert np.unique(numbers[:, 1] - numbers[:, 0]).size >= 2
    assert len(pairs) > 0.99 * 20000
