"""Surfaces of a virtual part in its document."""

from __future__ import annotations

from typing import Literal

import msgspec

from ocmm_core.camera import Vector3

Area = tuple[float, float, float, float]


class _Surface(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="kind"
):
    """Common fields: name, place and direction."""

    name: str
    point: Vector3
    direction: Vector3


class PlaneEntry(_Surface, frozen=True, kw_only=True, tag="plane"):
    """A plane: a point on it and the normal out of the material.

    ``along`` is the first in-plane axis, the second is normal x along; ``areas`` are the free
    rectangles [from, from, to, to] on these axes, from ``point``, mm.
    """

    along: Vector3
    areas: list[Area]


class SphereEntry(_Surface, frozen=True, kw_only=True, tag="sphere"):
    """A ball: its centre, and the direction from stem to pole."""

    diameter: float


class BoreEntry(_Surface, frozen=True, kw_only=True, tag="bore"):
    """A bore: centre of its mouth, axis out of the material, and depth."""

    diameter: float
    depth: float


class CylinderEntry(_Surface, frozen=True, kw_only=True, tag="cylinder"):
    """A boss: centre of its foot, axis out of the material, and height."""

    diameter: float
    height: float


class ConeEntry(_Surface, frozen=True, kw_only=True, tag="cone"):
    """A truncated cone: centre of its foot, axis, both diameters and height."""

    diameter: float
    top_diameter: float
    height: float


class LineEntry(_Surface, frozen=True, kw_only=True, tag="line"):
    """A line on a face: start, direction, length and the normal of the face."""

    normal: Vector3
    length: float


class PointEntry(_Surface, frozen=True, kw_only=True, tag="point"):
    """A point on a face, and the normal of the face."""


class SlotEntry(_Surface, frozen=True, kw_only=True, tag="slot"):
    """A slot or pocket: centre of its mouth, axis out of the material, depth.

    ``along`` is its length direction; both sizes are overall.
    """

    along: Vector3
    length: float
    width: float
    depth: float
    ends: Literal["round", "square"] = "round"


class EllipseEntry(_Surface, frozen=True, kw_only=True, tag="ellipse"):
    """An elliptic bore: as a slot, with its axes as length and width."""

    along: Vector3
    length: float
    width: float
    depth: float


class TorusEntry(_Surface, frozen=True, kw_only=True, tag="torus"):
    """A ring: centre, axis on the touchable side, and both diameters."""

    diameter: float
    tube_diameter: float


class TouchedEntry(_Surface, frozen=True, kw_only=True, tag="touched"):
    """A surface with its own touch points, such as a trimmed face of a CAD model.

    ``normals`` point from the material to the ball at ``places``; ``free`` is the distance along
    them to the opposite surface, mm. Inapplicable sizes are zero: diameter (of a cone at
    ``point``), tube width of a ring, whole apex angle of a cone, whose ``direction`` leads to its
    wider end.
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

HOLES = (BoreEntry, SlotEntry, EllipseEntry)
"""Surfaces touched from inside."""


def free_width(entry: BoreEntry | SlotEntry | EllipseEntry) -> float:
    """Return the diameter of the largest ball that reaches a hole's whole wall, mm."""
    if isinstance(entry, BoreEntry):
        return entry.diameter
    if isinstance(entry, EllipseEntry):
        # Curvature is highest at the ends.
        return entry.width**2 / entry.length
    return entry.width
