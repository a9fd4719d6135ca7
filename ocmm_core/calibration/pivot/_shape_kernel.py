"""Compiled inner loops over located targets: body rotations, group average, moments."""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float
from ocmm_core.tracking.kernels import best_turn
from ocmm_core.tracking.kernels import small_algebra as algebra


@compiled(algebra)
def fit_turns(
    body: Float, targets: Float, rotations: Float, origins: Float, residuals: Float
) -> None:
    """Fit the body (L, 3), mm, to the targets (n, L, 3), mm, of every pose; NaN if not located.

    Out, world from body: ``rotations`` (n, 3, 3), ``origins`` (n, 3), mm, ``residuals`` (n,), mm:
    RMS distance of the LEDs; NaN with fewer than three targets.
    """
    n_poses, n_leds = targets.shape[:2]
    s, work4, vectors4 = np.empty((3, 3)), np.empty((4, 4)), np.empty((4, 4))
    a, b = np.empty(3), np.empty(3)
    for n in range(n_poses):
        count = 0
        a[:] = 0.0
        b[:] = 0.0
        for led in range(n_leds):
            if np.isfinite(targets[n, led, 0]):
                count += 1
                for i in range(3):
                    a[i] += body[led, i]
                    b[i] += targets[n, led, i]
        # Two targets leave the rotation about their line undetermined.
        if count < 3:
            rotations[n] = np.nan
            origins[n] = np.nan
            residuals[n] = np.nan
            continue
        for i in range(3):
            # Centroids of the located LEDs of this pose: of the body (a) and of the targets (b),
            # mm.
            a[i] /= count
            b[i] /= count
        s[:] = 0.0
        for led in range(n_leds):
            if np.isfinite(targets[n, led, 0]):
                for i in range(3):
                    for j in range(3):
                        s[i, j] += (body[led, i] - a[i]) * (targets[n, led, j] - b[j])
        rotation = rotations[n]
        # Horn: rotation from the centred body to the centred targets, determinant +1.
        best_turn(s, rotation, work4, vectors4)
        for i in range(3):
            # origin = b - R a.
            origins[n, i] = b[i]
            for j in range(3):
                origins[n, i] -= rotation[i, j] * a[j]
        square = 0.0
        for led in range(n_leds):
            if np.isfinite(targets[n, led, 0]):
                for i in range(3):
                    off = origins[n, i] - targets[n, led, i]
                    for j in range(3):
                        off += rotation[i, j] * body[led, j]
                    square += off * off
        # Divided by the number of LEDs, not the degrees of freedom: a distance, not a noise
        # estimate.
        residuals[n] = np.sqrt(square / count)


@compiled(algebra)
def average_turned(targets: Float, centre: Float, body: Float, average: Float) -> float:
    """Write the mean of all poses turned onto the body; return its residual.

    One round of the group average (Gower; thesis 3.2 with the errata: a true rotation, and ``s =
    |G|^2 + |X|^2 - 2 tr``) of complete poses. Targets (n, L, 3), mm, world, rotate about
    ``centre``; ``body`` (L, 3) is the present average and ``average`` the next one.
    """
    n_poses, n_leds = targets.shape[:2]
    s, rotation = np.empty((3, 3)), np.empty((3, 3))
    work4, vectors4, arms = np.empty((4, 4)), np.empty((4, 4)), np.empty((n_leds, 3))
    average[:] = 0.0
    total, count = 0.0, 0
    # G|^2 of the present body, the same for every pose.
    size = 0.0
    for led in range(n_leds):
        for i in range(3):
            size += body[led, i] * body[led, i]
    for n in range(n_poses):
        whole = True
        own = 0.0
        for led in range(n_leds):
            # A mean over poses with different LEDs would distort the shape.
            whole = whole and np.isfinite(targets[n, led, 0])
            for i in range(3):
                # Relative to the centre of the ball, so that no translation remains.
                arms[led, i] = targets[n, led, i] - centre[i]
                own += arms[led, i] * arms[led, i]
        if not whole:
            continue
        for i in range(3):
            for j in range(3):
                value = 0.0
                for led in range(n_leds):
                    # s = sum of arm body': the rotation takes the arms back to the body.
                    value += arms[led, i] * body[led, j]
                s[i, j] = value
        best_turn(s, rotation, work4, vectors4)
        trace = 0.0
        for i in range(3):
            for j in range(3):
                # tr(R s): the sum of body . R arm. |G - X R'|^2 = |G|^2 + |X|^2 - 2 tr; the thesis
                # prints a plus (errata, 3.2).
                trace += rotation[i, j] * s[j, i]
        total += size + own - 2.0 * trace
        count += 1
        for led in range(n_leds):
            for i in range(3):
                average[led, i] += (
                    rotation[i, 0] * arms[led, 0]
                    + rotation[i, 1] * arms[led, 1]
                    + rotation[i, 2] * arms[led, 2]
                )
    if count > 0:
        average /= count
    return total


@compiled(reorder=True)
def add_moments(points: Float, reference: Float, moments: Float) -> None:
    """Add the moments for sphere fits to the paths of the LEDs; see `_centre`.

    ``points`` (n, L, 3), mm, NaN if not located; ``reference`` (L, 3), mm: near their means, to
    preserve digits. With y = point less reference, ``moments`` (L, 13) are sums of 1, y, y y' (xx,
    xy, xz, yy, yz, zz) and y |y|^2.
    """
    n_poses, n_leds = points.shape[:2]
    for led in range(n_leds):
        rx, ry, rz = reference[led, 0], reference[led, 1], reference[led, 2]
        # A sphere |y|^2 = 2 c . y + const is linear in its centre; these sums suffice for its
        # normal equations, so points need not be kept.
        count = sx = sy = sz = 0.0
        xx = xy = xz = yy = yz = zz = qx = qy = qz = 0.0
        for n in range(n_poses):
            x, y, z = points[n, led, 0] - rx, points[n, led, 1] - ry, points[n, led, 2] - rz
            # A target is NaN in all three or in none.
            if not np.isfinite(x):
                continue
            square = x * x + y * y + z * z
            count += 1.0
            sx += x
            sy += y
            sz += z
            xx += x * x
            xy += x * y
            xz += x * z
            yy += y * y
            yz += y * z
            zz += z * z
            qx += x * square
            qy += y * square
            qz += z * square
        own = moments[led]
        # Local sums, added once at the end: the compiler keeps them in registers.
        own[0] += count
        own[1] += sx
        own[2] += sy
        own[3] += sz
        own[4] += xx
        own[5] += xy
        own[6] += xz
        own[7] += yy
        own[8] += yz
        own[9] += zz
        own[10] += qx
        own[11] += qy
        own[12] += qz
