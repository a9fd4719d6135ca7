"""Document of a rig plan: volume, cameras and their possible places, probe, light, attitudes.

Cameras and lenses come from a catalogue, and from files that extend it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal, TypeVar

import msgspec
import numpy as np
from numpy.typing import NDArray

from ocmm_core.calibration.probe_design import leds_behind_body, load_design, shipped_design
from ocmm_core.camera import (
    MAX_CAMERAS,
    N_PARAMETERS,
    CalibrationDesign,
    CameraModel,
    Rig,
    SpotNoise,
    Vector3,
    known_points_covariance,
)
from ocmm_core.documents import Document, load_document, load_with_text, resource, text_digest
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, RigidTransform, rotation_xyz, unit
from ocmm_core.tracking import ProbeBody, load_probe

SCHEMA = "ocmm.rig_plan/1"
_PATTERN_LENGTH_PX = 20.0

Count = Annotated[int, msgspec.Meta(ge=1, le=100)]
Angle = Annotated[float, msgspec.Meta(ge=-180.0, le=180.0)]
Tilt = Annotated[float, msgspec.Meta(ge=0.0, le=180.0)]


class Box(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Box that nothing passes: a part, a chuck, a door."""

    name: str
    min: Vector3
    max: Vector3


class CameraPlace(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Permitted box, plane or line of a camera; equal limits fix a coordinate."""

    min: Vector3
    max: Vector3
    aim: Literal["target", "free"] = "target"
    """``free``: the search also chooses a target within the volume."""


class PlannedCamera(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One camera: ids of its types, projection centre, and the point on its axis.

    Defaults: the middle of the volume, focused there, and fixed where it is.
    """

    name: str
    camera: str
    lens: str
    stop: Positive
    centre: Vector3
    target: Vector3 | None = None
    roll_deg: Angle = 0.0
    focus: Positive | None = None
    place: CameraPlace | None = None


class Attitudes(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The upright probe, turned by ``turn_deg``, then tilted to both sides about X, Y and Z.

    ``share`` of these attitudes must be measurable at a node.
    """

    tilt_deg: tuple[Tilt, Tilt, Tilt]
    turn_deg: tuple[Angle, Angle, Angle] = (0.0, 0.0, 0.0)
    share: Share = 1.0


class LedLight(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """LEDs with a light-emitting square of edge ``chip``, the longest exposure, and the filter."""

    intensity_mw_sr: Positive
    wavelength_nm: Annotated[float, msgspec.Meta(ge=300.0, le=1100.0)]
    chip: NotNegative
    exposure_us: Positive
    transmission: Share


class Measuring(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Rate, frames averaged for a point, and the largest diameter of a blurred spot."""

    rate_hz: Positive
    frames: Annotated[int, msgspec.Meta(ge=1, le=1_000_000)]
    most_blur_px: Positive = 6.0


Cameras = Annotated[tuple[PlannedCamera, ...], msgspec.Meta(min_length=2, max_length=MAX_CAMERAS)]


class RigPlanDocument(Document, frozen=True, kw_only=True):
    """Document of a rig plan; lengths in mm, files relative to it.

    ``frame``: words for a person; ``length``: length whose U is predicted; without ``light``,
    neither brightness nor photon noise is computed.
    """

    name: str
    frame: str
    probe: str
    volume_min: Vector3
    volume_max: Vector3
    nodes: tuple[Count, Count, Count]
    length: Positive
    attitudes: Attitudes
    measuring: Measuring
    calibration: CalibrationDesign
    cameras: Annotated[
        tuple[PlannedCamera, ...], msgspec.Meta(min_length=2, max_length=MAX_CAMERAS)
    ]
    catalogue: tuple[str, ...] = ()
    keep_out: tuple[Box, ...] = ()
    light: LedLight | None = None
    search_nodes: tuple[Count, Count, Count] = (3, 3, 3)


@dataclass(frozen=True, slots=True)
class RigPlan:
    """A checked plan with everything that it names."""

    path: Path
    identity: str
    document: RigPlanDocument
    probe: ProbeBody
    hidden_leds: tuple[int, ...]
    """LEDs behind the body of the probe, from 0."""
    cameras: tuple[CameraType, ...]
    lenses: tuple[LensType, ...]
    """`cameras`, `lenses`: types of each planned camera."""
    turns: Float
    """(a, 3, 3): attitudes, world from probe; the first is the upright one."""
    boxes: Float
    """(b, 2, 3), mm: corners of the keep-out boxes."""

    @property
    def volume(self) -> Float:
        """Return the corners of the volume, (2, 3), mm."""
        return np.array([self.document.volume_min, self.document.volume_max])

    @property
    def places(self) -> Float:
        """Return projection centres and targets in the document, (C, 6), mm."""
        middle = self.volume.mean(axis=0)
        return np.array([(*one.centre, *(one.target or middle)) for one in self.document.cameras])

    def nodes(self, counts: Sequence[int]) -> Float:
        """Return a grid over the volume (n, 3), mm, without nodes in keep-out boxes."""
        low, high = self.document.volume_min, self.document.volume_max
        axes = [np.linspace(low[i], high[i], counts[i]) for i in range(3)]
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        return grid[~self.inside_box(grid)]

    def inside_box(self, points: Float) -> NDArray[np.bool_]:
        """Return which points (n, 3) are inside a keep-out box."""
        low, high = self.boxes[:, 0], self.boxes[:, 1]
        within = np.all((points[:, None] > low) & (points[:, None] < high), axis=2)
        return np.asarray(np.any(within, axis=1))

    def rig(self, places: Float) -> Rig:
        """Return the rig at places (C, 6), with the uncertainty of its planned calibration.

        InputError if the calibration does not determine a camera.
        """
        cameras = tuple(self._camera(index, places[index]) for index in range(len(self.cameras)))
        covariance = np.zeros((N_PARAMETERS * len(cameras),) * 2)
        for index, camera in enumerate(cameras):
            part = slice(N_PARAMETERS * index, N_PARAMETERS * (index + 1))
            covariance[part, part] = known_points_covariance(
                self.path, camera, self.document.calibration
            )
        noise = SpotNoise(
            white_px=max(one.white_px for one in self.cameras),
            pattern_px=max(one.pattern_px for one in self.cameras),
            pattern_length_px=_PATTERN_LENGTH_PX,
        )
        return Rig(
            self.document.name, cameras, tuple(range(1, len(cameras) + 1)),
            max(1, round(self.document.measuring.rate_hz)), noise, self.volume, covariance,
            self.identity,
        )  # fmt: skip

    def describes(self, rig: Rig) -> bool:
        """Return whether a rig has the sensors of the plan, in the same order."""
        planned = [(kind.width_px, kind.height_px, kind.pitch) for kind in self.cameras]
        return rig.markers is None and planned == [
            (camera.width, camera.height, camera.pitch_mm) for camera in rig.cameras
        ]

    def _camera(self, index: int, place: Float) -> CameraModel:
        planned, kind, lens = self.document.cameras[index], self.cameras[index], self.lenses[index]
        centre, ahead = place[:3], unit(place[3:] - place[:3])
        right = unit(np.cross(ahead, np.eye(3)[1 if abs(ahead[2]) > 0.999 else 2]))
        upright = np.stack([right, np.cross(ahead, right), ahead])
        rotation = rotation_xyz(0.0, 0.0, float(np.radians(planned.roll_deg))) @ upright
        return CameraModel(
            name=planned.name, serial=index + 1, width=kind.width_px, height=kind.height_px,
            pitch_mm=kind.pitch, focal=lens.focal, aspect=1.0, u0=0.5 * (kind.width_px - 1),
            v0=0.5 * (kind.height_px - 1), k1=lens.k1, k2=lens.k2, p1=0.0, p2=0.0,
            T_camera_from_world=RigidTransform(rotation, -rotation @ centre),
        )  # fmt: skip

    def without(self, index: int) -> RigPlan:
        """Return the plan with the camera of this index gone."""
        kept = [other for other in range(len(self.cameras)) if other != index]
        cameras = tuple(self.document.cameras[other] for other in kept)
        return replace(
            self,
            document=msgspec.structs.replace(self.document, cameras=cameras),
            cameras=tuple(self.cameras[other] for other in kept),
            lenses=tuple(self.lenses[other] for other in kept),
        )


def load_rig_plan(path: Path | str) -> RigPlan:
    """Return the plan of the document at ``path`` with its probe and the types of its cameras.

    InputError if it, its probe or a catalogue is malformed, or a value contradicts another.
    """
    path = Path(path)
    document, text = load_with_text(path, RigPlanDocument, SCHEMA)
    kinds, lenses = load_catalogue([path.parent / name for name in document.catalogue])
    body = load_probe(path.parent / document.probe)
    design = shipped_design(body)
    found = RigPlan(
        path, text_digest(text), document, body,
        () if design is None else tuple(leds_behind_body(body, load_design(design, body))),
        tuple(_known(path, kinds, one.camera) for one in document.cameras),
        tuple(_known(path, lenses, one.lens) for one in document.cameras),
        attitudes_of(document.attitudes),
        np.array([(box.min, box.max) for box in document.keep_out]).reshape(-1, 2, 3),
    )  # fmt: skip
    for field, why in _contradictions(found):
        raise InputError("rig_plan.value", f"{path}: field '{field}' {why}.", "Correct that field.")
    return found


def attitudes_of(wanted: Attitudes) -> Float:
    """Return the attitudes (a, 3, 3), world from probe; the first is not tilted."""
    first = rotation_xyz(*np.radians(wanted.turn_deg))
    tilts = np.radians(wanted.tilt_deg)
    turned = [sign * tilts[axis] * np.eye(3)[axis] for axis in range(3) for sign in (1.0, -1.0)
              if tilts[axis]]  # fmt: skip
    return np.stack([first, *(rotation_xyz(*tilt) @ first for tilt in turned)])


T = TypeVar("T")


def _known(path: Path, kinds: dict[str, T], name: str) -> T:
    if name not in kinds:
        raise InputError(
            "rig_plan.unknown", f"{path}: no catalogue contains '{name}'.",
            f"Known: {', '.join(sorted(kinds))}. Others come by a file in 'catalogue'.",
        )  # fmt: skip
    return kinds[name]


def _contradictions(plan: RigPlan) -> list[tuple[str, str]]:
    """Return fields that contradict others, each with its fault."""
    document, places = plan.document, plan.places
    solid = [("volume_max", document.volume_min, document.volume_max)]
    solid += [("keep_out", box.min, box.max) for box in document.keep_out]
    wrong = [
        (field, "is not above its lower corner in every axis")
        for field, low, high in solid
        if any(b <= a for a, b in zip(low, high, strict=True))
    ]
    inside = plan.inside_box(places[:, :3])
    aims = np.linalg.norm(places[:, 3:] - places[:, :3], axis=1)
    for index, (one, lens) in enumerate(zip(document.cameras, plan.lenses, strict=True)):
        field, place = f"cameras[{index}]", one.place
        if [other.name for other in document.cameras].count(one.name) > 1:
            wrong.append((f"{field}.name", "is that of another camera"))
        if not lens.stop_min <= one.stop <= lens.stop_max:
            wrong.append((f"{field}.stop", "is not a stop of that lens"))
        if place and any(b < a for a, b in zip(place.min, place.max, strict=True)):
            wrong.append((f"{field}.place", "does not state its lower corner first"))
        if inside[index]:
            wrong.append((f"{field}.centre", "is in a keep-out box"))
        if aims[index] < 1.0:
            wrong.append((f"{field}.target", "is where the camera is"))
    if document.length > np.ptp(plan.volume, axis=0).max():
        wrong.append(("length", "is longer than the volume"))
    for field, counts in (("nodes", document.nodes), ("search_nodes", document.search_nodes)):
        if not len(plan.nodes(counts)):
            wrong.append((field, "leaves no node outside of keep-out boxes"))
    return wrong


CATALOGUE_SCHEMA = "ocmm.rig_catalogue/1"

Pixels = Annotated[int, msgspec.Meta(ge=16, le=65536)]
Positive = Annotated[float, msgspec.Meta(gt=0.0, le=1e9)]
NotNegative = Annotated[float, msgspec.Meta(ge=0.0, le=1e9)]
Share = Annotated[float, msgspec.Meta(gt=0.0, le=1.0)]
Noise = Annotated[float, msgspec.Meta(ge=0.0, le=10.0)]


class CameraType(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One camera that can be bought; lengths in mm, electrons of a pixel.

    ``white_px``: random error of a spot in one exposure apart from photon and read noise;
    ``pattern_px``: the part that stays at its place on the sensor. ``frame_bytes`` are sent for
    each exposure over a link of ``link_bytes_s``, which all cameras use if ``shared_link``.
    """

    id: str
    name: str
    width_px: Pixels
    height_px: Pixels
    pitch: Annotated[float, msgspec.Meta(gt=1e-4, le=0.1)]
    saturation_e: Positive
    read_noise_e: NotNegative
    quantum_efficiency: Share
    rate_hz: Positive
    white_px: Noise
    pattern_px: Noise
    frame_bytes: Positive
    link_bytes_s: Positive
    shared_link: bool
    source: str


class LensType(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One lens that can be bought; mm, ``k1`` and ``k2`` as in a rig document."""

    id: str
    name: str
    focal: Annotated[float, msgspec.Meta(gt=0.5, le=1000.0)]
    stop_min: Positive
    stop_max: Positive
    image_circle: Positive
    k1: float
    k2: float
    source: str


class CatalogueDocument(Document, frozen=True, kw_only=True):
    """Document of cameras and lenses."""

    cameras: tuple[CameraType, ...] = ()
    lenses: tuple[LensType, ...] = ()


def load_catalogue(more: Sequence[Path] = ()) -> tuple[dict[str, CameraType], dict[str, LensType]]:
    """Return cameras and lenses by id: the shipped ones and those of more files.

    InputError if a file is malformed, or an id is given twice.
    """
    cameras: dict[str, CameraType] = {}
    lenses: dict[str, LensType] = {}
    for path in (*sorted(resource("catalogue").glob("*.toml")), *more):
        document = load_document(path, CatalogueDocument, CATALOGUE_SCHEMA)
        for ids, known in ((document.cameras, cameras), (document.lenses, lenses)):
            twice = [one.id for one in ids if one.id in known]
            if twice or len({one.id for one in ids}) < len(ids):
                raise InputError(
                    "catalogue.duplicate",
                    f"{path}: an id is given twice: {', '.join(twice) or 'in this file'}.",
                    "Give it another id.",
                )
        cameras |= {one.id: one for one in document.cameras}
        lenses |= {one.id: one for one in document.lenses}
    return cameras, lenses
