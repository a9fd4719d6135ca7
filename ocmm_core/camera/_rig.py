"""Camera rig: cameras, calibration uncertainty, and its document."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

from ocmm_core.camera import _model as model
from ocmm_core.camera import _tracker as tracker
from ocmm_core.camera._model import Vector3
from ocmm_core.documents import Document, load_with_text, schema_of, text_digest
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector

SCHEMA = "ocmm.rig/1"
MAX_CAMERAS = 16
USUAL_SLOTS = 8
"""Tracking windows (slots) of a present camera, the number of spots in its frames."""

MAX_SLOTS = 64
"""Largest number of slots of a camera in frames, as bits of one number mark occupied ones."""

MAX_LEDS = 64
"""LEDs of one body, and of all bodies tracked together."""

MAX_FOCAL_SIGMA = 1e-3
"""Relative standard deviation; above it, focal length and distance are not separable to first
order."""


class CameraEntry(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True
):
    """One camera in a rig document; lengths in mm, image positions in px.

    With ``sensor_serial``, a camera with another sensor is refused. ``device`` is the description
    of a third-party camera: a name, or a path relative to this document.
    """

    name: str
    serial: int
    alias: int
    width_px: int
    height_px: int
    pitch: float
    focal: float
    aspect: float
    u0_px: float
    v0_px: float
    k1: float
    k2: float
    p1: float
    p2: float
    centre: Vector3
    rotation_vector: Vector3
    sensor_serial: int = 0
    device: str = ""


class SpotNoise(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Error of a spot position, px per axis."""

    white_px: float
    """Standard deviation of one exposure, independent between frames."""
    pattern_px: float
    """Standard deviation of the part fixed to the sensor position."""
    pattern_length_px: float
    """Correlation length of that part (Gaussian)."""


class CalibrationDesign(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Reference points of the camera calibration (thesis 3.1)."""

    method: Literal["known points"]
    points: int
    volume_min: Vector3
    volume_max: Vector3
    spot_sigma_px: float
    reference_sigma: float


class RigDocument(Document, frozen=True, kw_only=True):
    """Document of a rig; ``calibrate_unproven`` admits cameras of unproven age or order."""

    name: str
    frame_rate_hz: int
    volume_min: Vector3
    volume_max: Vector3
    noise: SpotNoise
    calibration: CalibrationDesign
    cameras: list[CameraEntry]
    calibrate_unproven: bool = False


@dataclass(frozen=True, slots=True)
class ThermalShare:
    """Share of the error of one thermometer in the parameters of a calibration or body."""

    thermometer: str
    """Shares of the same thermometer are fully correlated; empty if unknown."""
    sigma_k: float
    """Standard uncertainty, K."""
    by_k: Float
    """(k,): derivative of the parameters by the error, contained in their covariance."""


@dataclass(frozen=True, slots=True)
class Rig:
    """The calibrated cameras and the uncertainty of their calibration."""

    name: str
    cameras: tuple[model.CameraModel, ...]
    aliases: tuple[int, ...]
    """EtherCAT station alias of each camera."""
    frame_rate_hz: int
    noise: SpotNoise
    volume_world: Float
    """(2, 3), mm: corners of the calibrated volume."""
    parameter_covariance: Float
    """(14 C, 14 C), in the order of `camera.model.PARAMETERS`, camera by camera."""
    identity: str
    sensors: tuple[int, ...] = ()
    """Serial number of the sensor of each camera, 0 if unknown; may be empty."""
    device: str = ""
    """Name, or absolute path, of the description of its cameras; empty for our own."""
    calibrate_unproven: bool = False
    """Permits calibration of cameras that cannot prove the age of their data."""
    thermal: ThermalShare | None = None
    """Share of the thermometer of the calibration; None if unknown."""
    noise_ratios: tuple[float, ...] = ()
    """Spot noise of each camera in a job, relative to ``noise`` (`measuring.check_noise`); empty if
    as stated."""
    markers: tracker.MarkerModel | None = None
    """Markers of the tracker that the cameras represent; None for real cameras."""
    # Every kernel call needs it, and computing it takes longer than a single tip.
    _packed: Float = dataclasses.field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        packed = np.stack([camera.packed() for camera in self.cameras])
        object.__setattr__(self, "_packed", packed)

    def packed(self) -> Float:
        """Return all cameras in kernel form, (C, 21); a shared array."""
        return self._packed

    @property
    def per_spot(self) -> int:
        """Return the independent coordinates of a spot."""
        return 2 if self.markers is None else 1


def load_rig(path: Path | str) -> Rig:
    """Return the rig of the document at ``path``, of cameras or of a tracker.

    InputError: the document is malformed, has duplicate cameras, serials or aliases, fewer than two
    or more than `MAX_CAMERAS` cameras, an implausible value, or an undetermined calibration.
    """
    return read_rig(path)[0]


def read_rig(path: Path | str) -> tuple[Rig, str]:
    """Return the rig of a document, and the text it was read from; InputError as `load_rig`."""
    if schema_of(path) == tracker.TRACKER_SCHEMA:
        return _tracker_rig(Path(path))
    document, text = load_with_text(path, RigDocument, SCHEMA)
    _check(Path(path), document)
    cameras = tuple(camera_of(entry) for entry in document.cameras)
    covariance = np.zeros((model.N_PARAMETERS * len(cameras),) * 2)
    for index, camera in enumerate(cameras):
        part = slice(index * model.N_PARAMETERS, (index + 1) * model.N_PARAMETERS)
        covariance[part, part] = known_points_covariance(Path(path), camera, document.calibration)
    rig = Rig(
        name=document.name,
        cameras=cameras,
        sensors=tuple(entry.sensor_serial for entry in document.cameras),
        device=_device_of(Path(path), document),
        calibrate_unproven=document.calibrate_unproven,
        aliases=tuple(entry.alias for entry in document.cameras),
        frame_rate_hz=document.frame_rate_hz,
        noise=document.noise,
        volume_world=np.array([document.volume_min, document.volume_max]),
        parameter_covariance=covariance,
        identity=text_digest(text),
    )
    return rig, text


def _tracker_rig(path: Path) -> tuple[Rig, str]:
    document, text = load_with_text(path, tracker.TrackerDocument, tracker.TRACKER_SCHEMA)
    return tracker_rig(document, text_digest(text), path), text


def tracker_rig(document: tracker.TrackerDocument, identity: str, path: Path | str = "") -> Rig:
    """Return the rig that is equivalent to a tracker; InputError for an implausible value."""
    tracker.check_tracker(path, document)
    virtual = tracker.virtual_cameras(path, document)
    return Rig(
        name=document.name,
        cameras=virtual.cameras,
        aliases=tuple(range(1, len(virtual.cameras) + 1)),
        frame_rate_hz=document.frame_rate_hz,
        noise=SpotNoise(
            white_px=tracker.WHITE_PX,
            pattern_px=virtual.pattern_px,
            pattern_length_px=virtual.pattern_length_px,
        ),
        volume_world=np.array([document.volume_min, document.volume_max]),
        parameter_covariance=virtual.parameter_covariance,
        identity=identity,
        markers=virtual.model,
    )


_MOST_NOISE_PX = 10.0
_MOST_POINTS = 100_000


def known_points_covariance(
    path: Path, camera: model.CameraModel, design: CalibrationDesign
) -> Float:
    """Return the covariance (14, 14) of a calibration with known points.

    The points are spread evenly over the design volume; with exact reference positions the cameras
    are independent (measured: ratio 1.000). InputError: the design does not determine the camera.
    """
    low, high = np.array(design.volume_min), np.array(design.volume_max)
    points = low + (high - low) * np.random.default_rng(0).random((design.points, 3))
    points = points[model.on_sensor(camera, model.project(camera, points))]
    if len(points) < model.N_PARAMETERS:
        raise InputError(
            "rig.calibration",
            f"{path}: only {len(points)} calibration points are seen by camera '{camera.name}'.",
            "Move the calibration volume into the view of the camera, or give more points.",
        )
    d_point, d_parameters = model.projection_jacobians(camera, points)
    variance = design.spot_sigma_px**2 + design.reference_sigma**2 * np.mean(
        np.sum(d_point**2, axis=2)
    )
    rows = d_parameters.reshape(-1, model.N_PARAMETERS)
    scale = np.linalg.norm(rows, axis=0)
    # Implausible sizes give infinite numbers here; undetermined results are refused below.
    with np.errstate(all="ignore"):
        information = (rows / scale).T @ (rows / scale) / variance
    covariance: Float = np.full_like(information, np.inf)
    if np.isfinite(information).all() and np.linalg.cond(information) <= 1e15:
        covariance = np.linalg.inv(information) / np.outer(scale, scale)
    focal = model.PARAMETERS.index("focal")
    if not covariance[focal, focal] <= (MAX_FOCAL_SIGMA * camera.focal) ** 2:
        raise InputError(
            "rig.calibration",
            f"{path}: the calibration volume is too flat to determine camera '{camera.name}'.",
            "Give the calibration volume at least 15 mm of depth.",
        )
    return 0.5 * (covariance + covariance.T)


def camera_of(entry: CameraEntry) -> model.CameraModel:
    rotation = rotation_from_vector(np.array(entry.rotation_vector))
    return model.CameraModel(
        name=entry.name,
        serial=entry.serial,
        width=entry.width_px,
        height=entry.height_px,
        pitch_mm=entry.pitch,
        focal=entry.focal,
        aspect=entry.aspect,
        u0=entry.u0_px,
        v0=entry.v0_px,
        k1=entry.k1,
        k2=entry.k2,
        p1=entry.p1,
        p2=entry.p2,
        T_camera_from_world=RigidTransform(rotation, -rotation @ np.array(entry.centre)),
    )


def _device_of(path: Path, document: RigDocument) -> str:
    """Return the common description of all cameras; paths are relative to the document."""
    named = {entry.device for entry in document.cameras}
    if len(named) > 1:
        raise InputError(
            "rig.devices",
            f"{path}: field 'device' of the cameras names {len(named)} kinds of cameras.",
            "Give all cameras of a rig the same; a bus has cameras of one kind.",
        )
    (name,) = named
    return str(path.absolute().parent / name) if "/" in name or name.endswith(".toml") else name


def _check(path: Path, document: RigDocument) -> None:
    if not 2 <= len(document.cameras) <= MAX_CAMERAS:
        raise InputError(
            "rig.cameras",
            f"{path}: field 'cameras' names {len(document.cameras)} camera(s).",
            f"Name two to {MAX_CAMERAS} cameras; one camera cannot see depth.",
        )
    for field in ("name", "serial", "alias"):
        values = [getattr(entry, field) for entry in document.cameras]
        for value in values:
            if values.count(value) > 1:
                raise InputError(
                    "rig.duplicate",
                    f"{path}: two cameras have the {field} {value!r}.",
                    f"Give every camera its own {field}.",
                )
    positive = [
        (f"cameras[{index}].{field}", getattr(entry, field))
        for index, entry in enumerate(document.cameras)
        for field in ("width_px", "height_px", "pitch", "focal", "aspect", "serial", "alias")
    ]
    positive += [
        ("frame_rate_hz", document.frame_rate_hz),
        ("noise.white_px", document.noise.white_px),
        ("noise.pattern_length_px", document.noise.pattern_length_px),
        ("calibration.spot_sigma_px", document.calibration.spot_sigma_px),
        ("calibration.points", document.calibration.points),
    ]
    for field, value in positive:
        if value <= 0:
            raise InputError(
                "rig.value",
                f"{path}: field '{field}' is {value}, but must be greater than zero.",
                "Correct that field.",
            )
    for field in ("white_px", "pattern_px"):
        value = getattr(document.noise, field)
        if not 0.0 <= value <= _MOST_NOISE_PX:
            raise InputError(
                "rig.value",
                f"{path}: field 'noise.{field}' is {value:g}, not from 0 to {_MOST_NOISE_PX:g} px.",
                "Correct that field.",
            )
    if document.calibration.points > _MOST_POINTS:
        raise InputError(
            "rig.points",
            f"{path}: field 'calibration.points' is {document.calibration.points}.",
            f"Give at most {_MOST_POINTS}.",
        )
    low, high = np.array(document.volume_min), np.array(document.volume_max)
    if np.any(high <= low):
        raise InputError(
            "rig.volume",
            f"{path}: field 'volume_max' is not above 'volume_min' in every axis.",
            "Give the two opposite corners of the calibrated volume, lowest values first.",
        )
