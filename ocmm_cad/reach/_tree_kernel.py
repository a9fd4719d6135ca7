"""Compiled: whether a body comes near the triangles of a part, by the tree of boxes over them.

Bodies are rows of `N_COLUMNS` numbers: a round bar is the hull of two balls, a panel a prism.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float, Int

BAR, PANEL = 0, 1
# Columns of a body: its kind; middle of its start and its end; unit vector across (panel); radius
# of a bar, or half the width of a panel, at the start and at the end; half the thickness of a
# panel; part of the probe.
KIND, START, END, ACROSS, AT_START, AT_END, HALF_THICK, PART = 0, 1, 4, 7, 10, 11, 12, 13
N_COLUMNS = 14

FREE = -1
_DEEP = 64
"""Stack of pending boxes: more than twice the depth of a tree of 10^9 triangles."""
_CLOSE = 0.004
"""Share of a bar over which the slope of the distance at its start is evaluated."""
_STEPS = 22
"""Of the golden section: 0.618^22 is 2.5e-5 of the length of a bar, 1 um of a stylus."""


class PartMesh(NamedTuple):
    """Triangles of a part, and the tree of boxes over them as of `_search_kernel.grow`."""

    triangles: Float
    faces: Int
    """(n,): of each triangle."""
    surfaces: Int
    """(f,): of each face."""
    boxes: Float
    links: Int
    order: Int


@compiled()
def point_triangle(px: float, py: float, pz: float, t: Float) -> float:
    """Return the distance of a point from a triangle (3, 3).

    By the region that the point projects to (Ericson 2005, 5.1.5); in scalars, as arrays of three
    would be allocated a million times a second.
    """
    ax, ay, az = t[0, 0], t[0, 1], t[0, 2]
    abx, aby, abz = t[1, 0] - ax, t[1, 1] - ay, t[1, 2] - az
    acx, acy, acz = t[2, 0] - ax, t[2, 1] - ay, t[2, 2] - az
    x, y, z = px - ax, py - ay, pz - az
    d1 = abx * x + aby * y + abz * z
    d2 = acx * x + acy * y + acz * z
    # v and w: position of the nearest point along both edges from the first corner.
    v, w = 0.0, 0.0
    if d1 > 0.0 or d2 > 0.0:
        bx, by, bz = px - t[1, 0], py - t[1, 1], pz - t[1, 2]
        d3 = abx * bx + aby * by + abz * bz
        d4 = acx * bx + acy * by + acz * bz
        cx, cy, cz = px - t[2, 0], py - t[2, 1], pz - t[2, 2]
        d5 = abx * cx + aby * cy + abz * cz
        d6 = acx * cx + acy * cy + acz * cz
        va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
        if d3 >= 0.0 and d4 <= d3:
            v = 1.0
        elif d6 >= 0.0 and d5 <= d6:
            w = 1.0
        elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
            v = d1 / (d1 - d3)
        elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
            w = d2 / (d2 - d6)
        elif va <= 0.0 and d4 >= d3 and d5 >= d6:
            w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
            v = 1.0 - w
        else:
            # va + vb + vc is the square of twice the area; 0 for a degenerate triangle, which the
            # edges above have caught.
            v, w = vb / (va + vb + vc), vc / (va + vb + vc)
    x, y, z = x - v * abx - w * acx, y - v * aby - w * acy, z - v * abz - w * acz
    return float(np.sqrt(x * x + y * y + z * z))


@compiled()
def _bar_near(body: Float, t: Float, gap: float) -> bool:
    """Return whether a triangle comes nearer to a bar than ``gap``, mm.

    The distance of a point on a line, less a linear radius, is convex: golden section.
    """
    x, y, z = body[START], body[START + 1], body[START + 2]
    wx, wy, wz = body[END] - x, body[END + 1] - y, body[END + 2] - z
    r0, dr = body[AT_START], body[AT_END] - body[AT_START]
    length = np.sqrt(wx * wx + wy * wy + wz * wz)
    middle = point_triangle(x + 0.5 * wx, y + 0.5 * wy, z + 0.5 * wz, t) - r0 - 0.5 * dr
    if middle < gap:
        return True
    # The distance changes at most by the length and the change of radius.
    if middle - 0.5 * (length + abs(dr)) >= gap:
        return False
    ratio = 0.6180339887498949
    low, high = 0.0, 1.0
    first = point_triangle(x, y, z, t) - r0
    near = point_triangle(x + _CLOSE * wx, y + _CLOSE * wy, z + _CLOSE * wz, t) - r0 - _CLOSE * dr
    if first < gap or near < gap:
        return True
    if near >= first:
        # A convex distance that rises at its start rises to its end: this settles most triangles
        # about a ball that leaves its surface.
        if 0.5 * (first + near - _CLOSE * (length + abs(dr))) >= gap:
            return False
        high = _CLOSE
    p, q = high * (1.0 - ratio), high * ratio
    at_p = point_triangle(x + p * wx, y + p * wy, z + p * wz, t) - r0 - p * dr
    at_q = point_triangle(x + q * wx, y + q * wy, z + q * wz, t) - r0 - q * dr
    for _ in range(_STEPS):
        if at_p < gap or at_q < gap:
            return True
        # The rest is too short to fall by the missing amount.
        if min(at_p, at_q) - (high - low) * (length + abs(dr)) >= gap:
            return False
        if at_p < at_q:
            high, q, at_q = q, p, at_p
            p = high - ratio * (high - low)
            at_p = point_triangle(x + p * wx, y + p * wy, z + p * wz, t) - r0 - p * dr
        else:
            low, p, at_p = p, q, at_q
            q = low + ratio * (high - low)
            at_q = point_triangle(x + q * wx, y + q * wy, z + q * wz, t) - r0 - q * dr
    at_low = point_triangle(x + low * wx, y + low * wy, z + low * wz, t) - r0 - low * dr
    at_high = point_triangle(x + high * wx, y + high * wy, z + high * wz, t) - r0 - high * dr
    return bool(min(at_low, at_high) < gap)


@compiled()
def _parted(x: float, y: float, z: float, corners: Float, t: Float, gap: float) -> bool:
    """Return whether corners and triangle are ``gap`` apart along a direction of any length."""
    size = np.sqrt(x * x + y * y + z * z)
    if size < 1e-9:
        return False
    low, high = np.inf, -np.inf
    for k in range(8):
        at = x * corners[k, 0] + y * corners[k, 1] + z * corners[k, 2]
        low, high = min(low, at), max(high, at)
    low3, high3 = np.inf, -np.inf
    for k in range(3):
        at = x * t[k, 0] + y * t[k, 1] + z * t[k, 2]
        low3, high3 = min(low3, at), max(high3, at)
    return bool(max(low3 - high, low - high3) >= gap * size)


@compiled()
def _parted_by(
    ax: float, ay: float, az: float, bx: float, by: float, bz: float, corners: Float, t: Float,
    gap: float,
) -> bool:  # fmt: skip
    """Return whether corners and triangle are ``gap`` apart perpendicular to two directions."""
    return _parted(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx, corners, t, gap)


@compiled()
def _panel_near(corners: Float, t: Float, gap: float) -> bool:
    """Return whether a triangle may come nearer to a prism (8, 3) than ``gap``, mm.

    Separating axes: normals, products of edges; conservative for corners facing each other.
    """
    c = corners
    # Bits of the number of a corner: thickness, width, length. Edges: 0-1, 0-2, and both sides.
    tx, ty, tz = c[1, 0] - c[0, 0], c[1, 1] - c[0, 1], c[1, 2] - c[0, 2]
    if _parted(tx, ty, tz, c, t, gap):
        return False
    for one, other in ((0, 2), (0, 4), (2, 6)):
        ex, ey, ez = c[other, 0] - c[one, 0], c[other, 1] - c[one, 1], c[other, 2] - c[one, 2]
        if _parted_by(ex, ey, ez, tx, ty, tz, c, t, gap):
            return False
    ux, uy, uz = t[1, 0] - t[0, 0], t[1, 1] - t[0, 1], t[1, 2] - t[0, 2]
    vx, vy, vz = t[2, 0] - t[1, 0], t[2, 1] - t[1, 1], t[2, 2] - t[1, 2]
    if _parted_by(ux, uy, uz, vx, vy, vz, c, t, gap):
        return False
    for one, other in ((0, 1), (0, 2), (0, 4), (2, 6)):
        ex, ey, ez = c[other, 0] - c[one, 0], c[other, 1] - c[one, 1], c[other, 2] - c[one, 2]
        if _parted_by(ex, ey, ez, ux, uy, uz, c, t, gap):
            return False
        if _parted_by(ex, ey, ez, vx, vy, vz, c, t, gap):
            return False
        # The third edge is minus the sum of the first two.
        if _parted_by(ex, ey, ez, ux + vx, uy + vy, uz + vz, c, t, gap):
            return False
    return True


@compiled()
def _is_beside(t: Float, low: Float, high: Float) -> bool:
    """Return whether a triangle (3, 3) lies outside a box on one side of it."""
    for a in range(3):
        if max(t[0, a], t[1, a], t[2, a]) < low[a] or min(t[0, a], t[1, a], t[2, a]) > high[a]:
            return True
    return False


@compiled()
def first_near(body: Float, gap: float, own_gap: float, mesh: PartMesh, own: int) -> int:
    """Return a face that comes nearer to a body than ``gap``, mm; FREE if none does.

    For the surface ``own`` the ``own_gap``, no greater, holds.
    """
    triangles, faces, surfaces, boxes, links, order = mesh
    corners = np.empty((8, 3))
    start, way, across, thick = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    size2 = 1e-18
    for a in range(3):
        start[a], way[a] = body[START + a], body[END + a] - body[START + a]
        across[a] = body[ACROSS + a]
    widest = max(body[AT_START], body[AT_END])
    if body[KIND] == PANEL:
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            thick[a] = way[b] * across[c] - way[c] * across[b]
            size2 += thick[a] * thick[a]
        # Thickness, width, length: the bits of the number of a corner.
        for k in range(8):
            t = (1.0 if k & 1 else -1.0) * body[HALF_THICK] / np.sqrt(size2)
            w = (1.0 if k & 2 else -1.0) * (body[AT_END] if k & 4 else body[AT_START])
            for a in range(3):
                corners[k, a] = start[a] + w * across[a] + t * thick[a]
                if k & 4:
                    corners[k, a] += way[a]
    low, high = np.empty(3), np.empty(3)
    for a in range(3):
        low[a], high[a] = np.inf, -np.inf
        if body[KIND] == PANEL:
            for k in range(8):
                low[a], high[a] = min(low[a], corners[k, a]), max(high[a], corners[k, a])
        else:
            low[a] = start[a] + min(-body[AT_START], way[a] - body[AT_END])
            high[a] = start[a] + max(body[AT_START], way[a] + body[AT_END])
        low[a] -= gap
        high[a] += gap
    round_about = widest + body[HALF_THICK] + gap
    waiting = np.empty(_DEEP, dtype=np.int64)
    waiting[0] = 0
    count = 1
    while count:
        count -= 1
        box = waiting[count]
        outside = False
        near, far = 0.0, 1.0
        for a in range(3):
            if boxes[box, a] > high[a] or boxes[box, 3 + a] < low[a]:
                outside = True
                break
            # The body's axis intersects the box, enlarged by its radius, between these shares of
            # its length (slabs, Kay and Kajiya 1986).
            if abs(way[a]) > 1e-12:
                one = (boxes[box, a] - round_about - start[a]) / way[a]
                other = (boxes[box, 3 + a] + round_about - start[a]) / way[a]
                near, far = max(near, min(one, other)), min(far, max(one, other))
        if outside or near > far:
            continue
        if links[box, 1] < 0:
            waiting[count], waiting[count + 1] = links[box, 0], links[box, 0] + 1
            count += 2
            continue
        for k in range(links[box, 0], links[box, 0] + links[box, 1]):
            triangle = triangles[order[k]]
            # Bounding boxes exclude most triangles of a leaf.
            if _is_beside(triangle, low, high):
                continue
            face = faces[order[k]]
            limit = own_gap if surfaces[face] == own else gap
            if body[KIND] == PANEL:
                if _panel_near(corners, triangle, limit):
                    return int(face)
            elif _bar_near(body, triangle, limit):
                return int(face)
    return FREE
