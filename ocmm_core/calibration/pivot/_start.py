"""Initial state of a sweep's adjustment from spots and cameras alone.

The mean shape of triangulated targets is fitted to every pose, poses that agree on one tip are
selected (`_poses`), and the common centre of their paths (`_centre`) is computed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocmm_core.calibration.pivot._bundle import PivotState
from ocmm_core.calibration.pivot._centre import common_centre, complete_poses, moments_of
from ocmm_core.calibration.pivot._data import PivotSweep
from ocmm_core.calibration.pivot._poses import pivot_of_poses
from ocmm_core.calibration.pivot._shape_kernel import fit_turns
from ocmm_core.camera import Rig, ideal_from_pixels
from ocmm_core.geometry import Float, Pixels, Points3

_SHAPES = 400
_ROUNDS = 8
_MISS_MEDIANS = 6.0
"""Rigid residuals above this multiple of the median indicate a wrong spot."""


@dataclass(frozen=True, slots=True)
class PivotStart:
    """The start of an adjustment."""

    targets: Float
    """(n, L, 3), mm, world; NaN if seen by fewer than two cameras."""
    state: PivotState
    """All frames; the rotation is the identity for frames that are not ``solvable``."""
    solvable: NDArray[np.bool_]
    agreeing: NDArray[np.bool_]
    """`solvable`, `agreeing`: (n,): frames with three targets, and those that agree on the tip."""


def locate_targets(rig: Rig, uv: Pixels) -> Float:
    """Return targets (n, L, 3), mm, world, of spots (n, C, L, 2), px; NaN if seen by one camera.

    Thesis 2.4.1 with homogeneous rows (errata).
    """
    n, _, n_leds, _ = uv.shape
    matrices, rights = np.zeros((n, n_leds, 3, 3)), np.zeros((n, n_leds, 3))
    views = np.zeros((n, n_leds), dtype=np.int64)
    for c, camera in enumerate(rig.cameras):
        seen = np.isfinite(uv[:, c, :, 0])
        ideal = ideal_from_pixels(camera, np.where(seen[..., None], uv[:, c], 0.0))
        pose = camera.T_camera_from_world
        for axis in range(2):
            w = ideal[..., axis]
            rows = w[..., None] * pose.rotation[2] - camera.focal * pose.rotation[axis]
            rows *= seen[..., None]
            offset = camera.focal * pose.translation[axis] - w * pose.translation[2]
            matrices += rows[..., :, None] * rows[..., None, :]
            rights += rows * offset[..., None]
        views += seen
    located = views >= 2
    targets = np.full((n, n_leds, 3), np.nan)
    targets[located] = np.linalg.solve(matrices[located], rights[located][..., None])[..., 0]
    return targets


def mean_shape(targets: Float, poses: int = _SHAPES) -> Points3:
    """Return the median shape (L, 3), mm, about its middle; CalibrationError if none complete."""
    whole = complete_poses(targets)
    some = np.ascontiguousarray(targets[whole[:: max(1, len(whole) // poses)]])
    distances = np.linalg.norm(some[:, :, None] - some[:, None], axis=3)
    odd = np.abs(distances - np.median(distances, axis=0)).max(axis=(1, 2))
    shape: Points3 = some[int(np.argmin(odd))]
    shape = shape - shape.mean(axis=0)
    for _ in range(_ROUNDS):
        rotations, origins, residuals = lay(shape, some)
        laid = np.einsum("nji,nlj->nli", rotations, some - origins[:, None])
        better = np.median(laid[residuals <= _MISS_MEDIANS * np.median(residuals) + 1e-9], axis=0)
        moved = float(np.abs(better - shape).max())
        shape = better - better.mean(axis=0)
        if moved < 1e-4:
            break
    return shape


def lay(shape: Points3, targets: Float) -> tuple[Float, Points3, Float]:
    """Return rotations, origins and rigid residuals of all poses (`fit_turns`)."""
    n = len(targets)
    rotations, origins, left = np.empty((n, 3, 3)), np.empty((n, 3)), np.empty(n)
    fit_turns(np.ascontiguousarray(shape), targets, rotations, origins, left)
    return rotations, origins, left


def start_pivot(rig: Rig, sweep: PivotSweep, seed: int) -> PivotStart:
    """Return the start; CalibrationError if no frame is complete or the tip undetermined."""
    targets = locate_targets(rig, sweep.uv)
    shape = mean_shape(targets)
    rotations, origins, left = lay(shape, targets)
    solvable = np.isfinite(left)
    fitting = solvable.copy()
    fitting[solvable] = left[solvable] <= _MISS_MEDIANS * np.median(left[solvable]) + 1e-9
    chosen = np.flatnonzero(fitting)
    pivot = pivot_of_poses(rotations[chosen], origins[chosen], seed)
    agreeing = np.zeros(len(targets), dtype=np.bool_)
    agreeing[chosen[pivot.used]] = True
    good = targets[agreeing]
    reference = np.nanmean(good, axis=0)
    centre = common_centre(moments_of(good, reference), reference)
    if not np.isfinite(centre).all():
        centre = pivot.centre
    # The tip from each pose, in the frame of the shape.
    tips = np.einsum("nji,nj->ni", rotations[agreeing], centre - origins[agreeing])
    rotations[~solvable] = np.eye(3)
    state = PivotState(centre, shape - tips.mean(axis=0), rotations, np.zeros((len(targets), 3)))
    return PivotStart(targets, state, solvable, agreeing)
