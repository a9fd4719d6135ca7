"""Measured values as colours on a part near touched points, with local refinement.

Also the choice of the view direction to a place on a part.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ocmm_core.geometry import Float, Int, perpendicular_pair
from ocmm_gui.rendering._mesh import RenderMesh

_MOST_ROUNDS = 40


def finer(
    mesh: RenderMesh, rows: NDArray[np.bool_], points: Float, reach_mm: float, longest_mm: Float,
    most: int,
) -> tuple[RenderMesh, Int]:  # fmt: skip
    """Return a mesh refined near some points, and the original vertex of each vertex.

    Edges that are too long and nearer to a point than ``reach_mm`` are halved, the longest of a
    triangle first, on both sides: surface and outline stay the same, without gaps. Beyond ``most``
    new triangles, edges stay longer. `rows`: (m,): triangles that may be divided. `points`,
    `longest_mm`: (k, 3), mm, and (k,): maximum length of the edges nearest to a point. Returns also
    (n,) the vertex of ``mesh`` nearest along the divided edges.
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
        # The midpoint is independent of the order of the ends.
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
"""Maximum distance of a point from its face."""
_REACH = 0.75
"""Share of the distance to the nearest other point: neighbouring colours overlap and blend."""
_ROUND, _ROUND_MM = 1.65, 40.0
"""Factor on that distance, and limit, for being surrounded by points."""
_MOST_MM, _LEAST_MM = 10.0, 0.3
_CORE_MM, _CORE = 2.0, 0.25
"""Within this distance, and this share of its reach, a single point suffices."""
_SURROUNDED = 0.5
"""The mean direction to surrounding points is short; to points on one side it has length one."""
_FINE = 4.0
"""Triangles between a point and the end of its colour."""
_MOST_TRIANGLES = 60_000


@dataclass(frozen=True, slots=True, eq=False)
class ValueField:
    mesh: RenderMesh
    """The part, refined near values; its shape is unchanged."""
    parents: Int
    """(n,): original vertex whose colour each vertex has without a value."""
    values: Float
    """(n,): at the vertices; NaN if not measured."""
    good: NDArray[np.bool_]
    """(n,): all contributing points are good."""
    reach_mm: float
    """Maximum distance of a value from its points."""


def value_field(
    mesh: RenderMesh, points: Float, values: Float, good: Sequence[bool], owners: Sequence[str]
) -> ValueField | None:
    """Return values on the faces with points; None if no point is on a face.

    A point counts on its own face and on those of the same feature, up to three quarters of the
    distance to the nearest other point, 10 mm at most. A place has a value if it is reached and
    surrounded by points, or within 2 mm of one: no extrapolation. Values are means of the points in
    reach, weighted by the inverse square of the distance, with weights vanishing at the end of each
    reach (Franke and Nielson 1980), so within the range of the points. `points`, `values`, `good`:
    (k, 3), mm, in the frame of the mesh, (k,) and (k,); non-finite ones are ignored. `owners`:
    feature of each face of the model; empty for none.
    """
    kept = np.isfinite(points).all(axis=1) & np.isfinite(values)
    points, values = points[kept], values[kept]
    fine = np.asarray(good, dtype=bool)[kept]
    if not np.isfinite(mesh.vertices).all():
        # Distances to a non-finite place are undefined.
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
    """Return a number per face, equal within a feature."""
    names = [owners[place] if place < len(owners) else "" for place in range(count)]
    first: dict[str, int] = {}
    return np.array(
        [first.setdefault(name, place) if name else place for place, name in enumerate(names)]
    )


def _reaches(points: Float, groups: Int) -> tuple[Float, Float]:
    """Return reach and surrounding distance of each point, both (k,), mm."""
    nearest = np.full(len(points), _CORE_MM / _CORE / _REACH)
    for group in np.unique(groups):
        rows = np.flatnonzero(groups == group)
        places = np.unique(np.round(points[rows], 6), axis=0)
        if len(places) > 1:
            # The nearest of all places is the point itself.
            away, _ = cKDTree(places).query(points[rows], k=2)
            nearest[rows] = np.asarray(away)[:, 1]
    return np.clip(_REACH * nearest, _LEAST_MM, _MOST_MM), np.minimum(_ROUND * nearest, _ROUND_MM)


def _faces_of(mesh: RenderMesh, points: Float) -> Int:
    """Return the face nearest to each point, (k,); -1 if none is near."""
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
    """Return the distances (m,) of a point (3,) from triangles with corners (m, 3)."""
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


_KEPT_COS = float(np.cos(np.radians(72.0)))
"""A view is kept while the surface is turned less than this from the eye."""
_GOOD_COS = float(np.cos(np.radians(58.0)))
"""New views are closer to perpendicular, so that they last for a while."""
_ELEVATIONS = np.radians([28.0, 45.0, 62.0, 12.0, 80.0, -12.0, -30.0, -50.0])
_AZIMUTHS = np.radians(np.arange(0.0, 360.0, 20.0))
_LATER_WORTH = 1.6
"""Extra turn, rad, for a view from which all later places are visible."""
_LIFT_PRICE = 0.35
"""Cost of turning over the vertical relative to turning about it: people walk round a part."""


def choose_side(
    toward: Float, normal: Float, up: Float, is_hidden: Callable[[Float], bool], later: Float
) -> Float:
    """Return a unit vector (3,) to the eye for viewing a place on a surface.

    The current view is kept while the place is visible; otherwise the nearest with a view of it,
    preferably from above. If there is none, the most perpendicular one.

    Parameters
    ----------
    toward
        (3,), unit: to the current eye.
    normal
        (3,), unit, outward at the place; zero if unknown.
    up
        (3,), unit.
    is_hidden
        Whether the part is between the place and a distant eye in a direction (3,).
    later
        (n, 3): outward normals at later places. A view that shows more of them may be farther, as
        it saves later turns.
    """
    known = bool(np.any(normal))
    if (not known or float(normal @ toward) > _KEPT_COS) and not is_hidden(toward):
        return toward
    sides = _sides(up)
    facing = sides @ normal if known else np.ones(len(sides))
    turn = np.arccos(np.clip(sides @ toward, -1.0, 1.0))
    price = turn + _LIFT_PRICE * np.abs(np.arcsin(np.clip(sides @ up, -1.0, 1.0)) - _ELEVATIONS[0])
    if len(later):
        price = price - _LATER_WORTH * (sides @ later.T > _KEPT_COS).mean(axis=1)
    order = np.argsort(price, kind="stable")
    for least in (_GOOD_COS, 0.12):
        for side in sides[order[facing[order] > least]]:
            if not is_hidden(side):
                best: Float = side
                return best
    # Such as a deep bore. The place is then drawn through the part.
    return sides[int(np.argmax(facing - 0.01 * price))] if known else toward


def _sides(up: Float) -> Float:
    east, north = perpendicular_pair(up)
    flat = np.outer(np.cos(_AZIMUTHS), east) + np.outer(np.sin(_AZIMUTHS), north)
    sides: Float = (
        np.cos(_ELEVATIONS)[:, None, None] * flat + np.sin(_ELEVATIONS)[:, None, None] * up
    ).reshape(-1, 3)
    return sides
