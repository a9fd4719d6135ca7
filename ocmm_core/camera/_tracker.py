"""Trackers: their document, and three virtual cameras that are equivalent to one.

A tracker reports markers in space, with a noise across and along its line of sight. Three cameras
on a cone about that line, at an angle a, give a marker the information
``diag(3 - 1.5 sin^2 a, same, 3 sin^2 a) / s^2`` (across, across, along; s: noise of one camera at
the marker), so that a and s follow from the two stated noises. The images of a marker have six
coordinates, but only its three are independent: each spot counts as one (`Rig.per_spot`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

from ocmm_core.camera._model import (
    N_PARAMETERS,
    CameraModel,
    Vector3,
    ideal_from_pixels,
    projection_jacobians,
)
from ocmm_core.documents import Document, load_document
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, RigidTransform, perpendicular_pair, unit

TRACKER_SCHEMA = "ocmm.tracker/1"
WHITE_PX = 0.03
"""Noise of a virtual camera; sets the size of its pixels."""
_PITCH_MM = 0.01
_VIEWS = 3
REACH_MM = 400.0
"""Markers of a probe are outside the volume of its ball, by at most this."""
_FAR = 20.0
"""Distance of the virtual cameras in sizes of the volume, if the noise is the same everywhere."""
_NEAREST = 0.1
"""Least depth of a marker, in distances of the stated noise."""
_AMPLIFIED = 10.0
"""Noise of a tip in noises of a marker, above which the markers are close to one line."""
_MOST_CORRELATION = 0.95
_MOST_SIGMA_MM = 2.0
_MOST_MARKERS = 64


class TrackerNoise(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Error of a marker; mm, standard deviations."""

    growth: Literal["distance", "none"]
    """With the distance from the head (across in proportion, along by its square), or not."""
    distance: float
    """Distance from the head at which the standard deviations hold."""
    sigma_across: float
    sigma_along: float
    """`sigma_across`, `sigma_along`: of one frame, across and along the line of sight."""
    place_sigma: float
    place_length: float
    """`place_sigma`, `place_length`: part that stays at its place, across (along in the same ratio
    as above), and its correlation length."""
    scale_sigma: float
    """Relative standard uncertainty of the scale."""
    correlation: float
    """Correlation of consecutive frames of a resting marker, by filters of the device."""
    rounding: float
    """Step of the reported coordinates; 0: none."""
    scale: float = 1.0
    """Factor from reported to true coordinates, by a calibrated length."""

    @property
    def reported(self) -> tuple[float, float]:
        """Return the standard deviations across and along of a frame as reported, rounded, mm."""
        step = self.rounding / np.sqrt(12.0)
        return float(np.hypot(self.sigma_across, step)), float(np.hypot(self.sigma_along, step))


class TrackerDocument(Document, frozen=True, kw_only=True):
    """Document of a tracker; world: the axes of the device, right-handed, mm."""

    name: str
    serial: int
    frame_rate_hz: int
    device_unit: Literal["mm", "m"]
    """Unit of the coordinates that the device sends."""
    handedness: Literal["right", "left"]
    """Handedness of its axes; z of left-handed ones is reversed."""
    missing: Literal["absent", "zero", "frozen"]
    """Report of a hidden marker: absent, all zero, or its last place repeated exactly."""
    markers: tuple[str, ...]
    """Names of the markers in its messages."""
    button: str = ""
    """Name of the SENSOR message whose first value above 0.5 is a pressed button; empty: none."""
    head: Vector3
    """Origin of the lines of sight."""
    volume_min: Vector3
    volume_max: Vector3
    noise: TrackerNoise


@dataclass(frozen=True, slots=True)
class MarkerModel:
    """Properties of a rig of equivalent cameras."""

    document: TrackerDocument
    most_tip_sigma: float
    """Largest standard deviation of a tip in one frame, mm, in place of that of cameras."""


@dataclass(frozen=True, slots=True)
class VirtualCameras:
    """Three equivalent cameras of a tracker, and their uncertainty."""

    cameras: tuple[CameraModel, ...]
    pattern_px: float
    pattern_length_px: float
    parameter_covariance: Float
    model: MarkerModel


def load_tracker(path: Path | str) -> TrackerDocument:
    """Return the tracker document at ``path``; InputError if it is malformed or implausible."""
    document = load_document(path, TrackerDocument, TRACKER_SCHEMA)
    check_tracker(path, document)
    return document


def check_tracker(path: Path | str, document: TrackerDocument) -> None:
    """Raise InputError for an implausible value."""
    noise = document.noise
    for field, value, low, high in (
        ("serial", document.serial, 1, 2**31),
        ("frame_rate_hz", document.frame_rate_hz, 20, 2000),
        ("noise.distance", noise.distance, 1.0, 1e5),
        ("noise.sigma_across", noise.sigma_across, 1e-4, _MOST_SIGMA_MM),
        ("noise.sigma_along", noise.sigma_along, noise.sigma_across, _MOST_SIGMA_MM),
        ("noise.place_sigma", noise.place_sigma, 0.0, _MOST_SIGMA_MM),
        ("noise.place_length", noise.place_length, 1.0, 1e5),
        ("noise.scale_sigma", noise.scale_sigma, 0.0, 1e-2),
        ("noise.correlation", noise.correlation, 0.0, _MOST_CORRELATION),
        # Noise of half a step makes the mean of rounded values unbiased, to 0.3 % of a step.
        ("noise.rounding", noise.rounding, 0.0, 2.0 * noise.sigma_across),
        ("noise.scale", noise.scale, 0.98, 1.02),
    ):
        if not low <= value <= high:
            raise InputError(
                "tracker.value",
                f"{path}: field '{field}' is {value:g}, not from {low:g} to {high:g}.",
                "Correct that field; coordinates rounded to more than twice the noise hide it: "
                "let the device send more digits.",
            )
    if not 3 <= len(set(document.markers)) == len(document.markers) <= _MOST_MARKERS:
        raise InputError(
            "tracker.markers",
            f"{path}: field 'markers' names {len(document.markers)} markers.",
            f"Name 3 to {_MOST_MARKERS} markers, each once, as the device does.",
        )
    if np.any(np.array(document.volume_max) <= np.array(document.volume_min)):
        raise InputError(
            "rig.volume",
            f"{path}: field 'volume_max' is not above 'volume_min' in every axis.",
            "Give the two opposite corners of the calibrated volume, lowest values first.",
        )


def virtual_cameras(path: Path | str, document: TrackerDocument) -> VirtualCameras:
    """Return the equivalent cameras of a tracker; InputError if its volume is at its head."""
    noise, head = document.noise, np.array(document.head)
    volume = np.array([document.volume_min, document.volume_max])
    centre = volume.mean(axis=0)
    reached = volume + np.array([[-REACH_MM], [REACH_MM]])
    corners = np.array(np.meshgrid(*reached.T)).reshape(3, -1).T
    away = float(np.linalg.norm(centre - head))
    if away < 1.0:
        raise InputError(
            "tracker.head",
            f"{path}: field 'head' is the middle of the volume, so that no line of sight is known.",
            "Give the middle between the cameras of the tracker.",
        )
    across, along = noise.reported
    sight = (centre - head) / away
    sine = np.sqrt(2.0 / (2.0 * (along / across) ** 2 + 1.0))
    cosine = np.sqrt(1.0 - sine**2)
    if noise.growth == "distance":
        target, distance = head + noise.distance * sight, noise.distance / cosine
    else:
        target, distance = centre, _FAR * float(np.linalg.norm(np.diff(reached, axis=0)))
    focal_px = float(WHITE_PX * distance / (across * np.sqrt(3.0 - 1.5 * sine**2)))
    first, second = perpendicular_pair(sight)
    cameras, scales = [], np.zeros((_VIEWS, N_PARAMETERS))
    for view in range(_VIEWS):
        angle = 2.0 * np.pi * view / _VIEWS
        look = cosine * sight - sine * (np.cos(angle) * first + np.sin(angle) * second)
        side = unit(np.cross(look, first if abs(look @ first) < 0.9 else second))
        rotation = np.array([side, np.cross(look, side), look])
        place = target - distance * look
        seen = (corners - place) @ rotation.T
        if seen[:, 2].min() < _NEAREST * distance:
            raise InputError(
                "tracker.near",
                f"{path}: the volume, with {REACH_MM:g} mm for the markers of a probe, comes too "
                "close to the head.",
                'Give a smaller volume, or noise.growth = "none".',
            )
        size = 2 * int(np.ceil(focal_px * np.abs(seen[:, :2] / seen[:, 2:]).max())) + 2
        cameras.append(
            CameraModel(
                name=f"view {view + 1}", serial=10 * document.serial + view, width=size,
                height=size, pitch_mm=_PITCH_MM, focal=focal_px * _PITCH_MM, aspect=1.0,
                u0=0.5 * size, v0=0.5 * size, k1=0.0, k2=0.0, p1=0.0, p2=0.0,
                T_camera_from_world=RigidTransform(rotation, -rotation @ place),
            )
        )  # fmt: skip
        # A larger scale moves the cameras away from the head.
        scales[view, 3:6] = -rotation @ (place - head)
    by_scale = noise.scale_sigma * scales.ravel()
    return VirtualCameras(
        tuple(cameras), WHITE_PX * noise.place_sigma / across,
        float(noise.place_length * focal_px / distance), np.outer(by_scale, by_scale),
        MarkerModel(document, _AMPLIFIED * along),
    )  # fmt: skip


def noise_pairs(before: TrackerNoise, after: TrackerNoise) -> list[tuple[str, str, str]]:
    """Return each field with both values, to compare."""

    def text(value: float | str) -> str:
        return f"{value:.5g}" if isinstance(value, float) else value

    later = msgspec.structs.asdict(after)
    return [
        (name, text(value), text(later[name]))
        for name, value in msgspec.structs.asdict(before).items()
    ]


def sights_of(places: Float, document: TrackerDocument) -> Float:
    """Return the lines of sight (..., 3), unit vectors, of places (..., 3), mm."""
    rays = places - np.array(document.head)
    if document.noise.growth == "none":
        middle = np.mean([document.volume_min, document.volume_max], axis=0)
        rays = np.broadcast_to(middle - np.array(document.head), places.shape)
    found: Float = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
    return found


def independent_share(correlation: float) -> float:
    """Return the share of independent frames, by the correlation of consecutive ones."""
    return (1.0 - correlation) / (1.0 + correlation)


def place_shape(places: Float, document: TrackerDocument) -> Float:
    """Return matrices (L, 3, 3): errors at places (L, 3) of an error of one across, everywhere."""
    noise, sight = document.noise, sights_of(places, document)
    ratio, grown = noise.sigma_along / noise.sigma_across, np.ones(len(places))
    if noise.growth == "distance":
        grown = np.linalg.norm(places - np.array(document.head), axis=1) / noise.distance
        ratio = ratio * grown
    more = np.broadcast_to(ratio - 1.0, grown.shape)
    along = sight[:, :, None] * sight[:, None]
    return (np.eye(3) + more[:, None, None] * along) * grown[:, None, None]


def slopes_of_places(
    cameras: Sequence[CameraModel], places: Float, document: TrackerDocument
) -> Float:
    """Return the derivatives (L, C, 2, 3), px/mm, of images by errors of `place_shape`."""
    by_place = np.stack([projection_jacobians(camera, places)[0] for camera in cameras], axis=1)
    return by_place @ place_shape(places, document)[:, None]


def locate_markers(cameras: Sequence[CameraModel], uv: Float) -> Float:
    """Return the markers (..., L, 3), mm, of their images (..., C, L, 2), px, in all views."""
    squares = np.zeros((*uv.shape[:-3], uv.shape[-2], 3, 3))
    right = np.zeros(squares.shape[:-1])
    for index, camera in enumerate(cameras):
        ideal = ideal_from_pixels(camera, uv[..., index, :, :])
        turn, shift = camera.T_camera_from_world.rotation, camera.T_camera_from_world.translation
        rows = ideal[..., None] * turn[2] - camera.focal * turn[:2]
        offsets = camera.focal * shift[:2] - ideal * shift[2]
        squares = squares + np.einsum("...ki,...kj->...ij", rows, rows)
        right = right + np.einsum("...ki,...k->...i", rows, offsets)
    return np.linalg.solve(squares, right[..., None])[..., 0]
