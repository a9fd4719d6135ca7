"""Common part of the fits: checked points, centring, orientation of directions."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.search._point_kernel import centre, principal
from ocmm_core.features.shapes import MINIMUM_POINTS, Shape
from ocmm_core.geometry import Float, Points3

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
