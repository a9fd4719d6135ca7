"""Smaller triangles where a picture needs them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ocmm_core.geometry import Float, Int
from ocmm_core.rendering._mesh import RenderMesh

_MOST_ROUNDS = 40


def finer(
    mesh: RenderMesh, rows: NDArray[np.bool_], points: Float, reach_mm: float, longest_mm: Float,
    most: int,
) -> tuple[RenderMesh, Int]:  # fmt: skip
    """Return a mesh whose triangles near some points are small, and whose vertex each one is.

    An edge that is longer than wanted, and nearer to a point than ``reach_mm``, is halved, the
    longest of a triangle first, on both sides of it: surface and outline stay what they are, and
    no gap opens. Where there would be more than ``most`` new triangles the edges stay longer.

    Parameters
    ----------
    rows
        (m,): triangles that may be divided.
    points, longest_mm
        (k, 3), mm, and (k,): edges nearest to a point become no longer than that.

    Returns
    -------
    tuple
        The mesh, and (n,) the vertex of ``mesh`` that is nearest along the edges divided.
    """
    tree, shortest = cKDTree(points), float(longest_mm.min())
    vertices, normals = mesh.vertices, mesh.normals
    parents = np.arange(len(vertices))
    kept = [np.flatnonzero(~rows)]
    done: list[Int] = [mesh.triangles[kept[0]].astype(np.int64)]
    source = np.flatnonzero(rows)
    left = mesh.triangles[source].astype(np.int64)
    made = 0
    for _ in range(_MOST_ROUNDS):
        starts, ends = left, np.roll(left, -1, axis=1)
        length = np.linalg.norm(vertices[ends] - vertices[starts], axis=2)
        long = length > shortest
        middle = 0.5 * (vertices[starts[long]] + vertices[ends[long]])
        # Seen from both sides an edge has the same middle, whichever end comes first.
        away, nearest = tree.query(middle)
        long[long] = (away < reach_mm + length[long]) & (length[long] > longest_mm[nearest])
        halved = long.any(axis=1)
        done.append(left[~halved])
        kept.append(source[~halved])
        left, source, length, long = left[halved], source[halved], length[halved], long[halved]
        made += len(left)
        if not len(left) or made > most:
            break
        side = np.argmax(np.where(long, length, -1.0), axis=1)
        row = np.arange(len(left))
        p, q, r = (left[row, (side + k) % 3] for k in range(3))
        count = len(vertices)
        keys, place = np.unique(np.minimum(p, q) * count + np.maximum(p, q), return_inverse=True)
        one, two = keys // count, keys % count
        normal = normals[one] + normals[two]
        size = np.linalg.norm(normal, axis=1, keepdims=True)
        vertices = np.concatenate([vertices, 0.5 * (vertices[one] + vertices[two])])
        normals = np.concatenate(
            [normals, np.where(size > 1e-6, normal / np.maximum(size, 1e-6), normals[one])]
        )
        parents = np.concatenate([parents, parents[one]])
        new = count + place
        left = np.concatenate([np.stack([p, new, r], axis=1), np.stack([new, q, r], axis=1)])
        source = np.concatenate([source, source])
    done.append(left)
    kept.append(source)
    order = np.concatenate(kept)
    return (
        replace(
            mesh,
            vertices=np.ascontiguousarray(vertices),
            normals=np.ascontiguousarray(normals),
            triangles=np.ascontiguousarray(np.concatenate(done), dtype=np.int32),
            triangle_faces=np.ascontiguousarray(mesh.triangle_faces[order]),
            closed=np.ascontiguousarray(mesh.closed[order]),
            origins=mesh.origins[parents],
        ),
        parents,
    )
