"""Compiled, for thousands of faces: spread of places, edge distances, edges that fall away."""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float, Int

_BESIDE = 0.25
"""Squared cosine to the perpendicular, within which a place is beside an edge: 60 degrees."""


@compiled()
def spread(places: Float, rows: Int) -> int:
    """Fill in ``rows`` (m,): of ``places`` (n, 3) each as far as possible from the earlier ones.

    The first is the farthest from the middle. Returns the number, the least of m and n.
    """
    n = len(places)
    count = min(n, len(rows))
    if count == 0:
        return 0
    nearest = np.empty(n)
    last = np.zeros(3)
    for i in range(n):
        for a in range(3):
            last[a] += places[i, a] / n
    for chosen in range(count):
        best = 0
        for i in range(n):
            away = 0.0
            for a in range(3):
                away += (places[i, a] - last[a]) ** 2
            # The middle is no chosen place: being far from it is no disadvantage.
            if chosen <= 1 or away < nearest[i]:
                nearest[i] = away
            if nearest[i] > nearest[best]:
                best = i
        rows[chosen] = best
        for a in range(3):
            last[a] = places[best, a]
    return count


@compiled()
def nearest(places: Float, axis: int, stretches: Float, far: float, squares: Float) -> None:
    """Lower ``squares`` (n,), mm2, to squared distances of places (n, 3) from stretches.

    ``stretches`` (m, 2, 3); one without length is its start. Places are sorted along ``axis``:
    those farther than ``far`` beyond both ends along it are skipped.
    """
    n = len(places)
    for k in range(len(stretches)):
        x, y, z = stretches[k, 0, 0], stretches[k, 0, 1], stretches[k, 0, 2]
        u, v, w = stretches[k, 1, 0] - x, stretches[k, 1, 1] - y, stretches[k, 1, 2] - z
        length2 = u * u + v * v + w * w
        inverse = 0.0 if length2 == 0.0 else 1.0 / length2
        low = min(stretches[k, 0, axis], stretches[k, 1, axis]) - far
        high = max(stretches[k, 0, axis], stretches[k, 1, axis]) + far
        first, last = 0, n
        while first < last:
            half = (first + last) // 2
            if places[half, axis] < low:
                first = half + 1
            else:
                last = half
        for i in range(first, n):
            if places[i, axis] > high:
                break
            a, b, c = places[i, 0] - x, places[i, 1] - y, places[i, 2] - z
            share = min(max((a * u + b * v + c * w) * inverse, 0.0), 1.0)
            a, b, c = a - share * u, b - share * v, c - share * w
            squares[i] = min(squares[i], a * a + b * b + c * c)


@compiled()
def distances(places: Float, stretches: Float, far: float) -> Float:
    """Return the distances of places (n, 3) from the nearest of stretches (m, 2, 3), mm.

    Infinite beyond ``far``. Places sorted along their box: only nearby ones are compared.
    """
    n = len(places)
    found = np.full(n, np.inf)
    if n == 0 or len(stretches) == 0:
        return found
    axis, longest = 0, -1.0
    for a in range(3):
        low, high = np.inf, -np.inf
        for i in range(n):
            low, high = min(low, places[i, a]), max(high, places[i, a])
        if high - low > longest:
            axis, longest = a, high - low
    order = np.argsort(places[:, axis])
    sorted_places, squares = np.empty((n, 3)), np.full(n, np.inf)
    for i in range(n):
        for a in range(3):
            sorted_places[i, a] = places[order[i], a]
    nearest(sorted_places, axis, stretches, far, squares)
    for i in range(n):
        if squares[i] <= far * far:
            found[order[i]] = np.sqrt(squares[i])
    return found


@compiled()
def gaps_about(point: Float, axis: Float, places: Float) -> Float:
    """Return the angular gaps between consecutive places (n, 3) about an axis, (n,), rad.

    ``point`` and ``axis`` (3,), unit. From the coordinate axis farthest from it, projected.
    """
    least = 0
    for a in range(1, 3):
        if abs(axis[a]) < abs(axis[least]):
            least = a
    across, up = np.empty(3), np.empty(3)
    for a in range(3):
        across[a] = (1.0 if a == least else 0.0) - axis[least] * axis[a]
    for a in range(3):
        i, j = (a + 1) % 3, (a + 2) % 3
        up[a] = axis[i] * across[j] - axis[j] * across[i]
    n = len(places)
    angles = np.empty(n)
    for i in range(n):
        x, y = 0.0, 0.0
        for a in range(3):
            x += (places[i, a] - point[a]) * across[a]
            y += (places[i, a] - point[a]) * up[a]
        angles[i] = np.arctan2(y, x)
    angles = np.sort(angles)
    gaps = np.empty(n)
    for i in range(n):
        gaps[i] = angles[i + 1] - angles[i] if i + 1 < n else angles[0] + 2.0 * np.pi - angles[i]
    return gaps


@compiled()
def leans_inward(middle: Float, along: Float, normal: Float, places: Float, beyond: Float) -> float:
    """Return the cosine by which the normal beyond an edge leans towards this face.

    ``middle``, ``along`` (3,) of the edge; ``normal`` (3,), ``places`` (n, 3) of this face,
    ``beyond`` (3,) the other normal. The direction into the face is perpendicular to edge and
    normal, towards the nearest place; 1 without such a place.
    """
    x = normal[1] * along[2] - normal[2] * along[1]
    y = normal[2] * along[0] - normal[0] * along[2]
    z = normal[0] * along[1] - normal[1] * along[0]
    length = np.sqrt(x * x + y * y + z * z)
    if length == 0.0 or len(places) == 0:
        return 1.0
    side, least = 0.0, np.inf
    for i in range(len(places)):
        a, b, c = places[i, 0] - middle[0], places[i, 1] - middle[1], places[i, 2] - middle[2]
        away = a * a + b * b + c * c
        across = x * a + y * b + z * c
        # Round a hole the nearest place may lie along the edge: rounding would decide its side.
        if away < least and across * across >= _BESIDE * length * length * away:
            side, least = across, away
    if side == 0.0:
        return 1.0
    lean: float = (x * beyond[0] + y * beyond[1] + z * beyond[2]) / length
    return -lean if side < 0.0 else lean
