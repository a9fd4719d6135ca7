"""Common part of the fits: checked points, centring, orientation of directions, first starts.

Starts are trial axes with their perpendicular directions, and, independent of these, the
second-order patch nearest to points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import isfinite

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.search._point_kernel import centre, principal
from ocmm_core.features.shapes import MINIMUM_POINTS, Shape
from ocmm_core.geometry import Float, Points3, spiral

FLAT = 1e-6
"""Relative extent below which points count as flat, in a line or coincident."""

SMALLEST_EXTENT = 1e-6
"""mm: points closer together count as one point."""


def checked_points(shape: Shape, points: Points3) -> Points3:
    """Return ``points`` as float64 (n, 3) after the checks common to all shapes.

    FitError for a wrong form, too few points, a masked coordinate, or one that is not finite.
    """
    word = shape.value.lower()
    refuse_masked(word, points)
    array = np.ascontiguousarray(points, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise FitError(
            "fit.not_points",
            f"The points of a {word} have the shape {array.shape}, not (n, 3).",
            "Give one row with x, y and z for every point.",
        )
    flat = array.ravel()
    # One sum for all; the faulty point is only searched if it is not finite.
    if not isfinite(np.dot(flat, flat)) and not np.isfinite(array).all():
        bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
        raise FitError(
            "fit.not_finite",
            f"Point {bad[0] + 1} of {len(array)} of a {word} has a coordinate that is not a "
            "finite number.",
            "Remove that point or take it again.",
        )
    if len(array) < MINIMUM_POINTS[shape]:
        raise FitError(
            "fit.too_few_points",
            f"{shape.value}: needs at least {MINIMUM_POINTS[shape]} points ({len(array)} given).",
            "Take more points.",
        )
    return array


def refuse_masked(word: str, points: Points3 | Sequence[Float]) -> None:
    """Raise FitError if a coordinate is masked: conversion would use the hidden value."""
    rows = (points,) if isinstance(points, np.ndarray) else points
    if not any(isinstance(row, np.ma.MaskedArray) and np.ma.is_masked(row) for row in rows):
        return
    mask = np.array([np.ma.getmaskarray(row) for row in points])
    masked = np.asarray(mask.reshape(len(mask), -1).any(axis=1))
    raise FitError(
        "fit.masked",
        f"{int(masked.sum())} of {len(masked)} points of a {word} are masked; the first one is "
        f"point {int(np.argmax(masked)) + 1}.",
        "Leave out these points (points[~mask.any(axis=1)]), or remove the mask if they count.",
    )


def centred(shape: Shape, points: Points3) -> tuple[Float, Float, float]:
    """Return centroid (3,), scaled points about it (n, 3), and the scale in mm.

    The scale is the root mean squared distance from the centroid: fits then work on numbers near
    one, for features of any place and size. Raises FitError if the points coincide.
    """
    centroid, about = np.empty(points.shape[1]), np.empty_like(points)
    size = float(centre(points, centroid, about))
    if size < SMALLEST_EXTENT:
        raise FitError(
            "fit.coincident",
            f"The {len(points)} points of a {shape.value.lower()} coincide.",
            "Take the points apart from each other.",
        )
    return centroid, about, size


def principal_axes(about: Float) -> tuple[Float, Float]:
    """Return singular values (3,), greatest first, and axes (3, 3), by rows, of points."""
    extents, axes = np.empty(3), np.empty((3, 3))
    principal(about, extents, axes)
    return extents, axes


def centred_solid(shape: Shape, points: Points3, flat: FitError) -> tuple[Float, Float, float]:
    """Return the result of `centred`; raise ``flat`` for points in a plane or on a line."""
    centroid, about, size = centred(shape, points)
    extents, _ = principal_axes(about)
    if extents[2] < FLAT * extents[0]:
        raise flat
    return centroid, about, size


def oriented(direction: Float, hint: Float | None) -> Float:
    """Return ``direction`` signed along ``hint``, else largest component positive."""
    if hint is not None:
        along = float(np.dot(direction, hint))
        if along != 0.0:
            return direction if along > 0.0 else -direction
    largest = int(np.argmax(np.abs(direction)))
    return direction if direction[largest] > 0.0 else -direction


def degenerate(shape: Shape, why: str, remedy: str) -> FitError:
    """Return the error for points that do not determine ``shape``."""
    return FitError(
        "fit.degenerate", f"The points do not determine a {shape.value.lower()}: {why}.", remedy
    )


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
    return np.concatenate([principal, _rings(principal), _hemisphere(TRIAL_AXES)])


def many_axes(points: Float) -> Float:
    """Return `trial_axes` with a finer hemisphere, (m, 3)."""
    principal = principal_axes(points - points.mean(axis=0))[1]
    return np.concatenate([principal, _rings(principal), _hemisphere(MANY_AXES)])


def few_axes(points: Float) -> Float:
    """Return the principal axes of the points and a coarse hemisphere, (m, 3)."""
    principal = principal_axes(points - points.mean(axis=0))[1]
    return np.concatenate([principal, _hemisphere(FEW_AXES)])


def _rings(principal: Float) -> Float:
    """Return eight axes at every tilt of `RINGS` around each principal axis, (m, 3)."""
    turns, tilts = np.arange(8)[:, None] * np.pi / 4.0, RINGS[:, None, None]
    first, second = principal[[2, 0, 1], None], principal[[1, 2, 0], None]
    side = np.cos(turns) * first + np.sin(turns) * second
    rings: Float = np.cos(tilts) * principal[:, None, None] + np.sin(tilts) * side[:, None]
    return rings.reshape(-1, 3)


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
    # Only the null space of few points needs them.
    few = len(points) < len(columns)
    algebraic = np.linalg.svd(columns.T, full_matrices=few)[2][: -NEAREST - 1 : -1]
    varying = columns[:9] - columns[:9].mean(axis=1, keepdims=True)
    weight = np.einsum("dip,djp->ij", jacobian, jacobian)
    weight += RIDGE * np.trace(weight) * np.eye(9)
    half = np.linalg.inv(np.linalg.cholesky(weight))
    nearest = np.linalg.svd(half @ varying, full_matrices=few)[0][:, : -NEAREST - 1 : -1]
    weighed = nearest.T @ half
    c = np.concatenate([algebraic[:, :6], weighed[:, :6]])
    c[:, 3:] *= 0.5
    matrices = c[:, [0, 5, 4, 5, 1, 3, 4, 3, 2]].reshape(-1, 3, 3)
    return np.linalg.eigh(matrices)[1].swapaxes(1, 2).reshape(-1, 3)


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


@cache
def _hemisphere(count: int) -> Float:
    """Return directions (count, 3) spread evenly over a hemisphere."""
    return spiral((np.arange(count) + 0.5) / count)


RANK = 1e-10
"""Relative singular value below which a term is undetermined and set to zero."""


@dataclass(frozen=True, slots=True)
class Patch:
    """A bent patch."""

    foot: Float
    normal: Float
    """`foot`, `normal`: (3,) and (3,), unit: foot of the middle of the points, and normal there."""
    curvatures: Float
    """(2,): principal curvatures, positive towards the normal."""
    directions: Float
    """(2, 3), unit: of these."""


def curved_patch(points: Float) -> Patch:
    """Return the patch of centred and scaled points (n, 3), as a height above their plane."""
    _, axes = principal_axes(np.ascontiguousarray(points))
    x, y, height = (points @ axes.T).T
    columns = np.stack([np.ones_like(x), x, y, 0.5 * x * x, x * y, 0.5 * y * y], axis=1)
    c = np.linalg.lstsq(columns, height, rcond=RANK)[0]
    # First and second fundamental form of z(x, y) above the middle.
    steep = np.sqrt(1.0 + c[1] ** 2 + c[2] ** 2)
    first = np.array([[1.0 + c[1] ** 2, c[1] * c[2]], [c[1] * c[2], 1.0 + c[2] ** 2]])
    second = np.array([[c[3], c[4]], [c[4], c[5]]]) / steep
    half = np.linalg.inv(np.linalg.cholesky(first))
    curvatures, turned = np.linalg.eigh(half @ second @ half.T)
    flat = (half.T @ turned).T
    jacobian = np.column_stack([flat, flat @ c[1:3]])
    directions = jacobian @ axes
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    normal = np.array([-c[1], -c[2], 1.0]) / steep
    return Patch(c[0] * axes[2], normal @ axes, curvatures, directions)
