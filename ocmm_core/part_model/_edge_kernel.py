"""Compiled: nearest of many edge segments to many points."""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float


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
