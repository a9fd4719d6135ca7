"""Alignment rules: every kind of alignment, as in a document (``docs/quality/alignment.md``).

`BoundAlignment` adds the nominal geometry of the named features, for computation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

import msgspec

from ocmm_core.camera import Vector3
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float
from ocmm_core.part_model import NominalFace

AxisName = Literal["x", "y", "z", "-x", "-y", "-z"]
LockedMotion = Literal["x", "y", "z", "rx", "ry", "rz"]

OLDEST = "3-2-1"
"""Default kind of an alignment without a type, as in the first plans."""


class _Rule(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="type"
):
    """Common base with the field ``type``."""


class DatumAlignment(_Rule, frozen=True, kw_only=True, tag=OLDEST):
    """The part frame from measured features (3-2-1)."""

    primary: str
    """Plane with its normal, or line or axis with its direction, as z axis of the part frame."""
    secondary: tuple[str, ...]
    """Source of the x axis, projected along z: two features with centres, x points from the first
    to the second; or one line, axis or plane, x along it or its normal."""
    origin: str
    """Feature whose centre is the origin, projected onto the primary and a single secondary."""
    towards: str = ""
    """For x along an axis: a feature at its positive side; else the nominals give the sense."""
    primary_axis: AxisName = "z"
    secondary_axis: AxisName = "x"
    """`primary_axis`, `secondary_axis`: Resulting axes of the part frame, if not z and x."""

    @property
    def features(self) -> tuple[str, ...]:
        """Return the names of the datum features, each once."""
        names = (self.primary, *self.secondary, self.origin, self.towards)
        return tuple(dict.fromkeys(name for name in names if name))


class PlaneAxisPoint(_Rule, frozen=True, kw_only=True, tag="plane-axis-point"):
    """A plane first, then an axis, then a point, each brought to its nominal place."""

    plane: str
    axis: str
    point: str
    """`plane`, `axis`, `point`: Names; the axis may be perpendicular or parallel to the plane."""

    @property
    def features(self) -> tuple[str, ...]:
        return (self.plane, self.axis, self.point)


class DatumReferenceFrame(_Rule, frozen=True, kw_only=True, tag="datum reference frame"):
    """Datums in their precedence (ISO 5459), each brought to its nominal place."""

    datums: tuple[str, ...]
    """One to three names, primary first."""

    @property
    def features(self) -> tuple[str, ...]:
        return self.datums


class BestFit(_Rule, frozen=True, kw_only=True, tag="best fit"):
    """The motion that brings centres and points nearest to their nominal places."""

    points: tuple[str, ...]
    """Names of at least three features with centres."""
    weights: tuple[float, ...] = ()
    """Of their squared distances, in the same order; empty: one for each."""
    locked: tuple[LockedMotion, ...] = ()
    """Motions of the part frame fixed by ``start``."""
    start: (
        DatumAlignment | PlaneAxisPoint | DatumReferenceFrame | SavedFrame | Relocation | None
    ) = None
    """Preceding alignment; required for locked motions."""

    @property
    def features(self) -> tuple[str, ...]:
        """Return the names of all features involved, each once."""
        first = () if self.start is None else self.start.features
        return tuple(dict.fromkeys((*first, *self.points)))


class ModelBestFit(_Rule, frozen=True, kw_only=True, tag="best fit to model"):
    """Motion of touches nearest to faces of the model, from the best fit to nominal places."""

    points: tuple[str, ...]
    """Names of single points on these faces, at least seven."""
    faces: tuple[NominalFace, ...]
    """Of the model; every ball is compared with the nearest of them."""

    @property
    def features(self) -> tuple[str, ...]:
        return self.points


class Condition(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One of the six conditions of reference points."""

    feature: str
    """Name of a feature with a centre or of a point."""
    direction: Vector3
    """(3,), part frame: the feature is exactly at its nominal place in this direction."""


class ReferencePoints(_Rule, frozen=True, kw_only=True, tag="rps"):
    """Reference points (RPS): six exact conditions on directions."""

    conditions: tuple[Condition, ...]
    """Six."""
    start: (
        DatumAlignment | PlaneAxisPoint | DatumReferenceFrame | SavedFrame | Relocation | None
    ) = None
    """Preceding alignment; None: best fit of all points, conditions on three or more features."""

    @property
    def features(self) -> tuple[str, ...]:
        """Return the names of all features involved, each once."""
        first = () if self.start is None else self.start.features
        return tuple(dict.fromkeys((*first, *(item.feature for item in self.conditions))))


class SavedFrame(_Rule, frozen=True, kw_only=True, tag="saved frame"):
    """A stored frame (`alignment.frame_document`), kept in the plan: a job needs no other file."""

    name: str
    digest: str
    """`name`, `digest`: Name of the frame, and SHA-256 of its document."""
    rotation: tuple[Vector3, Vector3, Vector3]
    """Rows of the rotation from the world to the frame."""
    translation: Vector3
    """mm, frame."""
    covariance: tuple[tuple[float, ...], ...] = ()
    """6 x 6: small rotation, rad, about the frame's axes, shift, mm; empty: nothing is proven."""
    simulated: bool = False
    """Measured on a virtual rig: nothing is proven in it about a real part."""

    @property
    def features(self) -> tuple[str, ...]:
        """Return nothing: no feature of the job is involved."""
        return ()


class ControlPoint(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A point of the part measured before it was moved; ``place`` is in the frame, mm."""

    feature: str
    place: Vector3


class Relocation(_Rule, frozen=True, kw_only=True, tag="relocation"):
    """The previous frame, recovered from control points after the part was moved."""

    name: str
    digest: str
    """`name`, `digest`: Name of the frame of the control points, and SHA-256 of its document."""
    control: tuple[ControlPoint, ...]
    """At least three, not collinear."""
    limit: float = 0.1
    """mm: a control point farther off after the best fit moved or is wrong: no frame."""
    simulated: bool = False
    """Measured on a virtual rig: nothing is proven in it about a real part."""

    @property
    def features(self) -> tuple[str, ...]:
        return tuple(item.feature for item in self.control)


Alignment: TypeAlias = (
    DatumAlignment
    | PlaneAxisPoint
    | DatumReferenceFrame
    | BestFit
    | ModelBestFit
    | ReferencePoints
    | SavedFrame
    | Relocation
)
"""All kinds; the plan's field ``type`` selects one."""


def simulated_frame(rule: Alignment | None) -> str:
    """Return the name of a rule's saved frame from a virtual rig, or empty text."""
    start = getattr(rule, "start", None)
    for item in (rule, start):
        if isinstance(item, SavedFrame | Relocation) and item.simulated:
            return item.name
    return ""


@dataclass(frozen=True, slots=True)
class BoundAlignment:
    """A rule with the nominals of all its features, probed and constructed."""

    rule: Alignment
    shapes: Mapping[str, Shape]
    nominals: Mapping[str, Float]
    """Geometry vectors (12,), mm, part frame, by name; unknown ones are missing."""
    choice: int | None = None
    """Sense of axes without one, once determined (`alignment.datums.settled`)."""

    @property
    def features(self) -> tuple[str, ...]:
        """Return the names of the features involved, each once."""
        return self.rule.features

    @property
    def frame(self) -> str:
        """Return the name of the results' frame, for reports."""
        return frame_name(self.rule)


AnyAlignment: TypeAlias = Alignment | BoundAlignment
"""Input of `alignment.datums.frame_of`; a rule alone if it needs no nominals."""


def frame_name(rule: Alignment) -> str:
    """Return the name of the results' frame, for reports."""
    match rule:
        case DatumAlignment():
            if len(rule.secondary) == 2:
                begin, end = rule.secondary
                return f"part frame 3-2-1 of {rule.primary}|{begin} to {end}|{rule.origin}"
            return f"part frame 3-2-1 of {rule.primary}|{rule.secondary[0]}|{rule.origin}"
        case PlaneAxisPoint() | DatumReferenceFrame():
            return f"part frame of {'|'.join(rule.features)}"
        case BestFit():
            return f"part frame, best fit of {len(rule.points)} points"
        case ModelBestFit():
            count = len(rule.faces)
            faces = "face" if count == 1 else "faces"
            return f"part frame, best fit of {len(rule.points)} points to {count} {faces}"
        case ReferencePoints():
            count = len({item.feature for item in rule.conditions})
            return f"part frame of {count} reference points (RPS)"
        case SavedFrame():
            return f"saved frame {rule.name}"
        case Relocation():
            return f"frame {rule.name}, relocated at {len(rule.control)} control points"
