"""The mesh of a part as an obstacle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_cad.reach import _grow_kernel as kernel
from ocmm_core.geometry import Float, Int

_LONG, _MORE = 2.0, 0.25
"""Edges longer than this multiple of the median are halved; limit of added triangles, relative."""


@dataclass(frozen=True, slots=True, eq=False)
class Obstacle:
    """Mesh of a part and its tree of boxes."""

    triangles: Float
    """(n, 3, 3), mm, frame of the part; very long ones are divided."""
    faces: Int
    """(n,): face of each, from 0."""
    n_faces: int
    deflection_mm: float
    """mm: bound of the distance of the mesh from the faces."""
    boxes: Float
    links: Int
    order: Int
    """`boxes`, `links`, `order`: See `_grow_kernel.grow`."""

    @property
    def middle(self) -> Float:
        """Return the middle of the part's bounding box, (3,), mm."""
        middle: Float = 0.5 * (self.boxes[0, :3] + self.boxes[0, 3:])
        return middle


def make_obstacle(triangles: Float, faces: Int, n_faces: int, deflection_mm: float) -> Obstacle:
    """Return a part as an obstacle.

    `triangles`: (n, 3, 3), mm, n > 0. `faces`: (n,), from 0, less than `n_faces`. `deflection_mm`:
    bound of the distance of the mesh from the faces.
    """
    # Read-only arrays, e.g. from a pipe, are another type to the compiler: it would recompile all
    # loops, which takes longer than thousands of queries.
    triangles = np.require(triangles, np.float64, ("C", "W"))
    faces = np.require(faces, np.int64, ("C", "W"))
    triangles, faces = _without_long(triangles, faces)
    n = len(triangles)
    boxes, links = np.empty((2 * n, 6)), np.empty((2 * n, 2), dtype=np.int64)
    order = np.empty(n, dtype=np.int64)
    count = kernel.grow(triangles, boxes, links, order)
    return Obstacle(
        triangles, faces, n_faces, deflection_mm, boxes[:count].copy(), links[:count].copy(), order
    )


def _without_long(triangles: Float, faces: Int) -> tuple[Float, Int]:
    """Return triangles with the longest ones divided, and the face of each.

    A face with thousands of holes has triangles as long as the part, so that every near body would
    be tested against all in their leaf.
    """
    longest = _longest(triangles)
    least = _LONG * float(np.median(longest))
    most = int((1.0 + _MORE) * len(triangles))
    limit = 0.5 * float(longest.max())
    while limit > least:
        while (long := longest > limit).any():
            if len(triangles) + int(long.sum()) > most:
                return triangles, faces
            halves = _halved(triangles[long])
            triangles = np.concatenate([triangles[~long], halves])
            longest = np.concatenate([longest[~long], _longest(halves)])
            faces = np.concatenate([faces[~long], np.tile(faces[long], 2)])
        limit *= 0.5
    return triangles, faces


def _longest(triangles: Float) -> Float:
    edges = triangles - triangles[:, [1, 2, 0]]
    found: Float = np.sqrt((edges * edges).sum(axis=2).max(axis=1))
    return found


def _halved(triangles: Float) -> Float:
    """Return both halves of triangles, cut at the middle of the longest edge; (2 n, 3, 3)."""
    edges = triangles - triangles[:, [1, 2, 0]]
    first = (edges * edges).sum(axis=2).argmax(axis=1)
    rows = np.arange(len(triangles))
    a, b, c = (triangles[rows, (first + turn) % 3] for turn in range(3))
    middle = 0.5 * (a + b)
    return np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
