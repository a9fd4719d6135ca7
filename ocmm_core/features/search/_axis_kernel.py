"""Compiled loops of the fits about an axis: cone, torus, and the circle in space.

All are functions of a point's distance rho from the axis and height t along it. A step shifts the
axis along two directions across it (u1, u2) and, for elements with a place along it, along itself
(ua); it turns the axis towards the two (t1, t2); then follow the sizes. Parameters are eight
numbers: a point of the axis, the axis, and two sizes.

============  ====================================  =============================================
kind          step                                  distance
============  ====================================  =============================================
``CYLINDER``  u1 u2 t1 t2, R                        rho - R
``CONE``      u1 u2 t1 t2, half angle f, s          rho cos f - t sin f - s
``TORUS``     u1 u2 ua t1 t2, R, r                  hypot(rho - R, t) - r
``RING``      u1 u2 ua t1 t2, R                     rho - R and t, both
============  ====================================  =============================================

s is the distance of the axis point from the cone, which stays finite as the half angle approaches a
right one; the half angle passes through zero if a cone turns over.
"""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float

CYLINDER, CONE, TORUS, RING = 0, 1, 2, 3

_NEAREST = 1e-12
"""Distance from the axis below which a point has no direction."""


@compiled()
def across(x: float, y: float, z: float, e: Float) -> None:
    """Write two unit vectors square to the axis to ``e`` (Duff and others, JCGT 6, 2017)."""
    # sign + z| is between 1 and 2 for every axis direction: no cancellation.
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    e[0, 0], e[0, 1], e[0, 2] = 1.0 + sign * x * x * a, sign * b, -sign * x
    e[1, 0], e[1, 1], e[1, 2] = b, sign + y * y * a, -y


@compiled()
def move_axis(kind: int, p: Float, step: Float, moved: Float) -> None:
    """Write the parameters after a step to ``moved`` (8,)."""
    e = np.empty((2, 3))
    across(p[3], p[4], p[5], e)
    # Cylinder and cone may slide along their axes: no step ua, and all later ones move up by one.
    along = 0 if kind <= CONE else 1
    t1, t2 = step[2 + along], step[3 + along]
    # The axis moves on a great circle, by |t| towards (t1, t2). Second derivatives below hold for
    # this path only.
    turn = np.hypot(t1, t2)
    c = np.cos(turn)
    # sin(x) / x is one to the last digit well before 1e-30.
    s = np.sin(turn) / turn if turn > 1e-30 else 1.0
    length = 0.0
    for k in range(3):
        moved[k] = p[k] + step[0] * e[0, k] + step[1] * e[1, k]
        if along:
            moved[k] += step[2] * p[3 + k]
        moved[3 + k] = c * p[3 + k] + s * (t1 * e[0, k] + t2 * e[1, k])
        length += moved[3 + k] * moved[3 + k]
    length = np.sqrt(length)
    # Cosine and sine lose digits over time; normalise at every step.
    for k in range(3):
        moved[3 + k] /= length
    moved[6] = p[6] + step[4 + along]
    moved[7] = p[7] + step[5 + along] if kind in (CONE, TORUS) else p[7]
    if not along:
        # The axis point stays the foot of the origin; the size of a cone changes there.
        foot = moved[0] * moved[3] + moved[1] * moved[4] + moved[2] * moved[5]
        for k in range(3):
            moved[k] -= foot * moved[3 + k]
        if kind == CONE:
            # The foot is lower by `foot`, so t grows by it: rho cos f - t sin f - s is unchanged
            # for every point with s less foot sin f.
            moved[7] -= foot * np.sin(moved[6])


@compiled()
def axis_terms(
    kind: int, points: Float, p: Float, residuals: Float, jacobian: Float, curvature: Float
) -> float:
    """Write the derivatives by a step and return the sum of squared residuals.

    ``points`` (n, 3), ``p`` (8,); ``residuals`` (n,), for a ring (2 n,): all radial ones, then all
    heights; ``jacobian`` (., k) with the same rows; ``curvature`` (k, k): sum of every residual
    times its matrix of second derivatives, (0, 0) to omit it.
    """
    n = len(points)
    e = np.empty((2, 3))
    across(p[3], p[4], p[5], e)
    k = jacobian.shape[1]
    along = 0 if kind <= CONE else 1
    turn = 2 + along
    bent = curvature.size > 0
    curvature[:] = 0.0
    cf, sf = np.cos(p[6]), np.sin(p[6])
    cost = 0.0
    normal = np.empty(2)
    x = np.empty(2)
    by_rho = np.zeros(k)
    by_t = np.zeros(k)
    for row in range(n):
        qx, qy, qz = points[row, 0] - p[0], points[row, 1] - p[1], points[row, 2] - p[2]
        # Position across the axis (x), and along it (t), mm over the size of the feature.
        x[0] = qx * e[0, 0] + qy * e[0, 1] + qz * e[0, 2]
        x[1] = qx * e[1, 0] + qy * e[1, 1] + qz * e[1, 2]
        t = qx * p[3] + qy * p[4] + qz * p[5]
        rho = max(np.sqrt(x[0] * x[0] + x[1] * x[1]), _NEAREST)
        for i in range(2):
            # A shift of the axis by u_i takes x_i to x_i - u_i. A turn t_i takes the height to t +
            # t_i x_i, and since rho^2 + t^2 stays, rho d(rho) = -t x_i.
            normal[i] = x[i] / rho
            by_rho[i] = -normal[i]
            by_rho[turn + i] = -normal[i] * t
            by_t[turn + i] = x[i]
        if along:
            # A shift along the axis lowers every height equally.
            by_t[2] = -1.0
        # Weights of the second derivatives of rho and of t.
        weight_rho = weight_t = 0.0
        if kind == CYLINDER:
            d = rho - p[6]
            residuals[row] = d
            cost += d * d
            for i in range(4):
                jacobian[row, i] = by_rho[i]
            jacobian[row, 4] = -1.0
            # The residual rho - R has the curvature of rho alone.
            weight_rho = d
        elif kind == CONE:
            d = rho * cf - t * sf - p[7]
            residuals[row] = d
            cost += d * d
            for i in range(4):
                # The normal of the cone in the plane of axis and point is (cos f, -sin f).
                jacobian[row, i] = by_rho[i] * cf - by_t[i] * sf
                # d times the second derivative by (i, f): the derivative of the line above by f.
                if bent:
                    curvature[i, 4] -= d * (by_rho[i] * sf + by_t[i] * cf)
            jacobian[row, 4] = -rho * sf - t * cf
            jacobian[row, 5] = -1.0
            if bent:
                curvature[4, 4] -= d * (rho * cf - t * sf)
            weight_rho, weight_t = d * cf, -d * sf
        elif kind == TORUS:
            u = rho - p[6]
            # Distance from the circle of radius R; its gradient by (u, t) is (u, t) / tube.
            tube = max(np.sqrt(u * u + t * t), _NEAREST)
            d = tube - p[7]
            residuals[row] = d
            cost += d * d
            by_rho[5] = -1.0
            for i in range(6):
                jacobian[row, i] = (u * by_rho[i] + t * by_t[i]) / tube
            jacobian[row, 6] = -1.0
            # (tube)'' = (rho' rho' + t' t' - tube' tube' + u rho'' + t t'') / tube; the last two
            # terms come below, with their weights.
            share = d / tube
            for i in range(6 if bent else 0):
                for j in range(i, 6):
                    curvature[i, j] += share * (
                        by_rho[i] * by_rho[j]
                        + by_t[i] * by_t[j]
                        - jacobian[row, i] * jacobian[row, j]
                    )
            weight_rho, weight_t = share * u, share * t
        else:
            u = rho - p[6]
            residuals[row], residuals[n + row] = u, t
            cost += u * u + t * t
            by_rho[5] = -1.0
            for i in range(6):
                jacobian[row, i] = by_rho[i]
                jacobian[n + row, i] = by_t[i]
            weight_rho, weight_t = u, t
        for i in range(2 if bent else 0):
            for j in range(2):
                same = 1.0 if i == j else 0.0
                # Second derivatives of rho by two shifts: (1 - n n') / rho, the curvature of a
                # circle.
                flat = weight_rho * (same - normal[i] * normal[j]) / rho
                if j >= i:
                    curvature[i, j] += flat
                    curvature[turn + i, turn + j] += (
                        flat * t * t
                        # By two turns, from rho rho'' + rho' rho' = -t' t' - t t'' with t' = x and
                        # t'' = -t (the great circle): t^2 (1 - n n') / rho - rho n n'.
                        - weight_rho * rho * normal[i] * normal[j]
                        - weight_t * same * t
                    )
                # By a shift and a turn: -n t of the turn varies with n, and x of the height falls
                # by the shift.
                curvature[i, turn + j] += flat * t - weight_t * same
            if along:
                # -n t of the turn, with a height that falls by the shift along the axis.
                curvature[2, turn + i] += weight_rho * normal[i]
    # Only the upper half was summed.
    for i in range(len(curvature)):
        for j in range(i):
            curvature[i, j] = curvature[j, i]
    return cost


@compiled(reorder=True)
def axis_costs(kind: int, points: Float, starts: Float, costs: Float) -> None:
    """Write the sums of squared distances of points (n, 3) at all starts."""
    for row in range(len(starts)):
        p = starts[row]
        first, second = p[6], p[7]
        cf, sf = np.cos(first), np.sin(first)
        cost = 0.0
        for i in range(len(points)):
            qx, qy, qz = points[i, 0] - p[0], points[i, 1] - p[1], points[i, 2] - p[2]
            t = qx * p[3] + qy * p[4] + qz * p[5]
            # q|^2 - t^2 by subtraction: on the axis rounding may leave it below zero.
            square = max(qx * qx + qy * qy + qz * qz - t * t, 0.0)
            rho = np.sqrt(square)
            if kind == CYLINDER:
                d = rho - first
            elif kind == CONE:
                d = rho * cf - t * sf - second
            else:
                d = np.sqrt((rho - first) * (rho - first) + t * t) - second
            cost += d * d
        costs[row] = cost
