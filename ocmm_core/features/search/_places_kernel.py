"""Compiled comparison of elements: identify equal ends of a search."""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.features.search._axis_kernel import RING
from ocmm_core.geometry import Float

SIGNATURE = 14


@compiled()
def _signature(kind: int, p: Float, numbers: Float) -> int:
    """Write numbers that are equal for parameters (8,) of the same element; return how many."""
    if kind > RING:
        # An outline is unchanged by half a turn, and by a quarter with its sizes exchanged.
        turn, longer = p[2], p[3] - p[4]
        numbers[0], numbers[1], numbers[2] = p[0], p[1], p[3] + p[4]
        numbers[3], numbers[4] = longer * np.cos(2.0 * turn), longer * np.sin(2.0 * turn)
        numbers[5], numbers[6] = np.cos(4.0 * turn), np.sin(4.0 * turn)
        return 7
    for i in range(3):
        numbers[i] = p[i]
        # An axis and its opposite have the same products.
        for j in range(3):
            numbers[3 + 3 * i + j] = p[3 + i] * p[3 + j]
    numbers[12], numbers[13] = abs(p[6]), abs(p[7])
    return 14


@compiled()
def seen(kind: int, p: Float, known: Float, tolerance: float) -> bool:
    """Return whether parameters (8,) equal one of the elements ``known`` (m, 8)."""
    own, other = np.empty(SIGNATURE), np.empty(SIGNATURE)
    count = _signature(kind, p, own)
    greatest = 0.0
    for i in range(count):
        greatest = max(greatest, abs(own[i]))
    allowed = tolerance * (1.0 + greatest)
    for row in range(len(known)):
        _signature(kind, known[row], other)
        same = True
        for i in range(count):
            # Written so that NaN equals nothing.
            same = same and abs(own[i] - other[i]) < allowed
        if same:
            return True
    return False
