"""Compiled inner loops of the pivot calibration.

Unknowns of a pose: rotation about the ball (3) and, with slack, the ball in the cone (6 in total).
They are eliminated as in `bundle`; common are the centre of the ball and the arms to the LEDs.
"""

from __future__ import annotations

import numpy as np

from ocmm_core.calibration.bundle import N_CAMERA, eliminate
from ocmm_core.calibration.bundle import kernel as bundle_kernel
from ocmm_core.calibration.cameras import empty_rows, spot_rows
from ocmm_core.calibration.cameras import lens as camera_kernel
from ocmm_core.camera import compiled
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking.kernels import best_turn, turn
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


@compiled(camera_kernel, bundle_kernel)
def schur_reduce_rotations(
    cameras: Float, arms: Float, centre: Float, uv: Float, weights: Float, slack_weight: float,
    rotations: Float, slacks: Float, damping: float, blocks: Int,
    normals: Float, gradients: Float, factors: Float, y: Float, z: Float, scores: Float,
) -> float:  # fmt: skip
    """Add all poses to the reduced normal equations; return the sum of squares.

    Infinite if an LED is behind a camera or a rotation is undetermined. In: ``cameras`` (C, 24),
    `lens.LensCamera.packed`; ``arms`` (L, 3), mm, body, from the ball's centre; ``centre`` (3,),
    mm, world; ``uv`` (n, C, L, 2), px; ``weights`` (n, C, L), 1/px, zero if unused;
    ``slack_weight``, 1/mm: inverse standard deviation of the ball in its cone, zero without slack;
    ``rotations`` (n, 3, 3), world from body; ``slacks`` (n, 3), mm, from the centre; ``damping`` of
    the poses' diagonals (Levenberg-Marquardt); ``blocks`` (n,): which of B normal equations. Added
    to: ``normals`` (B, k, k), lower triangle, ``gradients`` (B, k). Columns: centre, arms, and if k
    is larger the cameras, 14 each, with only the rows coupled with centre and arms written. Out:
    ``factors`` (n, d, d), ``y`` (n, d, k), ``z`` (n, d), d = 6 with slack, else 3; ``scores`` (n, 3
    + 3 L): contribution of each pose to the gradient of centre and arms.
    """
    n_poses, n_cameras, n_leds = weights.shape
    size, width = y.shape[1], y.shape[2]
    # Columns: the centre of the ball (3), then three for the arm of each LED.
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
            # The ball rests in its cone: all poses share the centre; each has its own rotation
            # about it.
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
                # Predicted minus observed, in sigmas.
                miss_u = weight * (predicted_u - uv[n, c, led, 0])
                miss_v = weight * (predicted_v - uv[n, c, led, 1])
                total += miss_u * miss_u + miss_v * miss_v
                for k in range(3):
                    # By the point in the world: R' times the derivative by the point in the camera
                    # frame.
                    u_point[k] = weight * (
                        u_row[3] * packed[k] + u_row[4] * packed[3 + k] + u_row[5] * packed[6 + k]
                    )
                    v_point[k] = weight * (
                        v_row[3] * packed[k] + v_row[4] * packed[3 + k] + v_row[5] * packed[6 + k]
                    )
                # By the rotation about the centre, world axes: p . (w x q) = w . (q x p) with the
                # arm q.
                u_pose[0] = qy * u_point[2] - qz * u_point[1]
                u_pose[1] = qz * u_point[0] - qx * u_point[2]
                u_pose[2] = qx * u_point[1] - qy * u_point[0]
                v_pose[0] = qy * v_point[2] - qz * v_point[1]
                v_pose[1] = qz * v_point[0] - qx * v_point[2]
                v_pose[2] = qx * v_point[1] - qy * v_point[0]
                for k in range(3):
                    # Slack and centre both shift the point, with the same derivative. They are
                    # separable only because the slack weight holds slacks near zero.
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
                # d = 3 leaves the slack's part of u_pose unused.
                for i in range(size):
                    by_u, by_v = u_pose[i], v_pose[i]
                    g[i] += by_u * miss_u + by_v * miss_v
                    for j in range(i + 1):
                        v[i, j] += by_u * u_pose[j] + by_v * v_pose[j]
                    for j in range(3):
                        w[i, j] += by_u * u_point[j] + by_v * v_point[j]
                        w[i, at + j] += by_u * u_led[j] + by_v * v_led[j]
                # Coupling of cameras with centre and arms is needed for the uncertainty due to the
                # cameras; cameras are not fitted here, and their own block is not formed.
                if with_cameras:
                    first = own + N_CAMERA * c
                    for k in range(N_CAMERA):
                        # The rows of `spot_rows` are unweighted, unlike u_point, and stay so to
                        # keep their constant elements.
                        by_u, by_v = weight * u_row[k], weight * v_row[k]
                        for i in range(3):
                            normal[first + k, i] += by_u * u_point[i] + by_v * v_point[i]
                            normal[first + k, at + i] += by_u * u_led[i] + by_v * v_led[i]
                        for i in range(size):
                            w[i, first + k] += by_u * u_pose[i] + by_v * v_pose[i]
        # An identity keeps the factor regular; the pose contributes nothing.
        if not used:
            for i in range(size):
                v[i, i] = 1.0
            continue
        # The slack is an observation of zero with the slack weight.
        if size == 6:
            for i in range(3):
                off = slack_weight * slacks[n, i]
                total += off * off
                g[3 + i] += slack_weight * off
                v[3 + i, 3 + i] += slack_weight * slack_weight
        # After this v is L, w is Y = L^-1 W, g is z = L^-1 g.
        if not eliminate(v, w, g, damping):
            return np.inf
        # Schur complement: U - Y'Y and b - Y'z, pose by pose.
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
            # Scores are kept by pose: their scatter gives the centre's uncertainty without a noise
            # model.
            gradient[i] += score[i]
    return total


@compiled(algebra)
def move_turns(
    factors: Float, y: Float, z: Float, step: Float, rotations: Float, slacks: Float
) -> None:
    """Update all rotations, and slacks if any, in place for a step (k,)."""
    turned, work = np.empty((3, 3)), np.empty((3, 3))
    n_poses, size = z.shape
    own = np.zeros(6)
    for n in range(n_poses):
        for i in range(size):
            # L' own = -(z + Y step), solved from the last unknown up.
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
        # Three with slack, otherwise zero.
        for i in range(size - 3):
            slacks[n, i] += own[3 + i]
