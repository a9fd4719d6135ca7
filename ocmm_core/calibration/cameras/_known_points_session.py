"""Events of a calibration from known points; errors at independent points."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from ocmm_core.calibration.cameras._network import RigCalibration, calibrate_rig
from ocmm_core.calibration.cameras._reference_points import KnownPoints, SpotTable
from ocmm_core.calibration.guided import (
    CameraResiduals,
    Findings,
    SessionEvent,
    SessionHeader,
    Spots,
)
from ocmm_core.calibration.records import ArtefactUse
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
    """Return random disjoint calibration, evaluation indices; CalibrationError if one is empty."""
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
    """Return errors of located points; CalibrationError if no point was seen by two cameras."""
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


class KnownPointsBegun(SessionHeader, frozen=True, kw_only=True):
    """First line."""

    names: tuple[str, ...]
    positions: tuple[tuple[float, float, float], ...]
    reference_sigma: float
    frame: str
    length_sigma: float
    """`names`, `positions`, `reference_sigma`, `frame`, `length_sigma`: As `KnownPoints`; mm."""
    evaluation: int
    valid_days: int
    artefacts: tuple[ArtefactUse, ...]
    """The CMM that positioned the points, with its certificate."""


class ReferencePointEvent(SessionEvent, frozen=True, kw_only=True, tag="PointTaken"):
    """Spots at one reference point; replaces an earlier event of it."""

    point: str
    uv: Spots
    """(C, 1), px; all None for a skipped point."""
    sigma_px: float


KnownPointsEvent: TypeAlias = KnownPointsBegun | ReferencePointEvent


def views_of(taken: ReferencePointEvent) -> int:
    """Return the number of cameras that saw a point."""
    return sum(camera[0] is not None for camera in taken.uv)


def found_by(
    rig: Rig, points: KnownPoints, table: SpotTable, evaluation: int, force: bool
) -> Findings:
    """Return the findings, ``evaluation`` points held back; raises as `_network.calibrate_rig`."""
    used, held = (points, table), None
    if evaluation:
        chosen, rest = split(points, len(points.names) - evaluation, np.random.default_rng(0))
        used, held = subset(points, table, chosen), subset(points, table, rest)
    calibration = calibrate_rig(rig, *used, force)
    at, errors = np.empty((0, 3)), np.empty((0, 3))
    if held is not None:
        located = axis_errors(calibration.applied_to(rig, rig.identity), *held).errors_world
        seen = np.isfinite(located).all(axis=1)
        at, errors = held[0].positions_world[seen], located[seen]
    squares = [(one.chi2, one.dof) for one in calibration.cameras]
    residuals = np.concatenate([one.residuals_px[one.used] for one in calibration.cameras])
    return Findings(
        cameras=tuple(one.model for one in calibration.cameras),
        covariance=calibration.covariance,
        volume_world=calibration.volume_world,
        hull_world=calibration.hull_world,
        residuals=tuple(
            CameraResiduals(one.model.name, one.uv, one.residuals_px, one.used)
            for one in calibration.cameras
        ),
        rms_px=float(np.sqrt(np.mean(residuals**2))),
        chi2_per_dof=sum(chi2 for chi2, _ in squares) / sum(dof for _, dof in squares),
        points=_points_used(calibration),
        outliers=tuple(
            f"{one.name} in {camera.model.name}"
            for camera in calibration.cameras
            for one in camera.outliers
        ),
        errors_at_world=at,
        errors_world=errors,
        warnings=calibration.warnings,
    )


def _points_used(calibration: RigCalibration) -> int:
    return len({int(i) for one in calibration.cameras for i in one.indices[one.used]})
