"""Mean residuals of tracked frames over moments with little motion ("looks").

Averaged over some tens of milliseconds, little white noise is left: the rest is sensor pattern,
error of calibration and probe, or a moved camera. Their derivatives by poses, cameras and LEDs,
and the prior of these errors, are the design matrix of all tests.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import scipy
from numpy.typing import NDArray

from ocmm_core.camera import Rig, SpotNoise, projection_jacobians
from ocmm_core.cpu_features import njit
from ocmm_core.geometry import Float, Int, Pixels
from ocmm_core.tracking import FrameStatus, ProbeBody, TrackBlock, cut, join

_PIXEL_PX = 1.2
"""Correlation length of errors fixed to pixels, about the size of a spot."""
_PAIR_PX = 5.0
"""Farther apart, the pattern differs as much as errors of pixels."""
_MOST = 3.0
_POSE = 6

_MIN_SHARE = 0.5
"""Minimum share of a moment's frames, all with the same visible LEDs."""
_MIN_FRAMES = 4
_REACH_PX = 60.0
"""Limit of spot motion within a look, beyond which one pose cannot represent all its frames."""


@dataclass(frozen=True, slots=True)
class ResidualSample:
    """Mean residuals of consecutive frames."""

    first_ns: int
    last_ns: int
    """`first_ns`, `last_ns`: Bus time of its first and last frame."""
    n_frames: int
    residuals: Float
    """(C, L, 2), px: seen minus predicted by poses and residual map; NaN if unseen."""
    uv: Float
    """(C, L, 2), px: mean place of the spots."""
    still: Float
    """(C, L): part of an error of a pixel that the motion within the moment leaves."""
    pattern_px: Float
    """(C, L): standard deviation of the pattern not contained in the map."""
    white_px: float
    """Standard deviation of each of them due to white noise."""
    rotation_world_from_probe: Float
    origin_world: Float
    """`rotation_world_from_probe`, `origin_world`: (3, 3) and (3,), mm: pose in the middle."""
    known_tip_world: Float | None = None
    known_tip_covariance: Float | None = None
    """`known_tip_world`, `known_tip_covariance`: (3,), mm, (3, 3), mm^2: as of a control nest."""


@dataclass(frozen=True, slots=True)
class PatternMap:
    """Mean residuals of one camera over its sensor."""

    cell_px: Float
    """(2,): width and height of a cell; the first one starts at pixel (0, 0)."""
    mean_px: Float
    """(rows, columns, 2): at the middle of the cells."""
    left_px: Float
    """(rows, columns): standard deviation of the pattern not contained in the map."""

    def at(self, uv: Pixels) -> tuple[Pixels, Float]:
        """Return mean (..., 2), interpolated, and deviation (...), the largest of four cells."""
        rows, columns = self.left_px.shape
        place = uv / self.cell_px - 0.5
        column = np.clip(np.floor(place[..., 0]).astype(np.int64), 0, max(columns - 2, 0))
        row = np.clip(np.floor(place[..., 1]).astype(np.int64), 0, max(rows - 2, 0))
        right, down = np.minimum(column + 1, columns - 1), np.minimum(row + 1, rows - 1)
        h = np.clip(place[..., 0] - column, 0.0, 1.0)[..., None]
        g = np.clip(place[..., 1] - row, 0.0, 1.0)[..., None]
        mean = (1.0 - g) * ((1.0 - h) * self.mean_px[row, column] + h * self.mean_px[row, right])
        mean += g * ((1.0 - h) * self.mean_px[down, column] + h * self.mean_px[down, right])
        corners = [self.left_px[i, j] for i in (row, down) for j in (column, right)]
        return mean, np.max(corners, axis=0)


class ResidualAccumulator:
    """Cuts the stream of tracked frames into looks; for one thread.

    ``length_ns``: bus time of a look; ``maps``: one for each camera, or empty.
    """

    def __init__(
        self, rig: Rig, body: ProbeBody, length_ns: int, maps: Sequence[PatternMap] = ()
    ) -> None:
        self._rig = rig
        self._body = body
        self._length_ns = length_ns
        self._maps = tuple(maps)
        self._pieces: list[TrackBlock] = []
        self._moment = -1

    def push(self, track: TrackBlock) -> list[ResidualSample]:
        """Add frames and return completed looks; their starts do not depend on the blocks."""
        looks: list[ResidualSample] = []
        moments = track.time_ns // self._length_ns
        starts = [0, *(np.flatnonzero(np.diff(moments)) + 1).tolist(), len(track)]
        for first, last in pairwise(starts):
            if int(moments[first]) != self._moment:
                looks += self._complete()
                self._moment = int(moments[first])
            self._pieces.append(cut(track, first, last))
        return looks

    def _complete(self) -> list[ResidualSample]:
        pieces, self._pieces = self._pieces, []
        if not pieces:
            return []
        look = sample_of(join(pieces), self._rig, self._body, self._maps)
        return [] if look is None else [look]


def sample_of(
    frames: TrackBlock, rig: Rig, body: ProbeBody, maps: Sequence[PatternMap] = ()
) -> ResidualSample | None:
    """Return the look of consecutive tracked frames; those without a tip are ignored.

    None if too few saw the same LEDs, or the probe moved too far. ``maps``: one a camera, or empty.
    """
    enough = max(_MIN_FRAMES, round(_MIN_SHARE * len(frames)))
    good = np.flatnonzero(frames.status == FrameStatus.OK)
    if len(good) < enough:
        return None
    used = good[_seen_most_often(frames.seen[good])]
    if len(used) < enough:
        return None
    # Without a copy if all frames count.
    chosen = slice(None) if len(used) == len(frames) else used
    uv, rotations, origins = (
        np.ascontiguousarray(one[chosen])
        for one in (frames.uv, frames.rotation_world_from_probe, frames.origin_world)
    )
    seen = np.isfinite(uv[0, :, :, 0])
    pattern = np.full(seen.shape, rig.noise.pattern_px)
    expected = np.zeros((len(uv) if maps else 0, *uv.shape[1:]))
    for c, known in enumerate(maps):
        expected[:, c, seen[c]], left = known.at(uv[:, c, seen[c]])
        pattern[c, seen[c]] = left.mean(axis=0)
    moments = np.full((3, *seen.shape, 2), np.nan)
    squares, reach = spot_moments(
        uv, seen, rotations, origins, body.leds_probe, rig.packed(), expected, moments
    )
    if reach > _REACH_PX:
        return None
    # The pose of each frame has six parameters.
    freedom = (len(used) - 1) * (2 * int(np.count_nonzero(seen)) - 6)
    scatter = float(np.sqrt(squares / freedom))
    middle = len(used) // 2
    return ResidualSample(
        first_ns=int(frames.time_ns[used[0]]), last_ns=int(frames.time_ns[used[-1]]),
        n_frames=len(used), residuals=moments[0], uv=moments[1],
        # The mean of a Gaussian correlation over Gaussian places, two axes; a standard deviation.
        still=np.prod(1.0 + 2.0 * moments[2] / _PIXEL_PX**2, axis=2) ** -0.25,
        pattern_px=pattern,
        white_px=max(scatter, rig.noise.white_px) / float(np.sqrt(len(used))),
        rotation_world_from_probe=rotations[middle], origin_world=origins[middle],
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def spot_moments(
    uv: Float, seen: NDArray[np.bool_], rotations: Float, origins: Float, leds: Float, cams: Float,
    expected: Float, moments: Float,
) -> tuple[float, float]:  # fmt: skip
    """Write mean residuals, mean places and variances of places of the seen spots, (3, C, L, 2).

    ``uv`` (n, C, L, 2), px; poses (n, 3, 3) and (n, 3), world from probe; ``cams`` as `Rig.packed`;
    ``expected`` (n or 0, C, L, 2), px: subtracted from the residuals. Return the sum of the squares
    of the residuals about their means, and the longest way of a spot along an axis, px.
    """
    n, n_cameras, n_leds = uv.shape[:3]
    residuals, point = np.empty((n, 2)), np.empty(3)
    squares = reach = 0.0
    for c in range(n_cameras):
        cam = cams[c]
        for led in range(n_leds):
            if not seen[c, led]:
                continue
            for i in range(n):
                for a in range(3):
                    q = rotations[i, a]
                    place = q[0] * leds[led, 0] + q[1] * leds[led, 1] + q[2] * leds[led, 2]
                    point[a] = place + origins[i, a]
                z = cam[6] * point[0] + cam[7] * point[1] + cam[8] * point[2] + cam[11]
                x = cam[0] * point[0] + cam[1] * point[1] + cam[2] * point[2] + cam[9]
                y = cam[3] * point[0] + cam[4] * point[1] + cam[5] * point[2] + cam[10]
                # As `camera.project`; labelled spots are in front of their camera.
                x, y = cam[12] * x / z, cam[12] * y / z
                k1, k2, p1, p2 = cam[17], cam[18], cam[19], cam[20]
                r2 = x * x + y * y
                radial = 1.0 + r2 * (k1 + k2 * r2)
                xd = x * radial + 2.0 * p1 * x * y + p2 * (3.0 * x * x + y * y)
                yd = y * radial + p1 * (x * x + 3.0 * y * y) + 2.0 * p2 * x * y
                residuals[i, 0] = uv[i, c, led, 0] - (cam[15] + cam[13] * xd)
                residuals[i, 1] = uv[i, c, led, 1] - (cam[16] + cam[14] * yd)
            for a in range(2):
                if len(expected):
                    for i in range(n):
                        residuals[i, a] -= expected[i, c, led, a]
                mean, middle = residuals[:, a].mean(), uv[:, c, led, a].mean()
                spread = 0.0
                reach = max(reach, uv[:, c, led, a].max() - uv[:, c, led, a].min())
                for i in range(n):
                    squares += (residuals[i, a] - mean) ** 2
                    spread += (uv[i, c, led, a] - middle) ** 2
                moments[0, c, led, a], moments[1, c, led, a] = mean, middle
                moments[2, c, led, a] = spread / n
    return squares, reach


def _seen_most_often(seen: NDArray[np.uint64]) -> NDArray[np.bool_]:
    """Return the mask (n,) of frames with the most frequent visibility (n, ...)."""
    alike: NDArray[np.bool_] = np.all(seen == seen[0], axis=tuple(range(1, seen.ndim)))
    if not alike.all():
        _, kinds, counts = np.unique(seen, axis=0, return_inverse=True, return_counts=True)
        alike = kinds.ravel() == int(np.argmax(counts))
    return alike


def leds_world_of(looks: Sequence[ResidualSample], body: ProbeBody) -> Float:
    """Return the LED positions of the looks, (K, L, 3), mm, world."""
    rotations = np.stack([look.rotation_world_from_probe for look in looks])
    origins = np.stack([look.origin_world for look in looks])
    return body.leds_probe @ rotations.transpose(0, 2, 1) + origins[:, None]


@dataclass(frozen=True, slots=True)
class PixelNoise:
    """Errors fixed to pixels (their response, the black image), learnt from pairs of looks.

    A spot some pixels away has other ones, but nearly the same errors of pattern, calibration and
    probe (variogram; G. Matheron, Economic Geology 58 (1963) 1246).
    """

    squares: float = 0.0
    weight: float = 20.0
    """`squares`, `weight`: sums of weighted squares, px^2, and weights; none, as of one pair."""

    @property
    def px(self) -> float:
        """Return the standard deviation."""
        return float(np.sqrt(max(self.squares, 0.0) / self.weight))

    def learnt(self, before: ResidualSample, after: ResidualSample, noise: SpotNoise) -> PixelNoise:
        """Return the noise with one more pair; that of distant places adds nothing."""
        change = after.residuals - before.residuals
        seen = np.isfinite(change[..., 0])
        apart2 = np.sum((after.uv - before.uv)[seen] ** 2, axis=1)
        size = 2 * len(apart2)
        if size <= _POSE or apart2.max() > _PAIR_PX**2:
            return self
        kept = 2.0 * (1.0 - _POSE / size)
        alike = before.still[seen] * after.still[seen] * np.exp(-0.5 * apart2 / _PIXEL_PX**2)
        slope = kept * np.sum(before.still[seen] ** 2 + after.still[seen] ** 2 - 2.0 * alike)
        far = -np.expm1(-0.5 * apart2 / noise.pattern_length_px**2)
        other = 2.0 * before.pattern_px[seen] ** 2 * far
        expected = kept * np.sum(before.white_px**2 + after.white_px**2 + other)
        # Limit the effect of a push between the looks.
        most = _MOST * (expected + slope * max(self.px, 0.3 * noise.pattern_px) ** 2)
        found = min(float(np.sum(change[seen] ** 2)), most) - expected
        return PixelNoise(self.squares + found * slope / size, self.weight + slope**2 / size)


@dataclass(frozen=True, slots=True)
class Belief:
    """Prior of the errors of cameras and probe without changes."""

    mean: Float
    """(14 C + 3 L + 3,): truth minus documents; parameters of all cameras, then the probe as in
    `ProbeBody.geometry_covariance`."""
    covariance: Float
    _factor: Float | None = field(default=None, init=False, repr=False, compare=False)

    @classmethod
    def of_documents(cls, rig: Rig, body: ProbeBody) -> Belief:
        """Return the prior from the calibrations of the cameras and of the probe."""
        n_cameras = len(rig.parameter_covariance)
        size = n_cameras + len(body.geometry_covariance)
        covariance = np.zeros((size, size))
        covariance[:n_cameras, :n_cameras] = rig.parameter_covariance
        covariance[n_cameras:, n_cameras:] = body.geometry_covariance
        return cls(np.zeros(size), covariance)

    def factor(self) -> Float:
        """Return F with F F' = covariance; cached, as it is needed twice a second."""
        if self._factor is not None:
            return self._factor
        # Units differ widely, and fixed parameters have zero variance.
        scale = np.sqrt(np.diag(self.covariance))
        scale = np.where(scale > 0.0, scale, 1.0)
        values, vectors = np.linalg.eigh(self.covariance / np.outer(scale, scale))
        factor: Float = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
        object.__setattr__(self, "_factor", factor)
        return factor


@dataclass(frozen=True, slots=True)
class SpotRows:
    """The n spots of one camera in some looks, with derivatives."""

    look: Int
    led: Int
    """`look`, `led`: (n,)."""
    uv: Pixels
    residuals: Pixels
    """`uv`, `residuals`: (n, 2), px: position, and as in `ResidualSample`."""
    white_px: Float
    pattern_px: Float
    still: Float
    """`white_px`, `pattern_px`, `still`: (n,), as in `ResidualSample`."""
    by_pose: Float
    """(n, 2, 6): by rotation about the ball (rad), shift of the ball (mm), world."""
    by_camera: Float
    """(n, 2, 14): in the order of `camera.model.PARAMETERS`."""
    by_led: Float
    """(n, 2, 3): place of the LED, mm, probe frame."""


def spot_rows(looks: Sequence[ResidualSample], rig: Rig, body: ProbeBody, c: int) -> SpotRows:
    """Return the spots of camera ``c`` in the looks."""
    camera = rig.cameras[c]
    residuals = np.stack([look.residuals[c] for look in looks])
    k, led = np.nonzero(np.isfinite(residuals[..., 0]))
    points = leds_world_of(looks, body)[k, led]
    d_point, d_parameters = projection_jacobians(camera, points)
    rotations = np.stack([look.rotation_world_from_probe for look in looks])
    arms = points - tips_world(looks, body)[k]
    return SpotRows(
        look=k.astype(np.int64), led=led.astype(np.int64),
        uv=np.stack([look.uv[c] for look in looks])[k, led],
        residuals=residuals[k, led], white_px=np.array([look.white_px for look in looks])[k],
        pattern_px=np.stack([look.pattern_px[c] for look in looks])[k, led],
        still=np.stack([look.still[c] for look in looks])[k, led],
        by_pose=np.concatenate([np.cross(arms[:, None], d_point), d_point], axis=2),
        by_camera=d_parameters, by_led=d_point @ rotations[k],
    )  # fmt: skip


def spot_weights(
    spots: SpotRows, pattern_length_px: float, floor_px: float, pixel_px: float
) -> Float:
    """Return the inverse covariance (n, n), 1/px², per axis; LinAlgError if not definite."""
    n = len(spots.look)
    # Two buffers reused: this runs twice a second during measuring, and allocating arrays of this
    # size, or summing over pairs, would take longer than the computation.
    u, v = spots.uv.T
    covariance, other = u[:, None] - u, v[:, None] - v
    covariance *= covariance
    other *= other
    covariance += other
    fine = np.exp(covariance * (-0.5 / _PIXEL_PX**2)) if pixel_px else None
    covariance *= -0.5 / pattern_length_px**2
    np.exp(covariance, out=covariance)
    covariance *= np.multiply.outer(spots.pattern_px, spots.pattern_px, out=other)
    if fine is not None:
        fine *= np.multiply.outer(pixel_px * spots.still, pixel_px * spots.still, out=other)
        covariance += fine
    covariance += np.multiply(np.equal.outer(spots.led, spots.led), floor_px**2, out=other)
    diagonal = np.arange(n)
    covariance[diagonal, diagonal] += spots.white_px**2
    upper, failed = scipy.linalg.lapack.dpotrf(covariance.T, overwrite_a=1)
    if failed:
        raise np.linalg.LinAlgError(f"The covariance of {n} spots is not positive definite.")
    # Inverting from the factor takes a third of the work of solving for every column of one.
    half, _ = scipy.linalg.lapack.dpotri(upper, overwrite_c=1)
    half[diagonal, diagonal] *= 0.5
    weights: Float = half + half.T
    return weights


def tips_world(looks: Sequence[ResidualSample], body: ProbeBody) -> Float:
    """Return the ball position of each look from its pose, (K, 3), mm, world."""
    return np.stack(
        [look.rotation_world_from_probe @ body.tip_probe + look.origin_world for look in looks]
    )
