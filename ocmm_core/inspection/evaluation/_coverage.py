"""Touch points on the nominal surface, and the distribution of the points over a feature.

One function for each kind of surface, in the frame of the plan's nominals. A feature's ``point`` is
the middle of the touched region: of the length of a line, cylinder or cone, of the area of a plane.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocmm_core.features.shapes import Fit, NominalFeature
from ocmm_core.geometry import Float, RigidTransform, perpendicular_pair, unit
from ocmm_core.inspection.evaluation._view import Coverage
from ocmm_core.measuring import MeasuredPoint

EDGE = 0.06
"""Margin of touches to the ends, as a share of the length."""
LEVELS = 0.3
"""Distance of the levels around an axis from its middle, as a share of the length."""
_MANY = 12
"""Points from which three levels are touched instead of two."""
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))


@dataclass(frozen=True, slots=True)
class Places:
    points: Float
    """(n, 3), mm, on the surface; empty if the plan has no size of the feature."""
    normals: Float
    """(n, 3), unit, from the material to the probe; zero for a line, whose face is unknown."""


NOWHERE = Places(np.empty((0, 3)), np.empty((0, 3)))


def spread(count: int) -> Float:
    """Return ``count`` places from -0.5 to 0.5, away from the ends."""
    return np.linspace(EDGE - 0.5, 0.5 - EDGE, count) if count > 1 else np.zeros(1)


def across_of(nominal: NominalFeature) -> Float:
    """Return the direction of the length, (3,), unit, perpendicular to that of the feature."""
    axis = unit(np.array(nominal.direction))
    across = np.array(nominal.across) - (axis @ np.array(nominal.across)) * axis
    return perpendicular_pair(axis)[0] if float(np.linalg.norm(across)) < 1e-6 else unit(across)


def at_point(
    nominal: NominalFeature, centre: Float, axis: Float, sign: float, count: int
) -> Places:
    return Places(np.tile(centre, (count, 1)), np.tile(axis, (count, 1)))


def along_line(
    nominal: NominalFeature, centre: Float, axis: Float, sign: float, count: int
) -> Places:
    if nominal.length <= 0.0:
        return NOWHERE
    along = spread(count) * nominal.length
    return Places(centre + along[:, None] * axis, np.zeros((count, 3)))


def on_plane(
    nominal: NominalFeature, centre: Float, axis: Float, sign: float, count: int
) -> Places:
    """Return places in rows over the rectangle of a plane."""
    if nominal.length <= 0.0 or nominal.width <= 0.0:
        return NOWHERE
    along = across_of(nominal)
    columns = int(np.clip(round(np.sqrt(count * nominal.length / nominal.width)), 1, count))
    if count > 3:
        # Three in a row do not determine a plane.
        columns = int(np.clip(columns, 2, count - 2))
    rows = -(-count // columns)
    points = []
    for row, v in enumerate(spread(rows)):
        here = min(columns, count - row * columns)
        line = spread(here) if here > 1 else np.array([0.0 if rows == 1 else 0.5 - EDGE])
        line = line[::-1] if row % 2 else line
        points += [
            centre + u * nominal.length * along + v * nominal.width * np.cross(axis, along)
            for u in line
        ]
    return Places(np.array(points), np.tile(axis, (count, 1)))


def _turns(count: int, offset: float = 0.0) -> Float:
    return 2.0 * np.pi * (np.arange(count) + offset) / max(count, 1)


def radial(first: Float, second: Float, turns: Float) -> Float:
    return np.cos(turns)[:, None] * first + np.sin(turns)[:, None] * second


def around_axis(
    nominal: NominalFeature, centre: Float, axis: Float, sign: float, count: int
) -> Places:
    """Return places around a circle, or on several levels around a cylinder or cone."""
    first, second = perpendicular_pair(axis)
    levels = np.zeros(1)
    if not nominal.shape.spec.is_flat and nominal.length > 0.0:
        levels = (
            LEVELS
            * nominal.length
            * (np.array([-1.0, 1.0]) if count < _MANY else np.array([-1.0, 0.0, 1.0]))
        )
    half = np.radians(0.5 * nominal.angle_deg)
    points, normals = [], []
    shares = [len(part) for part in np.array_split(np.arange(count), len(levels))]
    for number, (level, share) in enumerate(zip(levels, shares, strict=True)):
        around = radial(first, second, _turns(share, 0.5 * (number % 2)))
        radius = 0.5 * nominal.diameter + level * np.tan(half)
        points.append(centre + level * axis + radius * around)
        normals.append(sign * (np.cos(half) * around - np.sin(half) * axis))
    return Places(np.concatenate(points), np.concatenate(normals))


def on_cap(nominal: NominalFeature, centre: Float, axis: Float, sign: float, count: int) -> Places:
    """Return places over the hemisphere about the sphere's direction."""
    normals = _cap(axis, count)
    return Places(centre + sign * 0.5 * nominal.diameter * normals, normals)


def _cap(axis: Float, count: int) -> Float:
    """Return directions over the hemisphere about ``axis``, by the golden angle."""
    first, second = perpendicular_pair(axis)
    heights = 1.0 - (np.arange(count) + 0.5) / count if count > 1 else np.ones(1)
    # The first one is the pole, the easiest to find.
    heights = heights + (1.0 - heights[0]) * np.linspace(1.0, 0.0, count)
    rings = np.sqrt(np.maximum(1.0 - heights**2, 0.0))
    cap: Float = heights[:, None] * axis + rings[:, None] * radial(
        first, second, _GOLDEN * np.arange(count)
    )
    return cap


def on_torus(
    nominal: NominalFeature, centre: Float, axis: Float, sign: float, count: int
) -> Places:
    around = radial(*perpendicular_pair(axis), _turns(count))
    tilt = np.radians(60.0) * (np.arange(count) % 3 - 1.0)
    normals = np.cos(tilt)[:, None] * axis + np.sin(tilt)[:, None] * around
    ring = centre + 0.5 * nominal.diameter * around
    return Places(ring + sign * 0.5 * nominal.width * normals, normals)


def _on_outline(
    flat: tuple[Float, Float], nominal: NominalFeature, centre: Float, axis: Float, sign: float
) -> Places:
    along = across_of(nominal)
    points, normals = flat
    basis = np.stack([along, np.cross(axis, along)])
    return Places(centre + points @ basis, sign * (normals @ basis))


def on_ellipse(
    nominal: NominalFeature, centre: Float, axis: Float, sign: float, count: int
) -> Places:
    flat = _ellipse(0.5 * nominal.length, 0.5 * nominal.width, count)
    return _on_outline(flat, nominal, centre, axis, sign)


def on_round_slot(
    nominal: NominalFeature, centre: Float, axis: Float, sign: float, count: int
) -> Places:
    flat = _round_slot(0.5 * nominal.length, 0.5 * nominal.width, count)
    return _on_outline(flat, nominal, centre, axis, sign)


def on_rectangle(
    nominal: NominalFeature, centre: Float, axis: Float, sign: float, count: int
) -> Places:
    flat = _rectangle(0.5 * nominal.length, 0.5 * nominal.width, count)
    return _on_outline(flat, nominal, centre, axis, sign)


def _ellipse(a: float, b: float, count: int) -> tuple[Float, Float]:
    turns = _turns(count)
    points = np.stack([a * np.cos(turns), b * np.sin(turns)], axis=1)
    return points, unit(np.stack([b * np.cos(turns), a * np.sin(turns)], axis=1))


def _rectangle(a: float, b: float, count: int) -> tuple[Float, Float]:
    # Both ends get one point each, the long sides the others, away from the corners.
    ends = 2 if count < 8 else 2 * max(1, round(count * b / (2.0 * (a + b))))
    sides = count - ends
    points, normals = [], []
    for share, size, other, turned in (
        (sides - sides // 2, a, b, False), (ends // 2, b, a, True),
        (sides // 2, -a, -b, False), (ends - ends // 2, -b, -a, True),
    ):  # fmt: skip
        for step in 2.0 * 0.8 * spread(share) if share else ():
            place, normal = (size * step, other), (0.0, float(np.sign(other)))
            points.append(place[::-1] if turned else place)
            normals.append(normal[::-1] if turned else normal)
    return np.array(points), np.array(normals)


def _round_slot(a: float, b: float, count: int) -> tuple[Float, Float]:
    straight = max(a - b, 0.0)
    around = 4.0 * straight + 2.0 * np.pi * b
    points, normals = [], []
    for step in around * (np.arange(count) + 0.5) / count:
        side, rest = divmod(step, 2.0 * straight + np.pi * b)
        turn = -1.0 if side else 1.0
        if rest < 2.0 * straight:
            place, normal = (straight - rest, b), (0.0, 1.0)
        else:
            angle = 0.5 * np.pi + (rest - 2.0 * straight) / max(b, 1e-9)
            normal = (float(np.cos(angle)), float(np.sin(angle)))
            place = (-straight + b * normal[0], b * normal[1])
        points.append((turn * place[0], turn * place[1]))
        normals.append((turn * normal[0], turn * normal[1]))
    return np.array(points), np.array(normals)


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
        flat = arms @ np.linalg.svd(arms, full_matrices=False)[2][:2].T
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
