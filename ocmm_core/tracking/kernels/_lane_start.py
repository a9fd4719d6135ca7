"""Eight frames from spots to the start pose of the refinement; see `_solve_kernel`."""

from __future__ import annotations

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float
from ocmm_core.tracking.kernels import _kernel as kernel
from ocmm_core.tracking.kernels import _lane_algebra as lane_algebra
from ocmm_core.tracking.kernels import _lanes as lanes
from ocmm_core.tracking.kernels._kernel import undistort
from ocmm_core.tracking.kernels._lane_algebra import best_rotation
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
