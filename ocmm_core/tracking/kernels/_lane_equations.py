"""Eight frames: start poses, normal equations, block solution; see `_solve_kernel`."""

from __future__ import annotations

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float
from ocmm_core.tracking.kernels import _kernel as kernel
from ocmm_core.tracking.kernels import _lane_algebra as lane_algebra
from ocmm_core.tracking.kernels import _lanes as lanes
from ocmm_core.tracking.kernels._kernel import undistort
from ocmm_core.tracking.kernels._lane_algebra import best_rotation, inverse3
from ocmm_core.tracking.kernels._lanes import Number, choose, load, spread, store

SPOT_ROWS = 7
"""Rows of a spot: ideal x and y, mm; diag(Sx, Sy) times the distortion's derivative by rows, px/mm,
zero if unseen; one if seen, else zero.
"""
POINT_ROWS = 4
"""Rows of a triangulated LED: place, mm, and one if seen by two cameras."""


@compiled(kernel, lanes)
def straighten_spots(
    like: Number, uv: Float, cams: Float, first: int, width: int, room: Float
) -> Number:
    """Fill the rows of all spots; return their number."""
    n, n_cameras, n_leds = uv.shape[0], uv.shape[1], uv.shape[2]
    one, zero = spread(like, 1.0), spread(like, 0.0)
    spots = zero
    for c in range(n_cameras):
        sx, sy, u0, v0 = cams[c, 13], cams[c, 14], cams[c, 15], cams[c, 16]
        for led in range(n_leds):
            row = SPOT_ROWS * (c * n_leds + led)
            for lane in range(width):
                # Behind the last frame, the last one is computed once more.
                frame = min(first + lane, n - 1)
                room[row, lane] = uv[frame, c, led, 0]
                room[row + 1, lane] = uv[frame, c, led, 1]
            u, v = load(like, room, row), load(like, room, row + 1)
            # A finite number less itself is zero, infinity and NaN are NaN.
            seen = choose(one, (u - u) + (v - v), one, zero)
            u, v = choose(seen, zero, u, spread(like, u0)), choose(seen, zero, v, spread(like, v0))
            # cams 13 to 20: Sx, Sy, u0, v0, k1, k2, p1, p2; 12 is f, 9 to 11 t and 0 to 8 R by
            # rows.
            x, y, j00, j01, j11 = undistort(
                (u - u0) * (1.0 / sx), (v - v0) * (1.0 / sy),
                cams[c, 17], cams[c, 18], cams[c, 19], cams[c, 20],
            )  # fmt: skip
            store(x, room, row)
            store(y, room, row + 1)
            store(seen * sx * j00, room, row + 2)
            store(seen * sx * j01, room, row + 3)
            store(seen * sy * j01, room, row + 4)
            store(seen * sy * j11, room, row + 5)
            store(seen, room, row + 6)
            spots = spots + seen
    return spots


@compiled(lanes)
def triangulate_lanes(like: Number, cams: Float, n_leds: int, room: Float, points: int) -> Number:
    """Fill the rows of all LEDs, from ``points`` on; return the number seen by two cameras."""
    one, zero = spread(like, 1.0), spread(like, 0.0)
    count = zero
    for led in range(n_leds):
        views = h00 = h10 = h20 = h11 = h21 = h22 = g0 = g1 = g2 = zero
        for c in range(cams.shape[0]):
            row = SPOT_ROWS * (c * n_leds + led)
            seen = load(like, room, row + 6)
            views = views + seen
            f = cams[c, 12]
            # The rows of `kernel.triangulate_leds`; one without weight is zero.
            for axis in range(2):
                w = load(like, room, row + axis)
                a0 = seen * (w * cams[c, 6] - f * cams[c, 3 * axis])
                a1 = seen * (w * cams[c, 7] - f * cams[c, 3 * axis + 1])
                a2 = seen * (w * cams[c, 8] - f * cams[c, 3 * axis + 2])
                b = f * cams[c, 9 + axis] - w * cams[c, 11]
                h00, h10, h11 = h00 + a0 * a0, h10 + a0 * a1, h11 + a1 * a1
                h20, h21, h22 = h20 + a0 * a2, h21 + a1 * a2, h22 + a2 * a2
                g0, g1, g2 = g0 + a0 * b, g1 + a1 * b, g2 + a2 * b
        located = choose(views, spread(like, 1.5), one, zero)
        # Cofactors of the symmetric H over its determinant.
        c00, c10, c20 = h11 * h22 - h21 * h21, h20 * h21 - h10 * h22, h10 * h21 - h20 * h11
        c11, c21, c22 = h00 * h22 - h20 * h20, h10 * h20 - h00 * h21, h00 * h11 - h10 * h10
        scale = 1.0 / (h00 * c00 + h10 * c10 + h20 * c20)
        row = points + POINT_ROWS * led
        store(choose(located, zero, scale * (c00 * g0 + c10 * g1 + c20 * g2), zero), room, row)
        store(choose(located, zero, scale * (c10 * g0 + c11 * g1 + c21 * g2), zero), room, row + 1)
        store(choose(located, zero, scale * (c20 * g0 + c21 * g1 + c22 * g2), zero), room, row + 2)
        store(located, room, row + 3)
        count = count + located
    return count


@compiled(lane_algebra, lanes)
def fit_lanes(
    like: Number, leds: Float, room: Float, points: int, count: Number
) -> tuple[tuple[Number, ...], tuple[Number, ...]]:
    """Return rotation, by rows, and origin of the rigid fit to the triangulated LEDs."""
    zero = spread(like, 0.0)
    a0 = a1 = a2 = b0 = b1 = b2 = zero
    for led in range(len(leds)):
        row = points + POINT_ROWS * led
        located = load(like, room, row + 3)
        a0, a1 = a0 + located * leds[led, 0], a1 + located * leds[led, 1]
        a2 = a2 + located * leds[led, 2]
        b0, b1 = b0 + load(like, room, row), b1 + load(like, room, row + 1)
        b2 = b2 + load(like, room, row + 2)
    share = 1.0 / count
    a0, a1, a2, b0, b1, b2 = (
        a0 * share, a1 * share, a2 * share, b0 * share, b1 * share, b2 * share
    )  # fmt: skip
    size = s00 = s01 = s02 = s10 = s11 = s12 = s20 = s21 = s22 = zero
    for led in range(len(leds)):
        row = points + POINT_ROWS * led
        located = load(like, room, row + 3)
        x, y, z = (
            located * (leds[led, 0] - a0), located * (leds[led, 1] - a1),
            located * (leds[led, 2] - a2),
        )  # fmt: skip
        u, v, w = (
            located * (load(like, room, row) - b0), located * (load(like, room, row + 1) - b1),
            located * (load(like, room, row + 2) - b2),
        )  # fmt: skip
        s00, s01, s02 = s00 + x * u, s01 + x * v, s02 + x * w
        s10, s11, s12 = s10 + y * u, s11 + y * v, s12 + y * w
        s20, s21, s22 = s20 + z * u, s21 + z * v, s22 + z * w
        size = size + 0.5 * (x * x + y * y + z * z + u * u + v * v + w * w)
    r = best_rotation(like, (s00, s01, s02, s10, s11, s12, s20, s21, s22), size)
    return r, (
        b0 - (r[0] * a0 + r[1] * a1 + r[2] * a2),
        b1 - (r[3] * a0 + r[4] * a1 + r[5] * a2),
        b2 - (r[6] * a0 + r[7] * a1 + r[8] * a2),
    )


@compiled(lanes)
def pose_equations(
    like: Number, cams: Float, leds: Float, room: Float,
    r: tuple[Number, ...], origin: tuple[Number, ...],
) -> tuple[Number, ...]:  # fmt: skip
    """Return J'J and J'r of the residuals in px, r'r, and the least depth of a seen LED.

    In the order: rotation by rotation (6, lower), translation by rotation (9), translation by
    translation (6, lower), gradient of rotation and of translation, r'r, depth. Pose increments and
    comments as in `kernel.normal_equations`. Cameras are first summed by the place of the LED, A =
    sum of d'd and b = sum of d'r: with the arm q from the probe's origin to the LED and Q =
    skew(q), the rows of the rotation are (Q d')', so that its blocks are Q A and Q A Q'.
    """
    zero = spread(like, 0.0)
    one = spread(like, 1.0)
    n_leds = len(leds)
    w00 = w10 = w11 = w20 = w21 = w22 = t00 = t10 = t11 = t20 = t21 = t22 = zero
    k00 = k01 = k02 = k10 = k11 = k12 = k20 = k21 = k22 = zero
    gw0 = gw1 = gw2 = gt0 = gt1 = gt2 = total = zero
    depth = one
    for led in range(n_leds):
        lx, ly, lz = leds[led, 0], leds[led, 1], leds[led, 2]
        qx = r[0] * lx + r[1] * ly + r[2] * lz
        qy = r[3] * lx + r[4] * ly + r[5] * lz
        qz = r[6] * lx + r[7] * ly + r[8] * lz
        px, py, pz = qx + origin[0], qy + origin[1], qz + origin[2]
        a00 = a10 = a11 = a20 = a21 = a22 = b0 = b1 = b2 = zero
        for c in range(cams.shape[0]):
            row = SPOT_ROWS * (c * n_leds + led)
            s00, s01 = load(like, room, row + 2), load(like, room, row + 3)
            s10, s11 = load(like, room, row + 4), load(like, room, row + 5)
            seen = load(like, room, row + 6)
            xc = cams[c, 0] * px + cams[c, 1] * py + cams[c, 2] * pz + cams[c, 9]
            yc = cams[c, 3] * px + cams[c, 4] * py + cams[c, 5] * pz + cams[c, 10]
            zc = cams[c, 6] * px + cams[c, 7] * py + cams[c, 8] * pz + cams[c, 11]
            # Unseen points may be anywhere: a depth of one is harmless.
            zc = choose(seen, zero, zc, one)
            depth = choose(depth, zc, zc, depth)
            iz = 1.0 / zc
            m = cams[c, 12] * iz
            xi, yi = m * xc, m * yc
            ex, ey = load(like, room, row) - xi, load(like, room, row + 1) - yi
            r0, r1 = s00 * ex + s01 * ey, s10 * ex + s11 * ey
            total = total + (r0 * r0 + r1 * r1)
            # Down the columns of the image: d(px) by the point along the axes of the camera.
            f0, f1 = m * s00, m * s01
            f2 = (0.0 - iz) * (s00 * xi + s01 * yi)
            h0, h1 = m * s10, m * s11
            h2 = (0.0 - iz) * (s10 * xi + s11 * yi)
            d0 = f0 * cams[c, 0] + f1 * cams[c, 3] + f2 * cams[c, 6]
            d1 = f0 * cams[c, 1] + f1 * cams[c, 4] + f2 * cams[c, 7]
            d2 = f0 * cams[c, 2] + f1 * cams[c, 5] + f2 * cams[c, 8]
            e0 = h0 * cams[c, 0] + h1 * cams[c, 3] + h2 * cams[c, 6]
            e1 = h0 * cams[c, 1] + h1 * cams[c, 4] + h2 * cams[c, 7]
            e2 = h0 * cams[c, 2] + h1 * cams[c, 5] + h2 * cams[c, 8]
            a00, a10, a11 = (
                a00 + (d0 * d0 + e0 * e0),
                a10 + (d1 * d0 + e1 * e0),
                (a11 + (d1 * d1 + e1 * e1)),
            )
            a20, a21, a22 = (
                a20 + (d2 * d0 + e2 * e0),
                a21 + (d2 * d1 + e2 * e1),
                (a22 + (d2 * d2 + e2 * e2)),
            )
            b0, b1, b2 = (
                b0 + (d0 * r0 + e0 * r1),
                b1 + (d1 * r0 + e1 * r1),
                (b2 + (d2 * r0 + e2 * r1)),
            )
        t00, t10, t11 = t00 + a00, t10 + a10, t11 + a11
        t20, t21, t22 = t20 + a20, t21 + a21, t22 + a22
        gt0, gt1, gt2 = gt0 + b0, gt1 + b1, gt2 + b2
        gw0, gw1, gw2 = (
            gw0 + (qy * b2 - qz * b1), gw1 + (qz * b0 - qx * b2), gw2 + (qx * b1 - qy * b0)
        )  # fmt: skip
        # A Q': its row i is Q times row i of A.
        m00, m01, m02 = qy * a20 - qz * a10, qz * a00 - qx * a20, qx * a10 - qy * a00
        m10, m11, m12 = qy * a21 - qz * a11, qz * a10 - qx * a21, qx * a11 - qy * a10
        m20, m21, m22 = qy * a22 - qz * a21, qz * a20 - qx * a22, qx * a21 - qy * a20
        k00, k01, k02 = k00 + m00, k01 + m01, k02 + m02
        k10, k11, k12 = k10 + m10, k11 + m11, k12 + m12
        k20, k21, k22 = k20 + m20, k21 + m21, k22 + m22
        w00, w10, w11 = (
            w00 + (qy * m20 - qz * m10), w10 + (qz * m00 - qx * m20), w11 + (qz * m01 - qx * m21)
        )  # fmt: skip
        w20, w21, w22 = (
            w20 + (qx * m10 - qy * m00), w21 + (qx * m11 - qy * m01), w22 + (qx * m12 - qy * m02)
        )  # fmt: skip
    return (
        w00, w10, w11, w20, w21, w22, k00, k01, k02, k10, k11, k12, k20, k21, k22,
        t00, t10, t11, t20, t21, t22, gw0, gw1, gw2, gt0, gt1, gt2, total, depth,
    )  # fmt: skip


@compiled(lane_algebra, lanes)
def eliminate(e: tuple[Number, ...]) -> tuple[Number, ...]:
    """Return T^-1, K' T^-1 = N, the inverse of W - N K, and the least pivot.

    K is the block translation by rotation, T that of the translation, W that of the rotation.
    """
    i = inverse3(e[15], e[16], e[17], e[18], e[19], e[20])
    k00, k01, k02, k10, k11, k12, k20, k21, k22 = e[6:15]
    n00, n01, n02 = (
        k00 * i[0] + k10 * i[1] + k20 * i[3], k00 * i[1] + k10 * i[2] + k20 * i[4],
        k00 * i[3] + k10 * i[4] + k20 * i[5],
    )  # fmt: skip
    n10, n11, n12 = (
        k01 * i[0] + k11 * i[1] + k21 * i[3], k01 * i[1] + k11 * i[2] + k21 * i[4],
        k01 * i[3] + k11 * i[4] + k21 * i[5],
    )  # fmt: skip
    n20, n21, n22 = (
        k02 * i[0] + k12 * i[1] + k22 * i[3], k02 * i[1] + k12 * i[2] + k22 * i[4],
        k02 * i[3] + k12 * i[4] + k22 * i[5],
    )  # fmt: skip
    v = inverse3(
        e[0] - (n00 * k00 + n01 * k10 + n02 * k20),
        e[1] - (n10 * k00 + n11 * k10 + n12 * k20),
        e[2] - (n10 * k01 + n11 * k11 + n12 * k21),
        e[3] - (n20 * k00 + n21 * k10 + n22 * k20),
        e[4] - (n20 * k01 + n21 * k11 + n22 * k21),
        e[5] - (n20 * k02 + n21 * k12 + n22 * k22),
    )
    least = choose(i[6], v[6], v[6], i[6])
    return (
        i[0], i[1], i[2], i[3], i[4], i[5], n00, n01, n02, n10, n11, n12, n20, n21, n22,
        v[0], v[1], v[2], v[3], v[4], v[5], least,
    )  # fmt: skip
