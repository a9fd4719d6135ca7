"""The surfaces of a virtual part as its document says them."""

from __future__ import annotations

from typing import Literal

import msgspec

from ocmm_core.camera import Vector3

Area = tuple[float, float, float, float]


class _Surface(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="kind"
):
    """What all of them have: a name, a place, and a direction."""

    name: str
    point: Vector3
    direction: Vector3


class PlaneEntry(_Surface, frozen=True, kw_only=True, tag="plane"):
    """A plane: a point on it and the normal that leaves the material.

    ``along`` is the first axis in the plane, the second is normal x along; ``areas`` are the
    free rectangles [from, from, to, to] on these axes, from ``point``, mm.
    """

    along: Vector3
    areas: list[Area]


class SphereEntry(_Surface, frozen=True, kw_only=True, tag="sphere"):
    """A ball: its centre, and the direction from its stem to its pole."""

    diameter: float


class BoreEntry(_Surface, frozen=True, kw_only=True, tag="bore"):
    """A bore: the centre of its mouth, the axis that leaves the material, and its depth."""

    diameter: float
    depth: float


class CylinderEntry(_Surface, frozen=True, kw_only=True, tag="cylinder"):
    """A boss: the centre of its foot, the axis that leaves the material, and its height."""

    diameter: float
    height: float


class ConeEntry(_Surface, frozen=True, kw_only=True, tag="cone"):
    """A truncated cone: the centre of its foot, its axis, both diameters and its height."""

    diameter: float
    top_diameter: float
    height: float


class LineEntry(_Surface, frozen=True, kw_only=True, tag="line"):
    """A line on a face: its start, its direction, its length and the normal of the face."""

    normal: Vector3
    length: float


class PointEntry(_Surface, frozen=True, kw_only=True, tag="point"):
    """A point on a face, and the normal of the face."""


class SlotEntry(_Surface, frozen=True, kw_only=True, tag="slot"):
    """A slot or pocket: the centre of its mouth, the axis that leaves the material, its depth.

    ``along`` is the direction of its length; both sizes are overall.
    """

    along: Vector3
    length: float
    width: float
    depth: float
    ends: Literal["round", "square"] = "round"


class EllipseEntry(_Surface, frozen=True, kw_only=True, tag="ellipse"):
    """An elliptic bore: as a slot, its two axes being length and width."""

    along: Vector3
    length: float
    width: float
    depth: float


class TorusEntry(_Surface, frozen=True, kw_only=True, tag="torus"):
    """A ring: its centre, the axis whose side can be touched, and both its diameters."""

    diameter: float
    tube_diameter: float


class TouchedEntry(_Surface, frozen=True, kw_only=True, tag="touched"):
    """A surface that is touched at places of its own, such as a trimmed face of a CAD model.

    ``normals`` are those from the material towards the ball at ``places``; ``free`` is how far a
    ball of no size can go along them before it meets the surface again, mm. What is no size of the
    shape is zero: diameter (of a cone at ``point``), width of the tube of a ring, whole apex angle
    of a cone, whose ``direction`` leads to its wider end.
    """

    places: list[Vector3]
    normals: list[Vector3]
    free: float
    true_diameter: float = 0.0
    true_width: float = 0.0
    apex_deg: float = 0.0


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
    | TouchedEntry
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
