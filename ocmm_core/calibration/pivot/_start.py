"""Initial state of a sweep's adjustment from spots and cameras alone.

The mean shape of triangulated targets is fitted to every pose, poses that agree on one tip are
selected, and the common centre of their paths (`_centre`) is computed. Tip of a body from its
poses about one resting point: ``R_i tip + o_i = centre`` is linear in both unknowns (algebraic one
step, Yaniv 2015). Least median of squares over triples of poses excludes wrong poses, up to nearly
half of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from ocmm_core.calibration.cameras import OUTLIER_PROBABILITY
from ocmm_core.calibration.pivot._bundle import PivotState
from ocmm_core.calibration.pivot._centre import common_centre, complete_poses, moments_of
from ocmm_core.calibration.pivot._data import PivotSweep
from ocmm_core.calibration.pivot._kernel import fit_turns
from ocmm_core.camera import Rig, ideal_from_pixels
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Pixels, Points3

SAMPLES = 300
"""Triples: with half of the poses wrong, all contain a wrong one with probability (7/8)^300."""

_JUDGED = 500
"""Evenly spread poses for the median."""

_POSE_ROUNDS = 50
_MEDIAN_OF_CHI = 1.5382
"""Median length of three unit normals."""

_LARGEST_CONDITION = 1e5


@dataclass(frozen=True, slots=True)
class PosePivot:
    """Tip and centre from poses."""

    tip: Float
    """(3,), mm, body."""
    centre: Float
    """(3,), mm, world."""
    used: NDArray[np.bool_]
    """(n,): poses used."""
    distances: Float
    """(n,), mm: distance of each pose's tip from the centre."""
    scale: float
    """mm per axis: standard deviation of the good poses."""

    @property
    def rms(self) -> float:
        return float(np.sqrt(np.mean(self.distances[self.used] ** 2)))


def pivot_of_poses(rotations: Float, origins: Points3, seed: int | None = 1) -> PosePivot:
    """Return tip and centre of poses (n, 3, 3) and (n, 3), mm, world from body.

    All poses are used without a ``seed`` for the choice of triples. CalibrationError if
    undetermined: fewer than three poses, or rotations about one axis only.
    """
    if len(rotations) < 3:
        raise _open(len(rotations))
    used = np.ones(len(rotations), dtype=np.bool_)
    if seed is None:
        return _judged(rotations, origins, used, *_solve(rotations, origins))
    tip, centre = _least_median(rotations, origins, seed)
    distances = _distances(rotations, origins, tip, centre)
    found = _judged(rotations, origins, _good(distances), tip, centre)
    for _ in range(_POSE_ROUNDS):
        tip, centre = _solve(rotations[found.used], origins[found.used])
        distances = _distances(rotations, origins, tip, centre)
        again = _judged(rotations, origins, _good(distances), tip, centre)
        if np.array_equal(again.used, found.used):
            return again
        found = again
    return found


def _solve(rotations: Float, origins: Points3) -> tuple[Float, Float]:
    """Return tip and centre by least squares over all poses, origins centred."""
    n = len(rotations)
    mean_turn, mean_origin = rotations.mean(axis=0), origins.mean(axis=0)
    # With the centre eliminated: sum (I - Rm'Rm) tip = -sum R'(o - om).
    matrix = np.eye(3) - mean_turn.T @ mean_turn
    right = -np.einsum("nji,nj->i", rotations - mean_turn, origins - mean_origin) / n
    if not np.linalg.cond(matrix) < _LARGEST_CONDITION**2:
        raise _open(n)
    tip = np.linalg.solve(matrix, right)
    centre: Float = mean_turn @ tip + mean_origin
    return tip, centre


def _least_median(rotations: Float, origins: Points3, seed: int) -> tuple[Float, Float]:
    rng = np.random.default_rng(seed)
    some = np.arange(0, len(rotations), max(1, len(rotations) // _JUDGED))
    triples = rng.integers(0, len(rotations), (SAMPLES, 3))
    turns, places = rotations[triples], origins[triples]
    mean_turn, mean_place = turns.mean(axis=1), places.mean(axis=1)
    matrices = np.eye(3) - mean_turn.transpose(0, 2, 1) @ mean_turn
    rights = -np.einsum("skji,skj->si", turns - mean_turn[:, None], places - mean_place[:, None])
    sized = np.linalg.eigvalsh(matrices)[:, 0] > 1.0 / _LARGEST_CONDITION
    if not sized.any():
        raise _open(len(rotations))
    tips = np.linalg.solve(matrices[sized], rights[sized, :, None] / 3.0)[..., 0]
    centres = np.einsum("sij,sj->si", mean_turn[sized], tips) + mean_place[sized]
    ends = np.einsum("nij,sj->sni", rotations[some], tips) + origins[some]
    squares = np.sum((ends - centres[:, None]) ** 2, axis=2)
    best = int(np.argmin(np.median(squares, axis=1)))
    return tips[best], centres[best]


def _distances(rotations: Float, origins: Points3, tip: Float, centre: Float) -> Float:
    distances: Float = np.linalg.norm(rotations @ tip + origins - centre, axis=1)
    return distances


def _scale(distances: Float) -> float:
    return max(float(np.median(distances)) / _MEDIAN_OF_CHI, 1e-9)


def _good(distances: Float) -> NDArray[np.bool_]:
    """Return inliers: chi-square of three coordinates, shared among all poses (Bonferroni)."""
    limit = scipy.special.chdtri(3, OUTLIER_PROBABILITY / len(distances))
    good: NDArray[np.bool_] = distances <= _scale(distances) * np.sqrt(limit)
    return good


def _judged(
    rotations: Float, origins: Points3, used: NDArray[np.bool_], tip: Float, centre: Float
) -> PosePivot:
    distances = _distances(rotations, origins, tip, centre)
    return PosePivot(tip, centre, used, distances, _scale(distances[used]))


def _open(count: int) -> CalibrationError:
    return CalibrationError(
        "pivot.open",
        f"The {count} poses of the probe do not determine its tip.",
        "Sweep the probe by 20 degrees to all sides, and turn it about its handle too.",
    )


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
