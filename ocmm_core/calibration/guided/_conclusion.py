"""Build the record of calibrated cameras, ready for acceptance, and its comparison.

Predicted length errors follow from the covariance of the cameras alone.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

import msgspec
import numpy as np
import scipy
from numpy.typing import NDArray

from ocmm_core.calibration import records
from ocmm_core.calibration.guided._procedure_views import (
    CalibrationComparison,
    CalibrationOutcome,
    CameraChange,
    CameraResiduals,
)
from ocmm_core.calibration.guided._session_events import utc_text
from ocmm_core.camera import (
    N_PARAMETERS,
    CameraModel,
    Rig,
    on_sensor,
    project,
    projection_jacobians,
)
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Pixels, Points3, rigid_fit, triple
from ocmm_core.tracking import triangulate

_TRIES = 100_000


def random_lines(volume_world: Float, length: float, lines: int, seed: int) -> Float:
    """Return ends (lines, 2, 3), mm, of uniformly random lines in a box (2, 3), mm.

    CalibrationError if the box is too small for the length.
    """
    rng = np.random.default_rng(seed)
    low, high = volume_world
    directions = rng.standard_normal((_TRIES, 3))
    arms = 0.5 * length * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    centres = low + rng.random((_TRIES, 3)) * (high - low)
    inside = np.minimum(centres - np.abs(arms) - low, high - centres - np.abs(arms)).min(axis=1)
    fits = np.flatnonzero(inside >= 0.0)[:lines]
    if len(fits) < lines:
        raise CalibrationError(
            "relocation.small_volume",
            f"A length of {length:g} mm does not fit into the volume of "
            f"{' x '.join(f'{side:.0f}' for side in high - low)} mm.",
            "Use a shorter length, or a larger volume.",
        )
    return np.stack([(centres - arms)[fits], (centres + arms)[fits]], axis=1)


def length_sigma(rig: Rig, volume_world: Float, length: float = 400.0) -> float:
    """Return the RMS standard deviation, mm, that the cameras' covariance gives to lengths.

    At fixed random places in the volume (2, 3), mm, without spot noise: the error after any
    averaging. CalibrationError if the volume is too small, or two cameras see none of the lines.
    """
    ends = random_lines(volume_world, length, lines=200, seed=0)
    gains, _, seen = location_gains(rig, ends.reshape(-1, 3))
    whole = seen.reshape(-1, 2).all(axis=1)
    if not whole.any():
        raise CalibrationError(
            "relocation.no_common_volume",
            "No length in the volume is seen by two cameras from end to end.",
            "Aim the cameras at one common volume.",
        )
    ends, gains = ends[whole], gains.reshape(-1, 2, *gains.shape[1:])[whole]
    along = (ends[:, 1] - ends[:, 0]) / length
    rows = np.einsum("ni,nip->np", along, gains[:, 1] - gains[:, 0])
    variances = np.einsum("np,pq,nq->n", rows, rig.parameter_covariance, rows, optimize=True)
    return float(np.sqrt(np.mean(variances)))


def location_gains(rig: Rig, points: Points3) -> tuple[Float, Float, NDArray[np.bool_]]:
    """Return how located points move with the cameras' parameters, and with the spots.

    d(point)/d(parameters), (n, 3, 14 C); covariances, (n, 3, 3), mm^2 / px^2, for a spot sigma of 1
    px; seen by two cameras, (n,): if not, the others are zero and NaN.
    """
    n, count = len(points), len(rig.cameras)
    by_point = np.zeros((n, count, 2, 3))
    by_parameters = np.zeros((n, count, 2, N_PARAMETERS))
    views = np.zeros(n, dtype=np.int64)
    for c, camera in enumerate(rig.cameras):
        sees = on_sensor(camera, project(camera, points))
        by_point[sees, c], by_parameters[sees, c] = projection_jacobians(camera, points[sees])
        views += sees
    seen = views >= 2
    gains = np.zeros((n, 3, count * N_PARAMETERS))
    covariances = np.full((n, 3, 3), np.nan)
    stacked = by_point[seen].reshape(-1, 2 * count, 3)
    covariances[seen] = np.linalg.inv(stacked.transpose(0, 2, 1) @ stacked)
    # Each camera's spots depend on its own parameters only.
    located = -np.einsum(
        "nij,ncuj,ncup->nicp", covariances[seen], by_point[seen], by_parameters[seen]
    )
    gains[seen] = located.reshape(-1, 3, count * N_PARAMETERS)
    return gains, covariances, seen


MAP_CELLS = 16
"""Cells of a residual map along either side of a sensor: some calibration spots in each."""

COMPARED_LENGTH_MM = 400.0
_NODES = 5


@dataclass(frozen=True, slots=True)
class CalibrationContext:
    """Provenance of a calibration."""

    method: records.Method
    made: datetime
    valid_days: int
    who: str
    software: str
    temperature_c: float | None
    sensor_temperatures_c: tuple[float, ...]
    """`who`, `software`, `temperature_c`, `sensor_temperatures_c`: As in `CameraRecord`."""
    data_sha256: str
    artefacts: tuple[records.ArtefactUse, ...]
    """Traceability of lengths and positions."""
    previous: str
    """Hash of the record in force; empty for the first one."""


@dataclass(frozen=True, slots=True)
class Findings:
    """Results of a calibration by any method."""

    cameras: tuple[CameraModel, ...]
    covariance: Float
    volume_world: Float
    hull_world: Points3
    """These four: as in `cameras.RigCalibration` and `relocation.RelocationResult`."""
    residuals: tuple[CameraResiduals, ...]
    rms_px: float
    chi2_per_dof: float
    """`rms_px`, `chi2_per_dof`: Over all cameras."""
    points: int
    outliers: tuple[str, ...]
    errors_at_world: Points3
    errors_world: Points3
    """`errors_at_world`, `errors_world`: See `outcome.CalibrationOutcome`."""
    warnings: tuple[records.Finding, ...]
    """Findings that did not refuse it."""
    thermal: records.ThermalTerm | None = None
    """Effect of the thermometer; None without one."""


def residuals_of(
    cameras: Sequence[CameraModel], uv: Pixels, residuals_px: Pixels, used: NDArray[np.bool_]
) -> tuple[CameraResiduals, ...]:
    """Return the residuals (n, C, L, 2) of spots of every camera; NaN if unseen."""
    seen = np.isfinite(residuals_px[..., 0] + residuals_px[..., 1])
    parts = ((c, seen[:, c]) for c in range(len(cameras)))
    return tuple(
        CameraResiduals(cameras[c].name, uv[:, c][s], residuals_px[:, c][s], used[:, c][s])
        for c, s in parts
    )


def hull_of(points: Points3, remedy: str) -> Points3:
    """Return the corners of the convex hull of points that two cameras saw; CalibrationError."""
    try:
        return points[scipy.spatial.ConvexHull(points).vertices]
    except (scipy.spatial.QhullError, ValueError) as error:
        raise CalibrationError(
            "calibration.no_common_volume",
            f"Only {len(points)} points, or points in one plane, were seen by two cameras.",
            remedy,
        ) from error


def build_outcome(
    rig: Rig, found: Findings, how: CalibrationContext, before: Rig | None
) -> CalibrationOutcome:
    """Return the record, its rig, and the comparison with ``before``, the rig in force."""
    low, high = found.volume_world
    record = records.CameraRecord(
        schema=records.SCHEMA,
        rig=rig.name,
        method=how.method,
        made_utc=utc_text(how.made),
        valid_until_utc=utc_text(how.made + timedelta(days=how.valid_days)),
        made_by=how.who,
        software=how.software,
        temperature_c=how.temperature_c,
        sensor_temperatures_c=how.sensor_temperatures_c,
        frame_rate_hz=rig.frame_rate_hz,
        noise=rig.noise,
        cameras=tuple(
            records.entry_of(camera, alias, sensor, rig.device)
            for camera, alias, sensor in zip(
                found.cameras, rig.aliases, rig.sensors or (0,) * len(rig.aliases), strict=True
            )
        ),
        covariance=tuple(tuple(row) for row in _symmetric(found.covariance).tolist()),
        volume_min=triple(low),
        volume_max=triple(high),
        hull=tuple(triple(corner) for corner in found.hull_world),
        residual_maps=tuple(
            residual_map(camera, of_camera)
            for camera, of_camera in zip(found.cameras, found.residuals, strict=True)
        ),
        rms_px=float(found.rms_px),
        chi2_per_dof=float(found.chi2_per_dof),
        points=found.points,
        outliers=found.outliers,
        data_sha256=how.data_sha256,
        artefacts=how.artefacts,
        previous=how.previous,
        thermal=msgspec.UNSET if found.thermal is None else found.thermal,
    )
    after = records.rig_from_record(record)
    return CalibrationOutcome(
        record=record, rig=after, residuals=found.residuals, errors_at_world=found.errors_at_world,
        errors_world=found.errors_world, warnings=found.warnings,
        comparison=None if before is None else compare(before, after),
    )  # fmt: skip


def compare(before: Rig, after: Rig) -> CalibrationComparison:
    """Return the difference from the previous calibration after the best common motion.

    Points of the volume, projected by the new cameras, are located by the old ones; the rigid
    motion between both is that of the whole frame.
    """
    low, high = after.volume_world
    axes = [np.linspace(low[axis], high[axis], _NODES) for axis in range(3)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    located = triangulate(before, np.stack([project(camera, nodes) for camera in after.cameras]))
    seen = np.isfinite(located).all(axis=1)
    nodes, located = nodes[seen], located[seen]
    rotation, translation = rigid_fit(located, nodes)
    moved = located @ rotation.T + translation
    changes = []
    for old, new in zip(before.cameras, after.cameras, strict=True):
        shift = new.centre_world - (rotation @ old.centre_world + translation)
        turn = new.T_camera_from_world.rotation @ rotation @ old.T_camera_from_world.rotation.T
        changes.append(
            CameraChange(
                name=new.name,
                shift_mm=float(np.linalg.norm(shift)),
                turn_rad=float(scipy.spatial.transform.Rotation.from_matrix(turn).magnitude()),
                focal_mm=new.focal - old.focal,
                u0_px=new.u0 - old.u0,
                v0_px=new.v0 - old.v0,
            )
        )
    length = min(COMPARED_LENGTH_MM, float(np.max(high - low)))
    return CalibrationComparison(
        moved_mm=float(np.linalg.norm((nodes - located).mean(axis=0))),
        turned_rad=float(scipy.spatial.transform.Rotation.from_matrix(rotation).magnitude()),
        cameras=tuple(changes),
        nodes_world=nodes,
        differences_world=nodes - moved,
        length_sigma_before_mm=length_sigma(before, after.volume_world, length),
        length_sigma_after_mm=length_sigma(after, after.volume_world, length),
    )


def residual_map(camera: CameraModel, residuals: CameraResiduals) -> records.ResidualMap:
    """Return the mean residual in each cell of a camera's sensor."""
    uv, left = residuals.uv[residuals.used], residuals.residuals_px[residuals.used]
    column = np.clip((uv[:, 0] / camera.width * MAP_CELLS).astype(int), 0, MAP_CELLS - 1)
    row = np.clip((uv[:, 1] / camera.height * MAP_CELLS).astype(int), 0, MAP_CELLS - 1)
    cell = row * MAP_CELLS + column
    count = np.bincount(cell, minlength=MAP_CELLS**2)
    means = [
        np.bincount(cell, left[:, axis], MAP_CELLS**2) / np.maximum(count, 1) for axis in range(2)
    ]
    return records.ResidualMap(
        columns=MAP_CELLS,
        rows=MAP_CELLS,
        mean_u_px=tuple(means[0].tolist()),
        mean_v_px=tuple(means[1].tolist()),
        count=tuple(count.tolist()),
    )


def hash_of(*arrays: Float) -> str:
    """Return the SHA-256 of observations, independent of their order in a session."""
    total = hashlib.sha256()
    for array in arrays:
        total.update(repr(array.shape).encode())
        total.update(np.ascontiguousarray(array, dtype="<f8").tobytes())
    return total.hexdigest()


def _symmetric(covariance: Float) -> Float:
    return 0.5 * (covariance + covariance.T)
