"""Compiled loops over points that every fit begins with: centre, size and principal axes."""

from __future__ import annotations

import numpy as np

from ocmm_core.camera.compiled import compiled
from ocmm_core.geometry import Float


@compiled(reorder=True)
def centre(points: Float, centroid: Float, about: Float) -> float:
    """Put the centroid (d,) and the points about it (n, d) divided by their size; return the size.

    The size is the root mean squared distance from the centroid.
    """
    n, d = points.shape
    for k in range(d):
        total = 0.0
        for row in range(n):
            total += points[row, k]
        mean = total / n
        # The second pass removes the rounding of a mean far from the origin.
        total = 0.0
        for row in range(n):
            total += points[row, k] - mean
        correction = total / n
        for row in range(n):
            about[row, k] = (points[row, k] - mean) - correction
        centroid[k] = mean + correction
    square = 0.0
    for row in range(n):
        for k in range(d):
            square += about[row, k] * about[row, k]
    size: float = np.sqrt(square / n)
    if size > 0.0:
        for row in range(n):
            for k in range(d):
                about[row, k] /= size
    return size


@compiled(reorder=True)
def _gram(points: Float, axes: Float, gram: Float) -> None:
    """Put the moments (3, 3) of points (n, 3) along the rows of ``axes`` (3, 3) into ``gram``."""
    xx = xy = xz = yy = yz = zz = 0.0
    for row in range(len(points)):
        px, py, pz = points[row, 0], points[row, 1], points[row, 2]
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
def _turn(gram: Float, axes: Float) -> None:
    """Turn the rows of ``axes`` to the eigenvectors of ``gram``, which is destroyed (Jacobi)."""
    for _ in range(30):
        rest = 0.0
        for i in range(2):
            for j in range(i + 1, 3):
                scale = gram[i, i] * gram[j, j]
                if gram[i, j] * gram[i, j] > 1e-36 * scale:
                    rest = 1.0
        if rest == 0.0:
            break
        for i in range(2):
            for j in range(i + 1, 3):
                if gram[i, j] == 0.0:
                    continue
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
    """Put the singular values (3,) and right singular vectors (3, 3), by rows, of points (n, 3).

    The moments are taken twice, the second time along the axes found first: the smallest extent
    and its axis then are as good as those of a singular value decomposition.
    """
    gram = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            axes[i, j] = 1.0 if i == j else 0.0
    for _ in range(2):
        _gram(points, axes, gram)
        _turn(gram, axes)
    _gram(points, axes, gram)
    for i in range(2):
        for j in range(2 - i):
            if gram[j, j] < gram[j + 1, j + 1]:
                gram[j, j], gram[j + 1, j + 1] = gram[j + 1, j + 1], gram[j, j]
                for k in range(3):
                    axes[j, k], axes[j + 1, k] = axes[j + 1, k], axes[j, k]
    for i in range(3):
        extents[i] = np.sqrt(gram[i, i])


@compiled(reorder=True)
def taubin(points: Float, moments: Float) -> float:
    """Put the moments of Taubin's ball (d + 1, d + 1) of centred points (n, d); return their size.

    See `ball.taubin_moments`, which does the same for many sets of points at once.
    """
    n, d = points.shape
    square = 0.0
    for row in range(n):
        for k in range(d):
            square += points[row, k] * points[row, k]
    mean = square / n
    scale = 0.5 / np.sqrt(mean)
    for i in range(d + 1):
        for j in range(d + 1):
            moments[i, j] = 0.0
    for row in range(n):
        first = -mean
        for k in range(d):
            first += points[row, k] * points[row, k]
        first *= scale
        moments[0, 0] += first * first
        for i in range(d):
            moments[i + 1, 0] += first * points[row, i]
            for j in range(i + 1):
                moments[i + 1, j + 1] += points[row, i] * points[row, j]
    for i in range(d + 1):
        for j in range(i + 1):
            moments[i, j] /= n
            moments[j, i] = moments[i, j]
    size: float = mean
    return size


@compiled()
def spread(gain: Float, shifts: Float, normals: Float, constant: Float, jacobian: Float) -> None:
    """Add how a geometry changes with the points to ``jacobian`` (12, 3 n).

    Parameters
    ----------
    gain
        (12, k): d(geometry) / d(step of the fit).
    shifts
        (n, k): how much a shift of each point along its normal takes part in the step.
    normals
        (n, 3), or (1, 3) where all points have the same.
    constant
        (12, 3): what every point adds, whichever way it moves.
    """
    n, k = shifts.shape
    single = len(normals) == 1
    for place in range(len(gain)):
        used = False
        for j in range(k):
            used = used or gain[place, j] != 0.0
        for j in range(3):
            used = used or constant[place, j] != 0.0
        if not used:
            continue
        for row in range(n):
            total = 0.0
            for j in range(k):
                total += gain[place, j] * shifts[row, j]
            normal = normals[0 if single else row]
            for j in range(3):
                jacobian[place, 3 * row + j] += total * normal[j] + constant[place, j]
