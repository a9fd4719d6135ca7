"""Closed surfaces of a mesh, whose backs need no painting."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ocmm_core.geometry import Float, Int
from ocmm_core.rendering._mesh import RenderMesh

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
    ones = np.ones(len(begins), dtype=np.int8)
    graph = coo_array((ones, (begins, ends)), shape=(count, count))
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
