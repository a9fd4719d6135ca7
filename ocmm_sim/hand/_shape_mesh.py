from __future__ import annotations

from itertools import pairwise

import numpy as np
import scipy
from numpy.typing import NDArray

from ocmm_core.geometry import Float, Int
from ocmm_core.part_model import ModelFace, PartModel
from ocmm_sim.hand import _kernel as kernel
from ocmm_sim.hand._solids import Solid, Solids

_TURN = np.linspace(0.0, 2.0 * np.pi, 65)
_STEP_MM = 8.0


class _Mesh:
    """Faces, each with its own vertices."""

    def __init__(self) -> None:
        self.vertices: list[Float] = []
        self.normals: list[Float] = []
        self.triangles: list[Int] = []
        self.owners: list[Int] = []
        self.faces: list[ModelFace] = []
        self.edges: list[Float] = []
        self._count = 0

    def add(self, feature: str, kind: str, places: Float, normals: Float, corners: Int) -> None:
        """Add a face; triangles are oriented along the normals."""
        a, b, c = (places[corners[:, k]] for k in range(3))
        facing = np.einsum("ni,ni->n", np.cross(b - a, c - a), normals[corners[:, 0]])
        corners = np.where((facing < 0.0)[:, None], corners[:, ::-1], corners)
        corners = corners[np.abs(facing) > 1e-9]
        self.vertices.append(places)
        self.normals.append(normals)
        self.triangles.append(corners + self._count)
        self.owners.append(np.full(len(corners), len(self.faces)))
        self.faces.append(ModelFace(number=len(self.faces) + 1, kind=kind, feature=feature))
        self._count += len(places)

    def strip(self, feature: str, kind: str, rings: list[Float], normals: list[Float]) -> None:
        """Add the face between rings of equally many points."""
        count = len(rings[0])
        corners = []
        for ring in range(len(rings) - 1):
            low = ring * count + np.arange(count - 1)
            high = low + count
            corners += [np.stack([low, low + 1, high], 1), np.stack([low + 1, high + 1, high], 1)]
        self.add(
            feature, kind, np.concatenate(rings), np.concatenate(normals), np.concatenate(corners)
        )

    def model(self, name: str) -> PartModel:
        edges = self.edges
        starts = np.concatenate([[0], np.cumsum([len(one) for one in edges])])
        return PartModel(
            source_name=name, source_sha256="0" * 64,
            vertices=np.concatenate(self.vertices), normals=np.concatenate(self.normals),
            triangles=np.concatenate(self.triangles).astype(np.int32),
            triangle_faces=np.concatenate(self.owners).astype(np.int32), faces=tuple(self.faces),
            edge_points=np.concatenate([np.empty((0, 3)), *edges]),
            edge_starts=starts.astype(np.int32),
            edge_faces=np.full((len(edges), 2), -1, dtype=np.int32), deflection_mm=0.05,
        )  # fmt: skip


def part_mesh(name: str, solids: Solids) -> PartModel:
    """Return the mesh of a part in the part frame."""
    mesh = _Mesh()
    for solid in solids.items:
        if solid.kind == kernel.BOX:
            _add_slab(mesh, solid)
        else:
            _add_round(mesh, solid)
    return mesh.model(name)


def outline_of(hole: Float) -> tuple[Float, Float]:
    """Return the closed outline (n, 2) of a hole in its slab, and its normals (n, 2)."""
    a, b = hole[kernel.HALF_A], hole[kernel.HALF_B]
    cosine, sine = np.cos(_TURN), np.sin(_TURN)
    if hole[kernel.OUTLINE] == kernel.LONG:
        outward = np.stack([cosine, sine], axis=1)
        places = b * outward + np.stack([np.where(cosine >= 0.0, a, -a), 0.0 * sine], axis=1)
    elif hole[kernel.OUTLINE] == kernel.OVAL:
        places = np.stack([a * cosine, b * sine], axis=1)
        outward = np.stack([cosine / a, sine / b], axis=1)
        outward = outward / np.linalg.norm(outward, axis=1, keepdims=True)
    else:
        square = np.array([[1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
        sides = [np.linspace(square[k], square[k + 1], 12) for k in range(4)]
        facing = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
        places = np.concatenate(sides) * np.array([a, b])
        outward = np.repeat(facing, 12, axis=0)
    turn = np.array([
        [hole[kernel.COSINE], -hole[kernel.SINE]], [hole[kernel.SINE], hole[kernel.COSINE]],
    ])  # fmt: skip
    return places @ turn.T + hole[[kernel.X, kernel.Y]], outward @ turn.T


def _add_slab(mesh: _Mesh, solid: Solid) -> None:
    a, b, thick = solid.sizes

    def world(flat: Float, z: float) -> Float:
        placed: Float = np.column_stack([flat, np.full(len(flat), z)]) @ solid.axes + solid.origin
        return placed

    def facing(flat: Float) -> Float:
        turned: Float = np.column_stack([flat, np.zeros(len(flat))]) @ solid.axes
        return turned

    rim = _rim(a, b)
    outlines = [(name, hole, *outline_of(hole)) for name, hole in solid.holes]
    flat = np.unique(
        np.round(np.concatenate([rim, *(one[2] for one in outlines)]), 6), axis=0
    )  # Delaunay refuses duplicate points.
    corners = scipy.spatial.Delaunay(flat).simplices
    middle = flat[corners].mean(axis=1)
    inside = np.zeros(len(corners), dtype=np.bool_)
    for _, _, outline, _ in outlines:
        inside |= _within(outline, middle)
    up = np.tile(solid.axes[2], (len(flat), 1))
    mesh.add(solid.feature, "Plane", world(flat, 0.0), up, corners[~inside].astype(np.int64))
    square = np.array([[a, -b], [a, b], [-a, b], [-a, -b], [a, -b]])
    outward = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    for side in range(4):
        ends = square[side : side + 2]
        normal = facing(np.repeat(outward[side : side + 1], 2, axis=0))
        mesh.strip("", "Plane", [world(ends, 0.0), world(ends, -thick)], [normal, normal])
    mesh.edges += [world(square, 0.0), world(square, -thick)]
    for name, hole, outline, out in outlines:
        depth = min(float(hole[kernel.DEPTH]), thick)
        wall = -facing(out)
        mesh.strip(
            name, "Cylinder", [world(outline, 0.0), world(outline, -depth)], [wall, wall]
        )  # fmt: skip
        closed = np.concatenate([outline, outline.mean(axis=0)[None]])
        fan = np.stack([
            np.arange(len(outline) - 1), np.arange(1, len(outline)),
            np.full(len(outline) - 1, len(outline)),
        ], axis=1)  # fmt: skip
        mesh.add("", "Plane", world(closed, -depth), np.tile(solid.axes[2], (len(closed), 1)), fan)
        mesh.edges += [world(outline, 0.0), world(outline, -depth)]


def _add_round(mesh: _Mesh, solid: Solid) -> None:
    a, b, c = solid.sizes
    around = np.stack([np.cos(_TURN), np.sin(_TURN), 0.0 * _TURN], axis=1) @ solid.axes
    axis, origin = solid.axes[2], solid.origin
    if solid.kind == kernel.ROUND:
        normal = (c * around + (a - b) * axis) / np.hypot(c, a - b)
        rings = [origin + a * around, origin + b * around + c * axis]
        mesh.strip(solid.feature, "Cone", rings, [normal, normal])
        top = np.concatenate([rings[1], (origin + c * axis)[None]])
        last = len(rings[1])
        fan = np.stack(
            [np.arange(last - 1), np.arange(1, last), np.full(last - 1, last)], axis=1
        )  # fmt: skip
        mesh.add("", "Plane", top, np.tile(axis, (len(top), 1)), fan)
        mesh.edges += rings
        return
    turns = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 25)
    middle, tube = 0.0, a
    if solid.kind == kernel.RING:
        turns, middle, tube = np.linspace(-np.pi, np.pi, 33), a, b
    normals = [np.cos(turn) * around + np.sin(turn) * axis for turn in turns]
    rings = [origin + middle * around + tube * normal for normal in normals]
    mesh.strip(solid.feature, "Sphere", rings, normals)


def _rim(a: float, b: float) -> Float:
    """Return points round a rectangle, as dense as those of holes."""
    corners = np.array([[a, -b], [a, b], [-a, b], [-a, -b], [a, -b]])
    sides = []
    for first, last in pairwise(corners):
        count = max(int(np.linalg.norm(last - first) / _STEP_MM), 1)
        sides.append(first + np.arange(count)[:, None] / count * (last - first))
    return np.concatenate(sides)


def _within(outline: Float, places: Float) -> NDArray[np.bool_]:
    """Return whether points (n, 2) lie in a closed outline, by ray crossings."""
    x, y = places[:, 0][:, None], places[:, 1][:, None]
    x0, y0, x1, y1 = outline[:-1, 0], outline[:-1, 1], outline[1:, 0], outline[1:, 1]
    spans = (y0 > y) != (y1 > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        cross = x0 + (y - y0) / (y1 - y0) * (x1 - x0)
    found: NDArray[np.bool_] = np.count_nonzero(spans & (x < cross), axis=1) % 2 == 1
    return found
