"""Compiled, for tens of thousands of edges: elementary faces' edges, and places inside."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float, Int

PLANE, CYLINDER, CONE, SPHERE, TORUS = range(5)
"""Elementary surfaces, parametrised as `ElSLib` of the library."""
LINE, RING, OTHER = range(3)
"""Curves in the parameters of a face: a line, a circle, and those evaluated by the library."""
_FEW, _MORE, _MOST = 400, 3600, 14_400
"""Places tried on a face: more if few of them lie inside its edges."""
_ENOUGH = 60
_THIN = 1.0 / 40.0


@compiled()
def _outline(kind: int, a: float, b: float, v: float) -> tuple[float, float, float, float]:
    """Return radius and height of the profile turned about an axis at ``v``, and both by ``v``.

    ``a``, ``b``: radius of a cylinder, sphere; start radius, half angle of a cone; torus radii.
    """
    if kind == CYLINDER:
        return a, v, 0.0, 1.0
    if kind == CONE:
        return a + v * np.sin(b), v * np.cos(b), np.sin(b), np.cos(b)
    if kind == SPHERE:
        return a * np.cos(v), a * np.sin(v), -a * np.sin(v), a * np.cos(v)
    return a + b * np.cos(v), b * np.sin(v), -b * np.sin(v), b * np.cos(v)


@compiled()
def _place(kind: int, frame: Float, a: float, b: float, u: float, v: float, place: Float) -> None:
    """Fill in the ``place`` (3,) of a surface at its parameters; ``frame`` as in `run_along`."""
    if kind == PLANE:
        for k in range(3):
            place[k] = frame[0, k] + u * frame[1, k] + v * frame[2, k]
        return
    radius, height, _, _ = _outline(kind, a, b, v)
    x, y = radius * np.cos(u), radius * np.sin(u)
    for k in range(3):
        place[k] = frame[0, k] + x * frame[1, k] + y * frame[2, k] + height * frame[3, k]


@compiled()
def _normal(kind: int, frame: Float, a: float, b: float, u: float, v: float, normal: Float) -> None:
    """Fill in the ``normal`` (3,) of a surface: d/du times d/dv; zero where undefined."""
    by_u, by_v = np.empty(3), np.empty(3)
    radius, _, more, higher = _outline(kind, a, b, v)
    for k in range(3):
        if kind == PLANE:
            by_u[k], by_v[k] = frame[1, k], frame[2, k]
        else:
            by_u[k] = radius * (np.cos(u) * frame[2, k] - np.sin(u) * frame[1, k])
            out = np.cos(u) * frame[1, k] + np.sin(u) * frame[2, k]
            by_v[k] = more * out + higher * frame[3, k]
    size2 = 0.0
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        normal[k] = by_u[i] * by_v[j] - by_u[j] * by_v[i]
        size2 += normal[k] * normal[k]
    if size2 > 0.0:
        for k in range(3):
            normal[k] /= np.sqrt(size2)


@compiled()
def run_along(
    kind: int, frame: Float, sizes: Float, side: float, curve_kinds: Int, curves: Float,
    starts: Int, along: Float, uv: Float, lines: Float, normals: Float, lengths: Float,
) -> None:  # fmt: skip
    """Fill in the edges of a face: parameters, places, the normal in their middle, their length.

    ``frame`` (4, 3): origin, x, y, axis; left-handed if mirrored. ``sizes`` (2,): see `_outline`.
    ``side``: 1, or -1 for a reversed face. ``curves`` (m, 6): start and direction of a line;
    middle, x and y of a ring, both scaled by its radius. ``starts`` (m + 1,): of each edge in
    ``along`` (n,), ``uv`` (n, 2), given for other curves, and ``lines`` (n, 3). ``normals`` (m, 3),
    ``lengths`` (m,), mm.
    """
    a, b = sizes[0], sizes[1]
    for m in range(len(curve_kinds)):
        low, high = starts[m], starts[m + 1]
        lengths[m] = 0.0
        for i in range(low, high):
            for k in range(2):
                if curve_kinds[m] == LINE:
                    uv[i, k] = curves[m, k] + along[i] * curves[m, 2 + k]
                elif curve_kinds[m] == RING:
                    turned = (
                        np.cos(along[i]) * curves[m, 2 + k] + np.sin(along[i]) * curves[m, 4 + k]
                    )
                    uv[i, k] = curves[m, k] + turned
            _place(kind, frame, a, b, uv[i, 0], uv[i, 1], lines[i])
            if i > low:
                away = 0.0
                for k in range(3):
                    away += (lines[i, k] - lines[i - 1, k]) ** 2
                lengths[m] += np.sqrt(away)
        half = low + (high - low) // 2
        _normal(kind, frame, a, b, uv[half, 0], uv[half, 1], normals[m])
        for k in range(3):
            normals[m, k] *= side


@compiled()
def inside(us: Float, vs: Float, loops: Float, found: NDArray[np.bool_]) -> None:
    """Fill in which pairs of ``us`` (r,) and ``vs`` (c,), both rising, lie inside closed loops.

    ``loops`` (m, 2, 2): stretches. ``found`` (r, c) is initially false. A ray from an inside pair
    towards greater u crosses an odd number of times. Each crossing is noted at the last pair before
    it; finally all pairs before a note are toggled: time grows with places plus crossings, not
    their product.
    """
    for k in range(len(loops)):
        u0, v0, u1, v1 = loops[k, 0, 0], loops[k, 0, 1], loops[k, 1, 0], loops[k, 1, 1]
        # Half open, so that a corner on the ray is crossed once.
        low, high = min(v0, v1), max(v0, v1)
        slope = 0.0 if v1 == v0 else (u1 - u0) / (v1 - v0)
        for j in range(np.searchsorted(vs, low), len(vs)):
            if vs[j] >= high:
                break
            before = np.searchsorted(us, u0 + slope * (vs[j] - v0)) - 1
            if before >= 0:
                found[before, j] = not found[before, j]
    for i in range(len(us) - 2, -1, -1):
        for j in range(len(vs)):
            found[i, j] = found[i, j] != found[i + 1, j]


@compiled()
def closed_loops(uv: Float, starts: Int) -> Float:
    """Return the stretches (m, 2, 2) of all edges, and those that close gaps between their ends.

    Ray counting needs loops closed bit for bit: a ray through the gap of rounding at a corner
    misses a crossing. Each end is joined to the nearest free end; sorted along u, few are compared.
    """
    edges = len(starts) - 1
    ends = np.empty((2 * edges, 2))
    for m in range(edges):
        for k in range(2):
            ends[2 * m, k], ends[2 * m + 1, k] = uv[starts[m], k], uv[starts[m + 1] - 1, k]
    loops = np.empty((len(uv), 2, 2))
    count = 0
    for m in range(edges):
        for i in range(starts[m], starts[m + 1] - 1):
            for k in range(2):
                loops[count, 0, k], loops[count, 1, k] = uv[i, k], uv[i + 1, k]
            count += 1
    order = np.argsort(ends[:, 0])
    free = np.ones(len(order), dtype=np.bool_)
    for i in range(len(order)):
        if not free[i]:
            continue
        mate, least = -1, np.inf
        for j in range(i + 1, len(order)):
            over = ends[order[j], 0] - ends[order[i], 0]
            if over * over > least:
                break
            away = over * over + (ends[order[j], 1] - ends[order[i], 1]) ** 2
            if free[j] and away < least:
                mate, least = j, away
        if mate < 0:
            continue
        free[mate] = False
        if least > 0.0:
            loops[count, 0], loops[count, 1] = ends[order[i]], ends[order[mate]]
            count += 1
    return loops[:count]


@compiled()
def places_inside(kind: int, frame: Float, sizes: Float, uv: Float, starts: Int) -> Float:
    """Return places (n, 3) of a face inside its edges: more are tried if few are inside.

    A grid of similar spacing in space in both directions. Parameters as in `run_along`.
    """
    a, b = sizes[0], sizes[1]
    loops = closed_loops(uv, starts)
    u0, v0, u1, v1 = np.inf, np.inf, -np.inf, -np.inf
    for i in range(len(uv)):
        u0, u1 = min(u0, uv[i, 0]), max(u1, uv[i, 0])
        v0, v1 = min(v0, uv[i, 1]), max(v1, uv[i, 1])
    across, up = u1 - u0, v1 - v0
    if kind != PLANE:
        radius, _, more, higher = _outline(kind, a, b, 0.5 * (v0 + v1))
        across, up = across * abs(radius), up * np.sqrt(more * more + higher * higher)
    thin = _THIN * max(across, up, 1e-9)
    across, up = max(across, thin), max(up, thin)
    total = 0
    us, vs = np.empty(0), np.empty(0)
    found = np.zeros((0, 0), dtype=np.bool_)
    for tried in (_FEW, _MORE, _MOST):
        rows = max(3, int(np.rint(np.sqrt(tried * across / up))))
        columns = max(3, int(np.rint(tried / rows)))
        us = u0 + (u1 - u0) * (np.arange(rows) + 0.5) / rows
        vs = v0 + (v1 - v0) * (np.arange(columns) + 0.5) / columns
        found = np.zeros((rows, columns), dtype=np.bool_)
        inside(us, vs, loops, found)
        total = found.sum()
        if total >= _ENOUGH:
            break
    places = np.empty((total, 3))
    row = 0
    for i in range(len(us)):
        for j in range(len(vs)):
            if found[i, j]:
                _place(kind, frame, a, b, us[i], vs[j], places[row])
                row += 1
    return places
