"""Skew of the cameras: the time between their exposures, measured from a moving probe.

A camera that exposes ``s`` later sees an LED that moves at ``v`` px/s off by ``v s``. No pose of
the rigid probe explains that, except for the part along its derivatives: the rest of the
reprojection residuals, regressed on the speed of the spots, is the skew. One continuous motion is
one measurement: its frames share the errors of the calibration, so they count as a single one.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from ocmm_core.acquisition.frames import MOST_FRAMES, FrameAligner, FrameBlock
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float
from ocmm_core.tracking._body import ProbeBody
from ocmm_core.tracking._body_tracker import spot_sigma_px
from ocmm_core.tracking._pose import reprojection, solve
from ocmm_core.tracking._result import FrameStatus, TrackBlock, cut, in_rig, interruptions, join

DRIFT = 100e-6
"""Of two quartz clocks, s/s: 50 ppm each. The skew of free-running cameras drifts by as much."""
LARGEST_DOUBT_S = 5e-3
"""The skew is unknown with a larger standard uncertainty: 50 s after the last motion."""
_HALF = 2
"""Frames on each side of the one whose speed is estimated."""
_CENTRE = np.array([-3.0, 12.0, 17.0, 12.0, -3.0]) / 35.0
_SLOPE = np.array([-2.0, -1.0, 0.0, 1.0, 2.0]) / 10.0
"""Savitzky and Golay, Anal. Chem. 36 (1964) 1627: value and slope of a parabola."""
_LEAST_PX_S = 20.0
"""Slower spots move too little within an exposure skew to tell."""
_LEAST_SPOTS = 6
_STROKE_S, _LEAST_FRAMES = 0.4, 6
_MISFIT = 5.0
"""Residuals this many times their noise are of wrong labels or reflections, not of a skew."""
_MODEL_SHARE, _FLOOR_S = 0.1, 2e-5
"""Of the correction by a measurement: its speed was not constant. And of all others."""
_COARSE = 0.5
"""Periods: standard uncertainty of a measurement without information on any camera."""
_STROKES, _KEPT = 3, 48
"""Consistent measurements until the skew is known, and those that are kept."""
_JUMP = 6.0
"""A measurement off by this many standard deviations: the skew has changed."""


@dataclass(frozen=True, slots=True)
class CameraSkew:
    """Skew of every camera relative to the first one."""

    seconds: Float
    """(C,), s: exposure after that of the first camera in the same frame."""
    covariance: Float
    """(C, C), s^2."""
    known: bool
    """Measured often enough, recently enough, and consistently."""

    @property
    def largest_u_s(self) -> float:
        """Return the largest standard uncertainty, s."""
        return float(np.sqrt(np.diag(self.covariance).max()))


@dataclass(frozen=True, slots=True)
class _Stroke:
    """One measurement: time, s; skew (C - 1,), s; its covariance, s^2."""

    time_s: float
    skew: Float
    covariance: Float


@dataclass(frozen=True, slots=True)
class _Moving:
    """Normal equations of some frames for the skew that is left."""

    time_s: float
    normal: Float
    right: Float
    """`normal`, `right`: (C - 1, C - 1) and (C - 1,)."""
    squares: float
    dof: int
    """`squares`, `dof`: of the residuals without skew, px^2."""


@dataclass(slots=True)
class SkewMeter:
    """Align frames of cameras without proof of a common exposure time; for one thread.

    `align` the frames, track them, then `learn` from the result. The skew in use is the one
    learnt so far.
    """

    rig: Rig
    body: ProbeBody
    period_ns: int
    _strokes: deque[_Stroke] = field(default_factory=lambda: deque(maxlen=_KEPT))
    _open: list[_Moving] = field(default_factory=list)
    _rest: TrackBlock | None = None
    _before_ns: int = 0
    _applied: Float = field(init=False)
    _aligner: FrameAligner = field(init=False)

    def __post_init__(self) -> None:
        self._applied = np.zeros(len(self.rig.cameras))
        self._aligner = FrameAligner(self.period_ns)

    def align(self, block: FrameBlock) -> FrameBlock | None:
        """Return frames at common times; None if none are complete yet."""
        return self._aligner.push(block, self._applied)

    def learn(self, track: TrackBlock) -> None:
        """Measure the skew that is left in aligned and tracked frames, if the probe moves."""
        seen = in_rig(track)
        if interruptions(seen.time_ns, self._before_ns):
            # The cameras may have been restarted, or paired again.
            self._open.clear()
            self._strokes.clear()
            self._rest = None
        self._before_ns = int(seen.time_ns[-1])
        if self._rest is not None:
            seen = join([self._rest, seen])
        first = 0
        while first + 2 * _HALF < len(seen):
            moving = self._moving(seen, slice(first, first + 2 * _HALF + 1))
            if moving is not None:
                self._open.append(moving)
            if moving is None or moving.time_s - self._open[0].time_s > _STROKE_S:
                self._close()
            first += _HALF + 1
        self._rest = cut(seen, first, len(seen)) if first < len(seen) else None

    def skew(self) -> CameraSkew:
        """Return the skew as of the last frames."""
        count = len(self.rig.cameras)
        seconds, covariance = np.zeros(count), np.full((count, count), np.inf)
        if not self._strokes:
            return CameraSkew(seconds, covariance, known=False)
        now_s = self._before_ns * 1e-9
        ages = np.array([DRIFT * max(now_s - one.time_s, 0.0) for one in self._strokes])
        unit = np.eye(count - 1)
        weights = [
            np.linalg.inv(one.covariance + age**2 * unit)
            for one, age in zip(self._strokes, ages, strict=True)
        ]
        own = np.linalg.inv(np.sum(weights, axis=0))
        mean = own @ sum(w @ one.skew for w, one in zip(weights, self._strokes, strict=True))
        apart = [
            float((one.skew - mean) @ w @ (one.skew - mean))
            for w, one in zip(weights, self._strokes, strict=True)
        ]
        spread = max(1.0, sum(apart) / max(1, (len(apart) - 1) * (count - 1)))
        drifted = own @ sum(w * age for w, age in zip(weights, ages, strict=True))
        seconds[1:] = mean
        covariance[:] = 0.0
        covariance[1:, 1:] = own * spread + drifted @ drifted.T
        found = CameraSkew(seconds, covariance, known=False)
        known = len(self._strokes) >= _STROKES and found.largest_u_s <= LARGEST_DOUBT_S
        return CameraSkew(seconds, covariance, known)

    def _moving(self, seen: TrackBlock, part: slice) -> _Moving | None:
        """Return the measurement of some frames, or None if the probe rests or was not followed."""
        followed = np.isin(seen.status[part], (FrameStatus.OK, FrameStatus.DOUBTFUL)).all()
        if not followed or np.any(np.diff(seen.counter[part]) != 1):
            return None
        centre = np.einsum("k,kcla->cla", _CENTRE, seen.uv[part])
        speed = np.einsum("k,kcla->cla", _SLOPE, seen.uv[part]) / (self.period_ns * 1e-9)
        there = np.isfinite(centre).all(axis=2)
        fast = np.linalg.norm(speed[there], axis=1)
        if len(fast) < _LEAST_SPOTS or np.median(fast) < _LEAST_PX_S:
            return None
        pose = solve(centre[None], self.rig, self.body, spot_sigma_px(self.rig))
        if pose.status[0]:
            return None
        residuals, by_pose = reprojection(
            self.rig, self.body.leds_probe, centre,
            pose.rotation_world_from_probe[0], pose.origin_world[0],
        )  # fmt: skip
        camera = np.repeat(np.nonzero(there)[0], 2)
        columns = (camera[:, None] == np.arange(1, len(there))) * speed[there].ravel()[:, None]
        # A later exposure and a moved pose look the same along the derivatives of the pose.
        basis, _ = np.linalg.qr(by_pose)
        columns = columns - basis @ (basis.T @ columns)
        residuals = residuals - basis @ (basis.T @ residuals)
        return _Moving(
            float(seen.time_ns[part.start + _HALF]) * 1e-9,
            columns.T @ columns, columns.T @ residuals,
            float(residuals @ residuals), len(residuals) - by_pose.shape[1],
        )  # fmt: skip

    def _close(self) -> None:
        """Make a measurement of the open motion."""
        frames, self._open = self._open, []
        if len(frames) < _LEAST_FRAMES:
            return
        variance, count = spot_sigma_px(self.rig) ** 2, len(self.rig.cameras) - 1
        # A camera that saw no motion keeps an uncertainty of a second.
        normal = np.sum([one.normal for one in frames], axis=0) + np.eye(count) * variance
        right = np.sum([one.right for one in frames], axis=0)
        left = np.linalg.solve(normal, right)
        dof = sum(one.dof for one in frames)
        explained = float(left @ right)
        noise = max((sum(one.squares for one in frames) - explained) / dof, variance)
        if noise > _MISFIT**2 * variance + _MODEL_SHARE**2 * explained / dof:
            return
        covariance = np.linalg.inv(normal) * noise * len(frames)
        covariance += np.diag((_MODEL_SHARE * left) ** 2 + _FLOOR_S**2)
        if np.diag(covariance).min() > (_COARSE * self.period_ns * 1e-9) ** 2:
            return
        found = _Stroke(frames[0].time_s, self._applied[1:] + left, covariance)
        if self._strokes:
            now = self.skew()
            off = found.skew - now.seconds[1:]
            both = covariance + now.covariance[1:, 1:]
            if float(off @ np.linalg.solve(both, off)) > _JUMP**2 * count:
                self._strokes.clear()
        self._strokes.append(found)
        most = 0.5 * MOST_FRAMES * self.period_ns * 1e-9
        self._applied = np.clip(self.skew().seconds, -most, most)
