"""Triangles of all faces of a model, to find what a probe would run into; needs OCP."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ocmm_core.geometry import Float
from ocmm_core.inspection.step._library import explored, static

DEFLECTION_MM = 0.04
_BEND_RAD = 0.35
_LARGE, _MANY_HOLES = 1500, 50
_COARSER_MM, _COARSER_RAD = 0.1, 0.5
"""Of so many faces: the same mesh is that of the picture."""
_VERY_LARGE, _COARSEST_RAD = 3000, 0.8
_LARGE_MM, _LARGE_PART = 800.0, 5e-5
"""A part longer than this gets a coarser mesh, by this part of its length."""


@dataclass(frozen=True, slots=True, eq=False)
class RawMesh:
    """Triangles of one face.

    Attributes
    ----------
    nodes
        (n, 3), mm, where the face has its place.
    rows
        (m, 3): nodes of each triangle, from 0, in the sense of the surface.
    """

    nodes: Float
    rows: NDArray[np.int64]


def make_mesh(shape: Any, faces: Sequence[Any]) -> float:
    """Give all faces of a model a mesh to find targets by; return its deflection, mm.

    Parameters
    ----------
    shape
        The model.
    faces
        Its faces with a surface.
    """
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.IMeshTools import IMeshTools_MeshAlgoType_Delabella

    box = Bnd_Box()
    static(BRepBndLib, "Add")(shape, box)
    longest = float(np.sqrt(box.SquareExtent()))
    deflection = max(DEFLECTION_MM, _LARGE_PART * longest if longest > _LARGE_MM else 0.0)
    bend = _BEND_RAD
    if len(faces) > _LARGE:
        deflection = max(deflection, _COARSER_MM)
        bend = _COARSER_RAD if len(faces) <= _VERY_LARGE else _COARSEST_RAD
    mesher = BRepMesh_IncrementalMesh()
    mesher.SetShape(shape)
    options = mesher.ChangeParameters()
    options.Deflection, options.Angle = deflection, bend
    # The usual way takes a time that grows with the square of the holes of a face.
    if len(faces) > _LARGE or any(_holes(face) > _MANY_HOLES for face in faces):
        options.MeshAlgo = IMeshTools_MeshAlgoType_Delabella
    mesher.Perform()
    return deflection


def raw_mesh(face: Any) -> RawMesh | None:
    """Return the mesh that a face has; None where it has none."""
    from OCP.BRep import BRep_Tool
    from OCP.TopLoc import TopLoc_Location

    place = TopLoc_Location()
    mesh = static(BRep_Tool, "Triangulation")(face, place)
    if mesh is None or not mesh.NbTriangles():
        return None
    nodes = np.array([(p.X(), p.Y(), p.Z()) for p in map(mesh.Node, range(1, mesh.NbNodes() + 1))])
    if not place.IsIdentity():
        matrix = motion_of(place)
        nodes = nodes @ matrix[:, :3].T + matrix[:, 3]
    rows = np.array([mesh.Triangle(i).Get() for i in range(1, mesh.NbTriangles() + 1)])
    return RawMesh(nodes, rows.reshape(-1, 3) - 1)


def motion_of(place: Any) -> Float:
    """Return the motion of a place, (3, 4), mm."""
    motion = place.Transformation()
    return np.array([[motion.Value(i, j) for j in (1, 2, 3, 4)] for i in (1, 2, 3)])


def triangles_of(meshes: Mapping[int, RawMesh]) -> tuple[Float, NDArray[np.int64]]:
    """Return all triangles (n, 3, 3), mm, and the face of each, (n,), from 0."""
    if not meshes:
        return np.empty((0, 3, 3)), np.empty(0, dtype=np.int64)
    triangles = np.concatenate([mesh.nodes[mesh.rows] for mesh in meshes.values()])
    owners = np.repeat(
        np.array(list(meshes), dtype=np.int64), [len(mesh.rows) for mesh in meshes.values()]
    )
    return triangles, owners


def _holes(face: Any) -> int:
    return sum(1 for _ in explored(face, "WIRE")) - 1
