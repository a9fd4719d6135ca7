"""The surfaces of a virtual part as its document says them."""

from __future__ import annotations

from typing import Literal

import msgspec

from ocmm_core.camera.rig import Vector3

Area = tuple[float, float, float, float]


class PlaneEntry(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="plane",
    tag_field="kind",
):  # fmt: skip
    """A plane: a point on it and the normal that leaves the material.

    ``along`` is the first axis in the plane, the second is normal x along; ``areas`` are the
    free rectangles [from, from, to, to] on these axes, from ``point``, mm.
    """

    name: str
    point: Vector3
    direction: Vector3
    along: Vector3
    areas: list[Area]


class SphereEntry(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="sphere",
    tag_field="kind",
):  # fmt: skip
    """A ball: its centre, and the direction from its stem to its pole."""

    name: str
    point: Vector3
    direction: Vector3
    diameter: float


class BoreEntry(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="bore",
    tag_field="kind",
):  # fmt: skip
    """A bore: the centre of its mouth, the axis that leaves the material, and its depth."""

    name: str
    point: Vector3
    direction: Vector3
    diameter: float
    depth: float


class CylinderEntry(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="cylinder",
    tag_field="kind",
):  # fmt: skip
    """A boss: the centre of its foot, the axis that leaves the material, and its height."""

    name: str
    point: Vector3
    direction: Vector3
    diameter: float
    height: float


class ConeEntry(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="cone",
    tag_field="kind",
):  # fmt: skip
    """A truncated cone: the centre of its foot, its axis, both diameters and its height."""

    name: str
    point: Vector3
    direction: Vector3
    diameter: float
    top_diameter: float
    height: float


class LineEntry(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="line",
    tag_field="kind",
):  # fmt: skip
    """A line on a face: its start, its direction, its length and the normal of the face."""

    name: str
    point: Vector3
    direction: Vector3
    normal: Vector3
    length: float


class PointEntry(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="point",
    tag_field="kind",
):  # fmt: skip
    """A point on a face, and the normal of the face."""

    name: str
    point: Vector3
    direction: Vector3


class SlotEntry(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="slot",
    tag_field="kind",
):  # fmt: skip
    """A slot or pocket: the centre of its mouth, the axis that leaves the material, its depth.

    ``along`` is the direction of its length; both sizes are overall.
    """

    name: str
    point: Vector3
    direction: Vector3
    along: Vector3
    length: float
    width: float
    depth: float
    ends: Literal["round", "square"] = "round"


class EllipseEntry(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="ellipse",
    tag_field="kind",
):  # fmt: skip
    """An elliptic bore: as a slot, its two axes being length and width."""

    name: str
    point: Vector3
    direction: Vector3
    along: Vector3
    length: float
    width: float
    depth: float


class TorusEntry(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="torus",
    tag_field="kind",
):  # fmt: skip
    """A ring: its centre, the axis whose side can be touched, and both its diameters."""

    name: str
    point: Vector3
    direction: Vector3
    diameter: float
    tube_diameter: float


Artefact = (
    PlaneEntry
    | SphereEntry
    | BoreEntry
    | CylinderEntry
    | ConeEntry
    | LineEntry
    | PointEntry
    | SlotEntry
    | EllipseEntry
    | TorusEntry
)
"""One surface of a part, in the part frame."""

HOLES = (BoreEntry, SlotEntry, EllipseEntry)
"""Surfaces that are touched from inside."""


def free_width(entry: BoreEntry | SlotEntry | EllipseEntry) -> float:
    """Return the diameter of the greatest ball that reaches all of a hole's wall, mm."""
    if isinstance(entry, BoreEntry):
        return entry.diameter
    if isinstance(entry, EllipseEntry):
        # Its ends are bent the most.
        return entry.width**2 / entry.length
    return entry.width
