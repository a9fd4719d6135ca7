"""Quality of a calibration: errors at independent points, and predicted errors."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.calibration.cameras._reference_points import KnownPoints, SpotTable
from ocmm_core.camera import Rig
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
