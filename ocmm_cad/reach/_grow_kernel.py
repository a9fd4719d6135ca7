"""Compiled: a tree of boxes over the triangles of a part."""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float, Int

_LEAF = 4
"""Triangles per leaf."""


@compiled()
def _part_at(wanted: int, low: int, high: int, keys: Float, order: Int) -> None:
    """Partition rows ``low`` to ``high`` about ``wanted`` (Hoare's selection, linear time)."""
    while low < high:
        mark = keys[order[(low + high) // 2]]
        i, j = low, high
        while i <= j:
            while keys[order[i]] < mark:
                i += 1
            while keys[order[j]] > mark:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                i += 1
                j -= 1
        if wanted <= j:
            high = j
        elif wanted >= i:
            low = i
        else:
            return


@compiled()
def grow(triangles: Float, boxes: Float, links: Int, order: Int) -> int:
    """Fill in the tree of ``triangles`` (n, 3, 3), and return its number of boxes.

    ``boxes`` (2 n, 6): least and greatest coordinates. ``links`` (2 n, 2): the first of two
    consecutive children, and -1; or first and number of a leaf's triangles in ``order`` (n,).
    """
    n = len(triangles)
    middles = np.empty((n, 3))
    for i in range(n):
        order[i] = i
        for a in range(3):
            middles[i, a] = triangles[i, 0, a] + triangles[i, 1, a] + triangles[i, 2, a]
    first = np.empty(2 * n, dtype=np.int64)
    last = np.empty(2 * n, dtype=np.int64)
    first[0], last[0] = 0, n
    count = 1
    box = 0
    while box < count:
        low, high = first[box], last[box]
        for a in range(3):
            boxes[box, a], boxes[box, 3 + a] = np.inf, -np.inf
        for k in range(low, high):
            for corner in range(3):
                for a in range(3):
                    x = triangles[order[k], corner, a]
                    boxes[box, a] = min(boxes[box, a], x)
                    boxes[box, 3 + a] = max(boxes[box, 3 + a], x)
        if high - low <= _LEAF:
            links[box, 0], links[box, 1] = low, high - low
        else:
            longest = 0
            for a in range(1, 3):
                if (
                    boxes[box, 3 + a] - boxes[box, a]
                    > boxes[box, 3 + longest] - boxes[box, longest]
                ):
                    longest = a
            # The median halves the count, so that the depth is log2 of it.
            half = (low + high) // 2
            _part_at(half, low, high - 1, middles[:, longest], order)
            links[box, 0], links[box, 1] = count, -1
            first[count], last[count] = low, half
            first[count + 1], last[count + 1] = half, high
            count += 2
        box += 1
    return count
