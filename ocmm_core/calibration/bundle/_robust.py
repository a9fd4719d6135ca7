"""Bundle adjustment with detection of wrong spots, started from the previous cameras.

Start values: poses, bars and seats as the previous cameras see them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ocmm_core.calibration.bundle._bundle import BundleMinimum, adjust, residuals
from ocmm_core.calibration.bundle._state import BundleData, BundleState, Prior
from ocmm_core.calibration.cameras import OUTLIER_PROBABILITY
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Pixels, Points3, perpendicular_pair, rigid_fit, unit
from ocmm_core.tracking import ProbeBody, require_spots, triangulate
from ocmm_core.tracking.kernels import OK, allocate, solve_frames

LEAST_LEDS = 3
"""LEDs seen by two cameras in one frame, needed for its pose."""

_SHAPE_FRAMES = 200
_SHAPE_ROUNDS = 10


def solvable(seen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the frames (n,) with enough LEDs, from a visibility mask (n, C, L)."""
    enough: NDArray[np.bool_] = (seen.sum(axis=1) >= 2).sum(axis=1) >= LEAST_LEDS
    return enough


def start_poses(rig: Rig, leds: Points3, uv: Pixels) -> tuple[Float, Points3, NDArray[np.bool_]]:
    """Return rotations (n, 3, 3), origins (n, 3), world from probe, and success (n,).

    Rigid fit to triangulated LEDs (thesis 2.4), tolerates millimetres. ``uv``: (n, C, L, 2), px.
    """
    require_spots(uv, rig, len(leds))
    outputs = allocate(len(uv))
    solve_frames(
        np.ascontiguousarray(uv, dtype=np.float64), rig.packed(), leds, np.zeros(3),
        1.0, np.inf, 0, *outputs,
    )  # fmt: skip
    status, _, _, rotations, origins, _, _ = outputs
    found = status == OK
    rotations[~found] = np.eye(3)
    origins[~found] = 0.0
    return rotations, origins, found


def start_shape(rig: Rig, body: ProbeBody, uv: Pixels) -> Points3:
    """Return the LEDs (L, 3), mm, from frames (n, C, L, 2), in the probe's frame.

    Mean of triangulated shapes (generalised Procrustes, Gower 1975; thesis 3.2), fitted to the
    body. CalibrationError if no frame shows all LEDs to two cameras.
    """
    complete = np.flatnonzero((np.isfinite(uv).all(axis=3).sum(axis=1) >= 2).all(axis=1))
    if not len(complete):
        raise CalibrationError(
            "relocation.no_complete_frame",
            "No frame shows all LEDs of the probe to two cameras, so its unknown geometry has "
            "no start value.",
            "Wave the probe with its LEDs towards the cameras.",
        )
    every = max(1, len(complete) // _SHAPE_FRAMES)
    shapes = [triangulate(rig, uv[index]) for index in complete[::every]]
    mean = shapes[0]
    for _ in range(_SHAPE_ROUNDS):
        laid = []
        for shape in shapes:
            rotation, translation = rigid_fit(shape, mean)
            laid.append(shape @ rotation.T + translation)
        mean = np.median(laid, axis=0)
    rotation, translation = rigid_fit(mean, body.leds_probe)
    return mean @ rotation.T + translation


def start_bars(rig: Rig, uv: Pixels) -> tuple[Float, Points3, NDArray[np.bool_]]:
    """Return bars along x in ``uv`` (m, C, 2, 2), px: world from bar (m, 3, 3), (m, 3); success."""
    rotations, centres = np.tile(np.eye(3), (len(uv), 1, 1)), np.zeros((len(uv), 3))
    found = np.zeros(len(uv), dtype=np.bool_)
    for index, placement in enumerate(uv):
        first, second = triangulate(rig, placement)
        found[index] = np.isfinite(first).all() and np.isfinite(second).all()
        if found[index]:
            direction = unit(second - first)
            rotations[index] = np.stack([direction, *perpendicular_pair(direction)], axis=1)
            centres[index] = 0.5 * (first + second)
    return rotations, centres, found


_MEDIAN_OF_RAYLEIGH = 1.1774
_ROUNDS = 12
_STEPS_PER_ROUND = 5


@dataclass(frozen=True, slots=True)
class RobustMinimum:
    """Adjustment without the wrong spots."""

    minimum: BundleMinimum
    data: BundleData
    """With the weights of excluded spots set to zero."""
    distances: Float
    """(n, C, L): miss of every spot in sigmas, also of excluded ones; NaN if unseen."""
    residuals: Float
    """(n, C, L, 2), predicted minus observed, px, likewise."""

    @property
    def used(self) -> NDArray[np.bool_]:
        """Return the mask of used spots (n, C, L)."""
        return self.data.weights > 0.0

    @property
    def placements_used(self) -> NDArray[np.bool_]:
        """Return the mask of used placements (m,) of bars."""
        return self.data.active[1]


Mask: TypeAlias = NDArray[np.bool_]


def adjust_robustly(
    data: BundleData, prior: Prior, start: BundleState, enough: Callable[[Mask], Mask] = solvable
) -> RobustMinimum:
    """Return the minimum of the good spots; frames stay that have ``enough`` of them.

    First with Cauchy weights scaled by the median residual, as the start is wrong by many pixels;
    then without outliers, re-judged after every fit. A bar's placement is kept or excluded as a
    whole: it has too few spots to identify the wrong one.
    """
    state = _settled(data, prior, start)
    chosen = data
    for _ in range(_ROUNDS):
        distances, bar_distances, _ = _judge(data, state)
        again = _without(data, distances, bar_distances, enough)
        minimum = adjust(again, prior, state)
        state = minimum.state
        same = np.array_equal(again.weights, chosen.weights) and np.array_equal(
            again.bar_weights, chosen.bar_weights
        )
        chosen = again
        if same:
            break
    distances, _, residuals = _judge(data, state)
    return RobustMinimum(minimum, chosen, distances, residuals)


def scale_of(distances: Float) -> float:
    """Return the ratio of good residuals to sigma, at least one."""
    return max(float(np.nanmedian(distances)) / _MEDIAN_OF_RAYLEIGH, 1.0)


def limit_of(distances: Float) -> float:
    """Return the outlier distance: P(d > x) = exp(-x^2 / 2), over all spots (Bonferroni)."""
    count = max(int(np.isfinite(distances).sum()), 1)
    return scale_of(distances) * math.sqrt(-2.0 * math.log(OUTLIER_PROBABILITY / count))


def _settled(data: BundleData, prior: Prior, start: BundleState) -> BundleState:
    state, last = start, math.inf
    for _ in range(_ROUNDS):
        distances, bar_distances, _ = _judge(data, state)
        scale = scale_of(np.concatenate([distances.ravel(), bar_distances.ravel()]))
        weighted = data.scaled(*(_cauchy(d, 3.0 * scale) for d in (distances, bar_distances)))
        state = adjust(weighted, prior, state, _STEPS_PER_ROUND).state
        if abs(last - scale) <= 1e-2 * scale:
            break
        last = scale
    return state


def _cauchy(distances: Float, scale: float) -> Float:
    """Return the square roots of Cauchy weights; zero for unseen spots."""
    weights = 1.0 / np.hypot(1.0, distances / scale)
    return np.where(np.isfinite(distances), weights, 0.0)


def _judge(data: BundleData, state: BundleState) -> tuple[Float, Float, Float]:
    """Return spot and bar spot distances, sigmas, and misses, px; NaN for zero weight."""
    of_frames, of_bars = residuals(data, state)
    return _lengths(of_frames, data.weights), _lengths(of_bars, data.bar_weights), of_frames


def _lengths(off: Float, weights: Float) -> Float:
    known = np.where(weights > 0.0, weights, np.nan)
    return np.hypot(off[..., 0], off[..., 1]) * known


def _without(
    data: BundleData, distances: Float, bar_distances: Float, enough: Callable[[Mask], Mask]
) -> BundleData:
    limit = limit_of(np.concatenate([distances.ravel(), bar_distances.ravel()]))
    good = distances <= limit
    good &= enough(good)[:, None, None]
    # Unseen spots compare as False.
    wrong = (bar_distances > limit).any(axis=tuple(range(1, bar_distances.ndim)))
    placed = np.where(wrong, 0.0, 1.0)[:, None, None]
    return data.scaled(good.astype(np.float64), placed)
