"""Triangles of all faces of a model, for collision checks; needs OCP."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ocmm_cad.step.brep._library import (
    SameShape,
    compound_of,
    explored,
    static,
    triangulation,
    without_place,
)
from ocmm_core.geometry import Float

DEFLECTION_MM = 0.04
_BEND_RAD = 0.35
_LARGE, _MANY_HOLES = 1500, 50
_COARSER_MM, _COARSER_RAD = 0.1, 0.5
"""Mesh for many faces, also used for the picture."""
_VERY_LARGE, _COARSEST_RAD = 3000, 0.8
_MESH_HEAD = 18
"""Bytes: two numbers, two marks, and the deflection."""
_LONGEST_HEAD = 4096
"""Bytes before the first mesh if nothing else is written."""
_LARGE_MM, _LARGE_PART = 800.0, 5e-5
"""A part longer than this gets a coarser mesh, by this share of its length."""


@dataclass(frozen=True, slots=True, eq=False)
class RawMesh:
    nodes: Float
    """(n, 3), mm, in the place of the face."""
    rows: NDArray[np.int64]
    """(m, 3): nodes of each triangle, from 0, in the sense of the surface."""
    normals: Float | None = None
    """(n, 3), of the surface without its place; None if not requested."""


def make_mesh(shape: Any, faces: Sequence[Any]) -> float:
    """Mesh all faces of a model for targets; return the deflection, mm."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    box = Bnd_Box()
    static(BRepBndLib, "Add")(shape, box)
    longest = float(np.sqrt(box.SquareExtent()))
    deflection = max(DEFLECTION_MM, _LARGE_PART * longest if longest > _LARGE_MM else 0.0)
    bend = _BEND_RAD
    if len(faces) > _LARGE:
        deflection = max(deflection, _COARSER_MM)
        bend = _COARSER_RAD if len(faces) <= _VERY_LARGE else _COARSEST_RAD
    wires = (sum(1 for _ in explored(face, "WIRE")) for face in faces)
    is_large = len(faces) > _LARGE or any(count - 1 > _MANY_HOLES for count in wires)
    mesh_shape(shape, deflection, bend, is_large=is_large)
    return deflection


def mesh_shape(shape: Any, deflection: float, bend: float, *, is_large: bool) -> None:
    """Mesh a shape; ``is_large``: it has many faces, or a face many holes."""
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.IMeshTools import IMeshTools_MeshAlgoType_Delabella

    mesher = BRepMesh_IncrementalMesh()
    mesher.SetShape(shape)
    options = mesher.ChangeParameters()
    options.Deflection, options.Angle = deflection, bend
    if is_large:
        # The usual method takes time quadratic in the holes of a face.
        options.MeshAlgo = IMeshTools_MeshAlgoType_Delabella
    mesher.Perform()


def raw_meshes(faces: Sequence[Any], *, with_normals: bool = False) -> dict[int, RawMesh]:
    """Return the existing meshes by index of the face.

    The library writes all at once, faster than node by node; used if counts match, and each mesh
    has the same first node. `with_normals`: they were computed before.
    """
    asked = {place: mesh for place, face in enumerate(faces) if (mesh := mesh_of(face))}
    whose: dict[SameShape, int] = {}
    first: list[int] = []
    of_face: dict[int, int] = {}
    for place in asked:
        key = without_place(faces[place])
        if key not in whose:
            whose[key] = len(first)
            first.append(place)
        of_face[place] = whose[key]
    read = _written([asked[place][0] for place in first], with_normals)
    if read is None:
        read = [asked_mesh(asked[place][0], with_normals) for place in first]
    found = {}
    for place, number in of_face.items():
        raw, motion = read[number], asked[place][1]
        if motion is not None:
            raw = replace(raw, nodes=raw.nodes @ motion[:, :3].T + motion[:, 3])
        found[place] = raw
    return found


def mesh_of(face: Any) -> tuple[Any, Float | None] | None:
    """Return the mesh of a face and the motion to its place, if any."""
    mesh, place = triangulation(face)
    if mesh is None or not mesh.NbTriangles():
        return None
    return mesh, None if place.IsIdentity() else motion_of(place)


def _written(meshes: Sequence[Any], with_normals: bool) -> list[RawMesh] | None:
    """Return meshes as written by the library (its binary format, version 4); None if it differs.

    Of each: numbers of nodes and triangles (int32), flags for parameters and normals (bytes),
    deflection; nodes, parameters of nodes (float64), triangles (int32, from 1), normals (float32).
    Little-endian on every computer.
    """
    from OCP.BinTools import BinTools, BinTools_FormatVersion_VERSION_4
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Face

    # Faces with only a mesh, so that no surfaces and edges are written.
    faces = [TopoDS_Face() for _ in meshes]
    for bare, mesh in zip(faces, meshes, strict=True):
        BRep_Builder().MakeFace(bare, mesh)
    compound = compound_of(faces)
    stream = io.BytesIO()
    try:
        static(BinTools, "Write")(
            compound, stream, True, with_normals, BinTools_FormatVersion_VERSION_4
        )
    except TypeError:
        # Older libraries write files only.
        return None
    content = stream.getbuffer()
    head = b"\nTriangulations %d\n" % len(meshes)
    at = bytes(content[:_LONGEST_HEAD]).find(head) + len(head)
    if at < len(head):
        return None
    found = []
    for mesh in meshes:
        raw, at = next_mesh(content, at)
        if raw is None or not is_of(raw, mesh) or (with_normals and raw.normals is None):
            return None
        found.append(raw)
    return found


def next_mesh(content: memoryview, at: int) -> tuple[RawMesh | None, int]:
    """Return the mesh at a byte offset, and the offset of the next one."""
    if at + _MESH_HEAD > len(content):
        return None, at
    nodes, triangles = np.frombuffer(content, "<i4", 2, at).tolist()
    has_uv, has_normals = content[at + 8] != 0, content[at + 9] != 0
    at += _MESH_HEAD
    sizes = (24 * nodes, 16 * nodes * has_uv, 12 * triangles, 12 * nodes * has_normals)
    if min(nodes, triangles) < 1 or at + sum(sizes) > len(content):
        return None, at
    points = np.frombuffer(content, "<f8", 3 * nodes, at).reshape(-1, 3)
    at += sizes[0] + sizes[1]
    rows = np.frombuffer(content, "<i4", 3 * triangles, at).reshape(-1, 3) - 1
    at += sizes[2]
    normals = None
    if has_normals:
        normals = np.frombuffer(content, "<f4", 3 * nodes, at).reshape(-1, 3).astype(np.float64)
    return RawMesh(points, rows.astype(np.int64), normals), at + sizes[3]


def is_of(raw: RawMesh, mesh: Any) -> bool:
    """Return whether the counts, the first node and the last triangle are those of a mesh."""
    if (len(raw.nodes), len(raw.rows)) != (mesh.NbNodes(), mesh.NbTriangles()):
        return False
    node = mesh.Node(1)
    return (
        raw.nodes[0].tolist() == [node.X(), node.Y(), node.Z()]
        and (raw.rows[-1] + 1).tolist() == list(mesh.Triangle(len(raw.rows)).Get())
        and bool(raw.rows.min() >= 0 and raw.rows.max() < len(raw.nodes))
    )


def asked_mesh(mesh: Any, with_normals: bool) -> RawMesh:
    """Return a mesh node by node."""
    nodes = range(1, mesh.NbNodes() + 1)
    points = np.array([(p.X(), p.Y(), p.Z()) for p in map(mesh.Node, nodes)])
    rows = np.array([mesh.Triangle(i).Get() for i in range(1, mesh.NbTriangles() + 1)])
    normals = None
    if with_normals:
        normals = np.array([(n.X(), n.Y(), n.Z()) for n in map(mesh.Normal, nodes)])
    return RawMesh(points, rows.reshape(-1, 3).astype(np.int64) - 1, normals)


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
