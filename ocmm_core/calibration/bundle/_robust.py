"""A bundle adjustment that finds wrong spots by itself and says which they are."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocmm_core.calibration.bundle._bundle import BundleMinimum, adjust, residuals
from ocmm_core.calibration.bundle._start import solvable
from ocmm_core.calibration.bundle._state import BundleData, BundleState, Prior
from ocmm_core.calibration.cameras import OUTLIER_PROBABILITY
from ocmm_core.geometry import Float

_MEDIAN_OF_RAYLEIGH = 1.1774
_ROUNDS = 12
_STEPS_PER_ROUND = 5


@dataclass(frozen=True, slots=True)
class RobustMinimum:
    """What is left when the wrong spots are left out."""

    minimum: BundleMinimum
    data: BundleData
    """With the weights of what was left out set to zero."""
    distances: Float
    """(n, C, L): length of every spot's miss in sigmas, of those left out too; NaN if not seen."""
    residuals: Float
    """(n, C, L, 2), predicted minus observed, px, likewise."""

    @property
    def used(self) -> NDArray[np.bool_]:
        """Return which spots (n, C, L) took part."""
        return self.data.weights > 0.0

    @property
    def placements_used(self) -> NDArray[np.bool_]:
        """Return which placements (m,) of bars took part."""
        return self.data.active[1]


def adjust_robustly(data: BundleData, prior: Prior, start: BundleState) -> RobustMinimum:
    """Return the minimum of the good spots.

    First with Cauchy weights whose scale follows the median residual, because the start is wrong by
    many pixels itself; then without what is farther off than chance explains. All spots are judged
    again after every fit, so that one wrongly left out comes back. A placement of a bar is taken or
    left as a whole: it has too few spots to tell which of them is wrong.
    """
    state = _settled(data, prior, start)
    chosen = data
    for _ in range(_ROUNDS):
        distances, bar_distances, _ = _judge(data, state)
        again = _without(data, distances, bar_distances)
        minimum = adjust(again, prior, state)
        state = minimum.state
        same = _same(again, chosen)
        chosen = again
        if same:
            break
    distances, _, residuals = _judge(data, state)
    return RobustMinimum(minimum, chosen, distances, residuals)


def scale_of(distances: Float) -> float:
    """Return how many sigma the good residuals are, at least one."""
    return max(float(np.nanmedian(distances)) / _MEDIAN_OF_RAYLEIGH, 1.0)


def limit_of(distances: Float) -> float:
    """Return the distance above which a spot is wrong.

    Two coordinates: P(d > x) = exp(-x^2 / 2), shared among all spots (Bonferroni).
    """
    count = max(int(np.isfinite(distances).sum()), 1)
    return scale_of(distances) * math.sqrt(-2.0 * math.log(OUTLIER_PROBABILITY / count))


def _settled(data: BundleData, prior: Prior, start: BundleState) -> BundleState:
    """Return a state near the minimum that wrong spots have not led astray."""
    state, last = start, math.inf
    for _ in range(_ROUNDS):
        distances, bar_distances, _ = _judge(data, state)
        everything = np.concatenate([distances.ravel(), bar_distances.ravel()])
        scale = scale_of(everything)
        weighted = data.scaled(*(_cauchy(d, 3.0 * scale) for d in (distances, bar_distances)))
        state = adjust(weighted, prior, state, _STEPS_PER_ROUND).state
        if abs(last - scale) <= 1e-2 * scale:
            break
        last = scale
    return state


def _cauchy(distances: Float, scale: float) -> Float:
    """Return the roots of Cauchy's weights; zero where nothing was seen."""
    weights = 1.0 / np.hypot(1.0, distances / scale)
    return np.where(np.isfinite(distances), weights, 0.0)


def _judge(data: BundleData, state: BundleState) -> tuple[Float, Float, Float]:
    """Return the distances of all spots and of those of the bars, in sigmas, and the misses, px.

    What has no weight from the beginning has no distance.
    """
    of_frames, of_bars = residuals(data, state)
    return _lengths(of_frames, data.weights), _lengths(of_bars, data.bar_weights), of_frames


def _lengths(off: Float, weights: Float) -> Float:
    known = np.where(weights > 0.0, weights, np.nan)
    lengths: Float = np.hypot(off[..., 0], off[..., 1]) * known
    return lengths


def _without(data: BundleData, distances: Float, bar_distances: Float) -> BundleData:
    limit = limit_of(np.concatenate([distances.ravel(), bar_distances.ravel()]))
    good = distances <= limit
    good &= solvable(good)[:, None, None]
    # A spot that was not seen compares as False with everything.
    wrong = (bar_distances > limit).any(axis=tuple(range(1, bar_distances.ndim)))
    placed = np.where(wrong, 0.0, 1.0)[:, None, None]
    return data.scaled(good.astype(np.float64), placed)


def _same(one: BundleData, other: BundleData) -> bool:
    return np.array_equal(one.weights, other.weights) and np.array_equal(
        one.bar_weights, other.bar_weights
    )
