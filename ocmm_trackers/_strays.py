"""Names for stray markers, which the device lists in any order."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment

from ocmm_core.geometry import Float
from ocmm_trackers._messages import MarkerPlace

_FARTHEST_MM = 20.0
"""Way of a marker between two frames, at most: 1.2 m/s at 60 Hz."""
_KEPT = 30
"""Frames for which the name of a hidden marker is kept."""


class StrayNames:
    """Names S1, S2, ... for markers by their last places.

    A name tells which marker of the frame before it was, not which LED it is: that follows from
    the distances between the markers, as with the spots of cameras.
    """

    def __init__(self) -> None:
        self._places = np.zeros((0, 3))
        self._hidden = np.zeros(0, np.int64)
        """Frames since a marker of this name was seen."""

    def named(self, places: Float) -> list[MarkerPlace]:
        """Return the markers (n, 3), mm, of the next frame with their names."""
        self._hidden += 1
        away = np.linalg.norm(places[:, None] - self._places, axis=2)
        away[:, self._hidden > _KEPT] = np.inf
        cost = np.minimum(away, 2.0 * _FARTHEST_MM) ** 2
        slots = np.full(len(places), -1)
        for marker, slot in zip(*linear_sum_assignment(cost), strict=True):
            if away[marker, slot] <= _FARTHEST_MM:
                slots[marker] = slot
        known = slots >= 0
        if known.any():
            # Hidden markers move with the others.
            self._places += (places[known] - self._places[slots[known]]).mean(axis=0)
        for marker in np.flatnonzero(~known).tolist():
            free = [slot for slot in np.flatnonzero(self._hidden > _KEPT) if slot not in slots]
            if not free:
                self._places = np.vstack([self._places, places[marker]])
                self._hidden = np.append(self._hidden, 0)
                free = [len(self._hidden) - 1]
            slots[marker] = free[0]
        self._places[slots], self._hidden[slots] = places, 0
        return [
            MarkerPlace(f"S{slot + 1}", (x, y, z))
            for slot, (x, y, z) in zip(slots.tolist(), places.tolist(), strict=True)
        ]
