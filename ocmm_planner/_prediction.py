"""Predicted uncertainty of a planned rig over its volume.

The tip is the least-squares pose of its spots, so that to first order its error is the derivative
(`tracking.tip_derivatives`) by spots, cameras and probe times their errors (GUM 5.1.2).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from ocmm_core.geometry import Float, Int
from ocmm_core.tracking import tip_derivatives
from ocmm_core.tracking.kernels import MAX_TIP_SIGMA
from ocmm_planner._optics import SEEN, Scene, spots_of

LEAST_LEDS = 4
"""LEDs seen by two cameras; fewer cannot be identified reliably."""
LINE = 6
"""Obstacle, next to those of `_optics`: enough LEDs are seen, but they are close to one line."""
_CHUNK = 2000
_K = 2.0


@dataclass(frozen=True, slots=True)
class Tips:
    """Predicted tips of n poses; rows without a tip are NaN."""

    stage: Int
    """(n,): `SEEN`, or the most frequent obstacle, or `LINE`."""
    leds: Int
    """(n,): LEDs seen by two cameras."""
    own: Float
    """(n, 3, 3), mm^2: covariance by noise of its own spots."""
    by_shared: Float
    """(n, 3, m): derivatives by the errors of cameras and probe, see `shared_covariance`."""
    light: Float
    """(n, 3): largest blur, px, faintest and brightest pixel by the saturation, of seen spots."""


@dataclass(frozen=True, slots=True)
class RigMap:
    """Prediction at n nodes; U is expanded (k = 2), mm, NaN if none."""

    nodes: Float
    """(n, 3), mm, frame of the document."""
    u_tip: Float
    """(n,): longest half axis, the largest over the attitudes."""
    u_length: Float
    """(n,): of the length of the plan, the largest of X, Y and Z, probe upright at both ends."""
    stage: Int
    """(n,): 0, or the obstacle of the first attitude without a tip."""
    leds: Int
    leds_mean: Float
    """`leds`, `leds_mean`: (n,): seen by two cameras; fewest and mean over the attitudes."""
    share: Float
    """(n,): part of the attitudes that give a tip."""
    light: Float
    """(n, 3): extremes over the attitudes, see `Tips`."""


def shared_covariance(scene: Scene) -> Float:
    """Return the covariance (m, m) of cameras and probe, common to all tips of a rig."""
    found: Float = block_diag(scene.rig.parameter_covariance, scene.plan.probe.geometry_covariance)
    return found


def predict_tips(scene: Scene, rotations: Float, tips_world: Float) -> Tips:
    """Return the predicted tips of poses (n, 3, 3) and (n, 3), mm, world from probe and balls."""
    spots, rig = spots_of(scene, rotations, tips_world), scene.rig
    seen, n = spots.stage == SEEN, len(rotations)
    leds = np.count_nonzero(np.count_nonzero(seen, axis=1) >= 2, axis=1)
    # The most frequent reason why a camera does not see an LED.
    hidden = [np.count_nonzero(spots.stage == kind, axis=(1, 2)) for kind in range(1, LINE)]
    stage: Int = 1 + np.argmax(hidden, axis=0)
    good = np.flatnonzero(leds >= LEAST_LEDS)
    tips = tip_derivatives(spots.uv[good], rig, scene.plan.probe)
    # Seen spots are listed first; the derivatives of the rest are 0.
    size = tips.by_spots.shape[2] // 2
    order = np.argsort(~seen[good].reshape(len(good), size), axis=1, kind="stable")

    def by_noise(variances: Float) -> Float:
        listed = np.take_along_axis(variances.reshape(len(good), size), order, axis=1)
        scaled = tips.by_spots * np.repeat(listed, 2, axis=1)[:, None]
        found: Float = scaled @ tips.by_spots.transpose(0, 2, 1)
        return found

    # The pattern of one sensor is correlated over the distance of spots, as in a job.
    uv = np.nan_to_num(spots.uv[good].reshape(len(good), size, 2))
    uv = np.take_along_axis(uv, order[:, :, None], axis=1)
    camera = order // seen.shape[2]
    sigma = np.array([one.pattern_px for one in scene.plan.cameras])[camera]
    squares = np.sum((uv[:, :, None] - uv[:, None]) ** 2, axis=3)
    alike = np.exp(-0.5 * squares / rig.noise.pattern_length_px**2)
    alike *= (camera[:, :, None] == camera[:, None]) * sigma[:, :, None] * sigma[:, None]
    u, v = tips.by_spots[:, :, 0::2], tips.by_spots[:, :, 1::2]
    pattern = u @ alike @ u.transpose(0, 2, 1) + v @ alike @ v.transpose(0, 2, 1)
    white = by_noise(spots.white[good])
    # The kernel refuses each frame by its own noise.
    frame = np.einsum("nii->n", white + pattern)
    stage[good] = np.where(tips.answered & (frame <= MAX_TIP_SIGMA**2), SEEN, LINE)
    own = np.full((n, 3, 3), np.nan)
    own[good] = white / scene.plan.document.measuring.frames + pattern
    by_shared = np.full((n, 3, tips.by_cameras.shape[2] + tips.by_geometry.shape[2]), np.nan)
    by_shared[good] = np.concatenate([tips.by_cameras, tips.by_geometry], axis=2)
    own[stage != SEEN] = by_shared[stage != SEEN] = np.nan
    light = [
        sign * np.where(seen, sign * values, -np.inf).max(axis=(1, 2))
        for sign, values in ((1.0, spots.blur_px), (-1.0, spots.peak), (1.0, spots.peak))
    ]
    return Tips(stage, leds, own, by_shared, np.stack(light, axis=1))


def predict_map(
    scene: Scene, nodes: Float, step: Callable[[float], None] = lambda share: None, *,
    with_length: bool = True,
) -> RigMap:  # fmt: skip
    """Return the prediction at nodes (n, 3), mm; ``step`` gets the finished share."""
    parts = []
    each = max(1, _CHUNK // len(scene.plan.turns))
    for start in range(0, len(nodes), each):
        step(start / len(nodes))
        parts.append(_some(scene, nodes[start : start + each], with_length=with_length))
    return RigMap(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _some(scene: Scene, nodes: Float, *, with_length: bool) -> tuple[Float, ...]:
    turns, common = scene.plan.turns, shared_covariance(scene)
    n, a = len(nodes), len(turns)
    tips = predict_tips(scene, np.tile(turns, (n, 1, 1)), np.repeat(nodes, a, axis=0))
    good, leds = (tips.stage == SEEN).reshape(n, a), tips.leds.reshape(n, a)
    half, flat = np.full(n * a, -np.inf), good.ravel()
    by_shared = tips.by_shared[flat]
    covariance = tips.own[flat] + by_shared @ common @ by_shared.transpose(0, 2, 1)
    half[flat] = _K * np.sqrt(np.linalg.eigvalsh(covariance)[:, -1])
    share = good.mean(axis=1)
    enough = (share >= scene.plan.document.attitudes.share - 1e-9) & good.any(axis=1)
    lost = tips.stage.reshape(n, a)[np.arange(n), (~good).argmax(axis=1)]
    length = _lengths(scene, nodes, tips, common) if with_length else np.full(n, np.nan)
    light = tips.light.reshape(n, a, 3) * [1.0, -1.0, 1.0]
    return (
        nodes, np.where(enough, half.reshape(n, a).max(axis=1), np.nan),
        np.where(enough, length, np.nan), np.where(enough, SEEN, lost),
        leds.min(axis=1), leds.mean(axis=1), share, light.max(axis=1) * [1.0, -1.0, 1.0],
    )  # fmt: skip


def _lengths(scene: Scene, nodes: Float, tips: Tips, common: Float) -> Float:
    """Return the largest U of the lengths from nodes along X, Y and Z towards the middle, (n,)."""
    plan, upright = scene.plan, len(scene.plan.turns)
    low, high = plan.volume
    worst = np.full(len(nodes), np.nan)
    for axis in range(3):
        ends = nodes.copy()
        inwards = np.where(nodes[:, axis] > 0.5 * (low + high)[axis], -1.0, 1.0)
        ends[:, axis] += inwards * plan.document.length
        inside = ((ends >= low - 1e-9) & (ends <= high + 1e-9)).all(axis=1) & ~plan.inside_box(ends)
        far = predict_tips(scene, np.tile(plan.turns[0], (int(inside.sum()), 1, 1)), ends[inside])
        rows = (far.by_shared - tips.by_shared[::upright][inside])[:, axis]
        own = (far.own + tips.own[::upright][inside])[:, axis, axis]
        found = _K * np.sqrt(own + np.einsum("nm,nm->n", rows @ common, rows))
        worst[inside] = np.fmax(worst[inside], found)
    return worst
