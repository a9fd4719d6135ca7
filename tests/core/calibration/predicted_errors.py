"""Errors that calibrations predict of themselves, for tests against their scatter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.calibration.pivot._covariance import block_length
from ocmm_core.calibration.pivot._start import PosePivot
from ocmm_core.camera import N_PARAMETERS, Rig, on_sensor, project, projection_jacobians
from ocmm_core.geometry import Float, Points3


@dataclass(frozen=True, slots=True)
class ErrorMap:
    """Errors that a calibration predicts; NaN if fewer than two cameras see the node."""

    nodes_world: Float
    """(nx, ny, nz, 3), mm."""
    calibration_sigma: Float
    """(nx, ny, nz, 3), mm: standard deviation per axis from the uncertain cameras; the same for
    every exposure, so that no averaging removes it."""
    spot_sigma: Float
    """(nx, ny, nz, 3), mm: from the noise of the spots."""


def error_map(
    rig: Rig, volume_world: Float, nodes: tuple[int, int, int], sigma_px: float
) -> ErrorMap:
    """Return the errors predicted over a volume by the covariance of the cameras.

    A point is located at its least reprojection residuals; to first order it moves by
    -(A'A)^-1 A' B d if the parameters of the cameras are wrong by d, with A and B the
    derivatives of the spots by point and parameters.

    Parameters
    ----------
    rig
        With its `parameter_covariance`.
    volume_world
        (2, 3), mm, opposite corners; it may extend beyond the calibrated volume.
    nodes
        Number of nodes along each axis.
    sigma_px
        Standard deviation of a spot, px per axis.
    """
    low, high = volume_world
    axes = [np.linspace(low[i], high[i], nodes[i]) for i in range(3)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    points = grid.reshape(-1, 3)
    count = len(rig.cameras)
    by_point = np.zeros((len(points), count, 2, 3))
    by_parameters = np.zeros((len(points), count, 2, N_PARAMETERS))
    views = np.zeros(len(points), dtype=np.int64)
    for c, camera in enumerate(rig.cameras):
        seen = on_sensor(camera, project(camera, points))
        by_point[seen, c], by_parameters[seen, c] = projection_jacobians(camera, points[seen])
        views += seen
    located = views >= 2
    stacked = by_point[located].reshape(-1, 2 * count, 3)
    inverse = np.linalg.inv(stacked.transpose(0, 2, 1) @ stacked)
    # Each camera's spots depend on its own parameters only.
    gain = np.einsum("nij,ncuj,ncup->nicp", inverse, by_point[located], by_parameters[located])
    gain = gain.reshape(-1, 3, count * N_PARAMETERS)
    variance = np.einsum("nip,pq,niq->ni", gain, rig.parameter_covariance, gain, optimize=True)
    calibration_sigma, spot_sigma = np.full((2, len(points), 3), np.nan)
    calibration_sigma[located] = np.sqrt(np.maximum(variance, 0.0))
    spot_sigma[located] = sigma_px * np.sqrt(np.diagonal(inverse, axis1=1, axis2=2))
    return ErrorMap(grid, calibration_sigma.reshape(grid.shape), spot_sigma.reshape(grid.shape))


def pose_pivot_covariance(
    rotations: Float, origins: Points3, found: PosePivot, resamples: int = 500, seed: int = 1
) -> tuple[Float, Float]:
    """Return the covariances (3, 3), mm^2, of a tip that was found from poses.

    The first by bootstrap of blocks of consecutive poses; the second is the formal one of
    independent poses, for comparison.

    Parameters
    ----------
    rotations, origins, found
        What `_poses.pivot_of_poses` took and gave.
    """
    turns, places = rotations[found.used], origins[found.used]
    n = len(turns)
    off = turns @ found.tip + places - found.centre
    centred = turns - turns.mean(axis=0)
    normals = np.einsum("nki,nkj->nij", centred, centred)
    scores = np.einsum("nki,nk->ni", centred, off)
    inverse = np.linalg.inv(normals.sum(axis=0))
    blocks = np.arange(n) // block_length(scores @ inverse)
    count = int(blocks[-1]) + 1
    block_normals, block_scores = np.zeros((count, 3, 3)), np.zeros((count, 3))
    np.add.at(block_normals, blocks, normals)
    np.add.at(block_scores, blocks, scores)
    rng = np.random.default_rng(seed)
    draws = rng.multinomial(count, np.full(count, 1.0 / count), size=resamples).astype(np.float64)
    drawn = np.tensordot(draws, block_normals, 1)
    tips = -np.linalg.solve(drawn, (draws @ block_scores)[..., None])[..., 0]
    variance = float(np.sum(off**2)) / (3 * n - 6)
    return np.cov(tips.T) * count / (count - 1), variance * inverse
