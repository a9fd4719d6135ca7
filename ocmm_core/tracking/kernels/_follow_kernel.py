"""Compiled slot tracking: extend free LEDs, drop spots that disturb each other."""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking.kernels import _decide_kernel as decide_kernel
from ocmm_core.tracking.kernels import _doubt_kernel as doubt_kernel
from ocmm_core.tracking.kernels import _grow_kernel as grow_kernel
from ocmm_core.tracking.kernels import _kernel as kernel
from ocmm_core.tracking.kernels import _meeting_kernel as meeting_kernel
from ocmm_core.tracking.kernels import _small_algebra as small_algebra
from ocmm_core.tracking.kernels._grow_kernel import (
    Cameras,
    FrameRays,
    Gates,
    LitBody,
    extend_hypothesis,
)
from ocmm_core.tracking.kernels._meeting_kernel import undistort_rays

_NEEDS = (decide_kernel, doubt_kernel, grow_kernel, kernel, meeting_kernel, small_algebra)


@compiled(*_NEEDS)
def extend_tracked(
    spots: Float, cams: Float, centres: Float, leds: Float, directions: Float, least_cosine: float,
    sigma: float, rival_px: float, limits: Float, labels: Int,
) -> float:  # fmt: skip
    """Complete given labels and return the ambiguity, infinite on failure.

    See `extend_hypothesis`. ``spots`` (C, S, 2), px, of one frame.
    """
    n_cameras, n_slots = spots.shape[0], spots.shape[1]
    ideal = np.empty((n_cameras, n_slots, 2))
    jacobian = np.empty((n_cameras, n_slots, 4))
    there = np.empty((n_cameras, n_slots), np.bool_)
    undistort_rays(spots, cams, ideal, jacobian, there)
    located = 0
    for led in range(len(leds)):
        views = 0
        for c in range(n_cameras):
            # A label with an empty slot in this frame has no effect on the pose; the LED is free.
            if labels[c, led] >= 0 and not there[c, labels[c, led]]:
                labels[c, led] = -1
            views += int(labels[c, led] >= 0)
        located += int(views >= 2)
    # Three located LEDs are the minimum for the six pose parameters.
    if located < 3:
        return np.inf
    worth = np.empty(1)
    # -1: any slot may be any LED. The strobe code is no longer needed once labels exist.
    usable = np.full(n_cameras * n_slots, -1)
    chi2 = extend_hypothesis(
        FrameRays(ideal, jacobian, there, usable), Cameras(cams, centres),
        LitBody(leds, directions, least_cosine), Gates(sigma, rival_px, limits), labels,
        np.empty((3, 3)), np.empty(3), worth,
    )  # fmt: skip
    # The caller compares with `_decide_kernel.MAX_DOUBT`; infinity is always above it.
    return worth[0] if chi2 >= 0.0 else np.inf


@compiled()
def without_rivals(spots: Float, rival_px: float) -> Float:
    """Return spots (n, C, S, 2), px, without those nearer to another one than ``rival_px``.

    Their images disturb each other, and the camera may exchange them.
    """
    kept = spots.copy()
    for frame in range(spots.shape[0]):
        for c in range(spots.shape[1]):
            for i in range(spots.shape[2]):
                for j in range(i):
                    du = spots[frame, c, i, 0] - spots[frame, c, j, 0]
                    dv = spots[frame, c, i, 1] - spots[frame, c, j, 1]
                    # The distance to an empty slot is NaN, and the comparison false: no rival.
                    if du * du + dv * dv < rival_px * rival_px:
                        # Drop both: both centroids are biased, and they are indistinguishable.
                        # Distances are from `spots`, not `kept`, so that a third spot near both is
                        # also found.
                        for axis in range(2):
                            kept[frame, c, i, axis] = np.nan
                            kept[frame, c, j, axis] = np.nan
    return kept
