"""The compiled hot path: spots of a frame to tip, covariance and chi-square.

The same function serves single frames and batches and releases the GIL. It does what
`tracking.pose` does in plain numpy, frame by frame and without temporary arrays:

1. exact inversion of the distortion (three Newton steps);
2. closed-form triangulation of every LED that two cameras see, with homogeneous rows
   ``(x R3 - f R1) . X = f x0 - x z0`` (thesis 2.4.1, errata);
3. rigid fit of the body with determinant +1 (Horn 1987, unit quaternions);
4. Gauss-Newton steps on the reprojection residuals of all spots, in pixels.

Step 4 is what makes the tip statistically efficient; `gauss_newton_steps = 0` is the method of
the thesis.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ocmm_core.geometry import Float, Int
from ocmm_core.tracking.kernels._small_algebra import backward, best_turn, cholesky, forward, turn

Bool: TypeAlias = NDArray[np.bool_]

OK, LOST = 0, 1
"""Values of the status output; the same as `tracking.result.FrameStatus`."""

MAX_TIP_SIGMA = 0.3
"""mm; where spot noise alone moves the tip further, targets near one line leave the pose open, and
a covariance of first order would be too small (measured: below this limit it holds)."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def undistort(
    xd: float, yd: float, k1: float, k2: float, p1: float, p2: float
) -> tuple[float, float, float, float, float]:
    """Return the ideal image point of a distorted one, mm, and the slope of the distortion there.

    The slope is symmetric: its elements 00, 01 and 11.
    """
    # The distorted point is the start: it is off by the distortion itself, a few per cent.
    x, y = xd, yd
    j00, j01, j11 = 1.0, 0.0, 1.0
    # Three Newton steps (`camera.NEWTON_STEPS`, exact to 5e-13 px); the fourth round only writes
    # the slope at the point found. The thesis takes one step, which is off by 0.045 px and more.
    for step in range(4):
        r2 = x * x + y * y
        radial = r2 * (k1 + k2 * r2)
        # d(radial)/d(r2) times two: with r2 = x^2 + y^2, d(radial)/dx is x slope and d(radial)/dy y
        # slope.
        slope = 2.0 * k1 + 4.0 * k2 * r2
        j00 = 1.0 + radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x
        j11 = 1.0 + radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x
        # Symmetric because the distortion is the gradient of a potential (radial and Brown terms
        # are), so that d(xd)/dy = d(yd)/dx.
        j01 = x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
        if step == 3:
            break
        # What is missing to the observed point, mm; J dx = fx is solved by the inverse of a 2x2
        # matrix.
        fx = xd - (x + x * radial + 2.0 * p1 * x * y + p2 * (3.0 * x * x + y * y))
        fy = yd - (y + y * radial + p1 * (x * x + 3.0 * y * y) + 2.0 * p2 * x * y)
        determinant = j00 * j11 - j01 * j01
        x += (j11 * fx - j01 * fy) / determinant
        y += (j00 * fy - j01 * fx) / determinant
    return x, y, j00, j01, j11


@njit(cache=True, nogil=True, error_model="numpy")
def triangulate_leds(ideal: Float, seen: Bool, cams: Float, points: Float, located: Bool) -> int:
    """Locate LEDs (L,) that two cameras see; return their number."""
    n_cameras, n_leds = seen.shape
    count = 0
    for led in range(n_leds):
        views = 0
        # Normal matrix H = A'A (upper triangle) and right side A'b of the point, by summing over
        # its rays.
        h00 = h01 = h02 = h11 = h12 = h22 = g0 = g1 = g2 = 0.0
        for c in range(n_cameras):
            if not seen[c, led]:
                continue
            views += 1
            f = cams[c, 12]
            # Each image axis w = f (r_axis . X + t_axis) / (r_3 . X + t_3), made linear in X by its
            # denominator: (w r_3 - f r_axis) . X = f t_axis - w t_3. Not singular where the world's
            # origin lies in the camera's principal plane, as the thesis's form with L12 = 1 is
            # (errata, 2.4.1).
            for axis in range(2):
                w = ideal[c, led, axis]
                a0 = w * cams[c, 6] - f * cams[c, 3 * axis]
                a1 = w * cams[c, 7] - f * cams[c, 3 * axis + 1]
                a2 = w * cams[c, 8] - f * cams[c, 3 * axis + 2]
                b = f * cams[c, 9 + axis] - w * cams[c, 11]
                h00 += a0 * a0
                h01 += a0 * a1
                h02 += a0 * a2
                h11 += a1 * a1
                h12 += a1 * a2
                h22 += a2 * a2
                g0 += a0 * b
                g1 += a1 * b
                g2 += a2 * b
        # One ray has two equations for three unknowns.
        located[led] = views >= 2
        if views < 2:
            continue
        # Cofactors of the symmetric H: its inverse is their matrix over the determinant. The
        # equations are not weighted by depth or pixel; this is only the start of the steps in
        # pixels.
        c00 = h11 * h22 - h12 * h12
        c01 = h02 * h12 - h01 * h22
        c02 = h01 * h12 - h02 * h11
        determinant = h00 * c00 + h01 * c01 + h02 * c02
        c11 = h00 * h22 - h02 * h02
        c12 = h01 * h02 - h00 * h12
        c22 = h00 * h11 - h01 * h01
        points[led, 0] = (c00 * g0 + c01 * g1 + c02 * g2) / determinant
        points[led, 1] = (c01 * g0 + c11 * g1 + c12 * g2) / determinant
        points[led, 2] = (c02 * g0 + c12 * g1 + c22 * g2) / determinant
        count += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def fit_leds(
    leds: Float, points: Float, located: Bool, count: int,
    rotation: Float, origin: Float, work4: Float, vectors4: Float,
) -> None:  # fmt: skip
    """Horn's closed form; leaves rotation (3, 3) and origin (3,) of world from probe."""
    n_leds = leds.shape[0]
    # Centroids of the LEDs in the probe frame (a) and in the world (b). About them the best turn
    # does not depend on the translation.
    a = np.zeros(3)
    b = np.zeros(3)
    for led in range(n_leds):
        if located[led]:
            for i in range(3):
                a[i] += leds[led, i] / count
                b[i] += points[led, i] / count
    s = np.zeros((3, 3))
    for led in range(n_leds):
        if located[led]:
            for i in range(3):
                for j in range(3):
                    s[i, j] += (leds[led, i] - a[i]) * (points[led, j] - b[j])
    best_turn(s, rotation, work4, vectors4)
    for i in range(3):
        # b = R a + origin: the centroid of the LEDs comes to lie on that of the points. The thesis
        # takes centred LEDs; here the origin is that of the probe document (errata, 2.4.2).
        origin[i] = b[i] - (rotation[i, 0] * a[0] + rotation[i, 1] * a[1] + rotation[i, 2] * a[2])


@njit(cache=True, nogil=True, error_model="numpy")
def normal_equations(
    ideal: Float, jacobian: Float, seen: Bool, cams: Float, leds: Float,
    rotation: Float, origin: Float, h: Float, g: Float,
) -> float:  # fmt: skip
    """Accumulate J'J (6, 6) and J'r (6,) of the residuals in px; return r'r.

    The pose moves by a rotation vector (world axes, about the probe origin) and a translation.
    """
    n_cameras, n_leds = seen.shape
    for i in range(6):
        g[i] = 0.0
        for j in range(6):
            h[i, j] = 0.0
    total = 0.0
    row = np.empty((2, 6))
    for led in range(n_leds):
        lx, ly, lz = leds[led, 0], leds[led, 1], leds[led, 2]
        # Arm from the probe's origin to the LED, along the axes of the world: what the rotation
        # vector acts on.
        qx = rotation[0, 0] * lx + rotation[0, 1] * ly + rotation[0, 2] * lz
        qy = rotation[1, 0] * lx + rotation[1, 1] * ly + rotation[1, 2] * lz
        qz = rotation[2, 0] * lx + rotation[2, 1] * ly + rotation[2, 2] * lz
        px, py, pz = qx + origin[0], qy + origin[1], qz + origin[2]
        for c in range(n_cameras):
            if not seen[c, led]:
                continue
            f = cams[c, 12]
            xc = cams[c, 0] * px + cams[c, 1] * py + cams[c, 2] * pz + cams[c, 9]
            yc = cams[c, 3] * px + cams[c, 4] * py + cams[c, 5] * pz + cams[c, 10]
            zc = cams[c, 6] * px + cams[c, 7] * py + cams[c, 8] * pz + cams[c, 11]
            # mm on the image per mm across at this depth. zc > 0 is not tested here: labels come
            # from points in front of their cameras (`_meeting_kernel.meet`).
            m = f / zc
            xi, yi = m * xc, m * yc
            # Observed minus predicted, so that the step is +(J'J)^-1 J'r with J the derivative of
            # the prediction.
            ex, ey = ideal[c, led, 0] - xi, ideal[c, led, 1] - yi
            # d(px)/d(mm on the ideal image) at the observed spot: pixel scale times distortion. To
            # first order it turns a difference of ideal points into one of pixels, where `sigma` is
            # the same everywhere and along both axes.
            s00, s01 = jacobian[c, led, 0], jacobian[c, led, 1]
            s10, s11 = jacobian[c, led, 2], jacobian[c, led, 3]
            r0 = s00 * ex + s01 * ey
            r1 = s10 * ex + s11 * ey
            total += r0 * r0 + r1 * r1
            for k in range(3):
                # d(f X/Z) = f/Z dX - f X/Z^2 dZ, and dX, dY, dZ by the point are the rows of the
                # camera's R.
                dx = m * cams[c, k] - xi / zc * cams[c, 6 + k]
                dy = m * cams[c, 3 + k] - yi / zc * cams[c, 6 + k]
                row[0, 3 + k] = s00 * dx + s01 * dy
                row[1, 3 + k] = s10 * dx + s11 * dy
            for i in range(2):
                # d(w x q)/dw: with p the derivative by the point, p . (w x q) = w . (q x p), so q x
                # p.
                row[i, 0] = qy * row[i, 5] - qz * row[i, 4]
                row[i, 1] = qz * row[i, 3] - qx * row[i, 5]
                row[i, 2] = qx * row[i, 4] - qy * row[i, 3]
            for i in range(6):
                g[i] += row[0, i] * r0 + row[1, i] * r1
                for j in range(i + 1):
                    h[i, j] += row[0, i] * row[0, j] + row[1, i] * row[1, j]
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def solve_frames(
    uv: Float, cams: Float, leds: Float, tip: Float, sigma: float, gauss_newton_steps: int,
    status: NDArray[np.uint8], tips: Float, covariances: Float, rotations: Float, origins: Float,
    chi2: Float, dof: Int,
) -> None:  # fmt: skip
    """Solve every frame of a batch; see `tracking.pose.solve` for the meaning of the outputs.

    Parameters
    ----------
    uv
        (n, C, L, 2), px by LED number, NaN where not seen.
    cams, leds, tip
        (C, 21), (L, 3) and (3,): `Rig.packed`, `ProbeBody.leds_probe`, `ProbeBody.tip_probe`.
    sigma
        Standard deviation of a spot, px, both axes.
    gauss_newton_steps
        0 for the method of the thesis.
    status, tips, covariances, rotations, origins, chi2, dof
        Outputs (n,), (n, 3), (n, 3, 3), (n, 3, 3), (n, 3), (n,), (n,).
    """
    n, n_cameras, n_leds = uv.shape[0], uv.shape[1], uv.shape[2]
    # Room for one frame, used by all of a batch in turn.
    ideal = np.empty((n_cameras, n_leds, 2))
    jacobian = np.empty((n_cameras, n_leds, 4))
    seen = np.empty((n_cameras, n_leds), np.bool_)
    points = np.empty((n_leds, 3))
    located = np.empty(n_leds, np.bool_)
    rotation = np.empty((3, 3))
    origin = np.empty(3)
    work4 = np.empty((4, 4))
    vectors4 = np.empty((4, 4))
    work3 = np.empty((3, 3))
    step3 = np.empty((3, 3))
    h = np.empty((6, 6))
    g = np.empty(6)
    column = np.empty((3, 6))
    for frame in range(n):
        observations = 0
        for c in range(n_cameras):
            sx, sy = cams[c, 13], cams[c, 14]
            for led in range(n_leds):
                u, v = uv[frame, c, led, 0], uv[frame, c, led, 1]
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
        count = triangulate_leds(ideal, seen, cams, points, located)
        # Two points leave the turn about their line free.
        solved = count >= 3
        if solved:
            fit_leds(leds, points, located, count, rotation, origin, work4, vectors4)
            squares = normal_equations(ideal, jacobian, seen, cams, leds, rotation, origin, h, g)
            solved = cholesky(h)
        if solved:
            for step in range(gauss_newton_steps):
                # With H = L L': y = L^-1 g, and |y|^2 = g'H^-1 g is what a full step takes off the
                # sum of squares.
                forward(h, g)
                reduction = 0.0
                for i in range(6):
                    reduction += g[i] * g[i]
                backward(h, g)
                turn(rotation, g[0], g[1], g[2], step3, work3)
                for i in range(3):
                    origin[i] += g[3 + i]
                if step + 1 < gauss_newton_steps:
                    squares = normal_equations(
                        ideal, jacobian, seen, cams, leds, rotation, origin, h, g
                    )
                    solved = solved and cholesky(h)
                else:
                    # To first order the last step takes this much off the sum of squares.
                    # The covariance below uses the factor at the pose before the last step, too.
                    squares = max(squares - reduction, 0.0)
        if solved:
            qx = rotation[0, 0] * tip[0] + rotation[0, 1] * tip[1] + rotation[0, 2] * tip[2]
            qy = rotation[1, 0] * tip[0] + rotation[1, 1] * tip[1] + rotation[1, 2] * tip[2]
            qz = rotation[2, 0] * tip[0] + rotation[2, 1] * tip[1] + rotation[2, 2] * tip[2]
            # d(tip)/d(pose) = [-skew(q), I]; its rows through the factor give the covariance.
            for i in range(3):
                for k in range(6):
                    column[i, k] = 0.0
                column[i, 3 + i] = 1.0
            # -skew(q) w = w x q, row by row; q is the arm from the probe's origin to the ball,
            # world axes.
            column[0, 1], column[0, 2] = qz, -qy
            column[1, 0], column[1, 2] = -qz, qx
            column[2, 0], column[2, 1] = qy, -qx
            total = 0.0
            for i in range(3):
                # H^-1 = L^-T L^-1, so A H^-1 A' is the product of the rows L^-1 A' with each other.
                forward(h, column[i])
                for k in range(6):
                    total += column[i, k] * column[i, k]
            solved = sigma * sigma * total <= MAX_TIP_SIGMA * MAX_TIP_SIGMA
        if not solved:
            status[frame] = LOST
            tips[frame] = np.nan
            covariances[frame] = np.nan
            rotations[frame] = np.nan
            origins[frame] = np.nan
            chi2[frame] = np.nan
            dof[frame] = 0
            continue
        status[frame] = OK
        # Two coordinates a spot, six numbers of the pose.
        dof[frame] = 2 * observations - 6
        chi2[frame] = squares / (sigma * sigma)
        for i in range(3):
            origins[frame, i] = origin[i]
            for j in range(3):
                rotations[frame, i, j] = rotation[i, j]
        tips[frame, 0], tips[frame, 1] = qx + origin[0], qy + origin[1]
        tips[frame, 2] = qz + origin[2]
        for i in range(3):
            for j in range(i + 1):
                value = 0.0
                for k in range(6):
                    value += column[i, k] * column[j, k]
                covariances[frame, i, j] = covariances[frame, j, i] = sigma * sigma * value


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
