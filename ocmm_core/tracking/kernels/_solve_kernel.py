"""Compiled hot path: spots of eight frames at once to tip, covariance and chi-square.

The same source processes eight frames in parallel and a single one (`_lanes`), and releases the
GIL. Same algorithm as `tracking.pose` in plain numpy:

1. exact inversion of the distortion (three Newton steps); 2. closed-form triangulation of every LED
  seen by two cameras, with homogeneous rows
   ``(x R3 - f R1) . X = f x0 - x z0`` (thesis 2.4.1, errata);
3. rigid fit of the body with determinant +1 (Horn 1987, unit quaternions); 4. Gauss-Newton steps on
  the reprojection residuals of all spots, in pixels.

Step 4 makes the tip statistically efficient; `gauss_newton_steps = 0` is the method of the thesis.
No branch depends on the frame: unseen spots have weight zero, and an undetermined pose ends in NaN
or in a pivot that is not positive, and is lost.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking.kernels import _kernel as kernel
from ocmm_core.tracking.kernels import _lane_algebra as lane_algebra
from ocmm_core.tracking.kernels import _lane_equations as lane_equations
from ocmm_core.tracking.kernels import _lanes as lanes
from ocmm_core.tracking.kernels._kernel import LOST, OK
from ocmm_core.tracking.kernels._lane_algebra import product, rotation_of_vector
from ocmm_core.tracking.kernels._lane_equations import (
    POINT_ROWS,
    SPOT_ROWS,
    eliminate,
    fit_lanes,
    pose_equations,
    straighten_spots,
    triangulate_lanes,
)
from ocmm_core.tracking.kernels._lanes import WIDTH, Number, choose, eight, spread, store

_RESULT = 24
"""Rows of the result: tip, covariance (6), rotation (9), origin, chi-square, dof, status."""
_LEAST = 2
"""Fewer frames are solved one by one."""

_NEEDS = (kernel, lane_algebra, lane_equations, lanes)


@compiled(*_NEEDS)
def _solve_group(
    like: Number, width: int, uv: Float, cams: Float, leds: Float, tip: Float, sigma: float,
    most_tip_sigma: float, steps: int, first: int, room: Float,
) -> int:  # fmt: skip
    """Solve as many frames as ``like`` holds, from ``first``; return the row of results."""
    one, zero = spread(like, 1.0), spread(like, 0.0)
    n_cameras, n_leds = len(cams), len(leds)
    points = SPOT_ROWS * n_cameras * n_leds
    spots = straighten_spots(like, uv, cams, first, width, room)
    count = triangulate_lanes(like, cams, n_leds, room, points)
    r, origin = fit_lanes(like, leds, room, points, count)
    e = pose_equations(like, cams, leds, room, r, origin)
    k = eliminate(e)
    squares, depth, pivot = e[27], e[28], k[21]
    for step in range(steps):
        # The rotation with its coupled translation, then the translation: T t = gt - K w.
        h0 = e[21] - (k[6] * e[24] + k[7] * e[25] + k[8] * e[26])
        h1 = e[22] - (k[9] * e[24] + k[10] * e[25] + k[11] * e[26])
        h2 = e[23] - (k[12] * e[24] + k[13] * e[25] + k[14] * e[26])
        w0 = k[15] * h0 + k[16] * h1 + k[18] * h2
        w1 = k[16] * h0 + k[17] * h1 + k[19] * h2
        w2 = k[18] * h0 + k[19] * h1 + k[20] * h2
        t0 = k[0] * e[24] + k[1] * e[25] + k[3] * e[26] - (k[6] * w0 + k[9] * w1 + k[12] * w2)
        t1 = k[1] * e[24] + k[2] * e[25] + k[4] * e[26] - (k[7] * w0 + k[10] * w1 + k[13] * w2)
        t2 = k[3] * e[24] + k[4] * e[25] + k[5] * e[26] - (k[8] * w0 + k[11] * w1 + k[14] * w2)
        # g' H^-1 g is the decrease of the sum of squares by a full step.
        reduction = (
            e[21] * w0 + e[22] * w1 + e[23] * w2 + e[24] * t0 + e[25] * t1 + e[26] * t2
        )  # fmt: skip
        # From the left: w is along the axes of the world, as the arms of `pose_equations` are.
        r = product(rotation_of_vector(w0, w1, w2), r)
        origin = (origin[0] + t0, origin[1] + t1, origin[2] + t2)
        if step + 1 < steps:
            e = pose_equations(like, cams, leds, room, r, origin)
            k = eliminate(e)
            squares = e[27]
            depth, pivot = choose(depth, e[28], e[28], depth), choose(pivot, k[21], k[21], pivot)
        else:
            # First-order decrease of the sum of squares by the last step. The covariance below also
            # uses the matrix before the last step: recomputing it would cost a third of the frame.
            # The step is as long as the noise of the rigid fit, at most some 0.1 mm at a metre, and
            # changes the covariance by that part, at most 1e-3
            # (tests/core/tracking/test_solve_kernel.py).
            left = squares - reduction
            squares = choose(left, zero, left, zero)
    q0 = r[0] * tip[0] + r[1] * tip[1] + r[2] * tip[2]
    q1 = r[3] * tip[0] + r[4] * tip[1] + r[5] * tip[2]
    q2 = r[6] * tip[0] + r[7] * tip[1] + r[8] * tip[2]
    # A translation follows the rotation by -T^-1 K w = -N' w, and the tip also moves by w x q: in
    # total M w, M = -skew(q) - N', plus the translation's own uncertainty, T^-1.
    m00, m01, m02 = 0.0 - k[6], q2 - k[9], 0.0 - q1 - k[12]
    m10, m11, m12 = 0.0 - q2 - k[7], 0.0 - k[10], q0 - k[13]
    m20, m21, m22 = q1 - k[8], 0.0 - q0 - k[11], 0.0 - k[14]
    v00, v01, v02 = (
        m00 * k[15] + m01 * k[16] + m02 * k[18], m00 * k[16] + m01 * k[17] + m02 * k[19],
        m00 * k[18] + m01 * k[19] + m02 * k[20],
    )  # fmt: skip
    v10, v11, v12 = (
        m10 * k[15] + m11 * k[16] + m12 * k[18], m10 * k[16] + m11 * k[17] + m12 * k[19],
        m10 * k[18] + m11 * k[19] + m12 * k[20],
    )  # fmt: skip
    v20, v21, v22 = (
        m20 * k[15] + m21 * k[16] + m22 * k[18], m20 * k[16] + m21 * k[17] + m22 * k[19],
        m20 * k[18] + m21 * k[19] + m22 * k[20],
    )  # fmt: skip
    variance = sigma * sigma
    c00 = variance * (k[0] + v00 * m00 + v01 * m01 + v02 * m02)
    c10 = variance * (k[1] + v10 * m00 + v11 * m01 + v12 * m02)
    c11 = variance * (k[2] + v10 * m10 + v11 * m11 + v12 * m12)
    c20 = variance * (k[3] + v20 * m00 + v21 * m01 + v22 * m02)
    c21 = variance * (k[4] + v20 * m10 + v21 * m11 + v22 * m12)
    c22 = variance * (k[5] + v20 * m20 + v21 * m21 + v22 * m22)
    # NaN fails the comparison, so it is also lost. Two points leave the rotation about their line
    # undetermined; a light behind a camera that sees it is not of the body.
    limit = spread(like, most_tip_sigma * most_tip_sigma)
    good = choose(count, spread(like, 2.5), one, zero)
    good = choose(pivot, zero, good, zero)
    good = choose(depth, zero, good, zero)
    good = choose(limit, c00 + c11 + c22, good, zero)
    row = points + POINT_ROWS * n_leds
    store(q0 + origin[0], room, row)
    store(q1 + origin[1], room, row + 1)
    store(q2 + origin[2], room, row + 2)
    store(c00, room, row + 3)
    store(c10, room, row + 4)
    store(c11, room, row + 5)
    store(c20, room, row + 6)
    store(c21, room, row + 7)
    store(c22, room, row + 8)
    for i in range(9):
        store(r[i], room, row + 9 + i)
    for i in range(3):
        store(origin[i], room, row + 18 + i)
    store(squares * (1.0 / variance), room, row + 21)
    # Two coordinates a spot, six pose parameters.
    store(2.0 * spots - 6.0, room, row + 22)
    store(good, room, row + 23)
    return row


@compiled()
def _give(
    room: Float, row: int, lane: int, frame: int,
    status: NDArray[np.uint8], tips: Float, covariances: Float, rotations: Float, origins: Float,
    chi2: Float, dof: Int,
) -> None:  # fmt: skip
    """Write the results of one lane to the outputs of a frame."""
    good = room[row + 23, lane] > 0.0
    status[frame] = OK if good else LOST
    dof[frame] = int(room[row + 22, lane]) if good else 0
    chi2[frame] = room[row + 21, lane] if good else np.nan
    lower = row + 3
    for i in range(3):
        tips[frame, i] = room[row + i, lane] if good else np.nan
        origins[frame, i] = room[row + 18 + i, lane] if good else np.nan
        for j in range(3):
            rotations[frame, i, j] = room[row + 9 + 3 * i + j, lane] if good else np.nan
        for j in range(i + 1):
            value = room[lower, lane] if good else np.nan
            covariances[frame, i, j] = covariances[frame, j, i] = value
            lower += 1


@compiled(*_NEEDS)
def solve_frames(
    uv: Float, cams: Float, leds: Float, tip: Float, sigma: float, most_tip_sigma: float,
    gauss_newton_steps: int, status: NDArray[np.uint8], tips: Float, covariances: Float,
    rotations: Float, origins: Float, chi2: Float, dof: Int,
) -> None:  # fmt: skip
    """Solve every frame of a batch; for the outputs see `tracking.pose.solve`.

    ``uv`` (n, C, L, 2), px by LED number, NaN if unseen; ``cams`` (C, 21), ``leds`` (L, 3), ``tip``
    (3,): `Rig.packed`, `ProbeBody.leds_probe`, `ProbeBody.tip_probe`; ``sigma``: of a spot, px,
    both axes; ``most_tip_sigma``: of a tip that is not lost, mm; ``gauss_newton_steps``: 0 for the
    method of the thesis. Outputs (n,), (n, 3), (n, 3, 3), (n, 3, 3), (n, 3), (n,), (n,), in the
    order of the arguments.
    """
    n, n_spots, n_leds = uv.shape[0], uv.shape[1] * uv.shape[2], uv.shape[2]
    rows = SPOT_ROWS * n_spots + POINT_ROWS * n_leds + _RESULT
    first = 0
    # Eight frames at once take less than two single ones (measured: 4.7 and 5.3 us).
    if n >= _LEAST:
        room = np.empty((rows, WIDTH))
        while n - first >= _LEAST:
            row = _solve_group(
                eight(), WIDTH, uv, cams, leds, tip, sigma, most_tip_sigma, gauss_newton_steps,
                first, room,
            )  # fmt: skip
            for lane in range(min(WIDTH, n - first)):
                _give(
                    room, row, lane, first + lane,
                    status, tips, covariances, rotations, origins, chi2, dof,
                )  # fmt: skip
            first += WIDTH
    if first < n:
        single = np.empty((rows, 1))
        for frame in range(first, n):
            row = _solve_group(
                0.0, 1, uv, cams, leds, tip, sigma, most_tip_sigma, gauss_newton_steps, frame,
                single,
            )  # fmt: skip
            _give(
                single, row, 0, frame,
                status, tips, covariances, rotations, origins, chi2, dof,
            )  # fmt: skip


def allocate(n: int) -> tuple[NDArray[np.uint8], Float, Float, Float, Float, Float, Int]:
    """Return the outputs of `solve_frames` for ``n`` frames, in its order."""
    return (
        np.empty(n, np.uint8),
        np.empty((n, 3)),
        np.empty((n, 3, 3)),
        np.empty((n, 3, 3)),
        np.empty((n, 3)),
        np.empty(n),
        np.empty(n, np.int64),
    )
