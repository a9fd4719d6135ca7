"""Compiled loops of the led hand: distance to solids, and motion; part frame, mm, s, rad."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ocmm_core.cpu_features import njit
from ocmm_core.geometry import Float

BOX, ROUND, BALL, RING = 0, 1, 2, 3
"""Kinds of solids: a slab with holes, a truncated cone, a ball, a ring."""

# Columns of a solid: AXES are the rows of the rotation into its own frame, whose z leaves the
# material. SIZES: half length, half width and thickness of a slab below its top at z = 0; radius at
# z = 0, radius at the end and height of a round one; radius of a ball; radii of line and tube.
KIND, ORIGIN, AXES, SIZES, HOLE0, HOLE1, MIDDLE, REACH = 0, 1, 4, 13, 16, 17, 18, 21
N_SOLID = 22

LONG, SQUARE, OVAL = 0, 1, 2
"""Hole outlines: with round ends (a circle has length zero), rectangle, ellipse."""

# Columns of a hole, in the frame of its slab: outline, middle, direction, half sizes, depth. The
# first half size of LONG is that of its straight part.
OUTLINE, X, Y, COSINE, SINE, HALF_A, HALF_B, DEPTH = range(8)
N_HOLE = 8

# Columns of the state of a hand: place, velocity, outward contact normal, contact.
PLACE, VELOCITY, NORMAL, TOUCHES = 0, 3, 6, 9
N_STATE = 10

_STIFFNESS = 18.0
"""1/s: natural frequency of the approach to the target."""
_MOST_MM_S2 = 5000.0
"""A hand accelerates by half of g (Flash and Hogan 1985: reaches of 0.3 m in 0.5 s)."""
_GRIP = 0.5
"""Friction: lateral pull per pressed depth before the ball slides."""
_ROUNDS = 16
_SAME_MM = 1e-9


@njit(cache=True, nogil=True)
def _oval(a: float, b: float, x: float, y: float) -> tuple[float, float]:
    """Return the point on an ellipse nearest to (x, y), by the remaining turn.

    The foot of the normal is found by Newton's method on the parameter, from the point of the
    circle; half a dozen steps reach the last bit for the flat ellipses of parts.
    """
    t = math.atan2(a * y, b * x)
    for _ in range(12):
        c, s = math.cos(t), math.sin(t)
        slope = (a * a - b * b) * c * s - a * x * s + b * y * c
        # d/dt of the squared distance is -2 slope; its own slope is bounded away from zero.
        bend = (a * a - b * b) * (c * c - s * s) - a * x * c - b * y * s
        if abs(bend) < 1e-12:
            break
        t -= min(max(slope / bend, -0.5), 0.5)
    return a * math.cos(t), b * math.sin(t)


@njit(cache=True, nogil=True)
def _outline(hole: Float, x: float, y: float) -> tuple[float, float, float]:
    """Return the signed distance of (x, y) outside the outline, and its gradient."""
    c, s = hole[COSINE], hole[SINE]
    dx, dy = x - hole[X], y - hole[Y]
    u, v = c * dx + s * dy, -s * dx + c * dy
    a, b = hole[HALF_A], hole[HALF_B]
    if hole[OUTLINE] == LONG:
        along = u - min(max(u, -a), a)
        far = math.sqrt(along * along + v * v)
        if far < 1e-12:
            gu, gv, out = 0.0, 1.0, -b
        else:
            gu, gv, out = along / far, v / far, far - b
    elif hole[OUTLINE] == SQUARE:
        qu, qv = abs(u) - a, abs(v) - b
        su, sv = 1.0 if u >= 0.0 else -1.0, 1.0 if v >= 0.0 else -1.0
        if qu > 0.0 and qv > 0.0:
            out = math.sqrt(qu * qu + qv * qv)
            gu, gv = su * qu / out, sv * qv / out
        elif qu > qv:
            gu, gv, out = su, 0.0, qu
        else:
            gu, gv, out = 0.0, sv, qv
    else:
        fu, fv = _oval(a, b, u, v)
        nu, nv = fu / (a * a), fv / (b * b)
        size = math.sqrt(nu * nu + nv * nv)
        gu, gv = nu / size, nv / size
        out = (u - fu) * gu + (v - fv) * gv
    return out, c * gu - s * gv, s * gu + c * gv


@njit(cache=True, nogil=True)
def _slab(solid: Float, holes: Float, x: float, y: float, z: float, g: Float) -> float:
    """Return the signed distance outside a slab with holes; gradient in ``g``.

    Above a hole's rim it is the hypotenuse of the perpendicular distances to plane and wall.
    """
    qx, qy = abs(x) - solid[SIZES], abs(y) - solid[SIZES + 1]
    half = 0.5 * solid[SIZES + 2]
    qz = abs(z + half) - half
    sx = 1.0 if x >= 0.0 else -1.0
    sy = 1.0 if y >= 0.0 else -1.0
    sz = 1.0 if z + half >= 0.0 else -1.0
    ox, oy, oz = max(qx, 0.0), max(qy, 0.0), max(qz, 0.0)
    box = math.sqrt(ox * ox + oy * oy + oz * oz)
    if box > 0.0:
        g[0], g[1], g[2] = sx * ox / box, sy * oy / box, sz * oz / box
    else:
        box = max(qx, qy, qz)
        g[0], g[1], g[2] = 0.0, 0.0, 0.0
        if box == qz:
            g[2] = sz
        elif box == qx:
            g[0] = sx
        else:
            g[1] = sy
    for number in range(int(solid[HOLE0]), int(solid[HOLE1])):
        hole = holes[number]
        out, gx, gy = _outline(hole, x, y)
        above = z + hole[DEPTH]
        if out >= 0.0 or above <= 0.0:
            continue
        # In a hole: the wall or the bottom, whichever is nearer.
        free, hx, hy, hz = -out, -gx, -gy, 0.0
        if above < free:
            free, hx, hy, hz = above, 0.0, 0.0, 1.0
        if box <= 0.0:
            box = free
            g[0], g[1], g[2] = hx, hy, hz
        else:
            both = math.sqrt(box * box + free * free)
            g[0] = (box * g[0] + free * hx) / both
            g[1] = (box * g[1] + free * hy) / both
            g[2] = (box * g[2] + free * hz) / both
            box = both
        break
    return box


@njit(cache=True, nogil=True)
def _to_segment(
    x: float, y: float, ax: float, ay: float, bx: float, by: float
) -> tuple[float, float, float]:
    """Return the distance of (x, y) from a segment, and the vector from its foot."""
    ux, uy = bx - ax, by - ay
    t = min(max(((x - ax) * ux + (y - ay) * uy) / (ux * ux + uy * uy), 0.0), 1.0)
    dx, dy = x - ax - t * ux, y - ay - t * uy
    return math.sqrt(dx * dx + dy * dy), dx, dy


@njit(cache=True, nogil=True)
def _round(solid: Float, x: float, y: float, z: float, g: Float) -> float:
    """Return the signed distance outside a solid of revolution; gradient in ``g``."""
    rho = math.sqrt(x * x + y * y)
    if solid[KIND] == RING:
        away = rho - solid[SIZES]
        far = max(math.sqrt(away * away + z * z), 1e-12)
        gr, gz, out = away / far, z / far, far - solid[SIZES + 1]
    else:
        r0, r1, height = solid[SIZES], solid[SIZES + 1], solid[SIZES + 2]
        side, dr, dz = _to_segment(rho, z, r0, 0.0, r1, height)
        top, tr, tz = _to_segment(rho, z, r1, height, 0.0, height)
        if top < side:
            side, dr, dz = top, tr, tz
        foot, fr, fz = _to_segment(rho, z, r0, 0.0, 0.0, 0.0)
        if foot < side:
            side, dr, dz = foot, fr, fz
        inside = 0.0 < z < height and rho < r0 + (r1 - r0) * z / height
        sign = -1.0 if inside else 1.0
        if side < 1e-12:
            gr, gz = 0.0, 1.0
            if 0.0 < z < height:
                slant = math.sqrt(height * height + (r0 - r1) ** 2)
                gr, gz = height / slant, (r0 - r1) / slant
        else:
            gr, gz = sign * dr / side, sign * dz / side
        out = sign * side
    if rho > 1e-12:
        g[0], g[1] = gr * x / rho, gr * y / rho
    else:
        g[0], g[1] = gr, 0.0
    g[2] = gz
    return float(out)


@njit(cache=True, nogil=True)
def distance(place: Float, solids: Float, holes: Float, normal: Float) -> float:
    """Return the signed distance of (3,) to the nearest solid; gradient in ``normal``.

    ``solids`` (S, N_SOLID) and ``holes`` (H, N_HOLE). Outside all solids it is the true distance;
    inside it is negative and only indicates the way out.
    """
    best = 1e9
    g = np.empty(3)
    for number in range(len(solids)):
        solid = solids[number]
        mx, my, mz = (
            place[0] - solid[MIDDLE], place[1] - solid[MIDDLE + 1], place[2] - solid[MIDDLE + 2],
        )  # fmt: skip
        if math.sqrt(mx * mx + my * my + mz * mz) - solid[REACH] >= best:
            continue
        dx, dy, dz = (
            place[0] - solid[ORIGIN], place[1] - solid[ORIGIN + 1], place[2] - solid[ORIGIN + 2],
        )  # fmt: skip
        x = solid[AXES] * dx + solid[AXES + 1] * dy + solid[AXES + 2] * dz
        y = solid[AXES + 3] * dx + solid[AXES + 4] * dy + solid[AXES + 5] * dz
        z = solid[AXES + 6] * dx + solid[AXES + 7] * dy + solid[AXES + 8] * dz
        if solid[KIND] == BOX:
            out = _slab(solid, holes, x, y, z, g)
        elif solid[KIND] == BALL:
            far = max(math.sqrt(x * x + y * y + z * z), 1e-12)
            g[0], g[1], g[2] = x / far, y / far, z / far
            out = far - solid[SIZES]
        else:
            out = _round(solid, x, y, z, g)
        if out < best:
            best = out
            for a in range(3):
                normal[a] = (
                    solid[AXES + a] * g[0] + solid[AXES + 3 + a] * g[1] + solid[AXES + 6 + a] * g[2]
                )
    return best


@njit(cache=True, nogil=True)
def march(
    start: Float, direction: Float, radius: float, reach: float, solids: Float, holes: Float,
    place: Float, normal: Float,
) -> float:  # fmt: skip
    """Return the travel of a ball along a direction to contact, ``reach`` at most.

    Sphere tracing (Hart 1996): the distance to the nearest solid is free in any direction. Outputs:
    ``place`` (3,), the ball centre at the end, ``normal`` (3,), the way out there.
    """
    way = 0.0
    for _ in range(400):
        for a in range(3):
            place[a] = start[a] + way * direction[a]
        free = distance(place, solids, holes, normal) - radius
        if free < 1e-6:
            return way
        if way >= reach:
            return reach
        way = min(way + free, reach)
    return way


@njit(cache=True, nogil=True)
def drive(
    state: Float, aim: Float, most_mm_s: float, radius: float, period_s: float, solids: Float,
    holes: Float, tips: Float, gaps: Float, contact: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Move the ball towards ``aim`` (3,), frame by frame, without entering solids.

    ``state`` (N_STATE,) is updated in place. ``most_mm_s`` limits the speed. Outputs: ``tips`` (n,
    3); ``gaps`` (n,), mm, between ball and part; ``contact`` (n,).

    The hand is a critically damped spring, x'' = k^2 (aim - x) - 2 k x', with limits of a human arm
    for x'' and x'. Penetration becomes contact pressure: the ball is set back along the way out,
    and friction holds it until it is dragged.
    """
    p, v, n = state[PLACE : PLACE + 3], state[VELOCITY : VELOCITY + 3], state[NORMAL : NORMAL + 3]
    g = np.empty(3)
    for i in range(len(tips)):
        depth = 0.0
        for a in range(3):
            depth -= (aim[a] - p[a]) * n[a]
        held = False
        if state[TOUCHES] > 0.0 and depth > 0.0:
            drag2 = 0.0
            for a in range(3):
                drag2 += (aim[a] - p[a] + depth * n[a]) ** 2
            held = drag2 <= (_GRIP * depth) ** 2
        if held:
            for a in range(3):
                v[a] = 0.0
        else:
            pull2 = 0.0
            for a in range(3):
                g[a] = _STIFFNESS * (_STIFFNESS * (aim[a] - p[a]) - 2.0 * v[a])
                pull2 += g[a] * g[a]
            share = min(1.0, _MOST_MM_S2 / max(math.sqrt(pull2), 1e-12))
            speed2 = 0.0
            for a in range(3):
                v[a] += share * g[a] * period_s
                speed2 += v[a] * v[a]
            share = min(1.0, most_mm_s / max(math.sqrt(speed2), 1e-12))
            for a in range(3):
                v[a] *= share
                p[a] += v[a] * period_s
            state[TOUCHES] = 0.0
        gap = 0.0
        for _ in range(_ROUNDS):
            gap = distance(p, solids, holes, g) - radius
            if gap >= -_SAME_MM:
                break
            inward = 0.0
            for a in range(3):
                p[a] -= gap * g[a]
                n[a] = g[a]
                inward += v[a] * g[a]
            for a in range(3):
                v[a] -= min(inward, 0.0) * g[a]
            state[TOUCHES] = 1.0
            gap = 0.0
        for a in range(3):
            tips[i, a] = p[a]
        gaps[i] = max(gap, 0.0)
        contact[i] = state[TOUCHES] > 0.0
