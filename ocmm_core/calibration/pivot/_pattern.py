"""Effect of the fixed sensor pattern on a swept probe.

The error of a spot depends on its place on the sensor, correlated over the pattern's length
(`camera.rig.SpotNoise`). Poses at similar attitudes share it, and a sweep crosses few independent
places. The influence of every spot on LEDs and tip is summed over a field with that correlation: a
sum of cosine waves with normally distributed wave vectors (random Fourier features, Rahimi and
Recht 2007).
"""

from __future__ import annotations

import numpy as np

from ocmm_core.calibration.pivot._bundle import PivotState
from ocmm_core.calibration.pivot._data import PivotSweep
from ocmm_core.camera import CameraModel, Rig, distortion_jacobian
from ocmm_core.geometry import Float, Pixels

_CHUNK = 500
"""Poses with influences in memory at a time."""


def pattern_covariance(
    rig: Rig,
    sweep: PivotSweep,
    state: PivotState,
    by_common: Float,
    inverse: Float,
    slack_mm: float,
    waves: int,
    seed: int,
) -> Float:
    """Return the covariance (m, m), mm^2, of a result due to the sensor pattern.

    ``by_common`` (m, k): derivatives by centre and arms; ``inverse`` (k, k): their covariance, see
    `_bundle.inverse_pinned`.
    """
    rng = np.random.default_rng(seed)
    noise, cameras = rig.noise, len(rig.cameras)
    wave = rng.standard_normal((cameras, 2, 2, waves)) / noise.pattern_length_px
    phase = rng.uniform(0.0, 2.0 * np.pi, (cameras, 2, waves))
    # Response of the result to the amplitude of each wave, by image axis and camera.
    moved = np.zeros((cameras, 2, waves, len(by_common)))
    gain = by_common @ inverse
    for first in range(0, len(sweep.uv), _CHUNK):
        part = slice(first, first + _CHUNK)
        influences = spot_influences(rig, sweep, state, gain, slack_mm, part)
        uv = sweep.uv[part]
        for c in range(cameras):
            seen = np.isfinite(uv[:, c]).all(axis=2)
            places, own = uv[:, c][seen], influences[:, c][seen]
            for axis in range(2):
                field = np.cos(places @ wave[c, axis] + phase[c, axis])
                moved[c, axis] += field.T @ own[:, axis]
    flat = moved.reshape(-1, len(by_common))
    covariance: Float = noise.pattern_px**2 * 2.0 / waves * (flat.T @ flat)
    return covariance


def random_wave(rig: Rig, uv: Pixels, sigma_px: float, rng: np.random.Generator) -> Pixels:
    """Return one wave of a pattern of ``sigma_px`` at spots (n, C, L, 2), px."""
    shape = (uv.shape[1], 2)
    wave = rng.standard_normal((*shape, 2)) / rig.noise.pattern_length_px
    phase = rng.uniform(0.0, 2.0 * np.pi, shape)
    turns = np.einsum("nclj,caj->ncla", uv, wave) + phase[:, None]
    found: Pixels = np.sqrt(2.0) * sigma_px * np.cos(turns)
    return found


def spot_influences(
    rig: Rig, sweep: PivotSweep, state: PivotState, gain: Float, slack_mm: float, part: slice
) -> Float:
    """Return a result's derivative by each spot, (n, C, L, 2, m), mm/px; zero if unseen.

    ``gain`` (m, k) is its negative derivative by the gradient of centre and arms.
    """
    rotations, weights = state.rotations[part], sweep.weights[part]
    arms = np.einsum("nij,lj->nli", rotations, state.arms)
    points = arms + (state.centre + state.slacks[part])[:, None]
    n, n_leds = points.shape[:2]
    by_point = np.stack(
        [
            _by_point(camera, points) * weights[:, c, :, None, None]
            for c, camera in enumerate(rig.cameras)
        ],
        axis=1,
    )
    common = np.zeros((*by_point.shape[:4], 3 + 3 * n_leds))
    common[..., :3] = by_point
    by_arm = by_point @ rotations[:, None, None]
    for led in range(n_leds):
        common[:, :, led, :, 3 + 3 * led : 6 + 3 * led] = by_arm[:, :, led]
    own = np.cross(arms[:, None, :, None], by_point)
    prior = np.zeros(3)
    if slack_mm > 0.0:
        own = np.concatenate([own, by_point], axis=-1)
        prior = np.repeat([0.0, 1.0 / slack_mm**2], 3)
    a, b = common.reshape(n, -1, common.shape[-1]), own.reshape(n, -1, own.shape[-1])
    bt = b.transpose(0, 2, 1)
    # Part not absorbed by a pose's own unknowns.
    left = a - b @ np.linalg.solve(bt @ b + np.diag(prior), bt @ a)
    influences = (left @ gain.T).reshape(*by_point.shape[:4], len(gain))
    found: Float = influences * weights[..., None, None]
    return found


def _by_point(camera: CameraModel, points: Float) -> Float:
    """Return the derivative of spots, px, by points (n, L, 3), mm: (n, L, 2, 3)."""
    pose = camera.T_camera_from_world
    seen = pose.apply(points)
    depth = seen[..., 2]
    ideal = camera.focal * seen[..., :2] / depth[..., None]
    pinhole = np.zeros((*depth.shape, 2, 3))
    pinhole[..., 0, 0] = pinhole[..., 1, 1] = camera.focal / depth
    pinhole[..., :, 2] = -ideal / depth[..., None]
    slope = np.array([[camera.sx], [camera.sy]]) * distortion_jacobian(camera, ideal)
    derivative: Float = slope @ pinhole @ pose.rotation
    return derivative
