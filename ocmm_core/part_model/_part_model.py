"""The nominal part as a CAD model has it: trimmed faces, their mesh and their edges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ocmm_core.geometry import Float, RigidTransform

Triangles: TypeAlias = NDArray[np.int32]
"""Array (n, 3): rows of vertices, counter-clockwise seen from outside the material."""

NO_COLOUR = ""


@dataclass(frozen=True, slots=True, eq=False)
class SplineSurface:
    """A surface as a tensor product of rational B-splines."""

    poles: Float
    """(nu, nv, 3), mm, model frame."""
    weights: Float
    """(nu, nv)."""
    knots_u: Float
    knots_v: Float
    """`knots_u`, `knots_v`: With repetitions, (nu + degree_u + 1,) and (nv + degree_v + 1,);
    clamped at both ends, a periodic surface is unrolled."""
    degree_u: int
    degree_v: int
    """`degree_u`, `degree_v`: Of the polynomials."""


@dataclass(frozen=True, slots=True, eq=False)
class ModelFace:
    """One face of the model."""

    number: int
    """From 1, in the order of the file: how sentences name it."""
    kind: str
    """Plane, Cylinder, Cone, Sphere, Torus, BSplineSurface and so on: the word of the kernel that
    read it."""
    name: str = ""
    layer: str = ""
    colour: str = NO_COLOUR
    """`name`, `layer`, `colour`: As the model has them; empty where it says nothing. ``colour`` is
    ``#rrggbb``."""
    spline: SplineSurface | None = None
    """The surface, for any kind, exactly; the normal du x dv leaves the material where ``outward``
    is true. None where the file held no surface."""
    outward: bool = True
    loops: tuple[Float, ...] = ()
    """Trimming outline and holes, each (n, 2), closed polygons in the parameters (u, v) of
    ``spline``; material lies where a ray crosses them an odd time."""
    feature: str = ""
    """Name that the import gave to the feature which this face belongs to; empty for none."""


@dataclass(frozen=True, slots=True, eq=False)
class PartModel:
    """The nominal part in the frame of its model; lengths in mm whatever the file's unit was."""

    source_name: str
    source_sha256: str
    """`source_name`, `source_sha256`: File that it was read from, without its folder, and the hash
    of its bytes, 64 hex digits."""
    vertices: Float
    """(n, 3), mm."""
    normals: Float
    """(n, 3), unit, out of the material; vertices on an edge are there once for each face."""
    triangles: Triangles
    """(m, 3), see `Triangles`."""
    triangle_faces: NDArray[np.int32]
    """(m,): the place in ``faces`` of the face that a triangle belongs to."""
    faces: tuple[ModelFace, ...]
    """In the order of the file."""
    edge_points: Float
    """(k, 3), mm: lines along the edges of all faces, one after another."""
    edge_starts: NDArray[np.int32]
    """(e + 1,): where each line begins in ``edge_points``, and at last their number."""
    edge_faces: NDArray[np.int32]
    """(e, 2): the places in ``faces`` on both sides of an edge; -1 where there is none."""
    deflection_mm: float
    """No triangle and no stretch of an edge is further from its face than this."""

    @property
    def box(self) -> Float:
        """Return the least and the greatest coordinates, (2, 3), mm."""
        corners: Float = np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])
        return corners


@dataclass(frozen=True, slots=True, eq=False)
class PlacedPart:
    """The nominal part where it is thought to be."""

    model: PartModel
    """In its own frame, which is that of the nominals of the plan."""
    T_world_from_model: RigidTransform
    """Where it is."""
    is_rough: bool
    """Nothing that was measured tells where the part is, or not all that the alignment of the plan
    needs: whatever shows the part says so."""
