"""Compiled algebra of small fixed size, in place and without allocation."""

from __future__ import annotations

import numpy as np

from ocmm_core.cpu_features import njit
from ocmm_core.geometry import Float


@njit(cache=True, nogil=True, error_model="numpy")
def largest_eigenvector(a: Float, v: Float) -> int:
    """Write the eigenvectors of ``a`` (4, 4) to the columns of ``v``; return the largest's.

    The result is its column index. Cyclic Jacobi; ``a`` is destroyed.
    """
    for i in range(4):
        for j in range(4):
            v[i, j] = 1.0 if i == j else 0.0
    # The sweeps converge quadratically in a few rounds; 30 only bounds the loop for NaN.
    for _ in range(30):
        off = 0.0
        size = 0.0
        for i in range(4):
            size += a[i, i] * a[i, i]
            for j in range(i + 1, 4):
                off += a[i, j] * a[i, j]
        # Squares: the off-diagonal elements are below 1e-16 of the diagonal, float64 rounding.
        if off <= 1e-32 * size:
            break
        for p in range(3):
            for q in range(p + 1, 4):
                if a[p, q] == 0.0:
                    continue
                # Golub and Van Loan, Matrix Computations, on Jacobi methods: t = tan of the angle
                # that makes a[p, q] zero solves t^2 + 2 theta t = 1. The smaller root turns by at
                # most 45 degrees, which makes the sweeps converge.
                theta = 0.5 * (a[q, q] - a[p, p]) / a[p, q]
                t = 1.0 / (abs(theta) + np.sqrt(theta * theta + 1.0))
                # The root has the sign of theta, so that its denominator never cancels.
                if theta < 0.0:
                    t = -t
                c = 1.0 / np.sqrt(t * t + 1.0)
                s = t * c
                # A becomes J'AJ: columns first, then rows. V collects the same rotations of
                # columns.
                for k in range(4):
                    akp, akq = a[k, p], a[k, q]
                    a[k, p] = c * akp - s * akq
                    a[k, q] = s * akp + c * akq
                for k in range(4):
                    apk, aqk = a[p, k], a[q, k]
                    a[p, k] = c * apk - s * aqk
                    a[q, k] = s * apk + c * aqk
                for k in range(4):
                    vkp, vkq = v[k, p], v[k, q]
                    v[k, p] = c * vkp - s * vkq
                    v[k, q] = s * vkp + c * vkq
    # The signed largest: Horn's quaternion belongs to the most positive one.
    best = 0
    for k in range(1, 4):
        if a[k, k] > a[best, best]:
            best = k
    return best


@njit(cache=True, nogil=True, error_model="numpy")
def cholesky(a: Float) -> bool:
    """Factor ``a`` (6, 6) in place into its lower Cholesky factor; False if not positive."""
    for j in range(6):
        d = a[j, j]
        for k in range(j):
            d -= a[j, k] * a[j, k]
        # Written so that NaN also fails.
        if not d > 0.0:
            return False
        d = np.sqrt(d)
        a[j, j] = d
        for i in range(j + 1, 6):
            value = a[i, j]
            for k in range(j):
                value -= a[i, k] * a[j, k]
            a[i, j] = value / d
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def forward(factor: Float, b: Float) -> None:
    """Solve ``factor y = b`` in place."""
    for i in range(6):
        value = b[i]
        for k in range(i):
            value -= factor[i, k] * b[k]
        b[i] = value / factor[i, i]


@njit(cache=True, nogil=True, error_model="numpy")
def backward(factor: Float, b: Float) -> None:
    """Solve ``factor' x = b`` in place."""
    for i in range(5, -1, -1):
        value = b[i]
        for k in range(i + 1, 6):
            value -= factor[k, i] * b[k]
        b[i] = value / factor[i, i]


@njit(cache=True, nogil=True, error_model="numpy")
def rotation_of(w: float, x: float, y: float, z: float, rotation: Float) -> None:
    """Write the rotation of a quaternion of any length to ``rotation`` (3, 3)."""
    size = w * w + x * x + y * y + z * z
    # Dividing by the squared length avoids the root of a unit quaternion.
    s = 2.0 / size
    # Active and right-handed: it turns vectors, and columns are the turned axes.
    rotation[0, 0] = 1.0 - s * (y * y + z * z)
    rotation[0, 1] = s * (x * y - w * z)
    rotation[0, 2] = s * (x * z + w * y)
    rotation[1, 0] = s * (x * y + w * z)
    rotation[1, 1] = 1.0 - s * (x * x + z * z)
    rotation[1, 2] = s * (y * z - w * x)
    rotation[2, 0] = s * (x * z - w * y)
    rotation[2, 1] = s * (y * z + w * x)
    rotation[2, 2] = 1.0 - s * (x * x + y * y)


@njit(cache=True, nogil=True, error_model="numpy")
def turn(rotation: Float, wx: float, wy: float, wz: float, step: Float, work: Float) -> None:
    """Replace ``rotation`` by exp(w) rotation."""
    angle = np.sqrt(wx * wx + wy * wy + wz * wz)
    # Only prevents a division by zero: sin(half) / angle loses no digits for small rotations.
    if angle < 1e-300:
        return
    half = 0.5 * angle
    # The axis w / angle times sin(half) is the vector part of the quaternion.
    scale = np.sin(half) / angle
    rotation_of(np.cos(half), wx * scale, wy * scale, wz * scale, step)
    # From the left: w is along the axes of the world, as the rows of `normal_equations` are.
    for i in range(3):
        for j in range(3):
            work[i, j] = (
                step[i, 0] * rotation[0, j]
                + step[i, 1] * rotation[1, j]
                + step[i, 2] * rotation[2, j]
            )
    for i in range(3):
        for j in range(3):
            rotation[i, j] = work[i, j]


@njit(cache=True, nogil=True, error_model="numpy")
def best_turn(s: Float, rotation: Float, work4: Float, vectors4: Float) -> None:
    """Write the rotation (3, 3) with the largest trace of its transpose times s'.

    Horn's closed form with unit quaternions; ``s`` (3, 3) is the sum of ``a b'`` over pairs, and
    the rotation maps a to b. Always proper, even for coplanar points.
    """
    # Horn 1987: for a unit quaternion q = (w, x, y, z) the sum of b . R(q) a is q'Nq with this N;
    # its greatest value is the largest eigenvalue, and R(q) has determinant +1 for every q.
    work4[0, 0] = s[0, 0] + s[1, 1] + s[2, 2]
    work4[1, 1] = s[0, 0] - s[1, 1] - s[2, 2]
    work4[2, 2] = -s[0, 0] + s[1, 1] - s[2, 2]
    work4[3, 3] = -s[0, 0] - s[1, 1] + s[2, 2]
    # The first row is the sum of the cross products a x b: the axis that takes a to b.
    work4[0, 1] = work4[1, 0] = s[1, 2] - s[2, 1]
    work4[0, 2] = work4[2, 0] = s[2, 0] - s[0, 2]
    work4[0, 3] = work4[3, 0] = s[0, 1] - s[1, 0]
    work4[1, 2] = work4[2, 1] = s[0, 1] + s[1, 0]
    work4[1, 3] = work4[3, 1] = s[2, 0] + s[0, 2]
    work4[2, 3] = work4[3, 2] = s[1, 2] + s[2, 1]
    k = largest_eigenvector(work4, vectors4)
    rotation_of(vectors4[0, k], vectors4[1, k], vectors4[2, k], vectors4[3, k], rotation)
