"""Geometry of a rendered part: mesh, edges, vertex colours, and simplification.

The backs of closed surfaces need no painting.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ocmm_core.geometry import Float, Int
from ocmm_core.part_model import PartModel
from ocmm_gui.rendering._canvas import Colours, FaceNumbers, Flags

_COARSER = 1.4
_OWN: tuple[Literal["C"], Literal["W"]] = ("C", "W")
_FEWEST_CELLS = 8


@dataclass(frozen=True, slots=True, eq=False)
class RenderMesh:
    """Triangles with their faces, and polylines along the edges."""

    vertices: Float
    normals: Float
    """`vertices`, `normals`: (n, 3), mm and unit, model frame."""
    triangles: FaceNumbers
    triangle_faces: FaceNumbers
    """`triangles`, `triangle_faces`: (m, 3) vertex indices, and (m,) face indices of the model."""
    edge_points: Float
    edge_starts: FaceNumbers
    """`edge_points`, `edge_starts`: (k, 3), mm, and (e + 1,): see `PartModel`."""
    origins: Int
    """(n,): model vertex of each vertex, for its colour."""
    closed: Flags
    """(m,): 1 for triangles of a closed surface; see `with_closed`."""
    cell_mm: float = 0.0
    """Maximum displacement of a vertex from the model; 0 for the original mesh."""

    @property
    def centre(self) -> Float:
        """Return the middle of the axis-aligned bounding box, (3,), mm."""
        middle: Float = 0.5 * (self.vertices.min(axis=0) + self.vertices.max(axis=0))
        return middle

    def vertex_colours(self, colours: Colours) -> Colours:
        """Return its vertex colours from those of the model, (n, 3)."""
        return np.require(colours[self.origins] if self.cell_mm else colours, np.uint8, _OWN)


def mesh_of(model: PartModel) -> RenderMesh:
    """Return the whole mesh of a part."""
    # Read-only arrays from a file would be another type to compiled functions, which would be
    # recompiled at run time.
    return RenderMesh(
        np.require(model.vertices, np.float64, _OWN),
        np.require(model.normals, np.float64, _OWN),
        np.require(model.triangles, np.int32, _OWN),
        np.require(model.triangle_faces, np.int32, _OWN),
        np.require(model.edge_points, np.float64, _OWN).reshape(-1, 3),
        np.require(model.edge_starts, np.int32, _OWN),
        np.arange(len(model.vertices)),
        np.zeros(len(model.triangles), dtype=np.uint8),
    )


def coarser(mesh: RenderMesh, most: int) -> RenderMesh:
    """Return a mesh of about ``most`` triangles at most; the same one if small.

    Vertices in one cell of a grid are merged to their mean (vertex clustering, Rossignac and Borrel
    1993), separately per face, so that faces keep their colours and sharp edges; those of one cell
    share a place, so that no gap opens. Cells grow until the triangles are few enough or the part
    has only a few cells. About 0.2 s for 300,000 triangles.
    """
    if len(mesh.triangles) <= most:
        return mesh
    low = mesh.vertices.min(axis=0)
    diagonal = float(np.linalg.norm(mesh.vertices.max(axis=0) - low))
    a, b, c = (mesh.vertices[mesh.triangles[:, corner]] for corner in range(3))
    area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
    # A surface crosses some 1.5 cells per cell face of its area, with two triangles each.
    cell = np.sqrt(3.0 * area / max(most, 1))
    found = _clustered(mesh, low, cell)
    while len(found.triangles) > most and cell < diagonal / _FEWEST_CELLS:
        cell *= _COARSER
        found = _clustered(mesh, low, cell)
    return found


def _clustered(mesh: RenderMesh, low: Float, cell: float) -> RenderMesh:
    n = len(mesh.vertices)
    steps = np.floor((mesh.vertices - low) / max(cell, 1e-9)).astype(np.int64)
    reach = steps.max(axis=0) + 1
    keys = (steps[:, 0] * reach[1] + steps[:, 1]) * reach[2] + steps[:, 2]
    _, cell_of, count = np.unique(keys, return_inverse=True, return_counts=True)
    means = np.stack([np.bincount(cell_of, mesh.vertices[:, k]) / count for k in range(3)], axis=1)
    face_of = np.zeros(n, dtype=np.int64)
    face_of[mesh.triangles] = mesh.triangle_faces[:, None]
    pairs = cell_of * (int(face_of.max()) + 1) + face_of
    _, origins, vertex_of = np.unique(pairs, return_index=True, return_inverse=True)
    normals = np.stack([np.bincount(vertex_of, mesh.normals[:, k]) for k in range(3)], axis=1)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    # Opposite normals of a thin wall cancel: use any of them.
    normals = np.where(length > 1e-6, normals / np.maximum(length, 1e-6), mesh.normals[origins])
    corners = cell_of[mesh.triangles]
    kept = (
        (corners[:, 0] != corners[:, 1])
        & (corners[:, 1] != corners[:, 2])
        & (corners[:, 2] != corners[:, 0])
    )
    return RenderMesh(
        np.ascontiguousarray(means[cell_of[origins]]),
        np.ascontiguousarray(normals),
        np.ascontiguousarray(vertex_of[mesh.triangles[kept]], dtype=np.int32),
        np.ascontiguousarray(mesh.triangle_faces[kept]),
        mesh.edge_points,
        mesh.edge_starts,
        mesh.origins[origins],
        # Merging places of a surface without border creates none.
        np.ascontiguousarray(mesh.closed[kept]),
        cell,
    )


def face_colours(
    model: PartModel, base: str, marked: Mapping[int, str] | None = None, *, own: bool = True
) -> Colours:
    """Return the colour of each vertex of a model, (n, 3).

    `base`: ``#rrggbb``: of faces without colour. `marked`: colours by face index; they override the
    model's own. `own`: use the colours of the model.
    """
    wanted = {} if marked is None else marked
    table = np.array(
        [
            _channels(wanted.get(place) or (own and face.colour) or base)
            for place, face in enumerate(model.faces)
        ]
        or [_channels(base)],
        dtype=np.uint8,
    )
    of_vertex = np.zeros(len(model.vertices), dtype=np.int64)
    of_vertex[model.triangles] = model.triangle_faces[:, None]
    return np.ascontiguousarray(table[of_vertex])


def _channels(colour: str) -> tuple[int, int, int]:
    number = int(colour[1:7], 16)
    return number >> 16, (number >> 8) & 255, number & 255


_SAME_MM = 1e-6
"""Vertices on an edge are duplicated per face, from the same point of the edge."""


def with_closed(mesh: RenderMesh) -> RenderMesh:
    """Return a mesh with its triangles on closed surfaces marked.

    A connected surface is closed and consistently oriented if every edge is used equally often in
    both directions, and oriented outwards if it encloses a positive volume. All others, such as
    open sheets or inverted shells, are painted from both sides. About 0.1 s for 100,000 triangles.
    """
    corners = _places(mesh.vertices)[mesh.triangles]
    count = int(corners.max(initial=-1)) + 1
    if not count or not np.isfinite(mesh.vertices).all():
        return mesh
    begins, ends = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    _, edge = np.unique(
        np.minimum(begins, ends) * count + np.maximum(begins, ends), return_inverse=True
    )
    # A triangle without area uses an edge in both directions, or a single point.
    balance = np.bincount(edge, np.sign(ends - begins))
    graph = coo_array((np.ones(len(begins), dtype=np.int8), (begins, ends)), shape=(count, count))
    shells, shell_of = connected_components(graph, directed=False)
    shell = shell_of[corners[:, 0]]
    opened = np.bincount(np.repeat(shell, 3), balance[edge] != 0.0, minlength=shells) > 0.0
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] - mesh.vertices[0] for k in range(3))
    volume = np.bincount(shell, np.einsum("ij,ij->i", a, np.cross(b, c)), minlength=shells)
    good = ~opened & (volume > 0.0)
    return replace(mesh, closed=np.ascontiguousarray(good[shell], dtype=np.uint8))


def _places(vertices: Float) -> Int:
    """Return a number per vertex (n, 3), equal for coincident ones."""
    grid = np.round(vertices / _SAME_MM)
    order = np.lexsort(grid.T)
    is_new = np.ones(len(order), dtype=bool)
    is_new[1:] = (np.diff(grid[order], axis=0) != 0.0).any(axis=1)
    numbers = np.empty(len(order), dtype=np.int64)
    numbers[order] = np.cumsum(is_new) - 1
    return numbers
