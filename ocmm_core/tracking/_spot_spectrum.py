"""Slow noise of found spots, learnt from the touches of a session.

The scatter between consecutive frames does not show errors that last: flicker and warming of a
camera, and errors fixed to the sensor, which change as a spot moves over its pixels. Both drift as
a ball would. They are separated from motion by the residuals of the rigid pose: no motion of the
probe changes these. Their Allan variance (D. W. Allan, Proc. IEEE 54 (1966) 221), camera by camera,
is the sum of that of independent frames and of some courses: errors that last for a time, and
errors that last for a distance on the sensor. The size of each course is the nonnegative solution
of the normal equations of all touches so far, with a default that weighs as much as one touch.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import nnls

from ocmm_core.camera import Rig, project
from ocmm_core.geometry import Float, Int

_LAST_S = (0.04, 0.3)
"""Decay times of errors that last for a time, s."""

_LAST_PX = (0.7, 3.0, 15.0)
"""Correlation lengths of errors fixed to the sensor, px: within pixels, of a lens, of a pattern."""

_DEFAULT = np.array([0.0, 0.004, 0.006, 0.004, 0.012])
"""Sizes before the first touch, relative to the variance of a frame: rendered cameras at 1 kHz."""

_LEVELS = (1, 2, 3, 4, 6, 8, 12)
"""Spans of the Allan variance, in batches."""

_DEFAULT_WEIGHT = 1.0
"""Touches that the default counts for."""

_POSE = 6


@dataclass(frozen=True, slots=True)
class SpotSpectrum:
    """Spectrum of the spots' noise; ``learnt`` returns it with one more touch."""

    normal: Float | None = None
    right: Float | None = None
    """`normal`, `right`: (C, k, k) and (C, k): sums of the normal equations; None before any."""
    touches: int = 0

    def learnt(self, seen: SpotCourse) -> SpotSpectrum:
        """Return the spectrum with the spots of one more touch."""
        normal = np.zeros((len(seen.cameras), len(_DEFAULT), len(_DEFAULT)))
        right = np.zeros(normal.shape[:2])
        for c, camera in enumerate(seen.cameras):
            if camera is not None:
                normal[c], right[c] = camera.equations(seen.times_s, seen.counts)
        if self.normal is not None and self.right is not None:
            normal, right = normal + self.normal, right + self.right
        return replace(self, normal=normal, right=right, touches=self.touches + 1)

    def sizes(self) -> Float:
        """Return the sizes of the courses, (C, k), relative to the variance of a frame."""
        if self.normal is None or self.right is None:
            return _DEFAULT[None]
        found = np.empty(self.right.shape)
        for c, (normal, right) in enumerate(zip(self.normal, self.right, strict=True)):
            default = np.diag(np.diagonal(normal)) * (_DEFAULT_WEIGHT / max(self.touches, 1))
            # A camera without spots so far keeps the default.
            default += 1e-12 * np.eye(len(right))
            root = np.linalg.cholesky(normal + default)
            found[c] = nnls(root.T, np.linalg.solve(root, right + default @ _DEFAULT))[0]
        return found

    def between(self, seen: SpotCourse) -> Float:
        """Return the covariance of slow errors between batches, (m, m), in frame variances.

        The mean of the cameras: the share of each in a coordinate is unknown here.
        """
        sizes = self.sizes()
        found = [
            np.tensordot(sizes[c % len(sizes)], camera.courses(seen.times_s), axes=1)
            for c, camera in enumerate(seen.cameras)
            if camera is not None
        ]
        return np.asarray(np.mean(found, axis=0))


@dataclass(frozen=True, slots=True)
class CameraCourse:
    """Spots of one camera in m batches of a touch."""

    spots: Float
    """(m, s, 2), px: batch means."""
    residuals: Float
    """(m, s, 2), px: of the pose."""
    white: Float
    """Variance of a residual in one frame if frames were independent, px^2."""

    def courses(self, times_s: Float) -> Float:
        """Return the correlation of every course between batches, (k, m, m)."""
        apart_s = np.abs(times_s[:, None] - times_s)
        by_time = [np.exp(-apart_s / last) for last in _LAST_S]
        apart2 = np.sum((self.spots[:, None] - self.spots[None]) ** 2, axis=3)
        by_place = [np.exp(-0.5 * apart2 / last**2).mean(axis=2) for last in _LAST_PX]
        return np.array(by_time + by_place)

    def equations(self, times_s: Float, counts: Int) -> tuple[Float, Float]:
        """Return the normal equations of the sizes, (k, k) and (k,)."""
        spots = self.residuals.reshape(len(times_s), -1)
        observed = spots @ spots.T / spots.shape[1] / self.white
        rest = _allan(observed) - _allan(np.diag(1.0 / counts))
        columns = np.array([_allan(course) for course in self.courses(times_s)]).T
        # The variance of an Allan variance: its square over the number of independent spans.
        weights = np.array(_LEVELS) * spots.shape[1] * float(np.mean(counts)) ** 2
        return columns.T @ (weights[:, None] * columns), columns.T @ (weights * rest)


@dataclass(frozen=True, slots=True)
class SpotCourse:
    """Spots of a touch in batches of time."""

    times_s: Float
    counts: Int
    """`times_s`, `counts`: (m,): middle and number of frames of each batch."""
    cameras: tuple[CameraCourse | None, ...]
    """None for a camera without spots."""


def spot_course(
    labels: Int, times_s: Float, uv: Float, rotation: Float, origin: Float, rig: Rig, leds: Float
) -> SpotCourse:
    """Return the spots of a touch in batches.

    Parameters
    ----------
    labels
        (n,), ascending: batch of each frame.
    uv
        (n, C, L, 2), px: the same LEDs in all frames, NaN if unseen.
    rotation, origin
        (n, 3, 3) and (n, 3), mm: pose of the LEDs ``leds`` (L, 3), mm.
    """
    starts = np.flatnonzero(np.diff(labels, prepend=-1))
    counts = np.diff(np.append(starts, len(labels)))

    def means(values: Float) -> Float:
        shape = (len(starts), *([1] * (values.ndim - 1)))
        found: Float = np.add.reduceat(values, starts, axis=0) / counts.reshape(shape)
        return found

    # A pose turns by less than a milliradian within a batch: the mean is a rotation to 1e-6.
    places = np.einsum("mij,lj->mli", means(rotation), leds) + means(origin)[:, None]
    seen = np.isfinite(uv[0]).all(axis=2)
    kept = 1.0 - _POSE / (2.0 * np.count_nonzero(seen))
    cameras: list[CameraCourse | None] = []
    for camera, spots, mine in zip(rig.cameras, np.moveaxis(uv, 1, 0), seen, strict=True):
        if not np.any(mine):
            cameras.append(None)
            continue
        batches = means(spots[:, mine])
        # Second differences: the motion of a spot is no noise.
        white = float(np.mean(np.diff(spots[:, mine], 2, axis=0) ** 2)) / 6.0
        residuals = batches - project(camera, places[:, mine])
        cameras.append(CameraCourse(batches, residuals, max(kept * white, 1e-12)))
    return SpotCourse(means(times_s), counts, tuple(cameras))


def _allan(covariance: Float) -> Float:
    """Return the Allan variance at `_LEVELS` of a course with this covariance (m, m)."""
    found = []
    for level in _LEVELS:
        count = len(covariance) - 2 * level + 1
        if count < 1:
            found.append(0.0)
            continue
        rows = np.zeros((count, len(covariance)))
        for row in range(count):
            rows[row, row : row + level] = -1.0 / level
            rows[row, row + level : row + 2 * level] = 1.0 / level
        found.append(0.5 * float(np.einsum("ki,ij,kj->", rows, covariance, rows)) / count)
    return np.array(found)
