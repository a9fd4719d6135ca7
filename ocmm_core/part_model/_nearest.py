"""Exact nearest point of trimmed faces, and why it may not be usable for measuring.

Boxes around flat pieces of the surface bound the distance of each piece (`_trimming`). From the
nearest one Newton's method goes to a foot (`_spline`); every piece whose box is not farther than
that foot plus a margin is also tried, so that a nearer place of another face, or of the other side
of a fold, is not missed. All other pieces are farther by proof.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, Int, Points3
from ocmm_core.part_model import _spline as spline
from ocmm_core.part_model._part_model import ModelFace
from ocmm_core.part_model._trimming import Patches, Trimming, patches_of, trimming_of

RIVAL_MM = 0.1
"""Margin within which a second foot makes the touched place ambiguous."""
EDGE_MM = 0.05
"""Uncertainty of outlines: a foot nearer to an edge is on it."""
STRETCH = 0.1
"""Minimum stretch of a usable foot, see `Feet.stretches`."""

_SAME = 1e-4
"""mm: feet nearer to each other count as one."""
_CHUNK = 512


@dataclass(frozen=True, slots=True, eq=False)
class SearchedFace:
    """Face prepared for the search: its surface, outline and the pieces inside the outline."""

    number: int
    outward: bool
    surface: spline.BezierSurface
    trimming: Trimming
    patches: Patches


@dataclass(frozen=True, slots=True, eq=False)
class Feet:
    """Nearest places of faces to n points."""

    faces: Int
    """(n,): indices of the searched faces; -1 where only an edge is near."""
    parameters: Float
    """(n, 2): of the foot on the surface of its face."""
    feet: Points3
    """(n, 3), mm."""
    normals: Points3
    """(n, 3), unit: out of the material; on an edge towards the point."""
    distances: Float
    """(n,), mm: positive outside the material; on an edge the sign of the face next to it."""
    curvatures: Float
    """(n, 2), 1/mm: positive if the material bends away (a shaft)."""
    edge_gaps: Float
    """(n,), mm: from the foot to the nearest edge."""
    rivals: Float
    """(n,), mm: extra distance of the next foot; infinite without one within `RIVAL_MM`."""
    on_edge: spline.Bool
    """(n,): the nearest place is on an edge, or not distinguishable from one."""
    stretches: Float
    """(n,): minimum of 1 + distance times curvature; 0 in a centre of curvature.

    A shift of the point shifts its foot by that shift divided by this."""

    @property
    def doubts(self) -> tuple[str, ...]:
        """Return for each point why its distance is not usable; empty if it is."""
        return tuple(
            "the nearest place is on an edge of the face"
            if edge
            else "two places of the face are nearly as near"
            if rival <= RIVAL_MM
            else "the point is near or beyond the centre of curvature of the face"
            if stretch < STRETCH
            else ""
            for edge, rival, stretch in zip(self.on_edge, self.rivals, self.stretches, strict=True)
        )


def searched_face(face: ModelFace) -> SearchedFace:
    """Return a face prepared for `nearest_feet`; InputError without a spline surface."""
    if face.spline is None:
        raise InputError(
            "model.no_surface",
            f"The model holds no surface of face {face.number}.",
            "Choose another face, or export the model with surfaces.",
        )
    surface = spline.bezier_surface(face.spline)
    trimming = trimming_of(surface, face.loops)
    patches = patches_of(surface)
    inside = trimming.crosses(patches.low, patches.high)
    inside |= trimming.holds(0.5 * (patches.low + patches.high))
    return SearchedFace(
        face.number, face.outward, surface, trimming, patches.kept(np.flatnonzero(inside))
    )


def nearest_feet(points: Points3, faces: Sequence[SearchedFace]) -> Feet:
    """Return nearest places of points (n, 3), mm, model frame; InputError: not finite, no faces."""
    points = np.asarray(points, dtype=np.float64).reshape(-1, 3)
    if not faces or not np.all(np.isfinite(points)):
        raise InputError(
            "model.nearest",
            "A nearest place is asked for without a face, or of a point that is not finite.",
            "Name at least one face of the model.",
        )
    chunks = [
        _nearest(points[first : first + _CHUNK], faces)
        for first in range(0, max(len(points), 1), _CHUNK)
    ]
    names = Feet.__dataclass_fields__
    return Feet(*(np.concatenate([getattr(chunk, name) for chunk in chunks]) for name in names))


def followed_feet(points: Points3, faces: Sequence[SearchedFace], before: Feet) -> Feet:
    """Return the feet of points that moved a little, from their previous feet.

    For the steps of an iteration: it considers no other face, edge or second foot, and the result
    is to be checked by `nearest_feet`. Points without a foot inside are searched again.
    """
    lost = np.flatnonzero(before.faces < 0)
    found = {name: getattr(before, name).copy() for name in Feet.__dataclass_fields__}
    for i, face in enumerate(faces):
        rows = np.flatnonzero(before.faces == i)
        if not len(rows):
            continue
        at, feet = spline.feet_from(face.surface, points[rows], before.parameters[rows])
        normals = spline.normals_at(face.surface, at) * (1.0 if face.outward else -1.0)
        found["parameters"][rows], found["feet"][rows], found["normals"][rows] = at, feet, normals
        found["distances"][rows] = np.einsum("ni,ni->n", points[rows] - feet, normals)
    if len(lost):
        again = nearest_feet(points[lost], faces)
        for name in found:
            found[name][lost] = getattr(again, name)
    return Feet(**found)


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    """k rows of point, face, parameters, place and distance."""

    points: Int
    faces: Int
    parameters: Float
    feet: Float
    distances: Float

    @classmethod
    def joined(cls, parts: Sequence[_Found]) -> _Found:
        return cls(*(np.concatenate([getattr(part, name) for part in parts])
                     for name in cls.__dataclass_fields__))  # fmt: skip


def _nearest(points: Points3, faces: Sequence[SearchedFace]) -> Feet:
    n = len(points)
    edge, edge_place, edge_face = _edges_near(points, faces)
    # The nearest piece of each face gives an upper bound of the distance for the others.
    least = [_bounds(points, face) for face in faces]
    found = [
        _first(points, i, face, bounds)
        for i, (face, bounds) in enumerate(zip(faces, least, strict=True))
    ]
    best = edge.copy()
    for own in found:
        np.minimum.at(best, own.points, own.distances)
    margin = best + RIVAL_MM
    found += [
        _others(points, i, face, bounds, margin)
        for i, (face, bounds) in enumerate(zip(faces, least, strict=True))
    ]
    all_feet = _Found.joined(found)
    order = np.lexsort((all_feet.distances, all_feet.points))
    all_feet = _Found(*(getattr(all_feet, name)[order] for name in _Found.__dataclass_fields__))
    firsts = np.full(n, -1)
    firsts[all_feet.points[::-1]] = np.arange(len(order))[::-1]
    has = firsts >= 0
    return _feet(points, faces, all_feet, firsts, has, (edge, edge_place, edge_face))


def _feet(
    points: Points3,
    faces: Sequence[SearchedFace],
    found: _Found,
    firsts: Int,
    has: spline.Bool,
    edges: tuple[Float, Float, Int],
) -> Feet:
    n = len(points)
    edge, edge_place, edge_face = edges
    number = np.where(has, found.faces[firsts] if len(found.faces) else 0, -1).astype(np.int64)
    parameters = np.full((n, 2), np.nan)
    feet, distances = edge_place.copy(), edge.copy()
    own = firsts[has]
    parameters[has], inner = found.parameters[own], found.distances[own]
    # Nearer than every foot inside: an edge. A foot on the edge itself is as near.
    nearer = np.zeros(n, dtype=bool)
    nearer[has] = edge[has] < inner - 1e-9
    use = has.copy()
    use[has] &= ~nearer[has]
    feet[use], distances[use] = found.feet[firsts[use]], found.distances[firsts[use]]
    number[~use] = -1
    normals, curvatures = np.zeros((n, 3)), np.full((n, 2), np.nan)
    gaps = np.zeros(n)
    for i, face in enumerate(faces):
        rows = np.flatnonzero(use & (number == i))
        if not len(rows):
            continue
        sign = 1.0 if face.outward else -1.0
        normals[rows] = sign * spline.normals_at(face.surface, parameters[rows])
        curvatures[rows] = spline.curvatures_at(face.surface, parameters[rows], normals[rows])
        gaps[rows] = face.trimming.nearest_edge(feet[rows])[0]
    arms = points - feet
    side = np.einsum("ni,ni->n", arms, normals)
    for row in np.flatnonzero(~use):
        normals[row], side[row] = _beside_edge(points[row], faces[edge_face[row]], feet[row])
    signed = np.where(side < 0.0, -distances, distances)
    stretches = np.min(1.0 + signed[:, None] * curvatures, axis=1)
    rivals = _rivals(found, firsts, use, n)
    # An edge elsewhere that is nearly as near. Beside a foot on a flat face it lies within what
    # the circle about the point allows.
    near_edge = np.linalg.norm(edge_place - feet, axis=1)
    usual = 1.5 * np.sqrt(2.0 * distances * RIVAL_MM + RIVAL_MM**2)
    elsewhere = use & (edge - distances < RIVAL_MM) & (near_edge > usual)
    rivals[elsewhere] = np.minimum(rivals[elsewhere], np.maximum(edge - distances, 0.0)[elsewhere])
    return Feet(
        number, parameters, feet, normals, signed, curvatures, gaps, rivals,
        ~use | (gaps < EDGE_MM), np.where(use, stretches, 0.0),
    )  # fmt: skip


def _rivals(found: _Found, firsts: Int, use: spline.Bool, n: int) -> Float:
    rivals = np.full(n, np.inf)
    rows = np.flatnonzero(use[found.points])
    point = found.points[rows]
    first = firsts[point]
    apart = np.linalg.norm(found.feet[rows] - found.feet[first], axis=1) > _SAME
    more = found.distances[rows] - found.distances[first]
    near = apart & (more <= RIVAL_MM)
    np.minimum.at(rivals, point[near], more[near])
    return rivals


def _beside_edge(point: Float, face: SearchedFace, foot: Float) -> tuple[Float, float]:
    """Return the direction from an edge to a point, out of the material, and its side."""
    start = _place_near(face, foot)
    normal = spline.normals_at(face.surface, start[None])[0] * (1.0 if face.outward else -1.0)
    arm = point - foot
    side = float(arm @ normal)
    length = float(np.linalg.norm(arm))
    if length < 1e-12:
        return normal, 0.0
    return arm / length * (1.0 if side >= 0.0 else -1.0), side


def _place_near(face: SearchedFace, place: Float) -> Float:
    patches = face.patches
    if not len(patches.low):
        return 0.5 * (face.surface.low + face.surface.high)
    all_ = np.arange(len(patches.low))
    bounds = patches.at_least(np.broadcast_to(place, (len(all_), 3)), all_)
    start = np.argmin(bounds)
    middle = 0.5 * (patches.low[start] + patches.high[start])
    found: Float = spline.feet_from(face.surface, place[None], middle[None])[0][0]
    return found


def _edges_near(points: Points3, faces: Sequence[SearchedFace]) -> tuple[Float, Float, Int]:
    distance = np.full(len(points), np.inf)
    place, owner = np.full((len(points), 3), np.inf), np.zeros(len(points), dtype=np.int64)
    for i, face in enumerate(faces):
        own, at = face.trimming.nearest_edge(points)
        nearer = own < distance
        distance[nearer], place[nearer], owner[nearer] = own[nearer], at[nearer], i
    return distance, place, owner


def _bounds(points: Points3, face: SearchedFace) -> Float:
    """Return lower bounds of the distance of the ball about every patch, (n, k), mm."""
    middles = face.patches.middles
    centre = middles.mean(axis=0) if len(middles) else np.zeros(3)
    a, b = points - centre, middles - centre
    squares = np.sum(a * a, axis=1)[:, None] - 2.0 * a @ b.T + np.sum(b * b, axis=1)
    # Upper bound of the cancellation error of large squares.
    lost = 1e-6 * (1.0 + np.sqrt(np.abs(squares).max(initial=0.0)))
    bounds: Float = np.sqrt(np.maximum(squares, 0.0)) - face.patches.radii - lost
    return bounds


def _first(points: Points3, number: int, face: SearchedFace, bounds: Float) -> _Found:
    """Return the feet from the nearest pieces of a face."""
    if not bounds.shape[1]:
        return _none()
    rows = np.arange(len(points))
    most = min(8, bounds.shape[1])
    near = np.argpartition(bounds, most - 1, axis=1)[:, :most]
    boxes = face.patches.at_least(
        np.repeat(points, most, axis=0), near.ravel()
    ).reshape(-1, most)  # fmt: skip
    start = near[rows, np.argmin(boxes, axis=1)]
    return _to_feet(points, number, face, rows, start)


def _others(
    points: Points3, number: int, face: SearchedFace, bounds: Float, margin: Float
) -> _Found:
    """Return the feet from all pieces of a face that may be nearer than the margins (n,)."""
    rows, patches = np.nonzero(bounds < margin[:, None])
    near = face.patches.at_least(points[rows], patches) < margin[rows]
    return _to_feet(points, number, face, rows[near], patches[near])


def _to_feet(points: Points3, number: int, face: SearchedFace, rows: Int, patches: Int) -> _Found:
    if not len(rows):
        return _none()
    start = 0.5 * (face.patches.low[patches] + face.patches.high[patches])
    parameters, places = spline.feet_from(face.surface, points[rows], start)
    distances = np.linalg.norm(places - points[rows], axis=1)
    inside = face.trimming.holds(_nudged(face.surface, parameters))
    return _Found(
        rows[inside], np.full(np.count_nonzero(inside), number), parameters[inside],
        places[inside], distances[inside],
    )  # fmt: skip


def _nudged(surface: spline.BezierSurface, parameters: Float) -> Float:
    """Return parameters (m, 2) with those on a side of the surface moved inwards slightly.

    Rays count a side of the outline that runs along the surface's own to one side of it only.
    """
    span = 1e-9 * (surface.high - surface.low)
    return np.clip(parameters, surface.low + span, surface.high - span)


def _none() -> _Found:
    return _Found(
        np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros((0, 2)),
        np.zeros((0, 3)), np.zeros(0),
    )  # fmt: skip
