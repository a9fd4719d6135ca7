"""Measured values as colours on a part: near the points that were touched, and nowhere else.

Smaller triangles where a picture needs them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

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


_ON_FACE_MM = 1.0
"""A place belongs to a face that it is this near to."""
_REACH = 0.75
"""Of the way to the nearest other point: the colours of neighbours overlap, and blend."""
_ROUND, _ROUND_MM = 1.65, 40.0
"""Times that way, and no farther: whether a place has points all round it."""
_MOST_MM, _LEAST_MM = 10.0, 0.3
_CORE_MM, _CORE = 2.0, 0.25
"""So near, and no farther than this share of its reach, a point counts without another one."""
_SURROUNDED = 0.5
"""The mean direction to points all round is short; that to points on one side has length one."""
_FINE = 4.0
"""So many triangles go from a point to where its colour ends."""
_MOST_TRIANGLES = 60_000


@dataclass(frozen=True, slots=True, eq=False)
class ValueField:
    """Values on a part."""

    mesh: RenderMesh
    """The part, with smaller triangles where there are values; it looks the same."""
    parents: Int
    """(n,): the vertex of the mesh before that each vertex has the colour of without a value."""
    values: Float
    """(n,): at the vertices; NaN where nothing was measured."""
    good: NDArray[np.bool_]
    """(n,): all points that a value comes from are good."""
    reach_mm: float
    """No value is farther from its points than this."""


def value_field(
    mesh: RenderMesh, points: Float, values: Float, good: Sequence[bool], owners: Sequence[str]
) -> ValueField | None:
    """Return values on the faces that points lie on; None where none of them lies on a face.

    A point counts on its own face and on those that belong to the same feature, up to three
    quarters of the way to the nearest other point there, and no farther than 10 mm. A place has a
    value where it is reached and has points all round it, or where it is within 2 mm of one:
    nothing is extrapolated. It is the mean of the points that reach it, weighted by the inverse
    square of the distance and falling to nothing where each ends (Franke and Nielson 1980): never
    more than the largest of them nor less than the smallest.

    Parameters
    ----------
    points, values, good
        (k, 3), mm, in the frame of the mesh, (k,) and (k,); what is not finite does not count.
    owners
        The feature that each face of the model belongs to; empty for none.
    """
    kept = np.isfinite(points).all(axis=1) & np.isfinite(values)
    points, values = points[kept], values[kept]
    fine = np.asarray(good, dtype=bool)[kept]
    if not np.isfinite(mesh.vertices).all():
        # Nobody knows what is near to a place that is no place.
        return None
    faces = _faces_of(mesh, points)
    on = faces >= 0
    points, values, fine, faces = points[on], values[on], fine[on], faces[on]
    if not len(points):
        return None
    group_of_face = _groups(owners, int(mesh.triangle_faces.max()) + 1)
    groups = group_of_face[faces]
    reaches, rounds = _reaches(points, groups)
    rows = np.isin(group_of_face[mesh.triangle_faces], groups)
    edges = np.minimum(reaches / _FINE, _CORE_MM / 2.0)
    fined, parents = finer(mesh, rows, points, float(reaches.max()), edges, _MOST_TRIANGLES)
    own = replace(fined, origins=np.arange(len(fined.vertices)))
    count = len(own.vertices)
    group_of_vertex = np.full(count, -1, dtype=np.int64)
    group_of_vertex[own.triangles] = group_of_face[own.triangle_faces][:, None]
    sums, weights, all_good = np.zeros(count), np.zeros(count), np.ones(count, dtype=bool)
    toward, number, is_near = np.zeros((count, 3)), np.zeros(count), np.zeros(count, dtype=bool)
    for group in np.unique(groups):
        near = np.flatnonzero(group_of_vertex == group)
        tree = cKDTree(own.vertices[near])
        for k in np.flatnonzero(groups == group):
            hit = near[tree.query_ball_point(points[k], reaches[k])]
            length = np.linalg.norm(own.vertices[hit] - points[k], axis=1)
            is_near[hit] |= length <= min(_CORE_MM, _CORE * reaches[k])
            away = length / reaches[k]
            weight = ((1.0 - np.minimum(away, 1.0)) / (away + 1e-3)) ** 2
            sums[hit] += weight * values[k]
            weights[hit] += weight
            all_good[hit] &= fine[k] | (weight <= 0.0)
            seen = near[tree.query_ball_point(points[k], rounds[k])]
            run = points[k] - own.vertices[seen]
            toward[seen] += run / np.maximum(np.linalg.norm(run, axis=1), 1e-12)[:, None]
            number[seen] += 1.0
    found = np.full(count, np.nan)
    sided = np.linalg.norm(toward, axis=1) > _SURROUNDED * number
    some = (weights > 0.0) & (is_near | ~sided)
    found[some] = sums[some] / weights[some]
    return ValueField(own, parents, found, all_good & some, float(reaches.max()))


def _groups(owners: Sequence[str], count: int) -> Int:
    """Return a number for each face, the same for those of one feature."""
    names = [owners[place] if place < len(owners) else "" for place in range(count)]
    first: dict[str, int] = {}
    return np.array(
        [first.setdefault(name, place) if name else place for place, name in enumerate(names)]
    )


def _reaches(points: Float, groups: Int) -> tuple[Float, Float]:
    """Return how far from each point its value counts, and how far it is one of those all round.

    Each is (k,), mm.
    """
    nearest = np.full(len(points), _CORE_MM / _CORE / _REACH)
    for group in np.unique(groups):
        rows = np.flatnonzero(groups == group)
        places = np.unique(np.round(points[rows], 6), axis=0)
        if len(places) > 1:
            # The nearest of all places is the point itself.
            away, _ = cKDTree(places).query(points[rows], k=2)
            nearest[rows] = np.asarray(away)[:, 1]
    reaches = np.clip(_REACH * nearest, _LEAST_MM, _MOST_MM)
    return reaches, np.minimum(_ROUND * nearest, _ROUND_MM)


def _faces_of(mesh: RenderMesh, points: Float) -> Int:
    """Return the face nearest to each point, (k,); -1 where none is near."""
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    low = np.minimum(np.minimum(a, b), c) - _ON_FACE_MM
    high = np.maximum(np.maximum(a, b), c) + _ON_FACE_MM
    found = np.full(len(points), -1, dtype=np.int64)
    for k, point in enumerate(points):
        near = np.flatnonzero(((point >= low) & (point <= high)).all(axis=1))
        if not len(near):
            continue
        away = _distances(point, a[near], b[near], c[near])
        best = int(np.argmin(away))
        if away[best] <= _ON_FACE_MM:
            found[k] = mesh.triangle_faces[near[best]]
    return found


def _distances(point: Float, a: Float, b: Float, c: Float) -> Float:
    """Return how far a point (3,) is from triangles with corners (m, 3), (m,)."""
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    unit = normal / np.maximum(length, 1e-300)[:, None]
    sides = [
        np.einsum("ij,ij->i", np.cross(q - p, point - p), unit) for p, q in ((a, b), (b, c), (c, a))
    ]
    above = (np.minimum.reduce(sides) >= 0.0) & (length > 1e-12)
    to_edges = np.minimum.reduce([_to_segment(point, p, q) for p, q in ((a, b), (b, c), (c, a))])
    flat: Float = np.abs(np.einsum("ij,ij->i", point - a, unit))
    return np.where(above, flat, to_edges)


def _to_segment(point: Float, start: Float, end: Float) -> Float:
    run = end - start
    square = np.maximum(np.einsum("ij,ij->i", run, run), 1e-300)
    share = np.clip(np.einsum("ij,ij->i", point - start, run) / square, 0.0, 1.0)
    away: Float = np.linalg.norm(point - start - share[:, None] * run, axis=1)
    return away
