"""Compiled loops of the fits without an axis: balls, and outlines in a plane.

==============  =========================  ====================================================
kind            parameters                 step
==============  =========================  ====================================================
``DISC``        x y R                      the same
``BALL``        x y z R                    the same
``ELLIPSE``     x y turn a b, -, -, offset  u v in its own frame, turn, a, b
``ROUND_ENDS``  x y turn a b               the same; a half the overall length, b half the width
``SQUARE_ENDS``  x y turn a b              the same
==============  =========================  ====================================================

Distances are positive outside. That of an ellipse is reduced by its offset, which is no parameter:
the centre of a ball rolling on an ellipse does not follow an ellipse. Its loops are in
`_ellipse_kernel`.
"""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float

DISC, BALL, ELLIPSE, ROUND_ENDS, SQUARE_ENDS = 4, 5, 6, 7, 8

_NEAREST = 1e-12


@compiled()
def move_flat(kind: int, p: Float, step: Float, moved: Float) -> None:
    for k in range(8):
        moved[k] = p[k]
    if kind <= BALL:
        for k in range(3 if kind == DISC else 4):
            moved[k] += step[k]
        return
    # The step of the centre is along the axes of the outline: turn it back into those of the plane.
    c, s = np.cos(p[2]), np.sin(p[2])
    moved[0] += c * step[0] - s * step[1]
    moved[1] += s * step[0] + c * step[1]
    for k in range(2, 5):
        moved[k] += step[k]


@compiled(reorder=True)
def ball_terms(
    d: int, points: Float, p: Float, residuals: Float, jacobian: Float, curvature: Float
) -> float:
    """Write the derivatives of a ball in ``d`` dimensions; see `axis_kernel.axis_terms`."""
    # Second derivatives of a distance: (1 - n n') / distance, across the normal only; the two parts
    # are summed separately. The radius is linear and adds none.
    cost = total = xx = xy = xz = yy = yz = zz = 0.0
    radius, cx, cy, cz = p[d], p[0], p[1], p[2]
    for row in range(len(points)):
        x, y = points[row, 0] - cx, points[row, 1] - cy
        z = points[row, 2] - cz if d == 3 else 0.0
        distance = np.sqrt(x * x + y * y + z * z)
        # At the centre no direction is outwards; a normal of zero length is harmless.
        distance = distance if distance > _NEAREST else _NEAREST
        residual = distance - radius
        residuals[row] = residual
        cost += residual * residual
        scale = 1.0 / distance
        weight = residual * scale
        total += weight
        x, y, z = x * scale, y * scale, z * scale
        # A centre that follows the point comes nearer to it.
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
def slot_terms(
    kind: int, points: Float, p: Float, residuals: Float, jacobian: Float, curvature: Float
) -> float:
    """Write the derivatives of a slot or rectangle by a step; see `axis_kernel.axis_terms`."""
    turn_cos, turn_sin = np.cos(p[2]), np.sin(p[2])
    a, b = p[3], p[4]
    bent = curvature.size > 0
    curvature[:] = 0.0
    # Motion of the point relative to the nearest corner or end: by u, v, turn, a, b. Only used on
    # round ends and beyond corners.
    g = np.zeros((5, 2))
    g[0, 0] = g[1, 1] = -1.0
    by_anomaly = np.empty(5)
    cost = 0.0
    for row in range(len(points)):
        arm_x, arm_y = points[row, 0] - p[0], points[row, 1] - p[1]
        x = turn_cos * arm_x + turn_sin * arm_y
        y = turn_cos * arm_y - turn_sin * arm_x
        # By symmetry one quadrant suffices: sides restore the signs.
        side_x, side_y = np.copysign(1.0, x), np.copysign(1.0, y)
        g[2, 0], g[2, 1] = y, -x
        g[3, 0] = g[3, 1] = g[4, 0] = g[4, 1] = 0.0
        # Normal (nx, ny), distance, and its derivatives by the two sizes.
        bend = 0.0
        if kind == ROUND_ENDS:
            # Beyond the straight part: a is half the overall length, b the radius of the ends, so
            # that the centres of the ends are at a - b.
            reach = abs(x) - (a - b)
            if reach <= 0.0:
                nx, ny, distance, by_a, by_b = 0.0, side_y, abs(y) - b, 0.0, -1.0
            else:
                length = max(np.sqrt(reach * reach + y * y), _NEAREST)
                nx, ny, distance = side_x * reach / length, y / length, length - b
                bend = 1.0 / length
                # The centre of the end moves out with a and in with b, and the radius grows with b.
                by_a = -reach / length
                by_b = -1.0 - by_a
                g[3, 0], g[4, 0] = -side_x, side_x
        else:
            reach_x, reach_y = abs(x) - a, abs(y) - b
            by_a = by_b = 0.0
            # Beyond a corner, which is the nearest point.
            if reach_x > 0.0 and reach_y > 0.0:
                length = max(np.sqrt(reach_x * reach_x + reach_y * reach_y), _NEAREST)
                nx, ny, distance = side_x * reach_x / length, side_y * reach_y / length, length
                bend = 1.0 / length
                by_a, by_b = -reach_x / length, -reach_y / length
                g[3, 0], g[4, 1] = -side_x, -side_y
            # Inside both are negative: the nearer side has the greater one.
            elif reach_x > reach_y:
                nx, ny, distance, by_a = side_x, 0.0, reach_x, -1.0
            else:
                nx, ny, distance, by_b = 0.0, side_y, reach_y, -1.0
        residuals[row] = distance
        cost += distance * distance
        jacobian[row, 0], jacobian[row, 1] = -nx, -ny
        # The point moves by (y, -x) with the turn of the outline.
        jacobian[row, 2] = nx * y - ny * x
        jacobian[row, 3], jacobian[row, 4] = by_a, by_b
        if not bent:
            continue

        # Second derivatives of the position of the point in the outline's frame: by two turns -(x,
        # y), by a turn and a shift (0, 1) and (-1, 0).
        curvature[2, 2] -= distance * (nx * x + ny * y)
        curvature[0, 2] += distance * ny
        curvature[1, 2] -= distance * nx
        if bend > 0.0:
            for i in range(5):
                # Motion across the normal: about a centre at the distance 1 / bend, moves t across
                # it add t t' bend.
                by_anomaly[i] = g[i, 1] * nx - g[i, 0] * ny
            for i in range(5):
                for j in range(i, 5):
                    curvature[i, j] += distance * bend * by_anomaly[i] * by_anomaly[j]
    for i in range(len(curvature)):
        for j in range(i):
            curvature[i, j] = curvature[j, i]
    return cost
