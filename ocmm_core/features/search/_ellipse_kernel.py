"""Compiled loops of the ellipse, over blocks of points for vectorisation.

Parameters and step are those of `flat_kernel`. The second derivatives of the distance from an
ellipse follow from those of half its square F, minimised over the eccentric anomaly E of the foot:
F'' - F'E F'E / FEE.
"""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float

BLOCK = 64
"""Points per block: their data stay in the fastest memory."""
_COLUMNS = 18
_X, _Y, _T, _C, _S, _D, _WEIGHT = 0, 1, 2, 3, 4, 5, 6
_J, _A = 7, 12
"""Columns of a block: place, multiplier, foot, distance, weight; five of J; five by the anomaly."""
_STEPS = 4
"""Newton steps for all points of a block; the few that need more are handled separately."""
_NEAREST = 1e-12
_SETTLED = 1e-9
"""Relative step to a foot after which the next one would be as small as its square."""


@compiled()
def ellipse_foot(x: float, y: float, a: float, b: float) -> tuple[float, float]:
    """Return cosine and sine of the eccentric anomaly of the nearest point of an ellipse.

    Newton's iteration on a convex function (D. Eberly, Distance from a point to an ellipse, 2013),
    which always converges to the nearest foot, counted from the end of the shorter axis to avoid
    cancellation.
    """
    # By symmetry the point is moved to the first quadrant, the longer axis first; signs and order
    # are restored at the end.
    if a >= b:
        long, short, along, beside = a, b, abs(x), abs(y)
    else:
        long, short, along, beside = b, a, abs(y), abs(x)
    # On the long axis within the evolute the foot is off the axis; this prevents 0 / 0.
    beside = max(beside, 1e-18 * long)
    gap = long * long - short * short
    # The foot is (long^2 x / (t + gap), short^2 y / t), with t counted from the square of the
    # shorter axis. Cosine and sine are at most one, which bounds t from below.
    least = max(short * beside, long * along - gap)
    # On the ellipse itself t is the square of the short axis. From beyond the solution the first
    # step returns to its safe side, or further.
    t = max(least, short * short)
    for _ in range(80):
        by_long, by_short = 1.0 / (t + gap), 1.0 / t
        first, second = long * along * by_long, short * beside * by_short
        first, second = first * first, second * second
        # cos^2 + sin^2 - 1 over minus its derivative by t, -2 (c^2 / (t + gap) + s^2 / t).
        change = 0.5 * (first + second - 1.0) / (first * by_long + second * by_short)
        t = max(t + change, least)
        if abs(change) < _SETTLED * t:
            break
    c, s = long * along / (t + gap), short * beside / t
    scale = 1.0 / np.sqrt(c * c + s * s)
    c, s = c * scale, s * scale
    if a < b:
        c, s = s, c
    return np.copysign(c, x), np.copysign(s, y)


@compiled()
def _feet(m: int, a: float, b: float, block: Float) -> None:
    """Write the feet of the first ``m`` points of a block into it; see `ellipse_foot`."""
    swapped = a < b
    long, short = (b, a) if swapped else (a, b)
    gap = long * long - short * short
    smallest = 1e-18 * long
    for i in range(m):
        x, y = abs(block[_X, i]), abs(block[_Y, i])
        along, beside = (y, x) if swapped else (x, y)
        beside = beside if beside > smallest else smallest
        least, other = short * beside, long * along - gap
        least = least if least > other else other
        t = short * short
        t = t if t > least else least
        change = 0.0
        for _ in range(_STEPS):
            by_long, by_short = 1.0 / (t + gap), 1.0 / t
            first, second = long * along * by_long, short * beside * by_short
            first, second = first * first, second * second
            change = 0.5 * (first + second - 1.0) / (first * by_long + second * by_short)
            t += change
            t = t if t > least else least
        c, s = long * along / (t + gap), short * beside / t
        scale = 1.0 / np.sqrt(c * c + s * s)
        c, s = c * scale, s * scale
        block[_T, i] = abs(change) / t
        c, s = (s, c) if swapped else (c, s)
        block[_C, i] = -c if block[_X, i] < 0.0 else c
        block[_S, i] = -s if block[_Y, i] < 0.0 else s
    for i in range(m):
        if not block[_T, i] < _SETTLED:
            block[_C, i], block[_S, i] = ellipse_foot(block[_X, i], block[_Y, i], a, b)


@compiled()
def _columns(m: int, p: Float, block: Float) -> None:
    """Write the distances and their derivatives of the first ``m`` points of a block."""
    a, b, offset = p[3], p[4], p[7]
    rolling = offset != 0.0
    for i in range(m):
        x, y, c, s = block[_X, i], block[_Y, i], block[_C, i], block[_S, i]
        # The normal at the foot (a c, b s) is (c / a, s / b), here times a b.
        nx, ny = c * b, s * a
        scale = 1.0 / np.sqrt(nx * nx + ny * ny)
        nx, ny = nx * scale, ny * scale
        distance = nx * (x - a * c) + ny * (y - b * s)
        residual = distance - offset
        # For points on the ellipse; keeps the quotient below finite with its sign.
        nearest = 1e-9 if distance >= 0.0 else -1e-9
        nearest = distance if abs(distance) > 1e-9 else nearest
        block[_D, i] = residual
        # D = root of 2 F has D'' = (F'' - D' D') / D, multiplied by the residual D - offset: the
        # factor (D - offset) / D, which is one without an offset.
        block[_WEIGHT, i] = residual / nearest if rolling else 1.0
        # By u and v the point moves by -1, by the turn by (y, -x), in the frame of the ellipse.
        block[_J, i], block[_J + 1, i], block[_J + 2, i] = -nx, -ny, nx * y - ny * x
        # The foot moves by (c, 0) with a and by (0, s) with b; along the normal the distance
        # decreases.
        block[_J + 3, i], block[_J + 4, i] = -nx * c, -ny * s
        # d(foot)/dE; its own derivative is minus the foot.
        foot_x, foot_y = -a * s, b * c
        # FEE = |foot'|^2 - (p - foot) . foot'', with p - foot = distance n. It is zero at the
        # centre of curvature of the foot.
        bend = foot_x * foot_x + foot_y * foot_y + distance * (nx * a * c + ny * b * s)
        bend = bend if bend > _NEAREST else _NEAREST
        # F'E over the root of FEE, so that the products of the columns are F'E F'E / FEE.
        soft = 1.0 / np.sqrt(bend)
        block[_A, i], block[_A + 1, i] = foot_x * soft, foot_y * soft
        block[_A + 2, i] = (x * foot_y - y * foot_x) * soft
        block[_A + 3, i] = (c * foot_x + distance * nx * s) * soft
        block[_A + 4, i] = (s * foot_y - distance * ny * c) * soft


@compiled(reorder=True)
def _sums(m: int, block: Float, curvature: Float) -> None:
    """Add the second derivatives of the first ``m`` points of a block to ``curvature``."""
    turn_turn = x_turn = y_turn = 0.0
    w = wx = wy = wc = ws = wxx = wyc = wxs = wcc = wss = 0.0
    for i in range(m):
        x, y, c, s = block[_X, i], block[_Y, i], block[_C, i], block[_S, i]
        nx, ny, residual = -block[_J, i], -block[_J + 1, i], block[_D, i]
        # Second-order motion of the point itself: (x, y) turns to -(x, y).
        turn_turn -= residual * (nx * x + ny * y)
        x_turn += residual * ny
        y_turn -= residual * nx
        weight = block[_WEIGHT, i]
        # Products of the moves of p - foot: (-1, 0), (0, -1), (y, -x), (-c, 0), (0, -s).
        w += weight
        wx += weight * x
        wy += weight * y
        wc += weight * c
        ws += weight * s
        wxx += weight * (x * x + y * y)
        wyc += weight * y * c
        wxs += weight * x * s
        wcc += weight * c * c
        wss += weight * s * s
    curvature[0, 0] += w
    curvature[1, 1] += w
    curvature[2, 2] += turn_turn + wxx
    curvature[3, 3] += wcc
    curvature[4, 4] += wss
    curvature[0, 2] += x_turn - wy
    curvature[1, 2] += y_turn + wx
    curvature[0, 3] += wc
    curvature[1, 4] += ws
    curvature[2, 3] -= wyc
    curvature[2, 4] += wxs
    for j in range(5):
        for k in range(j, 5):
            total = 0.0
            for i in range(m):
                both = block[_A + j, i] * block[_A + k, i] + block[_J + j, i] * block[_J + k, i]
                total += block[_WEIGHT, i] * both
            curvature[j, k] -= total


@compiled()
def ellipse_terms(
    points: Float, p: Float, residuals: Float, jacobian: Float, curvature: Float
) -> float:
    """Write the derivatives of an ellipse by a step; see `axis_kernel.axis_terms`."""
    n = len(points)
    turn_cos, turn_sin = np.cos(p[2]), np.sin(p[2])
    curvature[:] = 0.0
    block = np.empty((_COLUMNS, BLOCK))
    cost = 0.0
    centre_x, centre_y = p[0], p[1]
    for first in range(0, n, BLOCK):
        some = points[first : first + BLOCK]
        m = len(some)
        for i in range(m):
            arm_x, arm_y = some[i, 0] - centre_x, some[i, 1] - centre_y
            block[_X, i] = turn_cos * arm_x + turn_sin * arm_y
            block[_Y, i] = turn_cos * arm_y - turn_sin * arm_x
        _feet(m, p[3], p[4], block)
        _columns(m, p, block)
        if curvature.size > 0:
            _sums(m, block, curvature)
        distances, slopes = residuals[first : first + BLOCK], jacobian[first : first + BLOCK]
        for i in range(m):
            distances[i] = block[_D, i]
        for j in range(5):
            for i in range(m):
                slopes[i, j] = block[_J + j, i]
    for i in range(n):
        cost += residuals[i] * residuals[i]
    for j in range(len(curvature)):
        for k in range(j):
            curvature[j, k] = curvature[k, j]
    return cost


@compiled()
def of_conic(conic: Float, offset: float, start: Float) -> bool:
    """Write the parameters of a conic (6,) to ``start`` (8,); False if not an ellipse.

    Of points ``offset`` outside the ellipse: a x^2 + b x y + c y^2 + d x + e y + f = 0.
    """
    # The sign of a conic is arbitrary; with this one an ellipse is positive outside.
    sign = 1.0 if conic[0] > 0.0 else -1.0
    a, h, c = sign * conic[0], 0.5 * sign * conic[1], sign * conic[2]
    d, e = 0.5 * sign * conic[3], 0.5 * sign * conic[4]
    determinant = a * c - h * h
    if not determinant > 0.0:
        return False
    # The centre, at zero gradient; h, d and e are the halves of b, d and e above.
    x, y = (h * e - c * d) / determinant, (h * d - a * e) / determinant
    # Minus the value at the centre; not positive if the conic has no real points.
    level = -(sign * conic[5] + d * x + e * y)
    if not level > 0.0:
        return False
    # Greatest eigenvalue of [[a, h], [h, c]], that of the shorter axis; determinant / greatest is
    # the other one. An axis squared is level / eigenvalue.
    greatest = 0.5 * (a + c) + np.hypot(0.5 * (a - c), h)
    long, short = np.sqrt(level * greatest / determinant), np.sqrt(level / greatest)
    start[0], start[1], start[7] = x, y, offset
    # The angle of the shorter axis, plus a quarter turn.
    start[2] = 0.5 * np.arctan2(2.0 * h, a - c) + 0.5 * np.pi
    # The centres of a ball of this radius are about that far outside; 0.05 keeps a start from a
    # rough conic an ellipse.
    start[3], start[4] = max(long - offset, 0.05 * short), max(short - offset, 0.05 * short)
    return True


@compiled()
def conics(points: Float, found: Float) -> None:
    """Write two conics (2, 6) through points (n, 2), in the form of `of_conic`.

    First the constrained one of Halir and Flusser, which always is an ellipse, then the one with
    unit coefficients. Raises LinAlgError for points on a straight line.
    """
    scatter = np.zeros((6, 6))
    one = np.empty(6)
    for row in range(len(points)):
        x, y = points[row, 0], points[row, 1]
        one[0], one[1], one[2], one[3], one[4], one[5] = x * x, x * y, y * y, x, y, 1.0
        for i in range(6):
            for j in range(6):
                scatter[i, j] += one[i] * one[j]
    mixed = np.ascontiguousarray(scatter[0:3, 3:6])
    # The linear part follows from the quadratic one at minimal scatter (Halir and Flusser, 1998): l
    # = -S3^-1 S2' q, and q'(S1 - S2 S3^-1 S2') q remains.
    to_linear = -np.linalg.solve(scatter[3:6, 3:6].copy(), mixed.T.copy())
    reduced = scatter[0:3, 0:3] + mixed @ to_linear
    # The inverse of the constraint 4 a c - b^2 = 1. Complex numbers, as rounding may need them.
    system = np.empty((3, 3), dtype=np.complex128)
    for j in range(3):
        system[0, j], system[1, j], system[2, j] = (
            0.5 * reduced[2, j], -reduced[1, j], 0.5 * reduced[0, j]
        )  # fmt: skip
    vectors = np.linalg.eig(system)[1].real
    best = 0
    # Only one of the three eigenvectors has 4 a c > b^2: the ellipse.
    inside = 4.0 * vectors[0] * vectors[2] - vectors[1] ** 2
    for j in range(1, 3):
        if inside[j] > inside[best]:
            best = j
    for i in range(3):
        found[0, i] = vectors[i, best]
        found[0, 3 + i] = 0.0
        for j in range(3):
            found[0, 3 + i] += to_linear[i, j] * vectors[j, best]
    found[1] = np.linalg.eigh(scatter)[1][:, 0]
