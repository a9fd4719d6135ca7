"""Covariance of LEDs and tip of a swept probe, and its prediction from the range of rotation.

The formal covariance is too small: the hand moves slowly over the sensor pattern, and the ball
creeps. A block bootstrap (Kuensch 1989) draws blocks of consecutive frames, as long as their
influences on the tip are correlated, with replacement; each draw is solved by one Gauss-Newton
step. A hand also returns to the same attitudes: blocks of neighbouring attitudes are drawn
likewise, and the larger scatter counts. Neither reveals all of the fixed sensor pattern; its effect
is computed and used if larger. The cameras' contribution, common to all frames, is added; its part
in the scatter of the blocks is subtracted, as it would count twice.

The error of a spot depends on its place on the sensor, correlated over the pattern's length
(`camera.rig.SpotNoise`). Poses at similar attitudes share it, and a sweep crosses few independent
places. The influence of every spot on LEDs and tip is summed over a field with that correlation: a
sum of cosine waves with normally distributed wave vectors (random Fourier features, Rahimi and
Recht 2007).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy

from ocmm_core.calibration.pivot import _bundle as bundle
from ocmm_core.calibration.pivot._data import PivotSweep, SweepCoverage
from ocmm_core.camera import CameraModel, Rig, distortion_jacobian, locate_markers, slopes_of_places
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Int, Pixels, Points3, RigidTransform, rigid_fit, skew, unit
from ocmm_core.tracking import ProbeBody, solve

_CHUNK = 500
"""Poses with influences in memory at a time."""


def pattern_covariance(
    rig: Rig, sweep: PivotSweep, state: bundle.PivotState, by_common: Float, inverse: Float,
    slack_mm: float, waves: int, seed: int,
) -> Float:  # fmt: skip
    """Return the covariance (m, m), mm^2, of a result due to the sensor pattern.

    ``by_common`` (m, k): derivatives by centre and arms; ``inverse`` (k, k): their covariance, see
    `_bundle.inverse_pinned`.
    """
    rng = np.random.default_rng(seed)
    noise, cameras = rig.noise, len(rig.cameras)
    if rig.markers is not None:
        return _of_markers(rig, sweep, state, by_common @ inverse, slack_mm, waves, rng)
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
    return noise.pattern_px**2 * 2.0 / waves * (flat.T @ flat)


def _of_markers(
    rig: Rig, sweep: PivotSweep, state: bundle.PivotState, gain: Float, slack_mm: float, waves: int,
    rng: np.random.Generator,
) -> Float:  # fmt: skip
    influences = spot_influences(rig, sweep, state, gain, slack_mm, slice(None))
    flat = influences.reshape(-1, len(gain)).T
    fields = random_waves(rig, sweep.uv, rig.noise.pattern_px, waves, rng)
    moved = np.array([flat @ np.nan_to_num(field).ravel() for field in fields])
    covariance: Float = moved.T @ moved / waves
    return covariance


def random_waves(
    rig: Rig, uv: Pixels, sigma_px: float, count: int, rng: np.random.Generator
) -> Iterator[Pixels]:
    """Yield waves of a pattern of ``sigma_px`` at spots (n, C, L, 2), px.

    Of a tracker: the images of markers displaced by one wave of its place errors, to first order.
    """
    if rig.markers is not None:
        noise, places = rig.markers.document.noise, locate_markers(rig.cameras, uv)
        slopes = slopes_of_places(rig.cameras, places.reshape(-1, 3), rig.markers.document)
        slopes *= np.sqrt(2.0) * noise.reported[0] * sigma_px / rig.noise.white_px
        for _ in range(count):
            turns = places @ (rng.standard_normal((3, 3)) / noise.place_length)
            field = np.cos(turns + rng.uniform(0.0, 2.0 * np.pi, 3)).reshape(-1, 1, 3, 1)
            yield (slopes @ field).reshape(*places.shape[:2], -1, 2).swapaxes(1, 2)
        return
    shape = (uv.shape[1], 2)
    for _ in range(count):
        wave = rng.standard_normal((*shape, 2)) / rig.noise.pattern_length_px
        phase = rng.uniform(0.0, 2.0 * np.pi, shape)
        turns = np.einsum("nclj,caj->ncla", uv, wave) + phase[:, None]
        yield np.sqrt(2.0) * sigma_px * np.cos(turns)


def spot_influences(
    rig: Rig, sweep: PivotSweep, state: bundle.PivotState, gain: Float, slack_mm: float, part: slice
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
    return slope @ pinhole @ pose.rotation


MOST_BLOCKS = 200
LEAST_BLOCKS = 8
_CORRELATIONS_PER_BLOCK = 6.0
_CELLS_ACROSS = 8

PATTERN_WAVES = 300
"""Cosine waves of a sensor pattern: gives variances to some per cent."""

BEYOND_CHANCE = 1.4
"""Variances from some sixty blocks scatter by a fifth; always the larger would overestimate."""


@dataclass(frozen=True, slots=True)
class Geometry:
    """LEDs and tip in the frame of a probe's document."""

    leds_probe: Points3
    tip_probe: Float
    """`leds_probe`, `tip_probe`: (L, 3) and (3,), mm."""
    T_probe_from_body: RigidTransform
    """From the frame of the adjustment, whose origin is the tip."""
    by_arms: Float
    """(3 L + 3, 3 L): derivative by the arms, with the LEDs kept fitted to the document's."""


@dataclass(frozen=True, slots=True)
class PivotUncertainty:
    """Covariances (3 L + 3, 3 L + 3), mm^2, of LEDs and tip in the probe's frame."""

    noise: Float
    """From block bootstrap less the cameras' part; at least formal and of the sensor pattern."""
    formal: Float
    """Of independent frames with the stated sigma."""
    by_cameras: Float
    """(3 L + 3, 14 C): derivative of LEDs and tip by the parameters of the cameras."""
    cameras: Float
    """Contribution of the cameras' uncertainty."""
    block: int

    @property
    def total(self) -> Float:
        return self.noise + self.cameras


def geometry_in(leds_document: Points3, arms: Points3) -> Geometry:
    """Return LEDs and tip, fitted to the LEDs (L, 3), mm, of the document."""
    rotation, tip = rigid_fit(arms, leds_document)
    leds = arms @ rotation.T + tip
    n_leds = len(leds)
    # Motions of the whole probe: rotations about the origin, then shifts.
    motions = np.vstack([np.hstack([-skew(point), np.eye(3)]) for point in (*leds, tip)])
    held = np.linalg.pinv(motions[: 3 * n_leds])
    by_leds = np.vstack([np.eye(3 * n_leds), np.zeros((3, 3 * n_leds))]) - motions @ held
    return Geometry(
        leds, tip, RigidTransform(rotation, tip), by_leds @ np.kron(np.eye(n_leds), rotation)
    )


def pivot_uncertainty(
    rig: Rig, sweep: PivotSweep, state: bundle.PivotState, geometry: Geometry, slack_mm: float,
    resamples: int, seed: int, *, pattern: bool = False,
) -> PivotUncertainty:  # fmt: skip
    """Return the uncertainty of a minimum, with bootstrap draws ``resamples``.

    ``pattern``: the sensors have that of the rig. CalibrationError if the probe is undetermined.
    """
    here = bundle.normals_at(rig, sweep, state, slack_mm, with_cameras=True)
    turns = state.turns()
    inverse = bundle.inverse_pinned(here.normals[0], turns)
    if inverse is None:
        raise CalibrationError(
            "pivot.open",
            "The sweep does not determine the geometry of the probe.",
            "Sweep the probe by 20 degrees to all sides, and turn it about its handle too.",
        )
    by_common = np.hstack([np.zeros((len(geometry.by_arms), 3)), geometry.by_arms])
    influences = here.scores @ inverse @ by_common[-3:].T
    block = block_length(influences)
    blocks = np.arange(len(sweep.uv), dtype=np.int64) // block
    cells = attitude_blocks(state.rotations @ state.arms.mean(axis=0))
    formal = by_common @ inverse @ by_common.T
    noises = []
    for numbers in (blocks, cells):
        split = bundle.normals_at(rig, sweep, state, slack_mm, blocks=numbers, with_cameras=True)
        drawn = by_common @ _bootstrap(split, turns, resamples, seed) @ by_common.T
        of_cameras = _scatter_of_cameras(split, inverse, by_common, rig.parameter_covariance)
        # A bootstrap of few blocks can by chance fall below pure noise.
        left = max(_of_tip(drawn) - of_cameras, _of_tip(formal))
        noises.append(drawn * left / _of_tip(drawn))
    beyond = _of_tip(noises[1]) > BEYOND_CHANCE * _of_tip(noises[0])
    noise = noises[1] if beyond and cells.max() + 1 >= LEAST_BLOCKS else noises[0]
    if pattern:
        modelled = formal + pattern_covariance(
            rig, sweep, state, by_common, inverse, slack_mm, PATTERN_WAVES, seed
        )
        noise = modelled if _of_tip(modelled) > _of_tip(noise) else noise
    by_cameras = -by_common @ bundle.solve_pinned(here.normals[0], turns, here.crossed[0])
    return PivotUncertainty(
        noise=noise,
        formal=formal,
        by_cameras=by_cameras,
        cameras=by_cameras @ rig.parameter_covariance @ by_cameras.T,
        block=block,
    )


def block_length(influences: Float) -> int:
    """Return the block length for correlated influences (n, 3) of frames.

    Six times the integrated autocorrelation time of the slowest axis (Sokal's window), for nearly
    independent blocks; at least eight blocks.
    """
    n = len(influences)
    times = max(_correlation_time(column) for column in influences.T)
    shortest = -(-n // MOST_BLOCKS)
    longest = max(n // LEAST_BLOCKS, 1)
    return int(np.clip(np.ceil(_CORRELATIONS_PER_BLOCK * times), shortest, longest))


def _correlation_time(series: Float) -> float:
    """Return half of one plus twice the sum of the autocorrelations: 0.5 for white noise."""
    centred = series - series.mean()
    n = len(centred)
    size = 1 << (2 * n - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(centred, size)) ** 2
    correlation = np.fft.irfft(spectrum, size)[:n]
    if not correlation[0] > 0.0:
        return 0.5
    sums = 0.5 + np.cumsum(correlation[1:] / correlation[0])
    windows = np.arange(1, n)
    enough = np.flatnonzero(windows >= 6.0 * sums)
    return max(float(sums[enough[0]] if len(enough) else sums.max(initial=0.5)), 0.5)


def attitude_blocks(directions: Points3) -> Int:
    """Return the attitude cell of every frame, (n,): eight across each of the widest directions."""
    centred = directions - directions.mean(axis=0)
    across = centred @ np.linalg.svd(centred, full_matrices=False)[2][:2].T
    low, width = across.min(axis=0), np.maximum(np.ptp(across, axis=0), 1e-12)
    cells = np.minimum((_CELLS_ACROSS * (across - low) / width).astype(np.int64), _CELLS_ACROSS - 1)
    return np.unique(cells @ [_CELLS_ACROSS, 1], return_inverse=True)[1]


def _of_tip(covariance: Float) -> float:
    return float(np.trace(covariance[-3:, -3:]))


def _scatter_of_cameras(
    split: bundle.PivotNormals, inverse: Float, by_common: Float, cameras: Float
) -> float:
    """Return the variance of the tip in a block bootstrap due to camera errors.

    Cameras with error d give every block the gradient ``(X_b - N_b N^-1 X) d`` at the minimum.
    """
    shift = inverse @ split.crossed.sum(axis=0)
    left = by_common[-3:] @ inverse @ (split.crossed - split.normals @ shift)
    return float(np.einsum("bij,jk,bik->", left, cameras, left, optimize=True))


def _bootstrap(split: bundle.PivotNormals, turns: Float, resamples: int, seed: int) -> Float:
    rng = np.random.default_rng(seed)
    normals, gradients = split.normals, split.gradients
    count = len(normals)
    draws = rng.multinomial(count, np.full(count, 1.0 / count), size=resamples).astype(np.float64)
    # Scale and gauge are shared by all draws: their sums differ by some per cent only.
    _, scale, pinned = bundle.pinned_normal(normals.sum(axis=0), turns)
    drawn = np.tensordot(draws, normals, 1) / scale / scale[:, None] + pinned
    steps = -np.linalg.solve(drawn, (draws @ gradients / scale)[..., None])[..., 0] / scale
    steps -= steps.mean(axis=0)
    # Draws from B blocks have (B - 1) / B of the variance of B independent blocks.
    return steps.T @ steps / (resamples - 1) * (count / max(count - 1, 1))


ATTITUDE_STEP = np.radians(2.0)
_LEAST_FRAMES = 10
_WAVES = 60
"""Cosine waves of a sensor pattern: sufficient for display."""


@dataclass(frozen=True, slots=True)
class PivotPreview:
    """Preview of a sweep in progress."""

    coverage: SweepCoverage | None
    """None with fewer than ten frames."""
    tip_sigma: float
    """mm: standard uncertainty of the tip (root of the sum over its axes) from spot noise and
    cameras if the sweep ended now; infinite if undetermined."""
    centre_world: Float
    """(3,), mm: ball centre by the probe's document; NaN without coverage."""


def coverage_of(rotations: Float, middle_probe: Float) -> SweepCoverage:
    """Return the coverage by rotations (n, 3, 3), world from probe; ball to LEDs' middle (3,)."""
    turns = scipy.spatial.transform.Rotation.from_matrix(rotations)
    vectors = (turns.mean().inv() * turns).as_rotvec()
    axes = np.linalg.svd(vectors - vectors.mean(axis=0), full_matrices=False)[2]
    along = vectors @ axes.T
    low, high = np.percentile(along, [1.0, 99.0], axis=0)
    ranges = np.sort(high - low)[::-1]
    cells = np.unique(np.round(vectors / ATTITUDE_STEP).astype(np.int64), axis=0)
    return SweepCoverage(ranges, len(cells), unit(rotations @ middle_probe))


def preview_pivot(
    rig: Rig, body: ProbeBody, sweep: PivotSweep, *, pattern: bool = False
) -> PivotPreview:
    """Return coverage and predicted uncertainty, live: nominal probe, only poses fitted."""
    sigma = float(np.median(sweep.sigma_px)) if len(sweep.uv) else 1.0
    poses = solve(sweep.uv, rig, body, sigma)
    solved = poses.status == 0
    if np.count_nonzero(solved) < _LEAST_FRAMES:
        return PivotPreview(None, np.inf, np.full(3, np.nan))
    arms = body.leds_probe - body.tip_probe
    rotations = poses.rotation_world_from_probe[solved]
    centre = np.median(poses.tip_world[solved], axis=0)
    state = bundle.PivotState(centre, arms, rotations, np.zeros((len(rotations), 3)))
    kept = sweep.only(solved)
    here = bundle.normals_at(rig, kept, state, 0.0, with_cameras=True)
    covariance = bundle.inverse_pinned(here.normals[0], state.turns())
    tip_sigma = np.inf
    if covariance is not None:
        by_arms = geometry_in(body.leds_probe, arms).by_arms[-3:]
        by_cameras = by_arms @ (covariance @ here.crossed[0])[3:]
        variance = by_arms @ covariance[3:, 3:] @ by_arms.T
        variance += by_cameras @ rig.parameter_covariance @ by_cameras.T
        if pattern:
            by_common = np.hstack([np.zeros((3, 3)), by_arms])
            variance += pattern_covariance(rig, kept, state, by_common, covariance, 0.0, _WAVES, 1)
        tip_sigma = float(np.sqrt(np.trace(variance)))
    return PivotPreview(coverage_of(rotations, arms.mean(axis=0)), tip_sigma, centre)
