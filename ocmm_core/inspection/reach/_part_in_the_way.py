"""The mesh of a part as something that can be run into."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.geometry import Float, Int
from ocmm_core.inspection.reach import _grow_kernel as kernel


@dataclass(frozen=True, slots=True, eq=False)
class Obstacle:
    """The mesh of a part and the tree of boxes over it.

    Attributes
    ----------
    triangles
        (n, 3, 3), mm, frame of the part.
    faces
        (n,): to which face each belongs, from 0.
    n_faces
        How many faces there are.
    deflection_mm
        No triangle is farther from its face.
    boxes, links, order
        See `_grow_kernel.grow`.
    """

    triangles: Float
    faces: Int
    n_faces: int
    deflection_mm: float
    boxes: Float
    links: Int
    order: Int

    @property
    def middle(self) -> Float:
        """Return the middle of the box about the part, (3,), mm."""
        middle: Float = 0.5 * (self.boxes[0, :3] + self.boxes[0, 3:])
        return middle


def make_obstacle(triangles: Float, faces: Int, n_faces: int, deflection_mm: float) -> Obstacle:
    """Return a part that can be run into.

    Parameters
    ----------
    triangles
        (n, 3, 3), mm, n > 0.
    faces
        (n,): number of the face of each, from 0.
    n_faces
        More than the largest of them.
    deflection_mm
        No triangle is farther from its face.
    """
    triangles = np.ascontiguousarray(triangles, dtype=np.float64)
    faces = np.ascontiguousarray(faces, dtype=np.int64)
    n = len(triangles)
    boxes, links = np.empty((2 * n, 6)), np.empty((2 * n, 2), dtype=np.int64)
    order = np.empty(n, dtype=np.int64)
    count = kernel.grow(triangles, boxes, links, order)
    return Obstacle(
        triangles, faces, n_faces, deflection_mm, boxes[:count].copy(), links[:count].copy(), order
    )
