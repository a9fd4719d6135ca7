"""Test parts with known truth, their documents, and the true state of the virtual rig.

A part document defines the part's pose in the world and its true surfaces in the part frame.
Measuring code never reads it or the true state, only the plan.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.camera import CameraModel, Vector3
from ocmm_core.documents import Document, load_with_text, text_digest
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, Int, RigidTransform, rotation_from_vector, unit
from ocmm_sim.scene import _surfaces as surfaces
from ocmm_sim.scene._surfaces import Artefact, ConeEntry, EllipseEntry, TorusEntry, TouchedEntry

SCHEMA = "ocmm.part/1"


class PartPose(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Pose of the part: motion from the part frame to the world, mm and rad."""

    translation: Vector3
    rotation_vector: Vector3

    def motion(self) -> RigidTransform:
        return RigidTransform(
            rotation_from_vector(np.array(self.rotation_vector)), np.array(self.translation)
        )


class PartDocument(Document, frozen=True, kw_only=True):
    """Document of a part; lengths in mm, part frame.

    ``reference`` is the pose of an attached reference body: part from reference frame.
    """

    name: str
    pose: PartPose
    features: list[Artefact]
    reference: PartPose | None = None


@dataclass(frozen=True, slots=True)
class TrueFeature:
    """True geometry of a surface."""

    name: str
    kind: str
    """``"plane"``, ``"sphere"``, ``"bore"``, ``"cylinder"``, ``"cone"``, ``"line"``, ``"point"``,
    ``"slot"``, ``"ellipse"``, ``"torus"`` or ``"touched"``; a bore is a circle in plans."""
    point: Float
    """(3,), mm: centre (sphere, torus, mouth of a hole, foot of cylinder and cone) or a point on
    it."""
    direction: Float
    """(3,), unit: normal, axis or direction of the line."""
    diameter: float
    """mm; zero if inapplicable; of the foot of a cone, of the centre line of a torus."""
    along: Float
    """(3,), unit: length direction of slot and ellipse, otherwise zero."""
    length: float = 0.0
    width: float = 0.0
    """`length`, `width`: mm, overall, of slot and ellipse; width of a torus: tube diameter."""
    half_angle: float = 0.0
    """rad: of a cone, whose radius falls along its direction."""


@dataclass(frozen=True, slots=True)
class Part:
    """A part with known truth."""

    name: str
    T_world_from_part: RigidTransform
    artefacts: tuple[Artefact, ...]
    identity: str
    T_part_from_reference: RigidTransform | None = None
    """Pose of a reference body; None without a place for one."""

    def artefact(self, name: str) -> Artefact:
        """Return the surface with this name; raise InputError if absent."""
        for entry in self.artefacts:
            if entry.name == name:
                return entry
        names = ", ".join(entry.name for entry in self.artefacts)
        raise InputError(
            "part.feature",
            f"The part '{self.name}' has no feature '{name}'.",
            f"Use a plan for this part; its features are {names}.",
        )

    def features_part(self) -> dict[str, TrueFeature]:
        """Return the true features by name, part frame."""
        return {entry.name: _true_feature(entry) for entry in self.artefacts}

    def features_world(self) -> dict[str, TrueFeature]:
        """Return the true features by name, world frame."""
        pose = self.T_world_from_part
        return {
            name: replace(
                feature,
                point=pose.apply(feature.point),
                direction=pose.rotation @ feature.direction,
                along=pose.rotation @ feature.along,
            )
            for name, feature in self.features_part().items()
        }


def load_part(path: Path | str) -> Part:
    """Return the part of a document; raise InputError if it is invalid."""
    document, text = load_with_text(path, PartDocument, SCHEMA)
    _check(Path(path), document)
    return Part(
        name=document.name,
        T_world_from_part=document.pose.motion(),
        artefacts=tuple(document.features),
        identity=text_digest(text),
        T_part_from_reference=document.reference.motion() if document.reference else None,
    )


def _true_feature(entry: Artefact) -> TrueFeature:
    feature = TrueFeature(
        name=entry.name,
        kind=str(entry.__struct_config__.tag),
        point=np.array(entry.point),
        direction=unit(np.array(entry.direction)),
        diameter=entry.diameter if isinstance(entry, _ROUND) else 0.0,
        along=np.zeros(3),
    )
    if isinstance(entry, surfaces.SlotEntry | EllipseEntry):
        along = unit(np.array(entry.along))
        return replace(feature, along=along, length=entry.length, width=entry.width)
    if isinstance(entry, TorusEntry):
        return replace(feature, width=entry.tube_diameter)
    if isinstance(entry, TouchedEntry):
        # Here the radius of a cone falls along its direction.
        sense = -1.0 if entry.apex_deg else 1.0
        return replace(
            feature,
            direction=sense * feature.direction,
            diameter=entry.true_diameter,
            width=entry.true_width,
            half_angle=float(np.radians(0.5 * entry.apex_deg)),
        )
    if isinstance(entry, ConeEntry):
        taper = np.arctan2(entry.diameter - entry.top_diameter, 2.0 * entry.height)
        return replace(feature, half_angle=float(taper))
    return feature


_ROUND = (surfaces.SphereEntry, surfaces.BoreEntry, surfaces.CylinderEntry, ConeEntry, TorusEntry)


_LENGTHS = (
    "diameter", "top_diameter", "tube_diameter", "depth", "height", "length", "width", "free",
)  # fmt: skip


def _check(path: Path, document: PartDocument) -> None:
    if not document.features:
        raise _error(path, "features", "is empty", "Give the part at least one feature.")
    names: set[str] = set()
    for index, entry in enumerate(document.features):
        at = f"features[{index}]"
        if entry.name in names:
            raise _error(
                path, f"{at}.name", f"repeats the name '{entry.name}'", "Name each feature once."
            )
        names.add(entry.name)
        for field, fault, remedy in _faults(entry):
            raise _error(path, f"{at}.{field}", fault, remedy)


def _faults(entry: Artefact) -> Iterator[tuple[str, str, str]]:
    """Yield field, fault and remedy of each wrong value of a surface."""
    for field in _LENGTHS:
        value = getattr(entry, field, 1.0)
        if value <= 0.0:
            yield field, f"is {value}", "Give a length greater than zero."
    for field in ("direction", "along", "normal"):
        if np.linalg.norm(getattr(entry, field, (0.0, 0.0, 1.0))) < 1e-9:
            yield field, "is a zero vector", "Give a direction."
    square = "is not perpendicular to 'direction'"
    if isinstance(entry, surfaces.PlaneEntry):
        if _skewness(entry.direction, entry.along) > 1e-9:
            yield "along", square, "Give an axis that lies in the plane."
        if not entry.areas:
            yield "areas", "is empty", "Give a rectangle that is free to touch."
        for number, (u0, v0, u1, v1) in enumerate(entry.areas):
            if u1 <= u0 or v1 <= v0:
                fault = f"is {[u0, v0, u1, v1]}, which encloses no area"
                yield f"areas[{number}]", fault, "Give the lower corner first, then the upper one."
    if isinstance(entry, TouchedEntry):
        if not entry.places or len(entry.places) != len(entry.normals):
            fault = f"has {len(entry.places)} places, and 'normals' has {len(entry.normals)}"
            yield "places", fault, "Give each place its normal, and one at least."
        if min(np.linalg.norm(entry.normals, axis=1)) < 1e-9:
            yield "normals", "holds a zero vector", "Give a direction."
    smaller = "is not smaller than 'diameter'"
    if isinstance(entry, TorusEntry) and entry.tube_diameter >= entry.diameter:
        remedy = "Give the diameter of the centre line, and that of the tube around it."
        yield "tube_diameter", smaller, remedy
    if isinstance(entry, surfaces.SlotEntry | EllipseEntry):
        if entry.width >= entry.length:
            yield "width", "is not smaller than 'length'", "Give the longer one as length."
        if _skewness(entry.direction, entry.along) > 1e-9:
            yield "along", square, "Give the direction of the length, square to the axis."
    if isinstance(entry, surfaces.LineEntry) and _skewness(entry.direction, entry.normal) > 1e-9:
        yield "normal", square, "Give the normal of the face that the line lies in."
    if isinstance(entry, ConeEntry) and entry.top_diameter >= entry.diameter:
        yield "top_diameter", smaller, "Give the cone with its wide end at 'point'."


def _skewness(first: Vector3, second: Vector3) -> float:
    """Return the cosine of the angle between two directions."""
    return abs(float(unit(np.array(first)) @ unit(np.array(second))))


def _error(path: Path, field: str, fault: str, remedy: str) -> InputError:
    return InputError("part.field", f"{path}: field '{field}' {fault}.", remedy)


@dataclass(frozen=True, slots=True)
class TrueTouch:
    """True course of one touch."""

    feature: str
    contact_s: float
    """Bus time of the first contact, s."""
    first_frame: int
    last_frame: int
    surface_world: Float
    """(3,), mm: the point that is touched."""
    normal_world: Float
    """(3,), unit: from the material towards the ball."""
    tip_world: Float
    """(3,), mm: ball centre at rest."""


@dataclass(frozen=True, slots=True)
class Truth:
    """True geometry and touches."""

    cameras: tuple[CameraModel, ...]
    leds_probe: Float
    tip_probe: Float
    """`leds_probe`, `tip_probe`: (L, 3) and (3,), mm, probe frame."""
    tip_radius: float
    """mm."""
    slots: Int
    """(C, L): slot of each LED in each camera."""
    T_world_from_part: RigidTransform
    features_part: dict[str, TrueFeature]
    features_world: dict[str, TrueFeature]
    touches: tuple[TrueTouch, ...]
    """In script order; world before any nudge."""
    leds_reference: Float
    reference_slots: Int
    """`leds_reference`, `reference_slots`: (R, 3), mm, reference frame, (C, R); empty without."""
    T_world_from_reference: RigidTransform | None
    """Before any nudge; None without a reference body."""
