"""Which surfaces of a mesh are closed: their backs need not be painted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ocmm_core.geometry import Float, Int
from ocmm_core.rendering._mesh import RenderMesh

_SAME_MM = 1e-6
"""Vertices on an edge are there once for each face, from one place of the same edge."""


def with_closed(mesh: RenderMesh) -> RenderMesh:
    """Return a mesh that says which of its triangles belong to a closed surface.

    A surface is what hangs together. It is closed, its triangles all going round the same way,
    where as many of them go along every edge in one direction as in the other, and it is the right
    side out where it encloses a positive volume. What is not proven so, an open sheet or a shell
    that is inside out, is painted from both sides. Some 0.1 s for 100,000 triangles.
    """
    corners = _places(mesh.vertices)[mesh.triangles]
    count = int(corners.max(initial=-1)) + 1
    if not count or not np.isfinite(mesh.vertices).all():
        return mesh
    begins, ends = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    _, edge = np.unique(
        np.minimum(begins, ends) * count + np.maximum(begins, ends), return_inverse=True
    )
    # A triangle without an area goes along an edge there and back, or from a place to itself.
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
    """Return a number for each vertex (n, 3), the same for those at the same place."""
    grid = np.round(vertices / _SAME_MM)
    order = np.lexsort(grid.T)
    is_new = np.ones(len(order), dtype=bool)
    is_new[1:] = (np.diff(grid[order], axis=0) != 0.0).any(axis=1)
    numbers = np.empty(len(order), dtype=np.int64)
    numbers[order] = np.cumsum(is_new) - 1
    return numbers
