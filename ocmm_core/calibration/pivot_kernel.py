"""The compiled inner loops of the pivot calibration: one turn a pose about a ball that rests.

Every pose has a turn of its own, three unknowns, and with slack also the place of the ball in its
cone, six. They are eliminated pose by pose, as in `bundle_kernel`; what all poses have in common
is the centre of the ball and the arms from it to the LEDs.
"""

from __future__ import annotations

import numpy as np

import ocmm_core.calibration.kernel as camera_kernel
import ocmm_core.tracking.small_algebra as algebra
from ocmm_core.calibration.kernel import empty_rows, spot_rows
from ocmm_core.camera.compiled import compiled
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking.small_algebra import largest_eigenvector, rotation_of, turn

N_CAMERA = 14
"""Columns of a camera: `camera.model.PARAMETERS`."""

LEAST_PIVOT = 1e-11
"""Of its diagonal element; below, a turn is not determined."""


@compiled(algebra)
def best_turn(s: Float, rotation: Float, work4: Float, vectors4: Float) -> None:
    """Write the rotation (3, 3) with the largest trace of its transpose times s'.

    Horn's closed form with unit quaternions; ``s`` (3, 3) is the sum of ``a b'`` over pairs, and
    the rotation takes a to b. Never a reflection, also for points in one plane.
    """
    work4[0, 0] = s[0, 0] + s[1, 1] + s[2, 2]
    work4[1, 1] = s[0, 0] - s[1, 1] - s[2, 2]
    work4[2, 2] = -s[0, 0] + s[1, 1] - s[2, 2]
    work4[3, 3] = -s[0, 0] - s[1, 1] + s[2, 2]
    work4[0, 1] = work4[1, 0] = s[1, 2] - s[2, 1]
    work4[0, 2] = work4[2, 0] = s[2, 0] - s[0, 2]
    work4[0, 3] = work4[3, 0] = s[0, 1] - s[1, 0]
    work4[1, 2] = work4[2, 1] = s[0, 1] + s[1, 0]
    work4[1, 3] = work4[3, 1] = s[2, 0] + s[0, 2]
    work4[2, 3] = work4[3, 2] = s[1, 2] + s[2, 1]
    k = largest_eigenvector(work4, vectors4)
    rotation_of(vectors4[0, k], vectors4[1, k], vectors4[2, k], vectors4[3, k], rotation)


@compiled(algebra)
def fit_turns(body: Float, targets: Float, rotations: Float, origins: Float, misses: Float) -> None:
    """Lay the body onto the targets of every pose.

    Parameters
    ----------
    body
        (L, 3), mm.
    targets
        (n, L, 3), mm; NaN where not located.
    rotations, origins, misses
        (n, 3, 3), (n, 3), mm, and (n,), mm: rotation and origin, world from body, and the RMS
        distance of the LEDs that is left, out; NaN with fewer than three targets.
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
        if count < 3:
            rotations[n] = np.nan
            origins[n] = np.nan
            misses[n] = np.nan
            continue
        for i in range(3):
            a[i] /= count
            b[i] /= count
        s[:] = 0.0
        for led in range(n_leds):
            if np.isfinite(targets[n, led, 0]):
                for i in range(3):
                    for j in range(3):
                        s[i, j] += (body[led, i] - a[i]) * (targets[n, led, j] - b[j])
        rotation = rotations[n]
        best_turn(s, rotation, work4, vectors4)
        for i in range(3):
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
        misses[n] = np.sqrt(square / count)


@compiled(algebra)
def average_turned(targets: Float, centre: Float, body: Float, average: Float) -> float:
    """Write the mean of all poses turned onto the body about the centre; return its residual.

    One round of the group average (Gower; thesis 3.2 with the errata: a true rotation, and
    ``s = |G|^2 + |X|^2 - 2 tr``). Poses with an LED that was not located are left out.

    Parameters
    ----------
    targets, centre
        (n, L, 3) and (3,), mm, world.
    body, average
        (L, 3), mm: the average so far and, out, the next one.
    """
    n_poses, n_leds = targets.shape[:2]
    s, rotation = np.empty((3, 3)), np.empty((3, 3))
    work4, vectors4, arms = np.empty((4, 4)), np.empty((4, 4)), np.empty((n_leds, 3))
    average[:] = 0.0
    total, count = 0.0, 0
    size = 0.0
    for led in range(n_leds):
        for i in range(3):
            size += body[led, i] * body[led, i]
    for n in range(n_poses):
        whole = True
        own = 0.0
        for led in range(n_leds):
            whole = whole and np.isfinite(targets[n, led, 0])
            for i in range(3):
                arms[led, i] = targets[n, led, i] - centre[i]
                own += arms[led, i] * arms[led, i]
        if not whole:
            continue
        for i in range(3):
            for j in range(3):
                value = 0.0
                for led in range(n_leds):
                    value += arms[led, i] * body[led, j]
                s[i, j] = value
        best_turn(s, rotation, work4, vectors4)
        trace = 0.0
        for i in range(3):
            for j in range(3):
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
    """Add what spheres through the paths of the LEDs need; see `pivot_centre`.

    Parameters
    ----------
    points
        (n, L, 3), mm; NaN where not located.
    reference
        (L, 3), mm: near the mean of each path, so that no digits are lost.
    moments
        (L, 13), added to: with y = point less reference, sums of 1, y, y y' (xx, xy, xz, yy, yz,
        zz) and y |y|^2.
    """
    n_poses, n_leds = points.shape[:2]
    for led in range(n_leds):
        rx, ry, rz = reference[led, 0], reference[led, 1], reference[led, 2]
        count = sx = sy = sz = 0.0
        xx = xy = xz = yy = yz = zz = qx = qy = qz = 0.0
        for n in range(n_poses):
            x, y, z = points[n, led, 0] - rx, points[n, led, 1] - ry, points[n, led, 2] - rz
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


@compiled()
def _eliminate(v: Float, w: Float, g: Float, damping: float) -> bool:
    """Replace V (d, d) by its Cholesky factor, W (d, k) by Y and g (d,) by z; False if singular."""
    size, columns = w.shape
    for j in range(size):
        diagonal = v[j, j]
        d = diagonal * (1.0 + damping)
        for k in range(j):
            d -= v[j, k] * v[j, k]
        if not d > LEAST_PIVOT * diagonal:
            return False
        d = np.sqrt(d)
        v[j, j] = d
        for i in range(j + 1, size):
            value = v[i, j]
            for k in range(j):
                value -= v[i, k] * v[j, k]
            v[i, j] = value / d
        for k in range(j):
            factor = v[j, k]
            g[j] -= factor * g[k]
            for column in range(columns):
                w[j, column] -= factor * w[k, column]
        g[j] /= d
        for column in range(columns):
            w[j, column] /= d
    return True


@compiled(camera_kernel)
def eliminate_turns(
    cameras: Float, arms: Float, centre: Float, uv: Float, weights: Float, slack_weight: float,
    rotations: Float, slacks: Float, damping: float, blocks: Int,
    normals: Float, gradients: Float, factors: Float, y: Float, z: Float, scores: Float,
) -> float:  # fmt: skip
    """Add all poses to the reduced normal equations; return the sum of squares.

    Infinite where an LED is not in front of a camera or a turn is not determined.

    Parameters
    ----------
    cameras
        (C, 24): `lens.LensCamera.packed`.
    arms, centre
        (L, 3), mm, body: from the centre of the ball to the LEDs, and (3,), mm, world.
    uv, weights
        (n, C, L, 2), px, and (n, C, L), 1/px, zero for what is not used.
    slack_weight
        1/mm: one over how far the ball moves in its cone; zero where it rests.
    rotations, slacks
        (n, 3, 3), world from body, and (n, 3), mm: where the ball is, less the centre.
    damping
        Of Levenberg and Marquardt, on the diagonals of the poses.
    blocks
        (n,): to which of B normal equations each pose belongs.
    normals, gradients
        (B, k, k) lower triangle and (B, k), added to, poses eliminated. Columns: centre, arms, and
        if k is larger than these the cameras, 14 each, of which only the rows that cross with
        centre and arms are written.
    factors, y, z
        (n, d, d), (n, d, k) and (n, d), out; d is 6 with slack and else 3.
    scores
        (n, 3 + 3 L), out: what each pose adds to the gradient of centre and arms.
    """
    n_poses, n_cameras, n_leds = weights.shape
    size, width = y.shape[1], y.shape[2]
    own = 3 + 3 * n_leds
    with_cameras = width > own
    total = 0.0
    u_row, v_row = empty_rows()
    u_pose, v_pose = np.zeros(6), np.zeros(6)
    u_point, v_point = np.empty(3), np.empty(3)
    u_led, v_led = np.empty(3), np.empty(3)
    for n in range(n_poses):
        rotation, v, w, g = rotations[n], factors[n], y[n], z[n]
        normal, gradient, score = normals[blocks[n]], gradients[blocks[n]], scores[n]
        v[:] = 0.0
        w[:] = 0.0
        g[:] = 0.0
        score[:] = 0.0
        used = False
        for led in range(n_leds):
            lx, ly, lz = arms[led, 0], arms[led, 1], arms[led, 2]
            qx = rotation[0, 0] * lx + rotation[0, 1] * ly + rotation[0, 2] * lz
            qy = rotation[1, 0] * lx + rotation[1, 1] * ly + rotation[1, 2] * lz
            qz = rotation[2, 0] * lx + rotation[2, 1] * ly + rotation[2, 2] * lz
            px = qx + centre[0] + slacks[n, 0]
            py = qy + centre[1] + slacks[n, 1]
            pz = qz + centre[2] + slacks[n, 2]
            at = 3 + 3 * led
            for c in range(n_cameras):
                weight = weights[n, c, led]
                if weight == 0.0:
                    continue
                used = True
                packed = cameras[c]
                depth, predicted_u, predicted_v = spot_rows(packed, px, py, pz, u_row, v_row)
                if not depth > 0.0:
                    return np.inf
                miss_u = weight * (predicted_u - uv[n, c, led, 0])
                miss_v = weight * (predicted_v - uv[n, c, led, 1])
                total += miss_u * miss_u + miss_v * miss_v
                for k in range(3):
                    u_point[k] = weight * (
                        u_row[3] * packed[k] + u_row[4] * packed[3 + k] + u_row[5] * packed[6 + k]
                    )
                    v_point[k] = weight * (
                        v_row[3] * packed[k] + v_row[4] * packed[3 + k] + v_row[5] * packed[6 + k]
                    )
                u_pose[0] = qy * u_point[2] - qz * u_point[1]
                u_pose[1] = qz * u_point[0] - qx * u_point[2]
                u_pose[2] = qx * u_point[1] - qy * u_point[0]
                v_pose[0] = qy * v_point[2] - qz * v_point[1]
                v_pose[1] = qz * v_point[0] - qx * v_point[2]
                v_pose[2] = qx * v_point[1] - qy * v_point[0]
                for k in range(3):
                    u_pose[3 + k], v_pose[3 + k] = u_point[k], v_point[k]
                    u_led[k] = (
                        u_point[0] * rotation[0, k] + u_point[1] * rotation[1, k]
                        + u_point[2] * rotation[2, k]
                    )  # fmt: skip
                    v_led[k] = (
                        v_point[0] * rotation[0, k] + v_point[1] * rotation[1, k]
                        + v_point[2] * rotation[2, k]
                    )  # fmt: skip
                for i in range(3):
                    score[i] += u_point[i] * miss_u + v_point[i] * miss_v
                    score[at + i] += u_led[i] * miss_u + v_led[i] * miss_v
                    for j in range(i + 1):
                        normal[i, j] += u_point[i] * u_point[j] + v_point[i] * v_point[j]
                        normal[at + i, at + j] += u_led[i] * u_led[j] + v_led[i] * v_led[j]
                    for j in range(3):
                        normal[at + i, j] += u_led[i] * u_point[j] + v_led[i] * v_point[j]
                for i in range(size):
                    by_u, by_v = u_pose[i], v_pose[i]
                    g[i] += by_u * miss_u + by_v * miss_v
                    for j in range(i + 1):
                        v[i, j] += by_u * u_pose[j] + by_v * v_pose[j]
                    for j in range(3):
                        w[i, j] += by_u * u_point[j] + by_v * v_point[j]
                        w[i, at + j] += by_u * u_led[j] + by_v * v_led[j]
                if with_cameras:
                    first = own + N_CAMERA * c
                    for k in range(N_CAMERA):
                        by_u, by_v = weight * u_row[k], weight * v_row[k]
                        for i in range(3):
                            normal[first + k, i] += by_u * u_point[i] + by_v * v_point[i]
                            normal[first + k, at + i] += by_u * u_led[i] + by_v * v_led[i]
                        for i in range(size):
                            w[i, first + k] += by_u * u_pose[i] + by_v * v_pose[i]
        if not used:
            for i in range(size):
                v[i, i] = 1.0
            continue
        if size == 6:
            for i in range(3):
                off = slack_weight * slacks[n, i]
                total += off * off
                g[3 + i] += slack_weight * off
                v[3 + i, 3 + i] += slack_weight * slack_weight
        if not _eliminate(v, w, g, damping):
            return np.inf
        for k in range(size):
            for i in range(own):
                factor = w[k, i]
                score[i] -= factor * g[k]
                for j in range(i + 1):
                    normal[i, j] -= factor * w[k, j]
            for i in range(own, width):
                factor = w[k, i]
                for j in range(own):
                    normal[i, j] -= factor * w[k, j]
        for i in range(own):
            gradient[i] += score[i]
    return total


@compiled(algebra)
def move_turns(
    factors: Float, y: Float, z: Float, step: Float, rotations: Float, slacks: Float
) -> None:
    """Turn all poses, and with slack shift them, in place, given the step (k,) of the rest."""
    turned, work = np.empty((3, 3)), np.empty((3, 3))
    n_poses, size = z.shape
    own = np.zeros(6)
    for n in range(n_poses):
        for i in range(size):
            value = z[n, i]
            for k in range(step.shape[0]):
                value += y[n, i, k] * step[k]
            own[i] = -value
        for i in range(size - 1, -1, -1):
            value = own[i]
            for k in range(i + 1, size):
                value -= factors[n, k, i] * own[k]
            own[i] = value / factors[n, i, i]
        turn(rotations[n], own[0], own[1], own[2], turned, work)
        for i in range(size - 3):
            slacks[n, i] += own[3 + i]
