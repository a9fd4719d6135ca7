"""Compiled: derivatives of the poses of many sets of spots by spots, cameras and LEDs.

A pose minimises the sum of squares |r|^2 of residuals r, px. If the spots move by du, and the
prediction by the cameras' parameters or the LEDs by B db, the minimum moves to first order by

    d(pose) = (J'J)^-1 J' (du - B db),   J = d(prediction)/d(pose), (2 m, 6)

(implicit function theorem without the curvature of r, which is multiplied by r itself: 1e-5 of it
at residuals of 1e-3 px). With errors defined as truth minus assumed value, a camera that truly is b
+ db shows spots moved by B db: the derivative by the parameters is +(J'J)^-1 J' B.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking.kernels import _kernel as kernel
from ocmm_core.tracking.kernels import _small_algebra as small_algebra
from ocmm_core.tracking.kernels._kernel import (
    Bool,
    fit_leds,
    normal_equations,
    spot_rows,
    triangulate_leds,
    undistort,
)
from ocmm_core.tracking.kernels._small_algebra import backward, cholesky, forward, turn

ANSWERED, TOO_FEW, OPEN = 0, 1, 2
"""Solved, fewer than three LEDs seen by two cameras, or pose undetermined by them."""

N_LENS = 14
"""Parameters of a camera, in the order of `camera.PARAMETERS`."""

_MAX_STEPS = 10
_STEP_LIMIT = 1e-10
"""rad and mm: the tip is rounded to 1e-12 mm, and Gauss-Newton gains some three digits a step."""


@compiled(kernel, small_algebra)
def lens_rows(cam: Float, px: float, py: float, pz: float, by_point: Float, by_lens: Float) -> None:
    """Write the derivatives of a pixel by its world point (2, 3) and its camera (2, 14).

    All at the predicted point, as in `camera.projection_jacobians`.
    """
    f, sx, sy = cam[12], cam[13], cam[14]
    k1, k2, p1, p2 = cam[17], cam[18], cam[19], cam[20]
    # The point along the axes of the camera, before (r) and after the translation.
    rx = cam[0] * px + cam[1] * py + cam[2] * pz
    ry = cam[3] * px + cam[4] * py + cam[5] * pz
    rz = cam[6] * px + cam[7] * py + cam[8] * pz
    zc = rz + cam[11]
    m = f / zc
    x, y = m * (rx + cam[9]), m * (ry + cam[10])
    # Derivative of the distortion as in `_kernel.undistort`, and with the pixel scale px per mm.
    r2 = x * x + y * y
    radial = r2 * (k1 + k2 * r2)
    slope = 2.0 * k1 + 4.0 * k2 * r2
    j01 = x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
    s00 = sx * (1.0 + radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x)
    s01, s10 = sx * j01, sy * j01
    s11 = sy * (1.0 + radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x)
    for i in range(2):
        a = s00 if i == 0 else s10
        b = s01 if i == 0 else s11
        # By the point in the camera: d(f X/Z) = f/Z dX - f X/Z^2 dZ.
        d0, d1, d2 = a * m, b * m, -(a * x + b * y) / zc
        for k in range(3):
            by_point[i, k] = d0 * cam[k] + d1 * cam[3 + k] + d2 * cam[6 + k]
            for p in range(6, 14):
                by_lens[i, p] = 0.0
        # A small rotation w after the rotation moves the point by w x r: d . (w x r) = w . (r x d).
        by_lens[i, 0] = ry * d2 - rz * d1
        by_lens[i, 1] = rz * d0 - rx * d2
        by_lens[i, 2] = rx * d1 - ry * d0
        by_lens[i, 3], by_lens[i, 4], by_lens[i, 5] = d0, d1, d2
        # Both image coordinates are proportional to the focal length.
        by_lens[i, 6] = (a * x + b * y) / f
    # Sx = aspect Sy, so that d(u)/d(aspect) is the distorted x times Sy.
    by_lens[0, 7] = sy * (x + x * radial + 2.0 * p1 * x * y + p2 * (3.0 * x * x + y * y))
    by_lens[0, 8] = by_lens[1, 9] = 1.0
    by_lens[0, 10], by_lens[1, 10] = sx * x * r2, sy * y * r2
    by_lens[0, 11], by_lens[1, 11] = sx * x * r2 * r2, sy * y * r2 * r2
    by_lens[0, 12], by_lens[1, 12] = sx * 2.0 * x * y, sy * (x * x + 3.0 * y * y)
    by_lens[0, 13], by_lens[1, 13] = sx * (3.0 * x * x + y * y), sy * 2.0 * x * y


@compiled(kernel, small_algebra)
def observe(spots: Float, cams: Float, ideal: Float, jacobian: Float, seen: Bool) -> int:
    """Remove the distortion from the spots (C, L, 2), px, of a frame; return their number.

    Writes the ideal image points (C, L, 2), mm, and the Jacobian there (C, L, 4), px/mm, by rows.
    """
    observations = 0
    for c in range(seen.shape[0]):
        sx, sy = cams[c, 13], cams[c, 14]
        for led in range(seen.shape[1]):
            u, v = spots[c, led, 0], spots[c, led, 1]
            there = np.isfinite(u) and np.isfinite(v)
            seen[c, led] = there
            if not there:
                continue
            observations += 1
            x, y, j00, j01, j11 = undistort(
                # cams 13 to 20: Sx, Sy, u0, v0, k1, k2, p1, p2; 12 is f, 9 to 11 t and 0 to 8 R
                # by rows.
                (u - cams[c, 15]) / sx, (v - cams[c, 16]) / sy,
                cams[c, 17], cams[c, 18], cams[c, 19], cams[c, 20],
            )  # fmt: skip
            ideal[c, led, 0], ideal[c, led, 1] = x, y
            # diag(Sx, Sy) J, by rows: px per mm.
            jacobian[c, led, 0], jacobian[c, led, 1] = sx * j00, sx * j01
            jacobian[c, led, 2], jacobian[c, led, 3] = sy * j01, sy * j11
    return observations


@compiled(kernel, small_algebra)
def answer_of_poses(
    uv: Float, cams: Float, leds: Float,
    status: NDArray[np.uint8], located: Int, seen_by: Int, rotations: Float, origins: Float,
    by_spots: Float, by_cameras: Float, by_leds: Float,
) -> None:  # fmt: skip
    """Find the converged pose of every frame, and its derivatives.

    ``uv`` (n, C, L, 2), px by LED number, NaN if unseen; ``cams`` (C, 21): `Rig.packed`; ``leds``
    (L, 3), mm, body frame. Outputs (n,): ``status``, ``located`` (LEDs seen by two cameras),
    ``seen_by`` (number of spots m); ``rotations`` (n, 3, 3), ``origins`` (n, 3), mm: world from
    body; ``by_spots`` (n, 6, 2 C L): its first 2 m columns are those of the spots, camera by camera
    and LED by LED, u before v; ``by_cameras`` (n, 6, 14 C), ``by_leds`` (n, 6, 3 L), initially
    zero.
    """
    n, n_cameras, n_leds = uv.shape[0], uv.shape[1], uv.shape[2]
    ideal = np.empty((n_cameras, n_leds, 2))
    jacobian = np.empty((n_cameras, n_leds, 4))
    seen = np.empty((n_cameras, n_leds), np.bool_)
    points = np.empty((n_leds, 3))
    found = np.empty(n_leds, np.bool_)
    rotation = np.empty((3, 3))
    origin = np.empty(3)
    work4 = np.empty((4, 4))
    vectors4 = np.empty((4, 4))
    work3 = np.empty((3, 3))
    step3 = np.empty((3, 3))
    h = np.empty((6, 6))
    g = np.empty(6)
    rows = np.empty((2, 6))
    by_point = np.empty((2, 3))
    by_lens = np.empty((2, N_LENS))
    for frame in range(n):
        seen_by[frame] = observe(uv[frame], cams, ideal, jacobian, seen)
        count = triangulate_leds(ideal, seen, cams, points, found)
        located[frame] = count
        if count < 3:
            # Two points leave the rotation about their line undetermined.
            status[frame] = TOO_FEW
            continue
        fit_leds(leds, points, found, count, rotation, origin, work4, vectors4)
        normal_equations(ideal, jacobian, seen, cams, leds, rotation, origin, h, g)
        determined = cholesky(h)
        for _ in range(_MAX_STEPS):
            if not determined:
                break
            forward(h, g)
            backward(h, g)
            turn(rotation, g[0], g[1], g[2], step3, work3)
            largest = 0.0
            for i in range(6):
                largest = max(largest, abs(g[i]))
            for i in range(3):
                origin[i] += g[3 + i]
            # The factor used for the derivatives is also that of the last pose.
            normal_equations(ideal, jacobian, seen, cams, leds, rotation, origin, h, g)
            determined = cholesky(h)
            if largest < _STEP_LIMIT:
                break
        if not determined:
            status[frame] = OPEN
            continue
        status[frame] = ANSWERED
        rotations[frame] = rotation
        origins[frame] = origin
        column = 0
        for c in range(n_cameras):
            for led in range(n_leds):
                if not seen[c, led]:
                    continue
                qx = qy = qz = 0.0
                for k in range(3):
                    qx += rotation[0, k] * leds[led, k]
                    qy += rotation[1, k] * leds[led, k]
                    qz += rotation[2, k] * leds[led, k]
                px, py, pz = qx + origin[0], qy + origin[1], qz + origin[2]
                spot_rows(ideal[c, led], jacobian[c, led], cams[c], qx, qy, qz, px, py, pz, rows)
                lens_rows(cams[c], px, py, pz, by_point, by_lens)
                for i in range(2):
                    # A column of (J'J)^-1 J' is the solution of the factor for the spot's row.
                    forward(h, rows[i])
                    backward(h, rows[i])
                    for k in range(6):
                        gain = rows[i, k]
                        by_spots[frame, k, column] = gain
                        for p in range(N_LENS):
                            by_cameras[frame, k, c * N_LENS + p] += gain * by_lens[i, p]
                        for p in range(3):
                            # The LED moves along the axes of the body: d(world) = R d(body).
                            by_leds[frame, k, 3 * led + p] += gain * (
                                by_point[i, 0] * rotation[0, p]
                                + by_point[i, 1] * rotation[1, p]
                                + by_point[i, 2] * rotation[2, p]
                            )
                    column += 1
