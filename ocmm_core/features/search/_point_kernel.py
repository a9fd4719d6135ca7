"""Compiled loops over points common to all fits: centre, size and principal axes."""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float


@compiled(reorder=True)
def centre(points: Float, centroid: Float, about: Float) -> float:
    """Write centroid (3,) and points about it (n, 3), over their RMS distance; return that."""
    n = len(points)
    x = y = z = 0.0
    for row in range(n):
        x += points[row, 0]
        y += points[row, 1]
        z += points[row, 2]
    x, y, z = x / n, y / n, z / n
    # The second pass removes the rounding of a mean far from the origin.
    rest_x = rest_y = rest_z = square = 0.0
    for row in range(n):
        dx, dy, dz = points[row, 0] - x, points[row, 1] - y, points[row, 2] - z
        about[row, 0], about[row, 1], about[row, 2] = dx, dy, dz
        rest_x += dx
        rest_y += dy
        rest_z += dz
        square += dx * dx + dy * dy + dz * dz
    rest_x, rest_y, rest_z = rest_x / n, rest_y / n, rest_z / n
    centroid[0], centroid[1], centroid[2] = x + rest_x, y + rest_y, z + rest_z
    # The square is about the first mean; about the better one it is less by |rest|^2.
    square = square / n - (rest_x * rest_x + rest_y * rest_y + rest_z * rest_z)
    size: float = np.sqrt(max(square, 0.0))
    # Coordinates near one: iteration limits hold for features of any size.
    scale = 1.0 / size if size > 0.0 else 1.0
    for row in range(n):
        about[row, 0] = (about[row, 0] - rest_x) * scale
        about[row, 1] = (about[row, 1] - rest_y) * scale
        about[row, 2] = (about[row, 2] - rest_z) * scale
    return size


@compiled(reorder=True)
def _gram(points: Float, axes: Float, gram: Float) -> None:
    """Write the moments (3, 3) of points (n, 3) along the rows of ``axes`` (3, 3) to ``gram``."""
    xx = xy = xz = yy = yz = zz = 0.0
    for row in range(len(points)):
        px, py, pz = points[row, 0], points[row, 1], points[row, 2]
        # Along nearly principal axes, small moments are sums of small squares, not differences of
        # large ones.
        x = px * axes[0, 0] + py * axes[0, 1] + pz * axes[0, 2]
        y = px * axes[1, 0] + py * axes[1, 1] + pz * axes[1, 2]
        z = px * axes[2, 0] + py * axes[2, 1] + pz * axes[2, 2]
        xx += x * x
        xy += x * y
        xz += x * z
        yy += y * y
        yz += y * z
        zz += z * z
    gram[0, 0], gram[1, 1], gram[2, 2] = xx, yy, zz
    gram[0, 1] = gram[1, 0] = xy
    gram[0, 2] = gram[2, 0] = xz
    gram[1, 2] = gram[2, 1] = yz


@compiled()
def diagonalise(gram: Float, axes: Float) -> None:
    """Turn the rows of ``axes`` to the eigenvectors of ``gram``, which is destroyed (Jacobi)."""
    # A few sweeps suffice; 30 ends the loop for NaN.
    for _ in range(30):
        rest = 0.0
        for i in range(2):
            for j in range(i + 1, 3):
                scale = gram[i, i] * gram[j, j]
                # Relative to the product of both moments, so that a thin direction keeps its
                # digits.
                if gram[i, j] * gram[i, j] > 1e-36 * scale:
                    rest = 1.0
        if rest == 0.0:
            break
        for i in range(2):
            for j in range(i + 1, 3):
                if gram[i, j] == 0.0:
                    continue
                # Golub and Van Loan, on Jacobi methods: the smaller root of t^2 + 2 theta t = 1,
                # with the sign of theta to avoid cancellation.
                theta = 0.5 * (gram[j, j] - gram[i, i]) / gram[i, j]
                t = 1.0 / (abs(theta) + np.sqrt(theta * theta + 1.0))
                if theta < 0.0:
                    t = -t
                c = 1.0 / np.sqrt(t * t + 1.0)
                s = t * c
                for k in range(3):
                    first, second = gram[k, i], gram[k, j]
                    gram[k, i], gram[k, j] = c * first - s * second, s * first + c * second
                for k in range(3):
                    first, second = gram[i, k], gram[j, k]
                    gram[i, k], gram[j, k] = c * first - s * second, s * first + c * second
                for k in range(3):
                    first, second = axes[i, k], axes[j, k]
                    axes[i, k], axes[j, k] = c * first - s * second, s * first + c * second


@compiled()
def principal(points: Float, extents: Float, axes: Float) -> None:
    """Write the singular values (3,) and right singular vectors, by rows, of points (n, 3).

    Moments are computed twice, the second time along the first axes: the smallest extent and its
    axis are then as accurate as from a singular value decomposition.
    """
    gram = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            axes[i, j] = 1.0 if i == j else 0.0
    for _ in range(2):
        _gram(points, axes, gram)
        diagonalise(gram, axes)
    # Sorted, the greatest first; three numbers need two passes.
    for i in range(2):
        for j in range(2 - i):
            if gram[j, j] < gram[j + 1, j + 1]:
                gram[j, j], gram[j + 1, j + 1] = gram[j + 1, j + 1], gram[j, j]
                for k in range(3):
                    axes[j, k], axes[j + 1, k] = axes[j + 1, k], axes[j, k]
    for i in range(3):
        # Rounding may leave a negative square for points without extent: NaN there would pass every
        # check for points in a line.
        extents[i] = np.sqrt(max(gram[i, i], 0.0))


@compiled(reorder=True)
def places(about: Float, axes: Float, along: Float) -> None:
    """Write coordinates (n, k) of points (n, 3) along the first k ``axes``."""
    for k in range(along.shape[1]):
        x, y, z = axes[k, 0], axes[k, 1], axes[k, 2]
        for row in range(len(about)):
            along[row, k] = about[row, 0] * x + about[row, 1] * y + about[row, 2] * z


@compiled(reorder=True)
def taubin(points: Float, moments: Float) -> float:
    """Write the moments of Taubin's ball of centred points (n, d); return their size.

    Their smallest eigenvector (d + 1,) is the ball; the eigenvalue approximates the mean squared
    distance.
    """
    n, d = points.shape
    square = 0.0
    for row in range(n):
        for k in range(d):
            square += points[row, k] * points[row, k]
    # Taubin's weight: the gradient of |x|^2 is 2 x, of mean square 4 mean. With |x|^2 - mean over
    # twice the root of the mean as first column his constraint is unit length of the coefficients.
    mean = square / n
    scale = 0.5 / np.sqrt(mean)
    ff = fx = fy = fz = xx = xy = xz = yy = yz = zz = 0.0
    for row in range(n):
        x, y = points[row, 0], points[row, 1]
        z = points[row, 2] if d == 3 else 0.0
        first = scale * (x * x + y * y + z * z - mean)
        ff += first * first
        fx += first * x
        fy += first * y
        fz += first * z
        xx += x * x
        xy += x * y
        xz += x * z
        yy += y * y
        yz += y * z
        zz += z * z
    moments[0, 0], moments[1, 0], moments[2, 0] = ff, fx, fy
    moments[1, 1], moments[2, 1], moments[2, 2] = xx, xy, yy
    if d == 3:
        moments[3, 0], moments[3, 1], moments[3, 2], moments[3, 3] = fz, xz, yz, zz
    for i in range(d + 1):
        for j in range(i + 1):
            moments[i, j] /= n
            moments[j, i] = moments[i, j]
    size: float = mean
    return size


@compiled(reorder=True)
def line_distances(about: Float, axes: Float, along: Float, residuals: Float) -> None:
    """Write coordinates along the first axis and distances from it (n,).

    Distances of points (n, 3) have the sign of their side along the second of the ``axes`` (3, 3).
    """
    for row in range(len(about)):
        x, y, z = about[row, 0], about[row, 1], about[row, 2]
        along[row] = x * axes[0, 0] + y * axes[0, 1] + z * axes[0, 2]
        second = x * axes[1, 0] + y * axes[1, 1] + z * axes[1, 2]
        third = x * axes[2, 0] + y * axes[2, 1] + z * axes[2, 2]
        distance = np.sqrt(second * second + third * third)
        # A line in space has no sides.
        residuals[row] = -distance if second < 0.0 else distance


@compiled()
def spread_alike(turning: Float, shifts: Float, constant: Float, jacobian: Float) -> None:
    """Write derivatives of a geometry by points, (12, 3 n), from equal blocks.

    ``turning`` (12, k, 3): d(geometry) / d(a point) per unit of its ``shifts`` (n, k), its weights;
    ``constant`` (12, 3): contribution common to all points.
    """
    n, k = shifts.shape
    for place in range(len(turning)):
        # Zero rows are common (sizes that an element does not have) and need no loop.
        rests = True
        for j in range(3):
            rests = rests and constant[place, j] == 0.0
            for i in range(k):
                rests = rests and turning[place, i, j] == 0.0
        row_of = jacobian[place]
        if rests:
            row_of[:] = 0.0
            continue
        cx, cy, cz = constant[place, 0], constant[place, 1], constant[place, 2]
        ax, ay, az = turning[place, 0, 0], turning[place, 0, 1], turning[place, 0, 2]
        # k is one or two; for one the second product is disabled.
        last = k - 1
        bx, by, bz = turning[place, last, 0], turning[place, last, 1], turning[place, last, 2]
        if k == 1:
            bx = by = bz = 0.0
        for row in range(n):
            a, b = shifts[row, 0], shifts[row, last]
            # Columns are x, y, z, point by point.
            row_of[3 * row] = a * ax + b * bx + cx
            row_of[3 * row + 1] = a * ay + b * by + cy
            row_of[3 * row + 2] = a * az + b * bz + cz


@compiled()
def spread(gain: Float, shifts: Float, normals: Float, constant: Float, jacobian: Float) -> None:
    """Add the derivatives of a geometry by points to ``jacobian`` (12, 3 n).

    ``gain`` (12, k): d(geometry) / d(step of the fit); ``shifts`` (n, k): weight of a shift of each
    point along its normal (n, 3) in the step; ``constant`` (12, 3): independent of the normal.
    """
    n, k = shifts.shape
    moves = np.empty(n)
    for place in range(len(gain)):
        # As in `spread_alike`: zero rows stay unchanged.
        used = False
        for j in range(k):
            used = used or gain[place, j] != 0.0
        for j in range(3):
            used = used or constant[place, j] != 0.0
        if not used:
            continue
        row_of = jacobian[place]
        moves[:] = 0.0
        for j in range(k):
            weight = gain[place, j]
            for row in range(n):
                # A normal shift of a point moves its residual equally, and residuals move the step.
                # Tangential shifts have no first-order effect.
                moves[row] += weight * shifts[row, j]
        cx, cy, cz = constant[place, 0], constant[place, 1], constant[place, 2]
        for row in range(n):
            total = moves[row]
            row_of[3 * row] += total * normals[row, 0] + cx
            row_of[3 * row + 1] += total * normals[row, 1] + cy
            row_of[3 * row + 2] += total * normals[row, 2] + cz
