"""Triangles of all faces of a model, to find what a probe would run into; needs OCP."""

from __future__ import annotations

from typing import Any

import numpy as np

from ocmm_core.geometry import Float, Int

DEFLECTION_MM = 0.04
_BEND_RAD = 0.35
_LARGE_MM, _LARGE_PART = 800.0, 5e-5
"""A part longer than this gets a coarser mesh, by this part of its length."""


def mesh_of(shape: Any, faces: list[Any]) -> tuple[Float, Int, float]:
    """Return triangles (n, 3, 3), mm, the face of each (n,), from 0, and how far they are off, mm.

    Parameters
    ----------
    shape
        The model.
    faces
        Its faces, in order.
    """
    from OCP.Bnd import Bnd_Box
    from OCP.BRep import BRep_Tool
    from OCP.BRepBndLib import BRepBndLib
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.TopLoc import TopLoc_Location

    box = Bnd_Box()
    (getattr(BRepBndLib, "Add_s", None) or BRepBndLib.Add)(shape, box)
    longest = float(np.sqrt(box.SquareExtent()))
    deflection = max(DEFLECTION_MM, _LARGE_PART * longest if longest > _LARGE_MM else 0.0)
    BRepMesh_IncrementalMesh(shape, deflection, False, _BEND_RAD, False)
    of_face = getattr(BRep_Tool, "Triangulation_s", None) or BRep_Tool.Triangulation
    triangles: list[Float] = []
    owners: list[Int] = []
    for number, face in enumerate(faces):
        location = TopLoc_Location()
        mesh = of_face(face, location)
        if mesh is None:
            continue
        moved = location.Transformation()
        nodes = np.array(
            [
                (p.X(), p.Y(), p.Z())
                for p in (mesh.Node(i).Transformed(moved) for i in range(1, mesh.NbNodes() + 1))
            ]
        )
        rows = np.array([mesh.Triangle(i).Get() for i in range(1, mesh.NbTriangles() + 1)])
        triangles.append(nodes[rows.reshape(-1, 3) - 1])
        owners.append(np.full(len(triangles[-1]), number, dtype=np.int64))
    if not triangles:
        return np.empty((0, 3, 3)), np.empty(0, dtype=np.int64), deflection
    return np.concatenate(triangles), np.concatenate(owners), deflection
