"""Distribution of the points over a feature."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ocmm_core.features.shapes import Fit, NominalFeature
from ocmm_core.geometry import Float, RigidTransform, perpendicular_pair, unit
from ocmm_core.inspection.evaluation._places import across_of
from ocmm_core.inspection.evaluation._view import Coverage
from ocmm_core.measuring import MeasuredPoint

_SECTORS = 8
_WIDEST_GAP_DEG = 150.0
_NARROWEST = 0.15
"""Width relative to length below which points of a plane lie nearly on a line."""
_SHORTEST = 0.5
"""Share of a line's length, or of a radius along an axis, that points should span."""
_CAP_DEG = 60.0
_SAME_GAP = 1e-6
"""Gaps that differ by less than this share of a sector are equal: rounding is 1e-9 of it, the
uncertainty of a touch 1e-4."""


def coverage_of(
    nominal: NominalFeature,
    fit: Fit,
    points: Sequence[MeasuredPoint],
    T_nominal_from_world: RigidTransform | None = None,
) -> Coverage:
    """Return the distribution of the points over a feature.

    Round shapes have sectors about their direction, planes cells, lines stretches; a sphere patches
    of the touched half. Sector edges avoid touches: evenly spread ones fall one in each. If the
    extent of a plane or line and its pose are known, all of it counts; else the area spanned by the
    points. ``fit``: world frame; ``T_nominal_from_world``: None if unknown.
    """
    tips = np.array([point.tip_world for point in points])
    match fit.shape.spec.spread:
        case "point":
            return Coverage(1.0, (True,), "1 of 1 point")
        case "line":
            return _line(nominal, fit, tips, T_nominal_from_world)
        case "plane":
            return _plane(nominal, fit, tips, T_nominal_from_world)
        case "sphere":
            return _sphere(nominal, fit, tips)
        case "turn":
            return _sectors(nominal, fit, tips)


def _coverage(cells: Sequence[bool], kind: str, warning: str, start: float = 0.0) -> Coverage:
    found = tuple(bool(cell) for cell in cells)
    hit = sum(found)
    return Coverage(hit / len(found), found, f"{hit} of {len(found)} {kind}", warning, start)


def _dial(turns: Float, count: int) -> tuple[NDArray[np.bool_], float]:
    """Return which of ``count`` sectors are touched, and the start of the first, rad.

    The edges lie in the middle of the widest gap between the touches, all sectors superposed:
    neither rounding nor an unsteady hand moves one across. Among equally wide gaps, that with the
    fewest touched sectors. `turns`: (n,), rad.
    """
    places = turns / (2.0 * np.pi) * count
    if not places.size:
        return np.zeros(count, dtype=bool), 0.0
    within = np.sort(places % 1.0)
    gaps = np.diff(np.append(within, within[0] + 1.0))
    widest = gaps > gaps.max() - _SAME_GAP
    edges = (within + 0.5 * gaps)[widest]
    cells = np.zeros((len(edges), count), dtype=bool)
    sectors = np.floor(places - edges[:, None]).astype(int) % count
    np.put_along_axis(cells, sectors, values=True, axis=1)
    fewest = int(np.argmin(cells.sum(axis=1)))
    return cells[fewest], float(edges[fewest]) / count * 2.0 * np.pi


def _sectors(nominal: NominalFeature, fit: Fit, tips: Float) -> Coverage:
    count = int(np.clip(nominal.points, 3, _SECTORS))
    first, second = perpendicular_pair(fit.direction)
    arms = tips - fit.point
    turns = np.sort(np.arctan2(arms @ second, arms @ first) % (2.0 * np.pi))
    cells, start = _dial(turns, count)
    gaps = np.diff(np.append(turns, turns[0] + 2.0 * np.pi))
    warning = ""
    if np.degrees(gaps.max()) > _WIDEST_GAP_DEG:
        warning = f"No points over {np.degrees(gaps.max()):.0f}° of the circle. Add one there."
    elif fit.shape.spec.is_long:
        along = float(np.ptp(arms @ fit.direction))
        if along < _SHORTEST * fit.radius:
            warning = f"Points span only {along:.1f} mm of the axis. Probe at two heights."
    return _coverage(list(cells), "sectors", warning, start)


def _sphere(nominal: NominalFeature, fit: Fit, tips: Float) -> Coverage:
    rays = unit(tips - fit.point)
    axis = rays.mean(axis=0)
    axis = unit(axis) if float(np.linalg.norm(axis)) > 1e-6 else unit(np.array(nominal.direction))
    # The pole, and sectors between the pole and the equator.
    heights = rays @ axis
    first, second = perpendicular_pair(axis)
    turns = np.arctan2(rays @ second, rays @ first) % (2.0 * np.pi)
    count = int(np.clip(nominal.points - 1, 3, _SECTORS))
    polar = heights > np.cos(np.radians(30.0))
    sectors, start = _dial(turns[~polar], count)
    cells = [polar.any(), *sectors]
    widest = float(np.degrees(np.arccos(np.clip(heights.min(), -1.0, 1.0))))
    warning = ""
    if widest < _CAP_DEG:
        warning = f"Points span only {widest:.0f}° from their middle. Add some near the equator."
    return _coverage(cells, "patches", warning, start)


def _plane(
    nominal: NominalFeature, fit: Fit, tips: Float, T_nominal_from_world: RigidTransform | None
) -> Coverage:
    sides = 3 if nominal.points >= 9 else 2
    arms = tips - tips.mean(axis=0)
    widths = np.linalg.svd(arms, compute_uv=False)
    narrow = float(widths[1] / max(widths[0], 1e-12))
    known = nominal.length > 0.0 and nominal.width > 0.0 and T_nominal_from_world is not None
    if known and T_nominal_from_world is not None:
        local = T_nominal_from_world.apply(tips) - np.array(nominal.point)
        along = across_of(nominal)
        beside = np.cross(unit(np.array(nominal.direction)), along)
        flat = np.stack([local @ along / nominal.length, local @ beside / nominal.width], axis=1)
    else:
        axes = np.linalg.svd(arms, full_matrices=False)[2][:2]
        flat = arms @ axes.T
        low, high = flat.min(axis=0), flat.max(axis=0)
        flat = (flat - 0.5 * (low + high)) / np.maximum(high - low, 1e-9)
    places = np.clip(((flat + 0.5) * sides).astype(int), 0, sides - 1)
    cells = np.zeros((sides, sides), dtype=bool)
    cells[places[:, 1], places[:, 0]] = True
    warning = ""
    if narrow < _NARROWEST:
        warning = "Points are nearly on one line. Add one beside it."
    elif known and float(np.ptp(flat, axis=0).min()) < _SHORTEST:
        warning = "Points cover little of the plane. Add some near its corners."
    return _coverage(list(cells.ravel()), "cells", warning)


def _line(
    nominal: NominalFeature, fit: Fit, tips: Float, T_nominal_from_world: RigidTransform | None
) -> Coverage:
    count = int(np.clip(nominal.points, 2, 5))
    along = tips @ fit.direction
    length = float(np.ptp(along))
    middle, warning = 0.5 * float(along.min() + along.max()), ""
    if nominal.length > 0.0 and T_nominal_from_world is not None:
        there = T_nominal_from_world.inverse().apply(np.array(nominal.point))
        middle = float(there @ fit.direction)
        if length < _SHORTEST * nominal.length:
            warning = (
                f"Points span {length:.1f} of {nominal.length:.1f} mm. Add some near the ends."
            )
        length = nominal.length
    places = ((along - middle) / max(length, 1e-9) + 0.5) * count
    cells = np.zeros(count, dtype=bool)
    cells[np.clip(places.astype(int), 0, count - 1)] = True
    return _coverage(list(cells), "stretches", warning)
