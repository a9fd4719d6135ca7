"""The compiled inner loop of camera fits: residuals and derivatives of one camera's spots.

One pass over the points; numpy needs some sixty passes for the same and three times as long.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ocmm_core.geometry import Float


@njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator] # numba ships no annotations
def see_points(
    packed: Float, points: Float, uv: Float, whitening: Float, misses: Float, rows: Float
) -> None:
    """Write whitened misses and their derivatives.

    Parameters
    ----------
    packed
        (24,): `CameraModel.packed`, then k3, s1, s2.
    points, uv
        (n, 3), mm, world, and (n, 2), px.
    whitening
        (3, n), 1/px: lower triangle (00, 10, 11) of each point.
    misses
        (2, n), out: predicted minus observed, whitened; infinite behind the camera.
    rows
        (p, 2, n), out: its derivatives by the first p of `lens.ALL_PARAMETERS`, p from 14 to 17.
    """
    f, sx, sy, u0, v0 = packed[12], packed[13], packed[14], packed[15], packed[16]
    k1, k2, p1, p2 = packed[17], packed[18], packed[19], packed[20]
    k3, s1, s2 = packed[21], packed[22], packed[23]
    terms = rows.shape[0]
    u_row, v_row = np.zeros(17), np.zeros(17)
    u_row[8] = 1.0
    v_row[9] = 1.0
    for n in range(points.shape[0]):
        px, py, pz = points[n, 0], points[n, 1], points[n, 2]
        ax = packed[0] * px + packed[1] * py + packed[2] * pz
        ay = packed[3] * px + packed[4] * py + packed[5] * pz
        az = packed[6] * px + packed[7] * py + packed[8] * pz
        depth = az + packed[11]
        if not depth > 0.0:
            misses[0, n] = misses[1, n] = np.inf
            for k in range(terms):
                rows[k, 0, n] = rows[k, 1, n] = 0.0
            continue
        tx, ty = (ax + packed[9]) / depth, (ay + packed[10]) / depth
        x, y = f * tx, f * ty
        xx, yy, xy2 = x * x, y * y, 2.0 * x * y
        r2 = xx + yy
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        slope = 2.0 * k1 + r2 * (4.0 * k2 + 6.0 * k3 * r2)
        along_x, along_y = 3.0 * xx + yy, xx + 3.0 * yy
        dx = x * radial + p1 * xy2 + p2 * along_x + s1 * r2
        dy = y * radial + p1 * along_y + p2 * xy2 + s2 * r2
        cross = 0.5 * xy2 * slope + 2.0 * (p1 * x + p2 * y)
        ux = sx * (radial + xx * slope + 2.0 * p1 * y + (6.0 * p2 + 2.0 * s1) * x)
        uy = sx * (cross + 2.0 * s1 * y)
        vx = sy * (cross + 2.0 * s2 * x)
        vy = sy * (radial + yy * slope + (6.0 * p1 + 2.0 * s2) * y + 2.0 * p2 * x)
        u_row[6], v_row[6] = ux * tx + uy * ty, vx * tx + vy * ty
        near = f / depth
        u_row[3], v_row[3] = near * ux, near * vx
        u_row[4], v_row[4] = near * uy, near * vy
        u_row[5], v_row[5] = -near * u_row[6], -near * v_row[6]
        u_row[0] = ay * u_row[5] - az * u_row[4]
        v_row[0] = ay * v_row[5] - az * v_row[4]
        u_row[1] = az * u_row[3] - ax * u_row[5]
        v_row[1] = az * v_row[3] - ax * v_row[5]
        u_row[2] = ax * u_row[4] - ay * u_row[3]
        v_row[2] = ax * v_row[4] - ay * v_row[3]
        u_row[7] = dx * sy
        u_row[10], v_row[10] = sx * x * r2, sy * y * r2
        u_row[11], v_row[11] = u_row[10] * r2, v_row[10] * r2
        u_row[12], v_row[12] = sx * xy2, sy * along_y
        u_row[13], v_row[13] = sx * along_x, sy * xy2
        u_row[14], v_row[14] = u_row[11] * r2, v_row[11] * r2
        u_row[15] = sx * r2
        v_row[16] = sy * r2
        first, across, second = whitening[0, n], whitening[1, n], whitening[2, n]
        miss_u, miss_v = sx * dx + u0 - uv[n, 0], sy * dy + v0 - uv[n, 1]
        misses[0, n] = first * miss_u
        misses[1, n] = across * miss_u + second * miss_v
        for k in range(terms):
            rows[k, 0, n] = first * u_row[k]
            rows[k, 1, n] = across * u_row[k] + second * v_row[k]
