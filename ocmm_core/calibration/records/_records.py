"""Records of camera calibrations and verifications, kept as `sealed` files."""

from __future__ import annotations

from typing import Literal

import msgspec
import numpy as np
import scipy

from ocmm_core.calibration.records._sealed import record_hash
from ocmm_core.camera import (
    N_PARAMETERS,
    CameraEntry,
    CameraModel,
    Rig,
    SpotNoise,
    ThermalShare,
    TrackerDocument,
    Vector3,
    camera_of,
    tracker_rig,
)
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float

Method = Literal["known points", "relocation", "boards", "tracker"]


class ResidualMap(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Mean calibration residuals over the sensor, for comparison by the monitor."""

    columns: int
    rows: int
    """`columns`, `rows`: Cells over the width and the height of the sensor."""
    mean_u_px: tuple[float, ...]
    mean_v_px: tuple[float, ...]
    """`mean_u_px`, `mean_v_px`: Mean residual of each cell, row by row; zero without spots."""
    count: tuple[int, ...]
    """Spots in each cell."""


class ArtefactUse(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An artefact that a result rests on, with its certificate."""

    name: str
    serial: str
    certificate: str
    certificate_sha256: str
    due_utc: str


class ThermalTerm(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Thermometer of a calibration and the effect of its error."""

    thermometer: str
    """Its name; empty if only U was stated."""
    expanded_k: float
    """U (k = 2) as stated, K."""
    sigma_k: float
    """Standard uncertainty of its error after the calibration, K."""
    by_k: tuple[float, ...]
    """Derivative of all camera parameters by the error; contained in the covariance."""


class CameraRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A calibration of the cameras of one rig."""

    schema: str
    rig: str
    method: Method
    made_utc: str
    valid_until_utc: str
    made_by: str
    software: str
    temperature_c: float | None
    """Ambient temperature at the cameras; None if not measured."""
    sensor_temperatures_c: tuple[float, ...] = ()
    """Reported by the cameras during calibration, camera by camera; empty if not reported."""
    frame_rate_hz: int
    noise: SpotNoise
    """`frame_rate_hz`, `noise`: As in the rig document."""
    cameras: tuple[CameraEntry, ...]
    """In the order of the frames."""
    covariance: tuple[tuple[float, ...], ...]
    """(14 C, 14 C), camera by camera, in the order of `camera.model.PARAMETERS`."""
    volume_min: Vector3
    volume_max: Vector3
    """`volume_min`, `volume_max`: Box in which points are accepted."""
    hull: tuple[Vector3, ...]
    """Corners of the convex hull of the data, mm, world."""
    residual_maps: tuple[ResidualMap, ...]
    """One for each camera."""
    rms_px: float
    chi2_per_dof: float
    """`rms_px`, `chi2_per_dof`: Of the residuals of all cameras."""
    points: int
    outliers: tuple[str, ...]
    data_sha256: str
    artefacts: tuple[ArtefactUse, ...]
    """What lengths and positions rest on."""
    previous: str
    """Hash of the previous record; empty for the first."""
    thermal: ThermalTerm | msgspec.UnsetType = msgspec.UNSET
    """Unset without a stated temperature and in earlier versions, to keep their hash."""
    tracker: TrackerDocument | msgspec.UnsetType = msgspec.UNSET
    """With measured noise; the cameras are then those that stand for it."""


SCHEMA = "ocmm.camera-calibration/1"
VERIFICATION_SCHEMA = "ocmm.verification/1"


class Check(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One measured length or diameter of a verification."""

    name: str
    """Line and length, or sphere and place."""
    measured_mm: float
    certified_mm: float
    expanded_mm: float
    limit_mm: float
    """`measured_mm`, `certified_mm`, `expanded_mm`, `limit_mm`: Value, certified value at the
    temperature of the test, expanded uncertainty (k = 2) of the test value, and permissible error.
    """

    @property
    def error_mm(self) -> float:
        """Return measured less certified."""
        return self.measured_mm - self.certified_mm


class Corner(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Whether a test length ended in a corner of the volume."""

    name: str
    """Side along X, Y and Z."""
    off: float
    """Distance of the nearest end of a test length, as the largest share of an edge."""
    reached: bool
    reason: str = ""
    """Explanation for an unreached corner; empty if none was given."""


class RepeatedSeat(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A pose visited at the start and again."""

    place: str
    first_utc: str
    again_utc: str
    shift_mm: Vector3
    """Again less first, world."""
    square: float
    limit: float
    """`square`, `limit`: Normalised square of the shift, and what chance exceeds hardly ever."""


class Objection(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Reason against a verification in addition to its checks; as in `OcmmError`."""

    code: str
    what: str
    remedy: str


class ErrorInterval(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """When an error of a calibration arose."""

    good_utc: str
    """Last observation of the last good verification; else the time of the calibration."""
    seen_utc: str
    """First observation with the error."""
    verified: bool
    """Whether `good_utc` is of a verification."""

    @property
    def sentence(self) -> str:
        good, seen = self.good_utc[:19].replace("T", " "), self.seen_utc[:19].replace("T", " ")
        if self.verified:
            return (
                f"The error arose between {good} UTC (last good verification) and {seen} UTC "
                "(first seen); points from the earlier time on are suspect."
            )
        return (
            f"The error arose between {good} UTC (calibration; no good verification since) and "
            f"{seen} UTC (first seen); points from the earlier time on are suspect."
        )


class ScaleError(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Relative error of all lengths of a tracker, and its standard uncertainty."""

    relative: float
    sigma: float


class VerificationRecord(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True
):
    """An independent check of a calibration; new fields are omitted at default, for old hashes."""

    schema: str
    calibration: str
    """Hash of the record that was checked."""
    made_utc: str
    made_by: str
    software: str
    temperature_c: float | None
    """`made_utc`, `made_by`, `software`, `temperature_c`: As in `CameraRecord`."""
    rule: str
    """How the checks were judged, in words."""
    checks: tuple[Check, ...]
    """All that count, also those that failed."""
    artefacts: tuple[ArtefactUse, ...]
    data_sha256: str
    """Hash of the observations; must differ from that of the calibration."""
    passed: bool
    """By the rule: all checks conform, each corner is reached or explained, no objections."""
    superseded: tuple[Check, ...] = ()
    """First results of the checks of a failed and repeated line."""
    corners: tuple[Corner, ...] = ()
    """All eight; empty in records of earlier versions."""
    repeats: tuple[RepeatedSeat, ...] = ()
    objections: tuple[Objection, ...] = ()
    notes: tuple[str, ...] = ()
    """Guideline advice that could not be followed, and why."""
    arose: ErrorInterval | None = None
    """None if no error was found, and in earlier versions."""
    scale: ScaleError | None = None
    """Of a tracker; None for cameras."""


def rig_from_record(record: CameraRecord) -> Rig:
    """Return the rig of a record; CalibrationError if its covariance is invalid."""
    if not isinstance(record.tracker, msgspec.UnsetType):
        return tracker_rig(record.tracker, record_hash(record), f"record of {record.rig}")
    size = N_PARAMETERS * len(record.cameras)
    rows = [list(row) for row in record.covariance]
    if len(rows) != size or any(len(row) != size for row in rows):
        raise CalibrationError(
            "record.covariance",
            f"The record of rig '{record.rig}' has no covariance of {size} parameters.",
            "Calibrate the cameras again.",
        )
    covariance: Float = np.array(rows)
    if not np.array_equal(covariance, covariance.T) or np.any(np.diag(covariance) < 0.0):
        raise CalibrationError(
            "record.covariance",
            f"The covariance in the record of rig '{record.rig}' is invalid.",
            "Calibrate the cameras again.",
        )
    return Rig(
        name=record.rig, cameras=tuple(camera_of(entry) for entry in record.cameras),
        aliases=tuple(entry.alias for entry in record.cameras),
        sensors=tuple(entry.sensor_serial for entry in record.cameras),
        device=record.cameras[0].device if record.cameras else "",
        frame_rate_hz=record.frame_rate_hz, noise=record.noise,
        volume_world=np.array([record.volume_min, record.volume_max]),
        parameter_covariance=covariance, identity=record_hash(record), thermal=_share(record, size),
    )  # fmt: skip


def _share(record: CameraRecord, size: int) -> ThermalShare | None:
    thermal = record.thermal
    if isinstance(thermal, msgspec.UnsetType) or len(thermal.by_k) != size:
        return None
    return ThermalShare(thermal.thermometer, thermal.sigma_k, np.array(thermal.by_k))


def entry_of(camera: CameraModel, alias: int, sensor: int = 0, device: str = "") -> CameraEntry:
    """Return the entry that describes a camera, its sensor and its device."""
    rotation = camera.T_camera_from_world.rotation
    vector: Float = scipy.spatial.transform.Rotation.from_matrix(rotation).as_rotvec()
    x, y, z = (float(value) for value in camera.centre_world)
    return CameraEntry(
        name=camera.name, serial=camera.serial, alias=alias, width_px=camera.width,
        height_px=camera.height, pitch=camera.pitch_mm, focal=camera.focal, aspect=camera.aspect,
        u0_px=camera.u0, v0_px=camera.v0, k1=camera.k1, k2=camera.k2, p1=camera.p1, p2=camera.p2,
        centre=(x, y, z), rotation_vector=(float(vector[0]), float(vector[1]), float(vector[2])),
        sensor_serial=sensor, device=device,
    )  # fmt: skip
