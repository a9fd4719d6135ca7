"""Outline of a trimmed face: inside test and distance of its edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float
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
