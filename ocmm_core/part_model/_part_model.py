"""Nominal part of a CAD model: trimmed faces, mesh and edges, and its placement in the volume."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

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
        corners: Float = np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])
        return corners


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
