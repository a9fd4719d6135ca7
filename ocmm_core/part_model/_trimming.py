"""Outline of a trimmed face (inside test, distance of its edges), and boxes around its surface.

The hull of the poles of a Bezier patch with positive weights contains the patch. Patches are halved
(de Casteljau) until they are flat, and each gets a box along its own middle; no point is nearer
than its box.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float, Int
from ocmm_core.part_model._spline import BezierSurface, places_at


@compiled()
def nearest_stretch(points: Float, edges: Float, distances: Float, places: Float) -> None:
    """Fill in distances (m,) and nearest places (m, 3), mm, of points (m, 3) to edges (k, 2, 3).

    Of equal squares the first counts, so the result does not depend on the processor.
    """
    for i in range(len(points)):
        least, best, at = np.inf, 0, 0.0
        for k in range(len(edges)):
            along, square = 0.0, 1e-300
            for a in range(3):
                way = edges[k, 1, a] - edges[k, 0, a]
                along += (points[i, a] - edges[k, 0, a]) * way
                square += way * way
            share = min(max(along / square, 0.0), 1.0)
            away = 0.0
            for a in range(3):
                foot = edges[k, 0, a] + share * (edges[k, 1, a] - edges[k, 0, a])
                away += (points[i, a] - foot) ** 2
            if away < least:
                least, best, at = away, k, share
        distances[i] = np.sqrt(least)
        for a in range(3):
            places[i, a] = edges[best, 0, a] + at * (edges[best, 1, a] - edges[best, 0, a])


_SEAM = 1e-7
"""Part of the range of a parameter within which a line lies on the side of the surface."""
_CHUNK = 2_000_000
_CHORD_MM = 0.002
"""Approximate maximum distance of a chord from its edge; longer ones are halved."""
_LONG = 0.1
"""Part of the size of the surface above which a segment is halved at least `_AT_LEAST` times."""
_AT_LEAST = 3
_HALVINGS = 10


@dataclass(frozen=True, slots=True, eq=False)
class Trimming:
    sides: Float
    """(k, 2, 2): sides of all loops in the parameters of the surface."""
    edges: Float
    """(e, 2, 3), mm: the sides as segments in space, without seams and poles of the surface."""

    def holds(self, parameters: Float) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Return which parameters (m, 2) lie inside, by the parity of crossings of a ray."""
        inside = np.zeros(len(parameters), dtype=bool)
        (u0, v0), (u1, v1) = self.sides[:, 0].T, self.sides[:, 1].T
        slope = (u1 - u0) / np.where(v1 != v0, v1 - v0, np.inf)
        step = max(_CHUNK // max(len(self.sides), 1), 1)
        for first in range(0, len(parameters), step):
            u, v = parameters[first : first + step].T
            spans = (v0 > v[:, None]) != (v1 > v[:, None])
            right = u[:, None] < u0 + slope * (v[:, None] - v0)
            inside[first : first + step] = np.count_nonzero(spans & right, axis=1) % 2 == 1
        return inside

    def nearest_edge(self, points: Float) -> tuple[Float, Float]:
        """Return distances (m,), mm, of points (m, 3) from edges, and places; infinite if none."""
        distances = np.full(len(points), np.inf)
        places = np.full((len(points), 3), np.inf)
        if not len(self.edges):
            return distances, places
        nearest_stretch(np.ascontiguousarray(points), self.edges, distances, places)
        return distances, places

    def crosses(self, low: Float, high: Float) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Return which ranges of parameters, low and high (k, 2), a side may run through."""
        found = np.zeros(len(low), dtype=bool)
        least, most = self.sides.min(axis=1), self.sides.max(axis=1)
        step = max(_CHUNK // max(len(self.sides), 1), 1)
        for first in range(0, len(low), step):
            own = slice(first, first + step)
            apart = (least[None] > high[own, None]) | (most[None] < low[own, None])
            found[own] = np.any(~apart.any(axis=2), axis=1)
        return found


def trimming_of(surface: BezierSurface, loops: tuple[Float, ...]) -> Trimming:
    """Return the outline of a face; without loops its whole surface is the face."""
    if not loops:
        (u0, v0), (u1, v1) = surface.low, surface.high
        loops = (np.array([[u0, v0], [u1, v0], [u1, v1], [u0, v1]]),)
    sides = np.concatenate(
        [np.stack([loop, np.roll(loop, -1, axis=0)], axis=1) for loop in loops]
    ).astype(np.float64)
    sides = sides[np.any(sides[:, 0] != sides[:, 1], axis=1)]
    return Trimming(sides, _edges(surface, sides))


def _edges(surface: BezierSurface, sides: Float) -> Float:
    real = np.ones(len(sides), dtype=bool)
    span = surface.high - surface.low
    for axis, closed in enumerate(surface.closed):
        if not closed:
            continue
        along = sides[..., axis]
        for end in (surface.low[axis], surface.high[axis]):
            # The surface continues beyond its seam.
            real &= ~np.all(np.abs(along - end) <= _SEAM * span[axis], axis=1)
    starts, ends = sides[real, 0], sides[real, 1]
    found = []
    for round_ in range(_HALVINGS + 1):
        a, b, middle = (
            places_at(surface, np.clip(at, surface.low, surface.high))
            for at in (starts, ends, 0.5 * (starts + ends))
        )
        # A quarter point as well: the middle of a wave lies on its chord.
        at = np.clip(0.75 * starts + 0.25 * ends, surface.low, surface.high)
        quarter = places_at(surface, at) - (0.75 * a + 0.25 * b)
        off = np.linalg.norm(middle - 0.5 * (a + b), axis=1) + np.linalg.norm(quarter, axis=1)
        long = np.linalg.norm(b - a, axis=1) > _LONG * surface.size
        bent = (off > _CHORD_MM) | (long & (round_ < _AT_LEAST))
        bent &= round_ < _HALVINGS
        found.append(np.stack([a[~bent], b[~bent]], axis=1))
        halves = 0.5 * (starts[bent] + ends[bent])
        starts, ends = (
            np.concatenate([starts[bent], halves]), np.concatenate([halves, ends[bent]])
        )  # fmt: skip
        if not len(starts):
            break
    stretches = np.concatenate(found)
    lengths = np.linalg.norm(stretches[:, 1] - stretches[:, 0], axis=1)
    return np.ascontiguousarray(stretches[lengths > 1e-9 * max(surface.size, 1e-9)])


_FLAT = 0.03
"""Height of a box, as part of its longer side, at which its patch is flat enough."""
_SMALL = 0.02
"""mm: smaller patches are not halved further."""
_MOST = 20_000
"""Maximum patches of a face."""
_ROUNDS = 24


@dataclass(frozen=True, slots=True, eq=False)
class Patches:
    """Pieces of one surface."""

    low: Float
    high: Float
    """(k, 2): ranges of their parameters."""
    middles: Float
    """(k, 3), mm: centres of the boxes."""
    axes: Float
    """(k, 3, 3): rows are the directions of the box."""
    halves: Float
    """(k, 3), mm: half sizes along them."""

    @property
    def radii(self) -> Float:
        """Return radii (k,), mm, of balls about the middles that contain the boxes."""
        radii: Float = np.linalg.norm(self.halves, axis=1)
        return radii

    def kept(self, chosen: Float | Int) -> Patches:
        return Patches(
            self.low[chosen], self.high[chosen], self.middles[chosen], self.axes[chosen],
            self.halves[chosen],
        )  # fmt: skip

    def at_least(self, points: Float, patches: Int) -> Float:
        """Return lower bounds (m,), mm, of the distance of points (m, 3) from patches (m,)."""
        arms = points - self.middles[patches]
        along = np.abs(np.einsum("mij,mj->mi", self.axes[patches], arms))
        outside = np.maximum(along - self.halves[patches], 0.0)
        least: Float = np.linalg.norm(outside, axis=1)
        return least


def patches_of(surface: BezierSurface) -> Patches:
    """Return the flat pieces of a whole surface."""
    a, b = surface.poles.shape[:2]
    poles = surface.poles.reshape(a * b, *surface.poles.shape[2:])
    low_u, low_v = np.meshgrid(surface.breaks_u[:-1], surface.breaks_v[:-1], indexing="ij")
    high_u, high_v = np.meshgrid(surface.breaks_u[1:], surface.breaks_v[1:], indexing="ij")
    low = np.stack([low_u.ravel(), low_v.ravel()], axis=1)
    high = np.stack([high_u.ravel(), high_v.ravel()], axis=1)
    done: list[Patches] = []
    count = 0
    for round_ in range(_ROUNDS):
        found = _boxes(poles, low, high)
        flat = found.halves[:, 2] <= _FLAT * found.halves[:, :2].max(axis=1)
        flat |= found.radii <= _SMALL
        bent = np.flatnonzero(~flat)
        full = count + len(poles) + len(bent) > _MOST
        if round_ == _ROUNDS - 1 or full or not len(bent):
            done.append(found)
            break
        done.append(found.kept(np.flatnonzero(flat)))
        count += len(poles) - len(bent)
        poles, low, high = _halved(poles[bent], low[bent], high[bent])
    return Patches(*(np.concatenate([getattr(one, name) for one in done])
                     for name in ("low", "high", "middles", "axes", "halves")))  # fmt: skip


def _boxes(poles: Float, low: Float, high: Float) -> Patches:
    places = poles[..., :3] / poles[..., 3:]
    k = len(places)
    corners = places[:, [0, -1, 0, -1], [0, 0, -1, -1]]
    along_u = corners[:, 1] - corners[:, 0] + corners[:, 3] - corners[:, 2]
    along_v = corners[:, 2] - corners[:, 0] + corners[:, 3] - corners[:, 1]
    hull = places.reshape(k, -1, 3)
    first = _direction(along_u, along_v)
    normal = np.cross(first, along_v)
    lengths = np.linalg.norm(normal, axis=1)
    # Any box that contains the hull is valid; this one is small where the patch is flat.
    spare = _perpendicular(first)
    flat = lengths <= 1e-9 * np.maximum(np.linalg.norm(along_v, axis=1), 1e-12)
    normal = np.where(flat[:, None], spare, normal / np.maximum(lengths, 1e-300)[:, None])
    axes = np.stack([first, np.cross(normal, first), normal], axis=1)
    seen = np.einsum("kij,knj->kni", axes, hull)
    least, most = seen.min(axis=1), seen.max(axis=1)
    middles = np.einsum("kij,ki->kj", axes, 0.5 * (least + most))
    # Margin for rounding errors of the hull.
    halves = 0.5 * (most - least) + 1e-9
    return Patches(low, high, middles, axes, halves)


def _direction(along: Float, other: Float) -> Float:
    lengths, others = np.linalg.norm(along, axis=1), np.linalg.norm(other, axis=1)
    use = np.where((lengths >= 1e-9 * np.maximum(others, 1e-12))[:, None], along, other)
    norms = np.linalg.norm(use, axis=1)
    return np.where(
        (norms > 0.0)[:, None], use / np.maximum(norms, 1e-300)[:, None], np.array([1.0, 0.0, 0.0])
    )


def _perpendicular(directions: Float) -> Float:
    axis = np.eye(3)[np.argmin(np.abs(directions), axis=1)]
    square = np.cross(directions, axis)
    units: Float = square / np.linalg.norm(square, axis=1)[:, None]
    return units


def _halved(poles: Float, low: Float, high: Float) -> tuple[Float, Float, Float]:
    """Return patches halved in the direction in which each is longer."""
    places = poles[..., :3] / poles[..., 3:]
    long_u = np.linalg.norm(np.diff(places, axis=1), axis=-1).sum(axis=1).max(axis=1)
    long_v = np.linalg.norm(np.diff(places, axis=2), axis=-1).sum(axis=2).max(axis=1)
    bent_u = _bend(places, 1)
    bent_v = _bend(places, 2)
    # A patch that is straight in one direction is halved in the other, unless it is far too long.
    by_u = 4.0 * bent_u + 0.01 * long_u >= 4.0 * bent_v + 0.01 * long_v
    found = []
    for chosen, axis in ((by_u, 0), (~by_u, 1)):
        own, least, most = poles[chosen], low[chosen], high[chosen]
        first, second = _de_casteljau(own, axis + 1)
        middle = 0.5 * (least[:, axis] + most[:, axis])
        upper, lower = most.copy(), least.copy()
        upper[:, axis] = middle
        lower[:, axis] = middle
        found += [(first, least, upper), (second, lower, most)]
    joined = [np.concatenate([one[i] for one in found]) for i in range(3)]
    return joined[0], joined[1], joined[2]


def _bend(places: Float, axis: int) -> Float:
    """Return the approximate maximum distance of poles from a straight line along an axis, (k,)."""
    if places.shape[axis] < 3:
        return np.zeros(len(places))
    second = np.linalg.norm(np.diff(places, n=2, axis=axis), axis=-1)
    bend: Float = second.reshape(len(places), -1).max(axis=1) * places.shape[axis]
    return bend


def _de_casteljau(poles: Float, axis: int) -> tuple[Float, Float]:
    moved = np.moveaxis(poles, axis, 0).copy()
    n = len(moved)
    first, second = np.empty_like(moved), np.empty_like(moved)
    for i in range(n):
        first[i], second[n - 1 - i] = moved[0], moved[-1 - i] if i == 0 else moved[n - 1 - i]
        moved[: n - 1 - i] = 0.5 * (moved[: n - 1 - i] + moved[1 : n - i])
    return np.moveaxis(first, 0, axis), np.moveaxis(second, 0, axis)
