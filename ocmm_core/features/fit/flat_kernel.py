"""The compiled loops of the fits without an axis: balls, and outlines in a plane.

==============  =========================  ====================================================
kind            parameters                 step
==============  =========================  ====================================================
``DISC``        x y R                      the same
``BALL``        x y z R                    the same
``ELLIPSE``     x y turn a b, -, -, offset  u v in its own frame, turn, a, b
``ROUND_ENDS``  x y turn a b               the same; a half the overall length, b half the width
``SQUARE_ENDS``  x y turn a b              the same
==============  =========================  ====================================================

Distances are positive outside. That of an ellipse is less its offset, which is no parameter: a ball
that rolls on an ellipse has its centre on a curve that is none.

The second derivatives of the distance from an ellipse follow from those of half its square F,
whose minimum over the eccentric anomaly E of the foot is taken: F'' - F'E F'E / FEE.
"""

from __future__ import annotations

import numpy as np

from ocmm_core.camera.compiled import compiled
from ocmm_core.geometry import Float

DISC, BALL, ELLIPSE, ROUND_ENDS, SQUARE_ENDS = 4, 5, 6, 7, 8

_NEAREST = 1e-12


@compiled()
def move_flat(kind: int, p: Float, step: Float, moved: Float) -> None:
    """Put the parameters after a step into ``moved`` (8,)."""
    for k in range(8):
        moved[k] = p[k]
    if kind <= BALL:
        for k in range(3 if kind == DISC else 4):
            moved[k] += step[k]
        return
    c, s = np.cos(p[2]), np.sin(p[2])
    moved[0] += c * step[0] - s * step[1]
    moved[1] += s * step[0] + c * step[1]
    for k in range(2, 5):
        moved[k] += step[k]


@compiled(reorder=True)
def ball_terms(
    d: int, points: Float, p: Float, residuals: Float, jacobian: Float, curvature: Float
) -> float:
    """Fill the derivatives of a ball in ``d`` dimensions; see `axis_kernel.axis_terms`."""
    cost = total = xx = xy = xz = yy = yz = zz = 0.0
    radius, cx, cy, cz = p[d], p[0], p[1], p[2]
    for row in range(len(points)):
        x, y = points[row, 0] - cx, points[row, 1] - cy
        z = points[row, 2] - cz if d == 3 else 0.0
        distance = np.sqrt(x * x + y * y + z * z)
        distance = distance if distance > _NEAREST else _NEAREST
        residual = distance - radius
        residuals[row] = residual
        cost += residual * residual
        scale = 1.0 / distance
        weight = residual * scale
        total += weight
        x, y, z = x * scale, y * scale, z * scale
        jacobian[row, 0], jacobian[row, 1] = -x, -y
        if d == 3:
            jacobian[row, 2] = -z
        xx += weight * x * x
        xy += weight * x * y
        xz += weight * x * z
        yy += weight * y * y
        yz += weight * y * z
        zz += weight * z * z
    jacobian[:, d] = -1.0
    for i in range(d + 1):
        curvature[i, d] = curvature[d, i] = 0.0
    curvature[0, 0], curvature[1, 1] = total - xx, total - yy
    curvature[0, 1] = curvature[1, 0] = -xy
    if d == 3:
        curvature[2, 2] = total - zz
        curvature[0, 2] = curvature[2, 0] = -xz
        curvature[1, 2] = curvature[2, 1] = -yz
    return cost


@compiled()
def ellipse_foot(x: float, y: float, a: float, b: float) -> tuple[float, float]:
    """Return cosine and sine of the eccentric anomaly of the nearest point of an ellipse.

    Newton's iteration on a convex function (D. Eberly, Distance from a point to an ellipse, 2013),
    which always ends at the nearest foot, counted from the end of the shorter axis so that nothing
    cancels there.
    """
    if a >= b:
        long, short, along, beside = a, b, abs(x), abs(y)
    else:
        long, short, along, beside = b, a, abs(y), abs(x)
    beside = max(beside, 1e-18 * long)
    gap = long * long - short * short
    least = max(short * beside, long * along - gap)
    # On the ellipse itself t is the square of the short axis. From beyond the solution the first
    # step leads back to its safe side, or further than that.
    t = max(least, short * short)
    for _ in range(80):
        by_long, by_short = 1.0 / (t + gap), 1.0 / t
        first, second = long * along * by_long, short * beside * by_short
        first, second = first * first, second * second
        change = 0.5 * (first + second - 1.0) / (first * by_long + second * by_short)
        t = max(t + change, least)
        # The next step would be as small as the square of this one.
        if abs(change) < 1e-9 * t:
            break
    c, s = long * along / (t + gap), short * beside / t
    scale = 1.0 / np.sqrt(c * c + s * s)
    c, s = c * scale, s * scale
    if a < b:
        c, s = s, c
    return np.copysign(c, x), np.copysign(s, y)


@compiled()
def outline_terms(
    kind: int, points: Float, p: Float, residuals: Float, jacobian: Float, curvature: Float
) -> float:
    """Fill the derivatives of an outline by a step; see `axis_kernel.axis_terms`."""
    turn_cos, turn_sin = np.cos(p[2]), np.sin(p[2])
    a, b = p[3], p[4]
    offset = p[7] if kind == ELLIPSE else 0.0
    for i in range(5):
        for j in range(5):
            curvature[i, j] = 0.0
    g = np.zeros((5, 2))
    g[0, 0] = g[1, 1] = -1.0
    by_anomaly = np.empty(5)
    cost = 0.0
    for row in range(len(points)):
        arm_x, arm_y = points[row, 0] - p[0], points[row, 1] - p[1]
        x = turn_cos * arm_x + turn_sin * arm_y
        y = turn_cos * arm_y - turn_sin * arm_x
        side_x, side_y = np.copysign(1.0, x), np.copysign(1.0, y)
        g[2, 0], g[2, 1] = y, -x
        g[3, 0] = g[3, 1] = g[4, 0] = g[4, 1] = 0.0
        # Normal (nx, ny), distance, and how the distance changes with the two sizes.
        bend = 0.0
        if kind == ELLIPSE:
            c, s = ellipse_foot(x, y, a, b)
            nx, ny = c * b, s * a
            scale = 1.0 / np.sqrt(nx * nx + ny * ny)
            nx, ny = nx * scale, ny * scale
            distance = nx * (x - a * c) + ny * (y - b * s)
            g[3, 0], g[4, 1] = -c, -s
            by_a, by_b = -nx * c, -ny * s
        elif kind == ROUND_ENDS:
            reach = abs(x) - (a - b)
            if reach <= 0.0:
                nx, ny, distance, by_a, by_b = 0.0, side_y, abs(y) - b, 0.0, -1.0
            else:
                length = max(np.sqrt(reach * reach + y * y), _NEAREST)
                nx, ny, distance = side_x * reach / length, y / length, length - b
                bend = 1.0 / length
                by_a = -reach / length
                by_b = -1.0 - by_a
                g[3, 0], g[4, 0] = -side_x, side_x
        else:
            reach_x, reach_y = abs(x) - a, abs(y) - b
            by_a = by_b = 0.0
            if reach_x > 0.0 and reach_y > 0.0:
                length = max(np.sqrt(reach_x * reach_x + reach_y * reach_y), _NEAREST)
                nx, ny, distance = side_x * reach_x / length, side_y * reach_y / length, length
                bend = 1.0 / length
                by_a, by_b = -reach_x / length, -reach_y / length
                g[3, 0], g[4, 1] = -side_x, -side_y
            elif reach_x > reach_y:
                nx, ny, distance, by_a = side_x, 0.0, reach_x, -1.0
            else:
                nx, ny, distance, by_b = 0.0, side_y, reach_y, -1.0
        residual = distance - offset
        residuals[row] = residual
        cost += residual * residual
        jacobian[row, 0], jacobian[row, 1] = -nx, -ny
        jacobian[row, 2] = nx * y - ny * x
        jacobian[row, 3], jacobian[row, 4] = by_a, by_b

        # Second derivatives of the place of the point in the frame of the outline.
        curvature[2, 2] -= residual * (nx * x + ny * y)
        curvature[0, 2] += residual * ny
        curvature[1, 2] -= residual * nx
        if kind == ELLIPSE:
            weight = 1.0
            if offset != 0.0:
                weight = residual / np.copysign(max(abs(distance), 1e-9), distance)
            foot_x, foot_y = -a * s, b * c
            second = foot_x * foot_x + foot_y * foot_y + distance * (nx * a * c + ny * b * s)
            for i in range(5):
                by_anomaly[i] = -(g[i, 0] * foot_x + g[i, 1] * foot_y)
            by_anomaly[3] += distance * nx * s
            by_anomaly[4] -= distance * ny * c
            softness = 1.0 / max(second, _NEAREST)
            for i in range(5):
                for j in range(i, 5):
                    curvature[i, j] += weight * (
                        g[i, 0] * g[j, 0]
                        + g[i, 1] * g[j, 1]
                        - by_anomaly[i] * by_anomaly[j] * softness
                        - jacobian[row, i] * jacobian[row, j]
                    )
        elif bend > 0.0:
            for i in range(5):
                by_anomaly[i] = g[i, 1] * nx - g[i, 0] * ny
            for i in range(5):
                for j in range(i, 5):
                    curvature[i, j] += residual * bend * by_anomaly[i] * by_anomaly[j]
    for i in range(5):
        for j in range(i):
            curvature[i, j] = curvature[j, i]
    return cost
