"""Touches and slides by kind of surface, part frame: contacts, pace with stick-slip, hops."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, perpendicular_pair, unit
from ocmm_sim.scene import _surfaces as surfaces

_CORNER = 0.4
"""Fraction of each side omitted at the ends: a ball does not reach into a corner."""
_TUBE = np.radians([25.0, 90.0, 155.0])
"""Touch angles on a ring's tube, from outside over its top."""
_LEVELS = (0.35, 0.80)
"""Touch heights of bosses and cones, as fractions of their height."""


@dataclass(frozen=True, slots=True)
class Contacts:
    points: Float
    """(n, 3), mm: on the surface."""
    normals: Float
    """(n, 3), unit: from the material towards the ball."""
    place: np.ndarray[tuple[int], np.dtype[np.int64]]
    """(n,) int64: touches with the same number can be joined by a straight path."""

    def subset(self, chosen: Sequence[int]) -> Contacts:
        """Return the touches with the given indices."""
        index = np.asarray(chosen, dtype=np.int64)
        return Contacts(self.points[index], self.normals[index], self.place[index])


def sample(artefact: surfaces.Artefact, count: int, rng: np.random.Generator) -> Contacts:
    """Return `count` touches spread over a surface as an inspector would.

    Planes: a grid over their free areas; balls: layers from pole to equator; holes: around half
    their depth; bosses and cones: around two heights; rings: the upper half of their tube; lines:
    along their length. A surface with its own touch points uses these, in order.
    """
    point = np.array(artefact.point)
    axis = unit(np.array(artefact.direction))
    if isinstance(artefact, surfaces.PlaneEntry):
        return _on_plane(artefact, point, axis, count, rng)
    if isinstance(artefact, surfaces.SphereEntry):
        normals = _on_sphere(axis, count, rng)
        return _together(point + 0.5 * artefact.diameter * normals, normals)
    if isinstance(artefact, surfaces.BoreEntry):
        around = _around(axis, count, rng)
        depth = artefact.depth * rng.uniform(0.42, 0.58, (count, 1))
        return _together(point - depth * axis + 0.5 * artefact.diameter * around, -around, 0)
    if isinstance(artefact, surfaces.SlotEntry | surfaces.EllipseEntry):
        return _in_outline(artefact, point, axis, count, rng)
    if isinstance(artefact, surfaces.TorusEntry):
        return _on_ring(artefact, point, axis, count, rng)
    if isinstance(artefact, surfaces.CylinderEntry | surfaces.ConeEntry):
        return _on_boss(artefact, point, axis, count, rng)
    if isinstance(artefact, surfaces.TouchedEntry):
        # If there are too few, repeat them.
        which = np.arange(count) % len(artefact.places)
        return _together(np.array(artefact.places)[which], unit(np.array(artefact.normals))[which])
    if isinstance(artefact, surfaces.LineEntry):
        along = np.linspace(0.06, 0.94, count) if count > 1 else np.full(1, 0.5)
        along = along + rng.uniform(-0.03, 0.03, count)
        normals = np.tile(unit(np.array(artefact.normal)), (count, 1))
        return _together(point + artefact.length * along[:, None] * axis, normals, 0)
    return _together(np.tile(point, (count, 1)), np.tile(axis, (count, 1)), 0)


def farthest(contacts: Contacts, radius: float, tips: Float, count: int) -> Contacts:
    """Return the `count` touches with balls farthest from `tips` (n, 3), in order.

    ``radius``: of the ball, mm; ``tips``: ball centres, part frame, mm; each is nearest to its own
    touch, even after a small push of the part.
    """
    balls = contacts.points + radius * contacts.normals
    gaps = np.linalg.norm(balls[:, None] - tips[None], axis=2).min(axis=1, initial=np.inf)
    return contacts.subset(sorted(np.argsort(-gaps, kind="stable")[:count].tolist()))


def _together(points: Float, normals: Float, place: int | None = None) -> Contacts:
    """Return contacts with a common place, or one place each."""
    count = len(points)
    places = np.arange(count) if place is None else np.full(count, place)
    return Contacts(points, normals, places.astype(np.int64))


def _around(axis: Float, count: int, rng: np.random.Generator) -> Float:
    first, second = perpendicular_pair(axis)
    angle = 2.0 * np.pi * (np.arange(count) + rng.uniform()) / count
    directions: Float = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
    return directions


def _on_plane(
    artefact: surfaces.PlaneEntry, point: Float, normal: Float, count: int, rng: np.random.Generator
) -> Contacts:
    along = unit(np.array(artefact.along))
    across = np.cross(normal, along)
    # The square root favours small areas: they lie at the rim and determine the tilt.
    weight = np.sqrt([(u1 - u0) * (v1 - v0) for u0, v0, u1, v1 in artefact.areas])
    points: list[Float] = []
    place: list[int] = []
    for number, share in enumerate(_share(count, weight)):
        u0, v0, u1, v1 = artefact.areas[number]
        for fraction_u, fraction_v in _grid(share, (u1 - u0) / (v1 - v0), rng):
            u, v = u0 + (u1 - u0) * fraction_u, v0 + (v1 - v0) * fraction_v
            points.append(point + u * along + v * across)
            place.append(number)
    return Contacts(np.array(points), np.tile(normal, (count, 1)), np.array(place, dtype=np.int64))


def _grid(count: int, aspect: float, rng: np.random.Generator) -> list[tuple[float, float]]:
    """Return `count` jittered places of the unit square, row by row and back."""
    if count == 0:
        return []
    columns = int(np.clip(round(np.sqrt(count * aspect)), 1, count))
    rows = -(-count // columns)
    places: list[tuple[float, float]] = []
    for row in range(rows):
        across = _spread(min(columns, count - row * columns))
        if row % 2:
            across = across[::-1]
        places += [(float(u), float(_spread(rows)[row])) for u in across]
    scatter = rng.uniform(-0.04, 0.04, (count, 2))
    return [
        (u + float(du), v + float(dv)) for (u, v), (du, dv) in zip(places, scatter, strict=True)
    ]


def _spread(count: int) -> Float:
    return np.linspace(0.06, 0.94, count) if count > 1 else np.full(1, 0.5)


def _on_sphere(axis: Float, count: int, rng: np.random.Generator) -> Float:
    """Return normals: one at the pole, the others in layers down to the equator."""
    polar = np.radians([45.0, 90.0] if count < 12 else [30.0, 60.0, 90.0])
    normals = [axis]
    for angle, share in zip(polar, _share(count - 1, np.sin(polar)), strict=True):
        if share:
            normals += list(np.cos(angle) * axis + np.sin(angle) * _around(axis, share, rng))
    return np.array(normals)


def _in_outline(
    artefact: surfaces.SlotEntry | surfaces.EllipseEntry,
    mouth: Float,
    axis: Float,
    count: int,
    rng: np.random.Generator,
) -> Contacts:
    """Return contacts around the wall, all mutually reachable."""
    along = unit(np.array(artefact.along))
    beside = np.cross(axis, along)
    a, b = 0.5 * artefact.length, 0.5 * artefact.width
    share = (np.arange(count) + rng.uniform(0.2, 0.8)) / count
    if isinstance(artefact, surfaces.EllipseEntry):
        turn = 2.0 * np.pi * share
        flat = np.stack([a * np.cos(turn), b * np.sin(turn)], axis=1)
        outward = unit(flat / [a * a, b * b])
    elif artefact.ends == "round":
        if count < _MANY_ON_OUTLINE:
            share = _with_an_end(a, b, share)
        flat, outward = _on_round_ends(a, b, share)
    else:
        flat, outward = _on_sides(a, b, count)
    depth = artefact.depth * rng.uniform(0.42, 0.58, (count, 1))
    basis = np.stack([along, beside])
    return _together(mouth - depth * axis + flat @ basis, -outward @ basis, 0)


def _with_an_end(a: float, b: float, share: Float) -> Float:
    """Return few places, turned so that one or two are near an end.

    An operator with few touches covers both sides and both ends. Places at the transitions alone
    leave the length of a slot undetermined.
    """
    middle = (2.0 * (a - b) + 0.5 * np.pi * b) / (4.0 * (a - b) + 2.0 * np.pi * b)
    beside = share + (middle - share[np.argmin(np.abs(share - middle))])
    # A third of the random offset remains, as hands miss the exact middle.
    turned: Float = (beside + (share[0] - 0.5 / len(share)) / 3.0) % 1.0
    return turned


def _on_round_ends(a: float, b: float, share: Float) -> tuple[Float, Float]:
    """Return places (n, 2) and outward normals of an outline with round ends."""
    core, end = a - b, np.pi * b
    way = share * 2.0 * (2.0 * core + end)
    half = way >= 2.0 * core + end
    way = np.where(half, way - 2.0 * core - end, way)
    bend = np.clip(way - 2.0 * core, 0.0, end) / b
    sign = np.where(half, -1.0, 1.0)[:, None]
    outward = sign * np.stack([np.sin(bend), -np.cos(bend)], axis=1)
    middle = np.stack([np.minimum(way, 2.0 * core) - core, np.zeros(len(share))], axis=1)
    return sign * middle + b * outward, outward


def _on_sides(a: float, b: float, count: int) -> tuple[Float, Float]:
    """Return places (n, 2) and outward normals on the four sides of a rectangle.

    At least one on each end, and two on each side, which determine the direction, from six on.
    """
    places, normals = [], []
    few = count < _MANY_ON_OUTLINE
    weight = np.array([2.0, 1.0, 2.0, 1.0]) if few else np.array([a, b, a, b]) + 0.4 * (a + b)
    for side, number in enumerate(_share(count, weight)):
        for step in _spread(number) if number else ():
            way = (2.0 * float(step) - 1.0) * (1.0 - _CORNER)
            sign = -1.0 if side < 2 else 1.0
            if side % 2 == 0:
                places.append([-sign * way * a, sign * b])
                normals.append([0.0, sign])
            else:
                places.append([-sign * a, -sign * way * b])
                normals.append([-sign, 0.0])
    return np.array(places), np.array(normals)


def _on_ring(
    artefact: surfaces.TorusEntry, centre: Float, axis: Float, count: int, rng: np.random.Generator
) -> Contacts:
    around = _around(axis, count, rng)
    # Neighbours are touched at different angles of the tube.
    tube = _TUBE[np.arange(count) % len(_TUBE)][:, None]
    normals = np.cos(tube) * around + np.sin(tube) * axis
    ring = centre + 0.5 * artefact.diameter * around
    return _together(ring + 0.5 * artefact.tube_diameter * normals, normals)


def _on_boss(
    artefact: surfaces.CylinderEntry | surfaces.ConeEntry,
    foot: Float,
    axis: Float,
    count: int,
    rng: np.random.Generator,
) -> Contacts:
    taper = 0.0
    if isinstance(artefact, surfaces.ConeEntry):
        taper = 0.5 * (artefact.diameter - artefact.top_diameter) / artefact.height
    points: list[Float] = []
    normals: list[Float] = []
    for level, share in zip(_LEVELS, _share(count, np.ones(2)), strict=True):
        if share:
            height = level * artefact.height
            around = _around(axis, share, rng)
            radius = 0.5 * artefact.diameter - taper * height
            points.append(foot + height * axis + radius * around)
            normals.append(unit(around + taper * axis))
    return _together(np.concatenate(points), np.concatenate(normals))


def _share(count: int, weight: Float) -> list[int]:
    """Return `count` divided into integers by `weight` (largest remainder)."""
    exact = count * weight / weight.sum()
    shares = np.floor(exact).astype(int)
    shares[np.argsort(-(exact - shares), kind="stable")[: count - int(shares.sum())]] += 1
    return [int(share) for share in shares]


_MANY_ON_OUTLINE = 8
"""From this number on, every side and end of an outline gets a touch for any start."""


STEP_MM = 0.1
_STICKS, _STICK_S = 0.02, (0.03, 0.12)
"""Stops per mm of path, and their duration."""
_HOPS, _HOP_MM, _HOP_S = 0.01, (0.06, 0.3), 0.03
"""Losses of contact per mm of path, their height and duration."""
_RIM, _EDGE = 0.1, 0.06
"""Margins of a free path and of a scan, as shares of the size."""
_SLIDE_LEVELS = (0.35, 0.75)
_POLE, _LOWEST = np.radians([8.0, 75.0])


def slide(artefact: surfaces.Artefact, length: float, scan: str = "") -> Contacts:
    """Return the places of a slide of at least ``length``, mm, `STEP_MM` apart.

    Planes: a zigzag over their largest free area; balls, bores, bosses and cones: a helix of one
    turn or more, with the ``scan`` "ring" at one height; lines: once along. InputError for other
    surfaces.
    """
    point, axis = np.array(artefact.point), unit(np.array(artefact.direction))
    first, second = perpendicular_pair(axis)
    if isinstance(artefact, surfaces.PlaneEntry):
        along = unit(np.array(artefact.along))
        u0, v0, u1, v1 = max(artefact.areas, key=lambda a: (a[2] - a[0]) * (a[3] - a[1]))
        rim = _RIM * np.array([u1 - u0, v1 - v0])
        half = 0.5 * (u1 - u0) - rim[0]
        # Three lines or more, over half the length or more.
        half = min(half, max(0.5 * half, length / 6.0))
        lines = max(int(np.ceil(length / (2.0 * half))), 3)
        if scan == "raster":
            rim, half = _EDGE * np.array([u1 - u0, v1 - v0]), (0.5 - _EDGE) * (u1 - u0)
            lines = max(round(length / (u1 - u0)), 2)
        v = np.repeat(np.linspace(v0 + rim[1], v1 - rim[1], lines), 2)
        u = 0.5 * (u0 + u1) + np.resize([-half, half, half, -half], len(v))
        places = _dense(point + u[:, None] * along + v[:, None] * np.cross(axis, along))
        return _contacts(places, np.tile(axis, (len(places), 1)))
    if isinstance(artefact, surfaces.LineEntry):
        places = _dense(point + artefact.length * np.array([[0.06], [0.94]]) * axis)
        return _contacts(places, np.tile(unit(np.array(artefact.normal)), (len(places), 1)))
    if not isinstance(
        artefact,
        surfaces.SphereEntry | surfaces.BoreEntry | surfaces.CylinderEntry | surfaces.ConeEntry,
    ):
        raise InputError(
            "simulation.slide",
            f"The virtual hand cannot slide on '{artefact.name}'.",
            "Measure it by single touches: set 'spacing' to 0 in the plan.",
        )
    radius = 0.5 * artefact.diameter
    turns = max(length / (2.0 * np.pi * radius), 1.1)
    if isinstance(artefact, surfaces.SphereEntry):
        turns *= 1.5
    share = np.linspace(0.0, 1.0, int(turns * 2.0 * np.pi * radius / STEP_MM))[:, None]
    turn = 2.0 * np.pi * turns * share
    around = np.cos(turn) * first + np.sin(turn) * second
    if isinstance(artefact, surfaces.SphereEntry):
        tilt = _POLE + (_LOWEST - _POLE) * share
        normals = np.cos(tilt) * axis + np.sin(tilt) * around
        return _contacts(point + radius * normals, normals)
    levels = (0.5, 0.5) if scan == "ring" else _SLIDE_LEVELS
    level = levels[0] + (levels[1] - levels[0]) * share
    if isinstance(artefact, surfaces.BoreEntry):
        return _contacts(point - level * artefact.depth * axis + radius * around, -around)
    taper = 0.0
    if isinstance(artefact, surfaces.ConeEntry):
        taper = 0.5 * (artefact.diameter - artefact.top_diameter) / artefact.height
    height = level * artefact.height
    return _contacts(
        point + height * axis + (radius - taper * height) * around, unit(around + taper * axis)
    )


def pace(count: int, speed: float, rng: np.random.Generator) -> Float:
    """Return the seconds (count,) of each step at a mean ``speed``, mm/s, with stops."""
    waves = np.sin(np.linspace(0.0, rng.uniform(2.0, 8.0), count) * 2.0 * np.pi)
    seconds: Float = STEP_MM / (speed * (1.0 + 0.4 * waves))
    stops = rng.random(count) < _STICKS * STEP_MM
    return seconds + np.where(stops, rng.uniform(*_STICK_S, count), 0.0)


def hops(seconds: Float, rng: np.random.Generator) -> Float:
    """Return the height (n,), mm, of the ball above the surface after each step."""
    times, heights = np.cumsum(seconds), np.zeros(len(seconds))
    for start in np.flatnonzero(rng.random(len(seconds)) < _HOPS * STEP_MM):
        share = np.clip((times - times[start]) / _HOP_S, 0.0, 1.0)
        heights += rng.uniform(*_HOP_MM) * 4.0 * share * (1.0 - share)
    # It starts, stops and ends in contact.
    heights[:50] = heights[-50:] = 0.0
    latest = scipy.ndimage.maximum_filter1d(seconds, 9) - 0.02
    return np.where(scipy.ndimage.minimum_filter1d(seconds, 9) < latest, 0.0, heights)


def _dense(corners: Float) -> Float:
    """Return places `STEP_MM` apart along straight lines between corners (n, 3)."""
    far = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    at = np.arange(0.0, far[-1], STEP_MM)
    return np.stack([np.interp(at, far, corners[:, k]) for k in range(3)], axis=1)


def _contacts(points: Float, normals: Float) -> Contacts:
    return Contacts(points, normals, np.zeros(len(points), dtype=np.int64))
