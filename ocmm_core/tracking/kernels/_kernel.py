"""Compiled steps from spots to a pose, in the form used by the search for labels.

The search adds spots one at a time; labelled frames use `_solve_kernel`, with the same steps.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ocmm_core.cpu_features import njit
from ocmm_core.geometry import Float
from ocmm_core.tracking.kernels._lanes import Number
from ocmm_core.tracking.kernels._small_algebra import best_turn

Bool: TypeAlias = NDArray[np.bool_]

OK, LOST = 0, 1
"""Values of the status output; the same as `tracking.result.FrameStatus`."""

MAX_TIP_SIGMA = 0.3
"""mm; beyond this effect of spot noise on the tip, nearly collinear targets leave the pose
undetermined, and a first-order covariance would be too small (measured: below this limit it holds).
"""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def distortion_slope(
    x: Number, y: Number, k1: float, k2: float, p1: float, p2: float
) -> tuple[Number, Number, Number, Number]:
    """Return the radial distortion at a point, mm, and elements 00, 01, 11 of d/d(x, y).

    Symmetric, d(xd)/dy = d(yd)/dx: radial and Brown terms are the gradient of a potential.
    """
    r2 = x * x + y * y
    radial = r2 * (k1 + k2 * r2)
    # d(radial)/d(r2) times two: with r2 = x^2 + y^2, d(radial)/dx is x slope and d(radial)/dy y
    # slope.
    slope = 2.0 * k1 + 4.0 * k2 * r2
    j00 = 1.0 + radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x
    j11 = 1.0 + radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x
    j01 = x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
    return radial, j00, j01, j11


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def undistort(
    xd: Number, yd: Number, k1: float, k2: float, p1: float, p2: float
) -> tuple[Number, Number, Number, Number, Number]:
    """Return the ideal image point of a distorted one, mm, and the distortion derivative.

    The derivative is symmetric: elements 00, 01 and 11. One point, or eight in parallel (`_lanes`).
    """
    # The distorted point is the start: it is off by the distortion itself, a few per cent.
    x, y = xd, yd
    # Three Newton steps (`camera._model.NEWTON_STEPS`, exact to 5e-13 px). The thesis uses one
    # step, which is off by 0.045 px and more.
    for _ in range(3):
        radial, j00, j01, j11 = distortion_slope(x, y, k1, k2, p1, p2)
        # Remaining difference to the observed point, mm; J dx = fx is solved by the inverse of a
        # 2x2 matrix.
        fx = xd - (x + x * radial + 2.0 * p1 * x * y + p2 * (3.0 * x * x + y * y))
        fy = yd - (y + y * radial + p1 * (x * x + 3.0 * y * y) + 2.0 * p2 * x * y)
        scale = 1.0 / (j00 * j11 - j01 * j01)
        x = x + (j11 * fx - j01 * fy) * scale
        y = y + (j00 * fy - j01 * fx) * scale
    _, j00, j01, j11 = distortion_slope(x, y, k1, k2, p1, p2)
    return x, y, j00, j01, j11


@njit(cache=True, nogil=True, error_model="numpy")
def triangulate_leds(ideal: Float, seen: Bool, cams: Float, points: Float, located: Bool) -> int:
    """Locate LEDs (L,) seen by two cameras; return their number."""
    n_cameras, n_leds = seen.shape
    count = 0
    for led in range(n_leds):
        views = 0
        # Normal matrix H = A'A (upper triangle) and right side A'b of the point, summed over its
        # rays.
        h00 = h01 = h02 = h11 = h12 = h22 = g0 = g1 = g2 = 0.0
        for c in range(n_cameras):
            if not seen[c, led]:
                continue
            views += 1
            f = cams[c, 12]
            # Each image axis w = f (r_axis . X + t_axis) / (r_3 . X + t_3), made linear in X by its
            # denominator: (w r_3 - f r_axis) . X = f t_axis - w t_3. Not singular for a world
            # origin in the camera's principal plane, unlike the thesis's form with L12 = 1 (errata,
            # 2.4.1).
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
    """Horn's closed form; writes rotation (3, 3) and origin (3,) of world from probe."""
    n_leds = leds.shape[0]
    # Centroids of the LEDs in the probe frame (a) and in the world (b). About them the best
    # rotation does not depend on the translation.
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
        # b = R a + origin: the centroids coincide. The thesis uses centred LEDs; here the origin is
        # that of the probe document (errata, 2.4.2).
        origin[i] = b[i] - (rotation[i, 0] * a[0] + rotation[i, 1] * a[1] + rotation[i, 2] * a[2])


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def spot_rows(
    ideal: Float, jacobian: Float, cam: Float,
    qx: float, qy: float, qz: float, px: float, py: float, pz: float, row: Float,
) -> tuple[float, float]:  # fmt: skip
    """Write d(spot)/d(pose), (2, 6), px, to ``row``; return the residual, px.

    For the spot at ``ideal`` (2,), mm, with ``jacobian`` (4,), of the LED at p, whose arm from the
    origin of the probe is q, both mm along the axes of the world.
    """
    f = cam[12]
    xc = cam[0] * px + cam[1] * py + cam[2] * pz + cam[9]
    yc = cam[3] * px + cam[4] * py + cam[5] * pz + cam[10]
    zc = cam[6] * px + cam[7] * py + cam[8] * pz + cam[11]
    # mm on the image per mm across at this depth. zc > 0 is not tested here: labels come from
    # points in front of their cameras (`_meeting_kernel.triangulate_pairs`).
    m = f / zc
    xi, yi = m * xc, m * yc
    # Observed minus predicted, so that the step is +(J'J)^-1 J'r with J the derivative of the
    # prediction.
    ex, ey = ideal[0] - xi, ideal[1] - yi
    # d(px)/d(mm on the ideal image) at the observed spot: pixel scale times distortion. To first
    # order it converts a difference of ideal points to pixels, in which `sigma` is uniform and
    # isotropic.
    s00, s01, s10, s11 = jacobian[0], jacobian[1], jacobian[2], jacobian[3]
    for k in range(3):
        # d(f X/Z) = f/Z dX - f X/Z^2 dZ, and dX, dY, dZ by the point are the rows of the
        # camera's R.
        dx = m * cam[k] - xi / zc * cam[6 + k]
        dy = m * cam[3 + k] - yi / zc * cam[6 + k]
        row[0, 3 + k] = s00 * dx + s01 * dy
        row[1, 3 + k] = s10 * dx + s11 * dy
    for i in range(2):
        # d(w x q)/dw: with p the derivative by the point, p . (w x q) = w . (q x p), so q x p.
        row[i, 0] = qy * row[i, 5] - qz * row[i, 4]
        row[i, 1] = qz * row[i, 3] - qx * row[i, 5]
        row[i, 2] = qx * row[i, 4] - qy * row[i, 3]
    return s00 * ex + s01 * ey, s10 * ex + s11 * ey


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
        # Arm from the probe's origin to the LED, along the world axes: what the rotation vector
        # acts on.
        qx = rotation[0, 0] * lx + rotation[0, 1] * ly + rotation[0, 2] * lz
        qy = rotation[1, 0] * lx + rotation[1, 1] * ly + rotation[1, 2] * lz
        qz = rotation[2, 0] * lx + rotation[2, 1] * ly + rotation[2, 2] * lz
        px, py, pz = qx + origin[0], qy + origin[1], qz + origin[2]
        for c in range(n_cameras):
            if not seen[c, led]:
                continue
            r0, r1 = spot_rows(
                ideal[c, led], jacobian[c, led], cams[c], qx, qy, qz, px, py, pz, row
            )
            total += r0 * r0 + r1 * r1
            for i in range(6):
                g[i] += row[0, i] * r0 + row[1, i] * r1
                for j in range(i + 1):
                    h[i, j] += row[0, i] * row[0, j] + row[1, i] * row[1, j]
    return total
