"""Triangles of all faces of a model, to find what a probe would run into; needs OCP."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ocmm_core.geometry import Float, Int
from ocmm_core.inspection.reach import Obstacle, make_obstacle
from ocmm_core.inspection.step._library import explored, static

DEFLECTION_MM = 0.04
_BEND_RAD = 0.35
_LARGE, _MANY_HOLES = 1500, 50
_COARSER_MM, _COARSER_RAD = 0.1, 0.5
"""Of so many faces: the same mesh is that of the picture."""
_LARGE_MM, _LARGE_PART = 800.0, 5e-5
"""A part longer than this gets a coarser mesh, by this part of its length."""


def mesh_of(shape: Any, faces: Sequence[Any]) -> Obstacle | None:
    """Return the faces of a model as something to run into; None where no mesh can be made.

    Parameters
    ----------
    shape
        The model.
    faces
        Its faces with a surface, in order: the obstacle counts them from 0.
    """
    from OCP.Bnd import Bnd_Box
    from OCP.BRep import BRep_Tool
    from OCP.BRepBndLib import BRepBndLib
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.IMeshTools import IMeshTools_MeshAlgoType_Delabella
    from OCP.TopLoc import TopLoc_Location

    box = Bnd_Box()
    static(BRepBndLib, "Add")(shape, box)
    longest = float(np.sqrt(box.SquareExtent()))
    deflection = max(DEFLECTION_MM, _LARGE_PART * longest if longest > _LARGE_MM else 0.0)
    bend = _BEND_RAD
    if len(faces) > _LARGE:
        deflection, bend = max(deflection, _COARSER_MM), _COARSER_RAD
    mesher = BRepMesh_IncrementalMesh()
    mesher.SetShape(shape)
    options = mesher.ChangeParameters()
    options.Deflection, options.Angle, options.InParallel = deflection, bend, True
    # The usual way takes a time that grows with the square of the holes of a face.
    if len(faces) > _LARGE or any(_holes(face) > _MANY_HOLES for face in faces):
        options.MeshAlgo = IMeshTools_MeshAlgoType_Delabella
    mesher.Perform()
    of_face = static(BRep_Tool, "Triangulation")
    triangles: list[Float] = []
    owners: list[Int] = []
    for number, face in enumerate(faces):
        location = TopLoc_Location()
        mesh = of_face(face, location)
        if mesh is None:
            continue
        nodes = np.array(
            [(p.X(), p.Y(), p.Z()) for p in map(mesh.Node, range(1, mesh.NbNodes() + 1))]
        )
        if not location.IsIdentity():
            moved = location.Transformation()
            matrix = np.array([[moved.Value(i, j) for j in (1, 2, 3, 4)] for i in (1, 2, 3)])
            nodes = nodes @ matrix[:, :3].T + matrix[:, 3]
        rows = np.array([mesh.Triangle(i).Get() for i in range(1, mesh.NbTriangles() + 1)])
        triangles.append(nodes[rows.reshape(-1, 3) - 1])
        owners.append(np.full(len(triangles[-1]), number, dtype=np.int64))
    if not triangles:
        return None
    return make_obstacle(np.concatenate(triangles), np.concatenate(owners), len(faces), deflection)


def _holes(face: Any) -> int:
    return sum(1 for _ in explored(face, "WIRE")) - 1
