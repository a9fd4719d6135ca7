"""Compiled first half of the search for labels: ray intersections of two cameras.

Every spot of one camera is paired with every spot of another; a pair with intersecting rays
(epipolar condition) is a point in space that may be an LED. Each point has its covariance, so that
distances are compared with those of the body as closely as the geometry of the rig allows.
"""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking.kernels import _kernel as kernel
from ocmm_core.tracking.kernels._kernel import Bool, triangulate_leds, undistort

# Two intersecting rays leave one degree of freedom (four coordinates, three of the point), so the
# root of the sum of squares is one normal number. A wide limit: false intersections are refused by
# distances and by the pose.
MISS_SIGMAS = 7.0
"""Ray distance in standard deviations above which they do not intersect."""

DISTANCE_SIGMAS = 6.0
# First filter of the search: generous, as every triple that passes is examined with all its spots
# (`_grow_kernel.extend_hypothesis`).
DISTANCE_SLACK_MM = 0.1
"""Contribution of calibration and body to the error of a distance."""


@compiled(kernel)
def undistort_rays(spots: Float, cams: Float, ideal: Float, jacobian: Float, there: Bool) -> None:
    """Remove the distortion from spots (C, S, 2), px; see `_solve_kernel.solve_frames`."""
    for c in range(spots.shape[0]):
        sx, sy = cams[c, 13], cams[c, 14]
        for slot in range(spots.shape[1]):
            u, v = spots[c, slot, 0], spots[c, slot, 1]
            there[c, slot] = np.isfinite(u) and np.isfinite(v)
            if not there[c, slot]:
                continue
            x, y, j00, j01, j11 = undistort(
                (u - cams[c, 15]) / sx, (v - cams[c, 16]) / sy,
                cams[c, 17], cams[c, 18], cams[c, 19], cams[c, 20],
            )  # fmt: skip
            # mm on the ideal image, and the derivative of the pixels by it, row by row, px/mm.
            ideal[c, slot, 0], ideal[c, slot, 1] = x, y
            jacobian[c, slot, 0], jacobian[c, slot, 1] = sx * j00, sx * j01
            jacobian[c, slot, 2], jacobian[c, slot, 3] = sy * j01, sy * j11


@compiled()
def view(cams: Float, c: int, point: Float, derivative: Float) -> tuple[float, float, float]:
    """Return the image of a point (3,) in camera ``c``, ideal, mm, and its depth, mm.

    Writes the derivative of the former by the point to ``derivative`` (2, 3).
    """
    x, y, z = point[0], point[1], point[2]
    xc = cams[c, 0] * x + cams[c, 1] * y + cams[c, 2] * z + cams[c, 9]
    yc = cams[c, 3] * x + cams[c, 4] * y + cams[c, 5] * z + cams[c, 10]
    zc = cams[c, 6] * x + cams[c, 7] * y + cams[c, 8] * z + cams[c, 11]
    m = cams[c, 12] / zc
    xi, yi = m * xc, m * yc
    for k in range(3):
        # d(f X/Z) = f/Z dX - f X/Z^2 dZ; the rows of R are the derivatives of X, Y and Z by the
        # point.
        derivative[0, k] = m * cams[c, k] - xi / zc * cams[c, 6 + k]
        derivative[1, k] = m * cams[c, 3 + k] - yi / zc * cams[c, 6 + k]
    return xi, yi, zc


@compiled(kernel)
def triangulate_pairs(
    ideal: Float, jacobian: Float, seeds: Bool, there: Bool, cams: Float, first: int, second: int,
    sigma: float, bounds: Float, positions: Float, covariances: Float, lights: Int,
) -> int:  # fmt: skip
    """Find the intersections of rays of two cameras; return their number.

    ``seeds``, ``there`` (C, S): spots to use in the first camera, and in the second; ``sigma`` of
    one spot, px; ``bounds`` (2, 3), mm: possible LED positions. Outputs with room for S^2:
    ``positions`` (n, 3), mm, ``covariances`` (n, 3, 3), mm^2, ``lights`` (n, 2): both spots, camera
    number times S plus slot.
    """
    n_slots = there.shape[1]
    pair = np.empty((2, n_slots * n_slots, 2))
    seen = np.zeros((2, n_slots * n_slots), np.bool_)
    numbers = np.empty((n_slots * n_slots, 2), np.int64)
    n = 0
    # Every pair is laid out as one "LED" seen by two cameras, so that one call locates them all.
    for a in range(n_slots):
        for b in range(n_slots):
            if seeds[first, a] and there[second, b]:
                pair[0, n, 0], pair[0, n, 1] = ideal[first, a, 0], ideal[first, a, 1]
                pair[1, n, 0], pair[1, n, 1] = ideal[second, b, 0], ideal[second, b, 1]
                seen[0, n] = seen[1, n] = True
                numbers[n, 0], numbers[n, 1] = a, b
                n += 1
    points = np.empty((n_slots * n_slots, 3))
    located = np.empty(n_slots * n_slots, np.bool_)
    both = np.empty((2, cams.shape[1]))
    for k in range(cams.shape[1]):
        both[0, k], both[1, k] = cams[first, k], cams[second, k]
    triangulate_leds(pair, seen, both, points, located)
    derivative = np.empty((2, 3))
    information = np.empty((3, 3))
    row = np.empty(3)
    count = 0
    for i in range(n):
        # Cheap test first: parallel rays give infinity or NaN, and NaN fails both comparisons.
        inside = True
        for k in range(3):
            inside = inside and bounds[0, k] < points[i, k] < bounds[1, k]
        if not inside:
            continue
        squares = 0.0
        information[:] = 0.0
        for side in range(2):
            c = first if side == 0 else second
            slope = jacobian[c, numbers[i, side]]
            x, y, depth = view(cams, c, points[i], derivative)
            # Rays are lines in the equations; intersections behind a camera are invalid.
            inside = inside and depth > 0.0
            ex, ey = pair[side, i, 0] - x, pair[side, i, 1] - y
            for axis in range(2):
                # Observed minus predicted, px: only there do all spots have the same sigma.
                miss = slope[2 * axis] * ex + slope[2 * axis + 1] * ey
                squares += miss * miss
                for k in range(3):
                    row[k] = (
                        slope[2 * axis] * derivative[0, k] + slope[2 * axis + 1] * derivative[1, k]
                    )
                for k in range(3):
                    for m in range(3):
                        # J'J of the four coordinates by the point, px^2/mm^2.
                        information[k, m] += row[k] * row[m]
        # The sum of squares over sigma^2 is the squared ray distance in standard deviations.
        if not inside or squares > (MISS_SIGMAS * sigma) ** 2:
            continue
        for k in range(3):
            positions[count, k] = points[i, k]
        lights[count, 0] = first * n_slots + numbers[i, 0]
        lights[count, 1] = second * n_slots + numbers[i, 1]
        # sigma^2 (J'J)^-1, mm^2: long along the rays for a small base.
        _inverse(information, sigma * sigma, covariances[count])
        count += 1
    return count


@compiled()
def measure(positions: Float, covariances: Float, count: int, far: Float, slack: Float) -> None:
    """Write the distances of ``count`` points, mm, and their error bounds, (n, n) each."""
    for i in range(count):
        for j in range(i):
            distance = 0.0
            for k in range(3):
                distance += (positions[i, k] - positions[j, k]) ** 2
            distance = np.sqrt(distance)
            # First order: d = |p - q| has the gradients +n and -n, n = (p - q) / d, so that var(d)
            # is n'(Cp + Cq) n; two points that share a spot are correlated, but `_apart` excludes
            # these.
            variance = 0.0
            for k in range(3):
                for m in range(3):
                    variance += (
                        (positions[i, k] - positions[j, k])
                        * (covariances[i, k, m] + covariances[j, k, m])
                        * (positions[i, m] - positions[j, m])
                    )
            # The sum above has d n instead of n twice. Coincident points have no direction; 1e-9 mm
            # keeps their quotient finite.
            sigma = np.sqrt(variance) / max(distance, 1e-9)
            far[i, j] = far[j, i] = distance
            slack[i, j] = slack[j, i] = DISTANCE_SIGMAS * sigma + DISTANCE_SLACK_MM


@compiled()
def _inverse(a: Float, scale: float, out: Float) -> None:
    """Write ``scale`` times the inverse of a symmetric ``a`` (3, 3)."""
    # Cofactors over the determinant; the upper triangle suffices. For nearly coincident rays the
    # determinant is nearly zero, and the covariance so large that any distance matches.
    c00 = a[1, 1] * a[2, 2] - a[1, 2] * a[1, 2]
    c01 = a[0, 2] * a[1, 2] - a[0, 1] * a[2, 2]
    c02 = a[0, 1] * a[1, 2] - a[0, 2] * a[1, 1]
    s = scale / (a[0, 0] * c00 + a[0, 1] * c01 + a[0, 2] * c02)
    out[0, 0] = s * c00
    out[0, 1] = out[1, 0] = s * c01
    out[0, 2] = out[2, 0] = s * c02
    out[1, 1] = s * (a[0, 0] * a[2, 2] - a[0, 2] * a[0, 2])
    out[1, 2] = out[2, 1] = s * (a[0, 1] * a[0, 2] - a[0, 0] * a[1, 2])
    out[2, 2] = s * (a[0, 0] * a[1, 1] - a[0, 1] * a[0, 1])
