"""Trial axes of a cold start, and their perpendicular directions."""

from __future__ import annotations

import numpy as np

from ocmm_core.features.search._common import principal_axes
from ocmm_core.geometry import Float

TRIAL_AXES = 80
"""Over the hemisphere; more lie around the principal axes of the points."""
MANY_AXES = 300
"""The same if the quick search is inconclusive."""
FEW_AXES = 24
"""The same if the result can be certified, with a full search as fallback."""
NEAREST = 2
"""Number of quadrics per weighting."""
RIDGE = 1e-14
"""Relative to the trace of a matrix: keeps it invertible for points on a simpler surface."""
RINGS = np.deg2rad([1.5, 4.0, 10.0])
"""Angles around an axis; a narrow arc of a long cylinder has a narrow basin there."""


def trial_axes(points: Float) -> Float:
    """Return trial axes (m, 3): principal ones, rings around them, and a hemisphere."""
    principal = principal_axes(points - points.mean(axis=0))[1]
    rings = [_ring(principal, k, RINGS) for k in range(3)]
    return np.concatenate([principal, *rings, _hemisphere(TRIAL_AXES)])


def many_axes(points: Float) -> Float:
    """Return `trial_axes` with a finer hemisphere, and the axes of quadrics, (m, 3)."""
    principal = principal_axes(points - points.mean(axis=0))[1]
    rings = [_ring(principal, k, RINGS) for k in range(3)]
    return np.concatenate([quadric_axes(points), principal, *rings, _hemisphere(MANY_AXES)])


def few_axes(points: Float) -> Float:
    """Return the principal axes of the points and a coarse hemisphere, (m, 3)."""
    principal = principal_axes(points - points.mean(axis=0))[1]
    return np.concatenate([principal, _hemisphere(FEW_AXES)])


def _ring(principal: Float, k: int, tilts: Float) -> Float:
    """Return eight axes at every tilt around the principal axis ``k``, (8 t, 3)."""
    turns = np.arange(8) * np.pi / 4.0
    side = np.outer(np.cos(turns), principal[k - 1]) + np.outer(np.sin(turns), principal[k - 2])
    return np.concatenate([np.cos(t) * principal[k] + np.sin(t) * side for t in tilts])


def quadric_axes(points: Float) -> Float:
    """Return the principal axes (12, 3) of the quadrics nearest to ``points``.

    Cylinder and cone are quadrics: at small noise one of these axes is theirs, even for points on a
    curve. Nearest in the algebraic sense, and with the weight of G. Taubin (IEEE PAMI 13, 1991);
    the two nearest of each, as few points leave a choice.
    """
    x, y, z = points.T
    one, zero = np.ones(len(points)), np.zeros(len(points))
    linear = np.stack([x, y, z])
    products = np.stack([y * z, x * z, x * y])
    columns = np.concatenate([linear**2, products, linear, one[None]])
    jacobian = np.stack(
        [
            [2.0 * x, zero, zero, zero, z, y, one, zero, zero],
            [zero, 2.0 * y, zero, z, zero, x, zero, one, zero],
            [zero, zero, 2.0 * z, y, x, zero, zero, zero, one],
        ]
    )
    algebraic = np.linalg.svd(columns.T, full_matrices=True)[2][: -NEAREST - 1 : -1]
    varying = columns[:9] - columns[:9].mean(axis=1, keepdims=True)
    weight = np.einsum("dip,djp->ij", jacobian, jacobian)
    weight += RIDGE * np.trace(weight) * np.eye(9)
    half = np.linalg.inv(np.linalg.cholesky(weight))
    nearest = np.linalg.svd(half @ varying, full_matrices=True)[0][:, : -NEAREST - 1 : -1]
    weighed = nearest.T @ half
    found = []
    for c in (*algebraic, *weighed):
        matrix = np.diag(c[:3])
        matrix[[1, 0, 0], [2, 2, 1]] = matrix[[2, 2, 1], [1, 0, 0]] = 0.5 * c[3:6]
        found.append(np.linalg.eigh(matrix)[1].T)
    return np.concatenate(found)


def across_axes(axis: Float) -> tuple[Float, Float]:
    """Return two unit vectors (..., 3) square to ``axis`` (..., 3) and to each other.

    The form of T. Duff and others, Building an orthonormal basis, revisited, JCGT 6 (2017): without
    branches, hence vectorised over axes.
    """
    x, y, z = axis[..., 0], axis[..., 1], axis[..., 2]
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    first = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=-1)
    second = np.stack([b, sign + y * y * a, -y], axis=-1)
    return first, second


def _hemisphere(count: int) -> Float:
    """Return directions (count, 3) spread evenly over a hemisphere (Fibonacci spiral)."""
    index = np.arange(count) + 0.5
    height = index / count
    turn = np.pi * (1.0 + np.sqrt(5.0)) * index
    ring = np.sqrt(1.0 - height**2)
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1)
