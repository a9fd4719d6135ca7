"""The nominal part of a shape: mesh, edges, and every face as a spline with its outline."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ocmm_cad.step.brep._document import StepDocument
from ocmm_cad.step.brep._edge_steps import EdgeSteps, parameters_on
from ocmm_cad.step.brep._library import (
    SameShape,
    compound_of,
    explored,
    is_turned,
    kind_of,
    static,
    triangulation,
    vector,
)
from ocmm_cad.step.brep._raw_faces import UnusableModelError, faces_with_surface, go_round
from ocmm_cad.step.brep._solid_mesh import RawMesh, mesh_shape, motion_of, raw_meshes
from ocmm_cad.step.brep._surface_splines import MappedSurface, surface_of
from ocmm_core import part_model
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float

_SHARE = 5e-4
"""Deflection of the mesh relative to the size of the part: half a pixel on a full picture."""
_FINEST_MM, _COARSEST_MM = 0.002, 5.0
_TURN_RAD = 0.35
_ENOUGH_TRIANGLES = 200_000
_VERY_LARGE = 3000
"""A part with more faces is only shown: coarser, and without its exact surfaces."""
LARGE, _MANY_HOLES = 1500, 50
_KEPT = 1000
"""With more faces the part's mesh also serves for targets: selected surfaces query it later."""
_EXACT_MM = 1e-4
"""A spline that leaves its face by more does not belong to it."""
_TRIED = 24


def part_of(
    document: StepDocument, source: tuple[str, str], doing: Callable[[str], None]
) -> part_model.PartModel:
    """Return the part; ``source``: name (no folder), hash. ValueError if no face has a surface."""
    from OCP.BRepLib import BRepLib_ToolTriangulatedShape

    faces, _ = faces_with_surface(document.shape)
    if not faces:
        msg = "contains no faces"
        raise ValueError(msg)
    doing("the mesh")
    deflection = _meshed(document, faces)
    compute_normals = static(BRepLib_ToolTriangulatedShape, "ComputeNormals")
    for face in faces:
        if (mesh := triangulation(face)[0]) is not None:
            compute_normals(face, mesh)
    meshes = raw_meshes(faces, with_normals=True)
    parts: list[_FaceMesh] = []
    made: list[part_model.ModelFace] = []
    for number, face in enumerate(faces, start=1):
        if number % 16 == 1:
            doing(f"the shape of face {number} of {len(faces)}")
        parts.append(_face_mesh(face, meshes.pop(number - 1, None)))
        made.append(model_face(number, face, document, is_exact=len(faces) <= _VERY_LARGE))
    if not any(len(part.triangles) for part in parts):
        msg = "no mesh can be made of its faces"
        raise ValueError(msg)
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    vertices = np.concatenate([part.vertices for part in parts])
    triangles = np.concatenate(
        [part.triangles + start for part, start in zip(parts, starts, strict=False)]
    )
    if not np.abs(vertices).max() <= part_model.FARTHEST_MM:
        raise UnusableModelError(
            f"its faces lie {np.abs(vertices).max() / 1000.0:.0f} m from its origin",
            "Export the model with its origin at the part.",
        )
    points, edge_starts, sides = _edges(faces, parts)
    return part_model.PartModel(
        source_name=source[0],
        source_sha256=source[1],
        vertices=vertices,
        normals=_unit(vertices, np.concatenate([part.normals for part in parts]), triangles),
        triangles=triangles.astype(np.int32),
        triangle_faces=np.repeat(
            np.arange(len(parts), dtype=np.int32), [len(part.triangles) for part in parts]
        ),
        faces=tuple(made),
        edge_points=points,
        edge_starts=edge_starts,
        edge_faces=sides,
        deflection_mm=deflection,
    )


@dataclass(frozen=True, slots=True)
class _FaceMesh:
    """Mesh of a face with the library's normals, and its edges by vertices."""

    vertices: Float
    normals: Float
    triangles: NDArray[np.int64]
    rims: tuple[tuple[SameShape, Float], ...]


def _meshed(document: StepDocument, faces: Sequence[Any]) -> float:
    """Mesh all faces, coarser until it is small enough; return the deflection, mm."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib
    from OCP.BRepTools import BRepTools

    if len(faces) > _KEPT and (kept := _kept_deflection(faces)) > 0.0:
        return kept
    compound = compound_of(faces)
    box = Bnd_Box()
    static(BRepBndLib, "Add")(compound, box, False)
    size = float(np.linalg.norm(vector(box.CornerMax()) - vector(box.CornerMin())))
    if not np.isfinite(size) or size <= 0.0 or size > 1e6:
        msg = "its size is no size of a part"
        raise ValueError(msg)
    is_large = len(faces) > LARGE or any(
        sum(1 for _ in explored(face, "WIRE")) > _MANY_HOLES for face in faces
    )
    deflection = float(np.clip(_SHARE * size, _FINEST_MM, _COARSEST_MM))
    turn = _TURN_RAD if len(faces) <= _VERY_LARGE else 2.0 * _TURN_RAD
    for _ in range(6):
        static(BRepTools, "Clean")(compound)
        mesh_shape(compound, deflection, turn, is_large=is_large)
        if sum(_count(face) for face in faces) <= _ENOUGH_TRIANGLES:
            break
        deflection, turn = 2.0 * deflection, min(2.0 * turn, 1.5)
    return deflection


def _kept_deflection(faces: Sequence[Any]) -> float:
    """Return the deflection of an existing, displayable mesh for targets, mm; 0 without one."""
    meshes = [triangulation(face)[0] for face in faces]
    made = [one for one in meshes if one is not None]
    if not made or sum(one.NbTriangles() for one in made) > part_model.MOST_TRIANGLES:
        return 0.0
    # The deflection of flat faces with straight edges is 0; they are meshed nevertheless.
    return max(_FINEST_MM, *(float(one.Deflection()) for one in made))


def _count(face: Any) -> int:
    mesh = triangulation(face)[0]
    return 0 if mesh is None else int(mesh.NbTriangles())


def _face_mesh(face: Any, raw: RawMesh | None) -> _FaceMesh:
    from OCP.BRep import BRep_Tool
    from OCP.TopAbs import TopAbs_REVERSED

    mesh, place = triangulation(face)
    if raw is None or raw.normals is None:
        none = np.empty((0, 3))
        return _FaceMesh(none, none, np.empty((0, 3), dtype=np.int64), ())
    vertices, triangles, normals = raw.nodes, raw.rows, raw.normals
    if not place.IsIdentity():
        matrix = motion_of(place)
        normals = normals @ matrix[:, :3].T
        if np.linalg.det(matrix[:, :3]) < 0.0:
            triangles = triangles[:, ::-1]
    if face.Orientation() == TopAbs_REVERSED:
        triangles, normals = triangles[:, ::-1], -normals
    rims = []
    for edge in explored(face, "EDGE"):
        if static(BRep_Tool, "Degenerated")(edge) or static(BRep_Tool, "IsClosed")(edge, face):
            continue
        line = static(BRep_Tool, "PolygonOnTriangulation")(edge, mesh, place)
        if line is not None and line.NbNodes() > 1:
            on_it = [line.Node(index) - 1 for index in range(1, line.NbNodes() + 1)]
            rims.append((SameShape(edge), vertices[on_it]))
    return _FaceMesh(vertices, normals, triangles, tuple(rims))


def _unit(vertices: Float, normals: Float, triangles: NDArray[np.int64]) -> Float:
    """Return unit normals; without one, as at a tip, that of the triangles."""
    lengths = np.linalg.norm(normals, axis=1)
    bad = ~(lengths > 0.5)
    if bad.any():
        a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
        flat = np.cross(b - a, c - a)
        summed = np.zeros_like(vertices)
        for corner in range(3):
            np.add.at(summed, triangles[:, corner], flat)
        normals = np.where(bad[:, None], summed, normals)
        lengths = np.linalg.norm(normals, axis=1)
        normals = np.where((lengths > 0.0)[:, None], normals, [0.0, 0.0, 1.0])
        lengths = np.linalg.norm(normals, axis=1)
    unit: Float = normals / lengths[:, None]
    return unit


def _edges(
    faces: Sequence[Any], parts: Sequence[_FaceMesh]
) -> tuple[Float, NDArray[np.int32], NDArray[np.int32]]:
    """Return the lines of all edges, the start of each, and the faces on both sides."""
    found: dict[SameShape, int] = {}
    lines: list[Float] = []
    sides: list[list[int]] = []
    for number, part in enumerate(parts):
        for edge, line in part.rims:
            known = found.get(edge)
            if known is None:
                found[edge] = len(lines)
                lines.append(line)
                sides.append([number, -1])
            elif sides[known][1] < 0 and sides[known][0] != number:
                sides[known][1] = number
    points = np.concatenate(lines) if lines else np.empty((0, 3))
    starts = np.cumsum([0, *(len(line) for line in lines)])
    return (points, starts.astype(np.int32), np.array(sides, dtype=np.int32).reshape(-1, 2))


def model_face(
    number: int, face: Any, document: StepDocument, *, is_exact: bool
) -> part_model.ModelFace:
    """Return a face, with its exact surface and outline if wanted."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface

    surface = BRepAdaptor_Surface(face, True)
    said = document.about(face)
    mapped, loops = None, list[Float]()
    if is_exact:
        try:
            loops = _loops(face, surface, document.steps)
            mapped = _mapped(surface, loops)
        except MemoryError:
            raise
        except Exception:
            # One odd face is shown by its mesh alone; the library raises many classes.
            mapped = None
    outlines: tuple[Float, ...] = ()
    if mapped is not None:
        outlines = tuple(
            np.stack([mapped.map_u(loop[:, 0]), mapped.map_v(loop[:, 1])], axis=1) for loop in loops
        )
    return part_model.ModelFace(
        number=number,
        kind=kind_of(surface),
        name=said.name,
        layer=said.layer,
        colour=said.colour,
        spline=None if mapped is None else mapped.spline,
        outward=not is_turned(face),
        loops=outlines,
    )


def _mapped(surface: Any, loops: Sequence[Float]) -> MappedSurface | None:
    """Return the spline of a face; None if it leaves the face."""
    if not loops:
        return None
    every = np.concatenate(list(loops))
    (u0, v0), (u1, v1) = every.min(axis=0), every.max(axis=0)
    if not (u1 > u0 and v1 > v0):
        return None
    mapped = surface_of(surface, (float(u0), float(u1), float(v0), float(v1)))
    if mapped is None or mapped.is_exact:
        return mapped
    step = max(1, len(every) // _TRIED)
    shares = np.linspace(0.1, 0.9, 5)
    inside = np.stack(np.meshgrid(u0 + (u1 - u0) * shares, v0 + (v1 - v0) * shares), axis=-1)
    tried = np.concatenate([every[::step], inside.reshape(-1, 2)])
    as_spline = np.stack([mapped.map_u(tried[:, 0]), mapped.map_v(tried[:, 1])], axis=1)
    try:
        made = part_model.bezier_surface(mapped.spline)
    except InputError:
        return None
    points = part_model.places_at(made, np.clip(as_spline, made.low, made.high))
    truth = np.array([vector(surface.Value(float(u), float(v))) for u, v in tried])
    return mapped if float(np.linalg.norm(points - truth, axis=1).max()) <= _EXACT_MM else None


def _loops(face: Any, surface: Any, steps: EdgeSteps) -> list[Float]:
    """Return the outlines (n, 2) of a face in the library's parameters; empty if one is open."""
    loops = []
    for wire in explored(face, "WIRE"):
        pieces = [
            piece
            for edge in explored(wire, "EDGE")
            if (piece := _piece(edge, face, steps)) is not None
        ]
        ends = [vector(surface.Value(*place)) for one in pieces for place in one[[0, -1]].tolist()]
        if not go_round(np.array(ends).reshape(-1, 2, 3)):
            return []
        loop = _chained(pieces)
        if len(loop) >= 3:
            loops.append(loop)
    if not loops:
        u0, u1 = surface.FirstUParameter(), surface.LastUParameter()
        v0, v1 = surface.FirstVParameter(), surface.LastVParameter()
        whole = np.array([(u0, v0), (u1, v0), (u1, v1), (u0, v1)])
        loops = [whole] if np.isfinite(whole).all() and np.abs(whole).max() < 1e9 else []
    return loops


def _piece(edge: Any, face: Any, steps: EdgeSteps) -> Float | None:
    from OCP.BRepAdaptor import BRepAdaptor_Curve2d
    from OCP.TopAbs import TopAbs_REVERSED

    curve = BRepAdaptor_Curve2d(edge, face)
    along, _ = steps.lookup(edge, curve.FirstParameter(), curve.LastParameter())
    line = parameters_on(curve, along)
    if not np.isfinite(line).all():
        return None
    return line[::-1] if edge.Orientation() == TopAbs_REVERSED else line


def _chained(pieces: Sequence[Float]) -> Float:
    if not pieces:
        return np.empty((0, 2))
    starts = np.array([piece[0] for piece in pieces])
    left = np.ones(len(pieces), dtype=np.bool_)
    at, chain = 0, []
    for _ in pieces:
        left[at] = False
        chain.append(pieces[at][:-1])
        at = int(np.argmin(np.where(left, np.abs(starts - pieces[at][-1]).max(axis=1), np.inf)))
    return np.concatenate(chain)
