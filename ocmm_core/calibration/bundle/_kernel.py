"""Compiled inner loops of the bundle: elimination of the poses one by one.

Every frame of the probe has six unknowns, its pose; so has every placement of a bar, as a body of
two LEDs. Each forms its normal equations with the common columns and leaves, with ``V = L L'``, the
reduced rows ``Y = L^-1 W`` and ``z = L^-1 g``; the common columns then have the normal matrix ``U -
Y'Y`` (Schur complement; Triggs et al. 2000, section 6.1).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ocmm_core.calibration.cameras import empty_rows, spot_rows
from ocmm_core.calibration.cameras import lens as camera_kernel
from ocmm_core.camera import compiled
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking.kernels import backward, turn
from ocmm_core.tracking.kernels import small_algebra as algebra

N_CAMERA = 14
"""Columns of a camera: `camera.model.PARAMETERS`."""

# Leaves five digits above float64 rounding, 1e-16; the corresponding angle has a sine of 3e-6.
LEAST_PIVOT = 1e-11
"""Relative to its diagonal element; below, a pose or rotation is undetermined."""


@compiled()
def eliminate(v: Float, w: Float, g: Float, damping: float) -> bool:
    """Replace V by its Cholesky factor, W by Y and g by z; False if singular."""
    size, columns = w.shape
    for j in range(size):
        diagonal = v[j, j]
        # Marquardt's damping is relative to the diagonal, so that radians and millimetres are
        # treated alike.
        d = diagonal * (1.0 + damping)
        for k in range(j):
            d -= v[j, k] * v[j, k]
        # Remaining diagonal after the previous columns: sine squared of the angle between this
        # unknown's column and theirs.
        if not d > LEAST_PIVOT * diagonal:
            return False
        d = np.sqrt(d)
        v[j, j] = d
        for i in range(j + 1, size):
            value = v[i, j]
            for k in range(j):
                value -= v[i, k] * v[j, k]
            v[i, j] = value / d
        # The same elimination for the right sides, row by row: forward substitution L Y = W, L z =
        # g.
        for k in range(j):
            factor = v[j, k]
            g[j] -= factor * g[k]
            for column in range(columns):
                w[j, column] -= factor * w[k, column]
        g[j] /= d
        for column in range(columns):
            w[j, column] /= d
    return True


class WeightedRows(NamedTuple):
    """Weighted derivatives of a spot, u and v, and its weighted miss (2,)."""

    u_row: Float
    v_row: Float
    """`u_row`, `v_row`: by the camera, (14,)."""
    u_point: Float
    v_point: Float
    """`u_point`, `v_point`: by the point, (3,), world."""
    miss: Float


@compiled(camera_kernel)
def add_spot(
    packed: Float, x: float, y: float, z: float, seen: Float, weight: float, first: int,
    u: Float, b: Float, rows: WeightedRows,
) -> float:  # fmt: skip
    """Add a spot to U and b; return its weighted square, infinite behind the camera."""
    u_row, v_row, u_point, v_point, miss = rows
    depth, predicted_u, predicted_v = spot_rows(packed, x, y, z, u_row, v_row)
    if not depth > 0.0:
        return np.inf
    # Predicted minus observed, in sigmas; the step of the solver therefore has a minus.
    miss_u, miss_v = weight * (predicted_u - seen[0]), weight * (predicted_v - seen[1])
    miss[0], miss[1] = miss_u, miss_v
    for k in range(N_CAMERA):
        u_row[k] *= weight
        v_row[k] *= weight
    # By the point in the world: columns 3 to 5 are by the point in the camera frame, so multiply by
    # R'.
    for k in range(3):
        u_point[k] = u_row[3] * packed[k] + u_row[4] * packed[3 + k] + u_row[5] * packed[6 + k]
        v_point[k] = v_row[3] * packed[k] + v_row[4] * packed[3 + k] + v_row[5] * packed[6 + k]
    # Lower triangle only.
    for i in range(N_CAMERA):
        b[first + i] += u_row[i] * miss_u + v_row[i] * miss_v
        for j in range(i + 1):
            u[first + i, first + j] += u_row[i] * u_row[j] + v_row[i] * v_row[j]
    square: float = miss_u * miss_u + miss_v * miss_v
    return square


@compiled()
def add_to_frame(
    v: Float, w: Float, g: Float, u_pose: Float, v_pose: Float, first: int,
    u_row: Float, v_row: Float, miss_u: float, miss_v: float,
) -> None:  # fmt: skip
    """Add a spot to V, W and g of its frame; restore the rows of `kernel.spot_rows`."""
    for i in range(6):
        by_u, by_v = u_pose[i], v_pose[i]
        g[i] += by_u * miss_u + by_v * miss_v
        for j in range(i + 1):
            v[i, j] += by_u * u_pose[j] + by_v * v_pose[j]
        for k in range(N_CAMERA):
            w[i, first + k] += by_u * u_row[k] + by_v * v_row[k]
    # `add_spot` multiplied these by the weight.
    u_row[8] = v_row[9] = 1.0


@compiled(camera_kernel)
def schur_reduce_poses(
    cameras: Float, leds: Float, tip: Float, seat_positions: Float, seat_weight: float,
    led_columns: int, seat_columns: int, uv: Float, weights: Float, seats: Int,
    rotations: Float, origins: Float, damping: float,
    u: Float, b: Float, factors: Float, y: Float, z: Float, jacobian: Float, diagonals: Float,
) -> float:  # fmt: skip
    """Add all frames to U and b, output factors, Y and z; return the sum of squares.

    Infinite if an LED is behind a camera or a pose is undetermined. In: ``cameras`` (C, 24),
    `lens.LensCamera.packed`; ``leds`` (L, 3), ``tip`` (3,), mm, probe (two LEDs: a bar along x);
    ``seat_positions`` (S, 3), mm, world; ``seat_weight``, 1/mm: inverse seating repeatability;
    first common columns of LEDs (negative: none) and seats, those of the tip directly before the
    seats'; ``uv`` (n, C, L, 2), px; ``weights`` (n, C, L), 1/px, zero if unused; ``seats`` (n,), -1
    for none; poses, world from probe, (n, 3, 3) and (n, 3), mm; ``damping`` of the diagonals
    (Levenberg-Marquardt). Added to: ``u`` (k, k), lower triangle, and ``b`` (k,). Out: ``factors``
    (n, 6, 6), ``y`` (n, 6, k'), ``z`` (n, 6), k' <= k the first columns (frames without a seat need
    those of cameras and LEDs only); ``jacobian``, ``diagonals`` (n, 6): gradient by the pose, and
    diagonal of its normal matrix.
    """
    n_frames, n_cameras, n_leds = weights.shape
    total = 0.0
    u_row, v_row = empty_rows()
    u_pose, v_pose = np.empty(6), np.empty(6)
    u_point, v_point = np.empty(3), np.empty(3)
    u_led, v_led, miss = np.empty(3), np.empty(3), np.empty(2)
    rows = WeightedRows(u_row, v_row, u_point, v_point, miss)
    row, common, columns = np.empty(6), np.empty(9), np.empty(9, np.int64)
    for n in range(n_frames):
        rotation, v, w, g = rotations[n], factors[n], y[n], z[n]
        v[:] = 0.0
        w[:] = 0.0
        g[:] = 0.0
        used = False
        for led in range(n_leds):
            lx, ly, lz = leds[led, 0], leds[led, 1], leds[led, 2]
            qx = rotation[0, 0] * lx + rotation[0, 1] * ly + rotation[0, 2] * lz
            qy = rotation[1, 0] * lx + rotation[1, 1] * ly + rotation[1, 2] * lz
            qz = rotation[2, 0] * lx + rotation[2, 1] * ly + rotation[2, 2] * lz
            # First of the three columns of this LED, if LEDs are unknowns.
            at = led_columns + 3 * led
            for c in range(n_cameras):
                weight = weights[n, c, led]
                if weight == 0.0:
                    continue
                used = True
                first = N_CAMERA * c
                square = add_spot(
                    cameras[c], qx + origins[n, 0], qy + origins[n, 1], qz + origins[n, 2],
                    uv[n, c, led], weight, first, u, b, rows,
                )  # fmt: skip
                if square == np.inf:
                    return np.inf
                total += square
                miss_u, miss_v = miss[0], miss[1]
                # By the rotation w about the body's origin, world axes: p . (w x q) = w . (q x p).
                u_pose[0] = qy * u_point[2] - qz * u_point[1]
                u_pose[1] = qz * u_point[0] - qx * u_point[2]
                u_pose[2] = qx * u_point[1] - qy * u_point[0]
                v_pose[0] = qy * v_point[2] - qz * v_point[1]
                v_pose[1] = qz * v_point[0] - qx * v_point[2]
                v_pose[2] = qx * v_point[1] - qy * v_point[0]
                u_pose[3:], v_pose[3:] = u_point, v_point
                if led_columns >= 0:
                    for k in range(3):
                        # By the LED in the body frame: X = R led + origin, so R' times the
                        # derivative by X.
                        u_led[k] = (
                            u_point[0] * rotation[0, k] + u_point[1] * rotation[1, k]
                            + u_point[2] * rotation[2, k]
                        )  # fmt: skip
                        v_led[k] = (
                            v_point[0] * rotation[0, k] + v_point[1] * rotation[1, k]
                            + v_point[2] * rotation[2, k]
                        )  # fmt: skip
                    for i in range(3):
                        b[at + i] += u_led[i] * miss_u + v_led[i] * miss_v
                        for j in range(i + 1):
                            u[at + i, at + j] += u_led[i] * u_led[j] + v_led[i] * v_led[j]
                        for j in range(N_CAMERA):
                            u[at + i, first + j] += u_led[i] * u_row[j] + v_led[i] * v_row[j]
                        for j in range(6):
                            w[j, at + i] += u_pose[j] * u_led[i] + v_pose[j] * v_led[i]
                add_to_frame(v, w, g, u_pose, v_pose, first, u_row, v_row, miss_u, miss_v)
        # An identity keeps the factor regular; its step then is z = 0.
        if not used:
            jacobian[n] = 0.0
            diagonals[n] = 0.0
            for i in range(6):
                v[i, i] = 1.0
            continue
        if seats[n] >= 0:
            seat = seats[n]
            q = rotation @ tip
            for axis in range(3):
                # Tip less seat, one world axis at a time, in units of the seat's sigma.
                off = seat_weight * (q[axis] + origins[n, axis] - seat_positions[seat, axis])
                total += off * off
                row[:] = 0.0
                # The origin moves the tip along this axis by one. Axis i of w x q is w[i+1] q[i+2]
                # - w[i+2] q[i+1], indices modulo 3.
                row[3 + axis] = seat_weight
                after, before = (axis + 1) % 3, (axis + 2) % 3
                row[after] = seat_weight * q[before]
                row[before] = -seat_weight * q[after]
                for k in range(3):
                    # The tip's columns directly precede the seats': d(R tip)[axis] / d(tip[k]) =
                    # R[axis, k].
                    columns[k] = seat_columns - 3 + k
                    common[k] = seat_weight * rotation[axis, k]
                columns[3] = seat_columns + 3 * seat + axis
                # The seat has the opposite sign.
                common[3] = -seat_weight
                for i in range(6):
                    g[i] += row[i] * off
                    for j in range(i + 1):
                        v[i, j] += row[i] * row[j]
                    for k in range(4):
                        w[i, columns[k]] += row[i] * common[k]
                for i in range(4):
                    b[columns[i]] += common[i] * off
                    for j in range(i + 1):
                        u[columns[i], columns[j]] += common[i] * common[j]
        if n_leds == 2:
            # Rotation of a bar about itself is unobservable and held fixed. The bar's axis is R's
            # first column; pin times its square stiffens the rotation about it. The value of pin
            # affects no other step except via damping; the trace scales it like the rest.
            pin = v[0, 0] + v[1, 1] + v[2, 2]
            for i in range(3):
                for j in range(i + 1):
                    v[i, j] += pin * rotation[i, 0] * rotation[j, 0]
        for i in range(6):
            # Before the elimination overwrites them: needed to predict the gain of the step.
            jacobian[n, i] = g[i]
            diagonals[n, i] = v[i, i]
        if not eliminate(v, w, g, damping):
            return np.inf
    return total


@compiled(camera_kernel)
def miss_frames(
    cameras: Float, leds: Float, uv: Float, rotations: Float, origins: Float, residuals: Float
) -> None:
    """Write predicted minus observed, (n, C, L, 2), px; NaN unseen, infinite behind a camera."""
    n_frames, n_cameras, n_leds = uv.shape[:3]
    u_row, v_row = empty_rows()
    for n in range(n_frames):
        for led in range(n_leds):
            at = rotations[n] @ leds[led] + origins[n]
            for c in range(n_cameras):
                _, u, v = spot_rows(cameras[c], at[0], at[1], at[2], u_row, v_row)
                residuals[n, c, led, 0] = u - uv[n, c, led, 0]
                residuals[n, c, led, 1] = v - uv[n, c, led, 1]


@compiled(algebra)
def back_substitute(factors: Float, y: Float, z: Float, step: Float, steps: Float) -> None:
    """Write the steps (n, 6) of eliminated poses for a step (k,) of the common columns."""
    for n in range(factors.shape[0]):
        own = steps[n]
        for i in range(6):
            # V own + W step = -g with V = L L' gives L' own = -(z + Y step).
            value = z[n, i]
            for k in range(step.shape[0]):
                value += y[n, i, k] * step[k]
            own[i] = -value
        backward(factors[n], own)


@compiled(algebra)
def retract_poses(rotations: Float, origins: Float, steps: Float) -> None:
    """Update the poses in place by rotation vectors (world axes) and translations."""
    turned, work = np.empty((3, 3)), np.empty((3, 3))
    for n in range(steps.shape[0]):
        # exp(w) R: world axes, consistent with the derivatives above.
        turn(rotations[n], steps[n, 0], steps[n, 1], steps[n, 2], turned, work)
        for i in range(3):
            origins[n, i] += steps[n, 3 + i]
