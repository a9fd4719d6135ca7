"""Nominal part of a CAD model: trimmed faces, mesh, edges, placement, and its consistency."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector, unit

Triangles: TypeAlias = NDArray[np.int32]
"""Array (n, 3): vertex indices, counter-clockwise seen from outside the material."""

NO_COLOUR = ""


@dataclass(frozen=True, slots=True, eq=False)
class SplineSurface:
    """Surface as a tensor product of rational B-splines."""

    poles: Float
    """(nu, nv, 3), mm, model frame."""
    weights: Float
    """(nu, nv)."""
    knots_u: Float
    knots_v: Float
    """With repetitions, (nu + degree_u + 1,) and (nv + degree_v + 1,); clamped at both ends, a
    periodic surface is unrolled."""
    degree_u: int
    degree_v: int


@dataclass(frozen=True, slots=True, eq=False)
class ModelFace:
    number: int
    """From 1, in the order of the file; used in messages."""
    kind: str
    """Word of the CAD kernel: Plane, Cylinder, Cone, Sphere, Torus, BSplineSurface and so on."""
    name: str = ""
    layer: str = ""
    colour: str = NO_COLOUR
    """From the model; empty if unknown. ``colour`` is ``#rrggbb``."""
    spline: SplineSurface | None = None
    """Exact surface of any kind; du x dv leaves the material if ``outward``. None without one."""
    outward: bool = True
    loops: tuple[Float, ...] = ()
    """Trimming outline and holes, each (n, 2), closed polygons in the parameters (u, v) of
    ``spline``; material lies where a ray crosses them an odd number of times."""
    feature: str = ""
    """Name of the imported feature of this face; empty for none."""


@dataclass(frozen=True, slots=True, eq=False)
class PartModel:
    """Nominal part in the frame of its model; lengths in mm for any unit of the file."""

    source_name: str
    source_sha256: str
    """Name of the source file without its folder, and the hash of its bytes, 64 hex digits."""
    vertices: Float
    """(n, 3), mm."""
    normals: Float
    """(n, 3), unit, out of the material; vertices on an edge are there once for each face."""
    triangles: Triangles
    """(m, 3), see `Triangles`."""
    triangle_faces: NDArray[np.int32]
    """(m,): index in ``faces`` of the face of a triangle."""
    faces: tuple[ModelFace, ...]
    """In the order of the file."""
    edge_points: Float
    """(k, 3), mm: lines along the edges of all faces, one after another."""
    edge_starts: NDArray[np.int32]
    """(e + 1,): start of each line in ``edge_points``, and at last their number."""
    edge_faces: NDArray[np.int32]
    """(e, 2): indices in ``faces`` of both sides of an edge; -1 if missing."""
    deflection_mm: float
    """Maximum distance of triangles and edge segments from their face."""

    @property
    def box(self) -> Float:
        """Return the minimum and the maximum coordinates, (2, 3), mm."""
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])


@dataclass(frozen=True, slots=True, eq=False)
class PlacedPart:
    """Nominal part at its assumed position."""

    model: PartModel
    """In its own frame, which is that of the nominals of the plan."""
    T_world_from_model: RigidTransform
    is_rough: bool
    """Not measured, or not completely as the alignment needs it; displays must say so."""


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """Placement of a part before the cameras."""

    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    """(3,): direction of the model that points up."""
    turn_deg: float = 0.0
    """Rotation about the vertical, applied after ``up``."""
    offset_world: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """(3,), mm: of the middle of the part from that of the volume."""

    def pose(self, middle_part: Float, middle_world: Float) -> RigidTransform:
        """Return world from part, for the middles (3,), mm, of the part and of the volume."""
        up = unit(np.array(self.up))
        axis = np.cross(up, [0.0, 0.0, 1.0])
        size = float(np.linalg.norm(axis))
        angle = float(np.arctan2(size, up[2]))
        axis = axis / size if size > 1e-12 else np.array([1.0, 0.0, 0.0])
        turn = rotation_from_vector(np.array([0.0, 0.0, np.radians(self.turn_deg)]))
        rotation = turn @ rotation_from_vector(angle * axis)
        return RigidTransform(
            rotation, middle_world + np.array(self.offset_world) - rotation @ middle_part
        )


MOST_TRIANGLES = 400_000
MOST_FACES = 50_000
_MOST_DEGREE = 25
"""Limit of the kernels of CAD systems."""
FARTHEST_MM = 1e6
"""Largest coordinate of a part."""
_LONGEST_NAME = 255
_COLOUR = re.compile(r"(#[0-9a-f]{6})?")
_HASH = re.compile(r"[0-9a-f]{64}")
_NO_NAME = re.compile(r"[\x00-\x1f\x7f/\\]")
_OUTSIDE = 1e-3
"""Part of the range of parameters by which an outline may leave it."""


def check_model(model: PartModel, where: str) -> None:
    """Raise InputError, which names ``where``, for an inconsistent model."""
    why = _why_not(model)
    if why:
        raise InputError(
            "part_model.damaged",
            f"{where}: the part in it cannot be used: {why}.",
            "Import the CAD model again, or restore the file from a good copy.",
        )


def _why_not(model: PartModel) -> str:
    name = model.source_name
    if not name or len(name) > _LONGEST_NAME or _NO_NAME.search(name):
        return "the name of its source is none"
    if not _HASH.fullmatch(model.source_sha256):
        return "the hash of its source is none"
    if not 0.0 < model.deflection_mm < FARTHEST_MM:
        return "its deflection is no size"
    if not 0 < len(model.faces) <= MOST_FACES:
        return f"it has {len(model.faces)} faces, and can have 1 to {MOST_FACES}"
    if not 0 < len(model.triangles) <= MOST_TRIANGLES:
        return f"it has {len(model.triangles)} triangles, and can have 1 to {MOST_TRIANGLES}"
    why = _why_no_mesh(model) or _why_no_edges(model)
    if why:
        return why
    for face in model.faces:
        why = _why_no_face(face)
        if why:
            return f"face {face.number}: {why}"
    return ""


def _why_no_mesh(model: PartModel) -> str:
    count = len(model.vertices)
    if model.vertices.shape != (count, 3) or not _are_places(model.vertices):
        return "a vertex lies nowhere"
    if model.normals.shape != (count, 3):
        return "not every vertex has a normal"
    with np.errstate(over="ignore", invalid="ignore"):
        if not (np.abs(np.linalg.norm(model.normals, axis=1) - 1.0) < 1e-3).all():
            return "a normal has no direction"
    if model.triangles.shape != (len(model.triangles), 3) or not _within(
        model.triangles, 0, count - 1
    ):
        return "a triangle has no such vertex"
    if model.triangle_faces.shape != (len(model.triangles),) or not _within(
        model.triangle_faces, 0, len(model.faces) - 1
    ):
        return "a triangle has no such face"
    return ""


def _why_no_edges(model: PartModel) -> str:
    points, starts, sides = model.edge_points, model.edge_starts, model.edge_faces
    if points.shape != (len(points), 3) or not _are_places(points):
        return "an edge lies nowhere"
    if sides.shape != (len(sides), 2) or not _within(sides, -1, len(model.faces) - 1):
        return "an edge has no such face"
    if starts.shape != (len(sides) + 1,) or starts[0] != 0 or starts[-1] != len(points):
        return "its edges do not begin and end where they should"
    return "an edge has no two points" if not (np.diff(starts) >= 2).all() else ""


def _why_no_face(face: ModelFace) -> str:
    words = (face.kind, face.name, face.layer, face.feature)
    if face.number < 1 or not face.kind or any(len(word) > _LONGEST_NAME for word in words):
        return "its number, kind or name cannot be"
    if not _COLOUR.fullmatch(face.colour):
        return "its colour is none"
    if face.spline is None:
        return "it has an outline and no surface" if face.loops else ""
    why = _why_no_spline(face.spline)
    if why:
        return why
    low = np.array([face.spline.knots_u[0], face.spline.knots_v[0]])
    high = np.array([face.spline.knots_u[-1], face.spline.knots_v[-1]])
    spare = _OUTSIDE * (high - low) + 1e-9
    for loop in face.loops:
        if loop.ndim != 2 or loop.shape[1] != 2 or len(loop) < 3:
            return "an outline is no polygon"
        if not ((loop >= low - spare) & (loop <= high + spare)).all():
            return "an outline leaves its surface"
    return ""


def _why_no_spline(spline: SplineSurface) -> str:
    shape = spline.weights.shape
    if len(shape) != 2 or spline.poles.shape != (*shape, 3) or not _are_places(spline.poles):
        return "its surface lies nowhere"
    weights = spline.weights
    if not (np.isfinite(weights) & (weights > 1e-9) & (weights < 1e9)).all():
        return "a weight of its surface is not positive"
    for count, degree, knots in (
        (shape[0], spline.degree_u, spline.knots_u),
        (shape[1], spline.degree_v, spline.knots_v),
    ):
        if not 1 <= degree <= _MOST_DEGREE or count <= degree:
            return "its surface has no such degree"
        if knots.shape != (count + degree + 1,) or not _are_knots(knots, degree):
            return "the knots of its surface do not rise from end to end"
    return ""


def _are_knots(knots: Float, degree: int) -> bool:
    """Return whether knots rise, are clamped at both ends and keep the surface continuous."""
    if not np.isfinite(knots).all() or not (np.abs(knots) <= 1e15).all():
        return False
    length = knots[-1] - knots[0]
    if length <= 0.0 or (np.diff(knots) < 0.0).any():
        return False
    if (knots[: degree + 1] != knots[0]).any() or (knots[-degree - 1 :] != knots[-1]).any():
        return False
    # An inner knot is repeated at most ``degree`` times.
    inner = knots[1:-1]
    return len(inner) <= degree or bool((inner[degree:] > inner[:-degree]).all())


def _are_places(points: Float) -> bool:
    return bool((np.abs(points) <= FARTHEST_MM).all())


def _within(numbers: NDArray[Any], low: int, high: int) -> bool:
    return not numbers.size or bool(numbers.min() >= low and numbers.max() <= high)
