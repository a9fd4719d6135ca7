"""Mean residuals of tracked frames over moments with little motion ("looks").

Averaged over some tens of milliseconds, little white noise is left: the rest is sensor pattern,
error of calibration and probe, or a moved camera.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import Rig, project
from ocmm_core.geometry import Float, Pixels
from ocmm_core.tracking import FrameStatus, ProbeBody, TrackBlock, cut, join

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

    def feed(self, track: TrackBlock) -> list[ResidualSample]:
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
        look = look_of(join(pieces), self._rig, self._body, self._maps)
        return [] if look is None else [look]


def look_of(
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
    uv = frames.uv[used]
    seen = np.isfinite(uv[0, :, :, 0])
    if float(np.ptp(uv[:, seen], axis=0).max()) > _REACH_PX:
        return None
    rotations, origins = frames.rotation_world_from_probe[used], frames.origin_world[used]
    leds_world = body.leds_probe @ rotations.transpose(0, 2, 1) + origins[:, None]
    residuals = np.stack(
        [uv[:, c] - project(camera, leds_world) for c, camera in enumerate(rig.cameras)], axis=1
    )
    pattern = np.full(seen.shape, rig.noise.pattern_px)
    for c, known in enumerate(maps):
        expected, left = known.at(uv[:, c, seen[c]])
        residuals[:, c, seen[c]] -= expected
        pattern[c, seen[c]] = left.mean(axis=0)
    mean = residuals.mean(axis=0)
    # The pose of each frame has six parameters.
    freedom = (len(used) - 1) * (2 * int(np.count_nonzero(seen)) - 6)
    scatter = float(np.sqrt(np.sum((residuals - mean)[:, seen] ** 2) / freedom))
    middle = len(used) // 2
    return ResidualSample(
        first_ns=int(frames.time_ns[used[0]]), last_ns=int(frames.time_ns[used[-1]]),
        n_frames=len(used), residuals=mean, pattern_px=pattern,
        white_px=max(scatter, rig.noise.white_px) / float(np.sqrt(len(used))),
        rotation_world_from_probe=rotations[middle], origin_world=origins[middle],
    )  # fmt: skip


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
    leds: Float = body.leds_probe @ rotations.transpose(0, 2, 1) + origins[:, None]
    return leds
