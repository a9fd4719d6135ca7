"""Slow noise of found spots, learnt from the touches of a session.

The scatter between consecutive frames does not show errors that last: flicker and warming of a
camera, and errors fixed to the sensor, which change as a spot moves over its pixels. Both drift as
a ball would. The residuals of the rigid pose separate them from motion, which does not change these
residuals. Camera by camera, their Allan variance (D. W. Allan, Proc. IEEE 54 (1966) 221) is the sum
of that of independent frames and of some courses: errors that last for a time, or for a distance on
the sensor. The sizes of the courses are the nonnegative solution of the normal equations of all
touches so far, with a default that weighs as much as one touch.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy

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

_POSE = 6


@dataclass(frozen=True, slots=True)
class SpotCourse:
    """Spots of C cameras in m batches of a touch; zero for a camera without spots."""

    counts: Int
    """(m,): number of frames of each batch."""
    courses: Float
    """(C, k, m, m): correlation of every course between batches, for the motion of the spots."""
    observed: Float
    """(C, m, m): mean product of the residuals, relative to the variance of a frame."""
    series: Int
    """(C,): number of coordinates."""


@dataclass(frozen=True, slots=True)
class SpotSpectrum:
    """Spectrum of the noise of the spots; ``learnt`` returns it with one more touch."""

    normal: Float | float = 0.0
    right: Float | float = 0.0
    """`normal`, `right`: (C, k, k) and (C, k): sums of the normal equations."""
    touches: int = 0

    def learnt(self, seen: SpotCourse) -> SpotSpectrum:
        """Return the spectrum with the spots of one more touch."""
        rest = _allan(seen.observed) - np.outer(seen.series > 0, _allan(np.diag(1.0 / seen.counts)))
        columns = _allan(seen.courses)
        # The variance of an Allan variance: its square over the number of independent spans.
        weights = float(np.mean(seen.counts)) ** 2 * np.outer(seen.series, _LEVELS)
        normal = np.einsum("ckv,cv,clv->ckl", columns, weights, columns)
        right = np.einsum("ckv,cv,cv->ck", columns, weights, rest)
        return SpotSpectrum(self.normal + normal, self.right + right, self.touches + 1)

    def sizes(self) -> Float:
        """Return the sizes of the courses, (C, k), relative to the variance of a frame."""
        if not self.touches:
            return _DEFAULT[None]
        found = []
        for normal, right in zip(np.asarray(self.normal), np.asarray(self.right), strict=True):
            # A camera without spots so far keeps the default.
            default = np.diag(np.diagonal(normal) / self.touches + 1e-12)
            root = np.linalg.cholesky(normal + default)
            wanted = np.linalg.solve(root, right + default @ _DEFAULT)
            found.append(scipy.optimize.nnls(root.T, wanted)[0])
        return np.array(found)

    def between(self, seen: SpotCourse) -> Float:
        """Return the covariance of slow errors between batches, (m, m), in frame variances.

        The mean of the cameras: the share of each in a coordinate is unknown here.
        """
        of_cameras = np.einsum("ck,ckij->cij", self.sizes(), seen.courses)
        return np.asarray(of_cameras[seen.series > 0].mean(axis=0))


def spot_course(
    labels: Int, times_s: Float, uv: Float, rotation: Float, origin: Float, rig: Rig, leds: Float
) -> SpotCourse:
    """Return the spots of a touch in batches.

    Parameters
    ----------
    labels, times_s
        (n,), ascending: batch and time of each frame.
    uv
        (n, C, L, 2), px: the same LEDs in all frames, NaN if unseen.
    rotation, origin
        (n, 3, 3) and (n, 3), mm: pose of the LEDs ``leds`` (L, 3), mm.
    """
    starts = np.flatnonzero(np.diff(labels, prepend=-1))
    counts = np.diff(np.append(starts, len(labels)))

    def means(values: Float) -> Float:
        found: Float = np.add.reduceat(values, starts, axis=0).T / counts
        return found.T

    # A pose turns by less than a milliradian within a batch: the mean is a rotation to 1e-6.
    places = np.einsum("mij,lj->mli", means(rotation), leds) + means(origin)[:, None]
    batches, apart_s = means(uv), np.abs(np.subtract.outer(means(times_s), means(times_s)))
    seen = np.isfinite(uv[0]).all(axis=2)
    kept = 1.0 - _POSE / (float(rig.per_spot) * np.count_nonzero(seen))
    courses = np.zeros((len(seen), len(_DEFAULT), len(counts), len(counts)))
    observed = np.zeros((len(seen), len(counts), len(counts)))
    for c, (camera, mine) in enumerate(zip(rig.cameras, seen, strict=True)):
        if not np.any(mine):
            continue
        spots = batches[:, c, mine]
        apart2 = np.sum((spots[:, None] - spots) ** 2, axis=3)
        by_place = [np.exp(-0.5 * apart2 / last**2).mean(axis=2) for last in _LAST_PX]
        courses[c] = [*(np.exp(-apart_s / last) for last in _LAST_S), *by_place]
        residuals = (spots - project(camera, places[:, mine])).reshape(len(counts), -1)
        # Second differences, of six times the variance: the motion of a spot is no noise.
        white = kept * float(np.mean(np.diff(uv[:, c, mine], 2, axis=0) ** 2)) / 6.0
        observed[c] = residuals @ residuals.T / (residuals.shape[1] * max(white, 1e-12))
    return SpotCourse(counts, courses, observed, rig.per_spot * np.count_nonzero(seen, axis=1))


@lru_cache(maxsize=8)
def _kernels(count: int) -> Float:
    """Return the matrices (v, m, m) whose product with a covariance is its Allan variance."""
    found = np.zeros((len(_LEVELS), count, count))
    for kernel, level in zip(found, _LEVELS, strict=True):
        spans = range(count - 2 * level + 1)
        for first in spans:
            span = np.zeros(count)
            span[first : first + level], span[first + level : first + 2 * level] = -1.0, 1.0
            kernel += 0.5 * np.outer(span, span) / (level**2 * len(spans))
    return found


def _allan(covariances: Float) -> Float:
    """Return the Allan variances (..., v) at `_LEVELS` of series with covariances (..., m, m)."""
    kernels = _kernels(covariances.shape[-1])
    return np.asarray(np.einsum("...ij,vij->...v", covariances, kernels))
