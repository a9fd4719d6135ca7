"""Quality of a calibration: errors at independent points, and predicted errors."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.calibration.cameras._reference_points import KnownPoints, SpotTable
from ocmm_core.camera import N_PARAMETERS, Rig, on_sensor, project, projection_jacobians
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Int, Points3
from ocmm_core.tracking import triangulate


@dataclass(frozen=True, slots=True)
class AxisErrors:
    """Errors of points located with all cameras, as in Table 1 of the thesis."""

    errors_world: Points3
    """(n, 3), mm, located minus reference; NaN if seen by fewer than two cameras."""
    rms: Float
    rms_space: float
    """`rms`, `rms_space`: (3,) per axis, and in space, mm."""
    largest: float
    """In space, mm."""


@dataclass(frozen=True, slots=True)
class ErrorMap:
    """Errors predicted by a calibration; NaN for nodes seen by fewer than two cameras."""

    nodes_world: Float
    """(nx, ny, nz, 3), mm."""
    calibration_sigma: Float
    """(nx, ny, nz, 3), mm: standard deviation per axis due to the cameras; common to all exposures,
    so averaging does not reduce it.
    """
    spot_sigma: Float
    """(nx, ny, nz, 3), mm: from spot noise."""


def split(points: KnownPoints, calibration: int, rng: np.random.Generator) -> tuple[Int, Int]:
    """Return random disjoint indices of calibration and evaluation points.

    Raises
    ------
    CalibrationError
        One of the sets would be empty.
    """
    n = len(points.names)
    if not 0 < calibration < n:
        raise CalibrationError(
            "calibration.split",
            f"{calibration} of {n} points for calibration leave none for evaluation.",
            f"Use between 1 and {n - 1} points, typically half of them.",
        )
    order = rng.permutation(n).astype(np.int64)
    return np.sort(order[:calibration]), np.sort(order[calibration:])


def subset(points: KnownPoints, spots: SpotTable, indices: Int) -> tuple[KnownPoints, SpotTable]:
    """Return the points with these indices and their spots."""
    names = tuple(points.names[index] for index in indices)
    return (
        replace(points, names=names, positions_world=points.positions_world[indices]),
        SpotTable(spots.serials, spots.uv[:, indices], spots.sigma_px),
    )


def axis_errors(rig: Rig, points: KnownPoints, spots: SpotTable) -> AxisErrors:
    """Return the errors of points located with all cameras of a calibrated rig.

    Raises CalibrationError if no point was seen by two cameras.
    """
    rows = [spots.serials.index(camera.serial) for camera in rig.cameras]
    errors = triangulate(rig, spots.uv[rows]) - points.positions_world
    located = errors[np.isfinite(errors).all(axis=1)]
    if not len(located):
        raise CalibrationError(
            "calibration.no_evaluation",
            "No evaluation point was seen by two cameras.",
            "Take evaluation points where the camera views overlap.",
        )
    squares = np.mean(located**2, axis=0)
    return AxisErrors(
        errors_world=errors,
        rms=np.sqrt(squares),
        rms_space=float(np.sqrt(squares.sum())),
        largest=float(np.linalg.norm(located, axis=1).max()),
    )


def error_map(
    rig: Rig, volume_world: Float, nodes: tuple[int, int, int], sigma_px: float
) -> ErrorMap:
    """Return the errors predicted by the cameras' covariance over a volume; for tests.

    A point is located at the minimum of its reprojection residuals; to first order it moves by
    -(A'A)^-1 A' B d for camera parameter errors d, with A and B the derivatives of the spots by
    point and parameters.

    Parameters
    ----------
    rig
        With its `parameter_covariance`.
    volume_world
        (2, 3), mm, opposite corners; may exceed the calibrated volume.
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
