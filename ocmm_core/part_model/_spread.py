"""Touch points on a trimmed face: far from its edges and each other, where the ball fits."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np

from ocmm_core.geometry import Float
from ocmm_core.part_model._nearest import RIVAL_MM, SearchedFace, nearest_feet
from ocmm_core.part_model._spline import curvatures_at, normals_at, places_at

_GRID = 48
_FIT = 0.8
"""A hollow is touched where the ball is at most this part of its radius."""


def spread_places(
    face: SearchedFace, count: int, clear_mm: float, ball_radius: float
) -> tuple[Float, Float]:
    """Return places (k, 3), mm, on a face and its outward normals; k is at most ``count``.

    Each is as far as possible from the previous ones, the first one from the edges. `clear_mm`:
    minimum distance from every edge. `ball_radius`: mm: a ball there touches this place alone.
    """
    surface = face.surface
    steps = (np.arange(_GRID) + 0.5) / _GRID
    u, v = np.meshgrid(steps, steps, indexing="ij")
    at = surface.low + np.stack([u.ravel(), v.ravel()], axis=1) * (surface.high - surface.low)
    at = at[face.trimming.holds(at)]
    places = places_at(surface, at)
    gaps = face.trimming.nearest_edge(places)[0]
    normals = normals_at(surface, at) * (1.0 if face.outward else -1.0)
    hollow = np.maximum(-curvatures_at(surface, at, normals).min(axis=1, initial=0.0), 0.0)
    fits = (gaps >= clear_mm) & (hollow * ball_radius <= _FIT)
    places, normals, gaps = places[fits], normals[fits], gaps[fits]
    chosen: list[int] = []
    order = _order(places, gaps)
    # The order does not depend on refused places: many are evaluated at once.
    while len(chosen) < count and (asked := list(islice(order, count))):
        feet = nearest_feet(places[asked] + ball_radius * normals[asked], [face])
        for row, doubt, distance in zip(asked, feet.doubts, feet.distances, strict=True):
            # A ball here may touch another fold of the face first.
            if doubt == "" and abs(distance - ball_radius) < 0.1 * RIVAL_MM:
                chosen.append(row)
    return places[chosen[:count]], normals[chosen[:count]]


def _order(places: Float, gaps: Float) -> Iterator[int]:
    """Yield all places, each as far as possible from edges and from the previous ones."""
    apart = np.minimum(gaps, 1e6)
    while len(places) and float(apart.max()) > 0.0:
        best = int(np.argmax(apart))
        apart = np.minimum(apart, np.linalg.norm(places - places[best], axis=1))
        apart[best] = 0.0
        yield best
