"""Group faces into surfaces, and place targets for a ball on each.

Two bores on one axis stay two; two halves of one bore become one. Needs no OCP.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ocmm_cad.reach import Reach
from ocmm_cad.step import _place_kernel as kernel
from ocmm_cad.step._placed import Placed, Wish, bore_axis, in_order, placed_each, triples
from ocmm_cad.step._profiled import OPEN, StepSurface
from ocmm_cad.step.brep import RawFace, Rim, StepFace, stretches_of
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float

Inside: TypeAlias = Callable[[Sequence[int], Float], NDArray[np.bool_]]
"""Tells which points (n, 3), mm, lie inside the edges of faces, by their numbers."""
NOT_INSIDE = "its places fail the check of the geometry library: they lie outside of its edges"
_SAME_MM, _SAME_RAD = 1e-4, 1e-6
_LEAST_TURN = np.radians(170.0)
"""A round surface that spans less is a fillet, not selected by default."""
_NARROW_GAP = np.radians(20.0)
EDGE_MM = 1.0
"""Distance of targets from edges, by the accuracy of a hand."""
_HOLLOW = -0.1
"""An edge falls away if the normal beyond it leans back by more than this."""
_SAME_AXIS, _MOST_AXES = np.cos(np.radians(1.0)), 40
_AT_ONCE = 64
"""Surfaces per call for targets."""
_SPARE = 2
"""Multiple of the usual points that is placed, for users who want more."""


@dataclass(frozen=True, slots=True, eq=False)
class Room:
    """A surface, and room for a ball by its own edges; fields as `StepSurface`."""

    face: StepFace
    numbers: tuple[int, ...]
    order: Float
    """(n, 3), mm: places in order of preference."""
    against: str = ""


def rooms_of(
    faces: Sequence[RawFace], ball_radius: float, doing: Callable[[str], None] = lambda _: None
) -> list[Room]:
    """Return surfaces and the room for a ball, `ball_radius` mm, without the mesh."""
    groups = _groups(faces)
    hollow = _hollow_rims(faces, groups)
    rooms = []
    for number, group in enumerate(groups, start=1):
        doing(f"places on surface {number} of {len(groups)}")
        rooms.append(_room([faces[i] for i in group], [hollow[i] for i in group], ball_radius))
    return rooms


def surfaces_of(
    rooms: Sequence[Room],
    reach: Reach | None = None,
    doing: Callable[[str], None] = lambda _: None,
    inside: Inside | None = None,
) -> list[StepSurface]:
    """Return surfaces with targets.

    `reach`: None to skip. `inside`: checks each target; if one fails, all places of that surface
    are checked and its targets selected again.
    """
    surfaces = []
    for start in range(0, len(rooms), _AT_ONCE):
        doing(f"targets on surface {start + 1} of {len(rooms)}")
        surfaces += _placed(rooms[start : start + _AT_ONCE], reach)
    if inside is None:
        return surfaces
    for row, one in enumerate(surfaces):
        if not one.targets or inside(one.numbers, np.array(one.targets)).all():
            continue
        room = rooms[row]
        kept = room.order[inside(room.numbers, room.order)]
        if len(kept) < Shape(room.face.shape).spec.usual_points:
            surfaces[row] = _surface(replace(room, against=NOT_INSIDE), None)
        else:
            (surfaces[row],) = _placed([replace(room, order=kept)], reach)
    return surfaces


def _placed(rooms: Sequence[Room], reach: Reach | None) -> list[StepSurface]:
    found = iter(placed_each([_wish(room) for room in rooms if not room.against], reach))
    return [_surface(room, None if room.against else next(found)) for room in rooms]


def bore_axes(faces: Sequence[StepFace]) -> Float:
    """Return the distinct directions of hollow round surfaces (m, 3)."""
    found = [axis for one in faces if (axis := bore_axis(one)) is not None]
    axes = np.array(found).reshape(-1, 3)
    kept: list[int] = []
    for row, axis in enumerate(axes):
        if len(kept) < _MOST_AXES and (np.abs(axes[kept] @ axis) < _SAME_AXIS).all():
            kept.append(row)
    return axes[kept]


def _groups(faces: Sequence[RawFace]) -> list[list[int]]:
    round_ones = [index for index, one in enumerate(faces) if one.face.shape != "Plane"]
    points = np.array([faces[index].face.point for index in round_ones]).reshape(-1, 3)
    near = cKDTree(points).query_pairs(_SAME_MM) if round_ones else ()
    one = [
        (i, j) for i, j in ((round_ones[a], round_ones[b]) for a, b in near)
        if _is_same(faces[i].face, faces[j].face) and _is_whole(faces[i], faces[j])
    ]  # fmt: skip
    links = np.zeros((2, 0), dtype=np.int64) if not one else np.array(one).T
    graph = coo_array((np.ones(len(one)), links), shape=(len(faces),) * 2)
    groups: dict[int, list[int]] = {}
    for index, group in enumerate(connected_components(graph, directed=False)[1].tolist()):
        groups.setdefault(group, []).append(index)
    return list(groups.values())


def _is_same(one: StepFace, other: StepFace) -> bool:
    """Return whether two round faces at one point would be one surface if untrimmed."""
    if (one.shape, one.inner) != (other.shape, other.inner):
        return False
    turned = float(np.linalg.norm(np.cross(one.direction, other.direction)))
    if one.shape == "Sphere":
        turned = 0.0
    sizes = np.subtract((one.radius, one.second), (other.radius, other.second))
    return (
        turned < _SAME_RAD
        and bool(np.abs(sizes).max() < _SAME_MM)
        and abs(one.half_angle - other.half_angle) < _SAME_RAD
    )


def _is_whole(one: RawFace, other: RawFace) -> bool:
    """Return whether nothing lies between two faces along their axis, if they have one."""
    if one.face.shape not in ("Cylinder", "Cone"):
        return True
    low, high = max(one.face.low, other.face.low), min(one.face.high, other.face.high)
    if high - low > _SAME_MM:
        return True
    # One ends where the other starts: they are one only with a common edge.
    return any(_is_one_edge(a, b) for a in one.rims for b in other.rims)


def _is_one_edge(one: Rim, other: Rim) -> bool:
    first, second = _marks((one, other))
    return bool(np.abs(first - second).max() < _SAME_MM)


def _marks(rims: Sequence[Rim]) -> Float:
    """Return the marks of edges, (n, 7), mm: middle, that of the ends, their distance."""
    first = np.array([rim.line[0] for rim in rims])
    last = np.array([rim.line[-1] for rim in rims])
    middle = np.array([rim.line[len(rim.line) // 2] for rim in rims])
    return np.column_stack([middle, 0.5 * (first + last), np.linalg.norm(last - first, axis=1)])


def _hollow_rims(faces: Sequence[RawFace], groups: Sequence[Sequence[int]]) -> list[list[Float]]:
    """Return for each face the edges that a target must keep away from: first those that fall away.

    Then those beyond which material rises. Seams, and edges inside one surface, are none.
    """
    group_of = {index: number for number, group in enumerate(groups) for index in group}
    owners = [(i, rim) for i, one in enumerate(faces) for rim in one.rims]
    none = np.empty((0, 2, 3))
    kept: list[tuple[list[Float], list[Float]]] = [([none], [none]) for _ in faces]
    if not owners:
        return [[none, none] for _ in faces]
    marks = _marks([rim for _, rim in owners])
    same: Any = cKDTree(marks).query_ball_point(marks, _SAME_MM)
    for number, near in enumerate(same):
        index, rim = owners[number]
        beyond = [other for other in near if other != number]
        if any(group_of[owners[other][0]] == group_of[index] for other in beyond):
            continue
        falls = bool(beyond) and all(
            _falls_away(faces[index], rim, owners[other][1]) for other in beyond
        )
        kept[index][0 if falls else 1].append(stretches_of(rim.line))
    return [[np.concatenate(falls), np.concatenate(rises)] for falls, rises in kept]


def _falls_away(face: RawFace, rim: Rim, beyond: Rim) -> bool:
    """Return whether the material ends at an edge: the face beyond is turned away."""
    half = len(rim.line) // 2
    along = rim.line[half + 1] - rim.line[half - 1]
    lean: float = kernel.leans_inward(
        rim.line[half], along, rim.normal, face.places, beyond.normal
    )  # fmt: skip
    return lean < _HOLLOW


def _room(group: Sequence[RawFace], hollow: Sequence[Sequence[Float]], ball_radius: float) -> Room:
    face = _joined([one.face for one in group])
    numbers = tuple(one.number for one in group)
    places = np.concatenate([one.places for one in group])
    wanted = Shape(face.shape).spec.usual_points
    against = _against(face, places, ball_radius) if all(one.is_closed for one in group) else OPEN
    if against:
        return Room(face, numbers, np.empty((0, 3)), against)
    places = places[_ball_fits(face, places, ball_radius)]
    falls = np.concatenate([both[0] for both in hollow])
    rises = np.concatenate([both[1] for both in hollow])
    wide = ball_radius + EDGE_MM
    to_falls = kernel.distances(places, falls, wide)
    to_rises = kernel.distances(places, rises, wide)
    free = places[np.minimum(to_falls, to_rises) >= wide]
    if len(free) < wanted:
        free = places[(to_falls >= EDGE_MM) & (to_rises >= wide)]
    if len(free) < wanted:
        against = f"a ball of {2.0 * ball_radius:g} mm has no room for {wanted} points"
        return Room(face, numbers, np.empty((0, 3)), against)
    return Room(face, numbers, in_order(free, _SPARE * wanted))


def _wish(room: Room) -> Wish:
    wanted = Shape(room.face.shape).spec.usual_points
    own = [number - 1 for number in room.numbers]
    return Wish(room.face, room.order, _SPARE * wanted, wanted, own)


def _surface(room: Room, found: Placed | None) -> StepSurface:
    if found is None:
        return StepSurface(face=room.face, numbers=room.numbers, against=room.against)
    return StepSurface(
        face=room.face,
        targets=triples(found.points),
        held=triples(found.held),
        ways=tuple(found.ways.tolist()),
        numbers=room.numbers,
        against=found.against,
    )


def _joined(faces: Sequence[StepFace]) -> StepFace:
    first = faces[0]
    if first.shape not in ("Cylinder", "Cone"):
        return first
    low, high = min(one.low for one in faces), max(one.high for one in faces)
    return msgspec.structs.replace(first, low=low, high=high)


def _against(face: StepFace, places: Float, ball_radius: float) -> str:
    if not len(places):
        return "no place lies inside its edges"
    if face.shape == "Plane":
        return ""
    if _turn(face, places) < _LEAST_TURN:
        return "it spans less than half a turn, as a fillet does"
    tube = face.second if face.shape == "Torus" else face.radius
    if face.inner and 0.0 < tube <= ball_radius:
        return f"a ball of {2.0 * ball_radius:g} mm does not fit into it"
    return ""


def _ball_fits(face: StepFace, places: Float, ball_radius: float) -> NDArray[np.bool_]:
    """Return the places where a ball touches no other side of the same surface.

    Near the tip of a hollow cone its centre would lie beyond the axis; with a margin for a hand.
    """
    if face.shape != "Cone" or not face.inner:
        return np.ones(len(places), dtype=np.bool_)
    heights = (places - np.array(face.point)) @ np.array(face.direction)
    from_axis = heights * np.tan(face.half_angle) - ball_radius * np.cos(face.half_angle)
    fits: NDArray[np.bool_] = from_axis >= EDGE_MM
    return fits


def _turn(face: StepFace, places: Float) -> float:
    """Return the angle about the axis that a surface spans, rad, excluding narrow gaps."""
    gaps = kernel.gaps_about(np.array(face.point), np.array(face.direction), places)
    # Places are in rows along the axis, so most gaps are zero.
    steps = np.sort(gaps[gaps > _SAME_RAD])
    half = len(steps) // 2
    step = 0.5 * float(steps[half] + steps[-half - 1]) if len(steps) else 0.0
    wide = gaps > max(1.5 * step, _NARROW_GAP)
    return float(gaps[~wide].sum() + step * np.count_nonzero(wide))
