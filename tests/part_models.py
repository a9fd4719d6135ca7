"""Parts made without the library that reads CAD models."""

from __future__ import annotations

import numpy as np

from ocmm_core.geometry import Float
from ocmm_core.part_model import ModelFace, PartModel, SplineSurface


def block_part(
    length: float = 100.0, width: float = 60.0, height: float = 20.0, cells: int = 1
) -> PartModel:
    """Return a block from the origin on, mm, each face of it in ``cells`` by ``cells`` squares."""
    size = np.array([length, width, height])
    vertices: list[Float] = []
    faces: list[ModelFace] = []
    normals, triangles, owners = [], [], []
    for axis in range(3):
        for end in (0.0, 1.0):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            if end == 0.0:
                u, v = v, u
            steps = np.linspace(0.0, 1.0, cells + 1)
            grid = np.zeros((cells + 1, cells + 1, 3))
            grid[..., u], grid[..., v], grid[..., axis] = steps[:, None], steps[None], end
            start = len(faces) * (cells + 1) ** 2
            vertices.append(grid.reshape(-1, 3) * size)
            normal = np.zeros(3)
            normal[axis] = 2.0 * end - 1.0
            normals.append(np.broadcast_to(normal, vertices[-1].shape))
            at = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1) + start
            a, b, c, d = at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]
            both = [np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)]
            triangles.append(np.concatenate(both).reshape(-1, 3))
            owners.append(np.full(len(triangles[-1]), len(faces)))
            corners = grid[[0, -1]][:, [0, -1]] * size
            faces.append(_plane(len(faces) + 1, corners, float(size[u]), float(size[v])))
    lines, sides = _block_edges(size)
    return PartModel(
        source_name="block.step",
        source_sha256="0" * 64,
        vertices=np.concatenate(vertices),
        normals=np.concatenate(normals),
        triangles=np.concatenate(triangles).astype(np.int32),
        triangle_faces=np.concatenate(owners).astype(np.int32),
        faces=tuple(faces),
        edge_points=lines.reshape(-1, 3),
        edge_starts=np.arange(0, 2 * len(lines) + 1, 2, dtype=np.int32),
        edge_faces=np.array(sides, dtype=np.int32),
        deflection_mm=0.01,
    )


def _plane(number: int, corners: Float, u: float, v: float) -> ModelFace:
    ends_u, ends_v = np.repeat([0.0, u], 2), np.repeat([0.0, v], 2)
    spline = SplineSurface(corners, np.ones((2, 2)), ends_u, ends_v, 1, 1)
    outline = np.array([[0.0, 0.0], [u, 0.0], [u, v], [0.0, v]])
    return ModelFace(number, "Plane", spline=spline, loops=(outline,))


def _block_edges(size: Float) -> tuple[Float, list[tuple[int, int]]]:
    """Return the twelve edges (12, 2, 3), mm, and the places of the faces on both sides."""
    lines, sides = [], []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for at_u in (0, 1):
            for at_v in (0, 1):
                line = np.zeros((2, 3))
                line[1, axis], line[:, u], line[:, v] = 1.0, at_u, at_v
                lines.append(line * size)
                sides.append((2 * u + at_u, 2 * v + at_v))
    return np.array(lines), sides
