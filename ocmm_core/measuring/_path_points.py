"""Points along the path of a sliding ball, and the parts of it without contact.

Stations at equal distances along the path become points; each averages the frames of some tenths
of a millimetre. A ball that hops leaves a short bump on the outer side of the path, which is left
out and counted. A longer one may be a lifted ball or the surface itself: no filter decides that.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from ocmm_core.geometry import Float, Int
from ocmm_core.measuring._path import TICK_S, Ticks
from ocmm_core.measuring._point import FASTEST_MM_S
from ocmm_core.measuring._stable_point import StablePoint, mean_rotation

_WINDOW_MM = 0.3
"""Length of path that is averaged to a point: its sagitta is 0.1 µm to 2 µm."""
_HOP_MM = 0.02
"""Height above its neighbours from which a ball is without contact, if beyond the noise."""
_LIFT_MM = 0.03
"""The same above the whole path, if beyond its form."""
MOST_POINTS = 2000
"""Of one path: a longer one has them a multiple of the spacing apart."""
_LONGEST_STRAIGHT = 10
"""Multiple of the spacing after which a straight path has a point as well."""
_LEAST_CHORD_MM = 0.2
"""A shorter piece of path shows no direction."""
_SMOOTH, _REACH, _FLANK = 9, 25, 2
"""Ticks: of the moving average, of a parabola to each side, and next to a hop."""
_NEAR_MM, _OUTSIDE = 3.0, 0.02
_OUTLYING = 7.5
"""Multiple of the median deviation, 5 sigma of normal ones."""
_LONGEST_HOP_S = 0.06
_MOST_UNTIMED_MM = 0.01
_MOST_TICKS = 400
"""On each side of a point, if the ball stops."""


def spaced(path: Float, spacing: float) -> tuple[Int, Int]:
    """Return the indices along a path (n, 3) at least ``spacing`` apart, and the last one to each.

    The second is (n,): places among the first.
    """
    chosen = thinned(path, np.zeros(len(path)), Thinning(spacing))[0]
    return chosen, np.searchsorted(chosen, np.arange(len(path)), side="right") - 1


@dataclass(frozen=True, slots=True)
class Thinning:
    """Which places along a path become points."""

    spacing: float
    """mm: least distance from the last point; with ``gates`` that of the planes."""
    interval_s: float = 0.0
    """Least time since the last point."""
    turn: float = 0.0
    """rad: change of direction since the last point; a straight path has points farther apart."""
    gates: Float | None = None
    """(3,), unit, world: normal of parallel planes; the first crossing of each gives a point."""
    start: Float = field(default_factory=lambda: np.zeros(3))
    """(3,), mm, world: on one of the planes."""


def thinned(path: Float, time_s: Float, rule: Thinning) -> tuple[Int, float]:
    """Return the indices of a path (n, 3), mm, that become points, and the way against gates."""
    if rule.gates is not None:
        along = (path - rule.start) @ rule.gates
        passed = np.floor(np.maximum.accumulate(along) / rule.spacing)
        # Behind a part without contact the ball may be far beyond the plane.
        on = along - passed * rule.spacing < _WINDOW_MM
        crossed = np.flatnonzero((np.diff(passed, prepend=passed[0]) > 0.0) & on)
        return crossed, float(-np.minimum(np.diff(along[:: 2 * _SMOOTH]), 0.0).sum())
    ahead = np.minimum(np.arange(len(path)) + _REACH, len(path) - 1)
    ways = path[ahead] - path[np.maximum(np.arange(len(path)) - _REACH, 0)]
    lengths = np.linalg.norm(ways, axis=1)
    ways = np.where(lengths[:, None] < _LEAST_CHORD_MM, 0.0, ways) / lengths.clip(1e-9)[:, None]
    chosen = [0]
    for index in range(1, len(path)):
        last = chosen[-1]
        away = float(np.linalg.norm(path[index] - path[last]))
        if away < rule.spacing or time_s[index] - time_s[last] < rule.interval_s:
            continue
        straight = not np.any(ways[index]) or ways[index] @ ways[last] > np.cos(rule.turn)
        if not (rule.turn and straight and away < _LONGEST_STRAIGHT * rule.spacing):
            chosen.append(index)
    return np.array(chosen), 0.0


def transported(path_world: Float, normal_world: Float, spacing: float) -> Float:
    """Return the normals (n, 3) along a path (n, 3), mm, from the one at its start, (3,).

    Each is the former one less its part along the path: on a plane it stays, around a bore or
    shaft it turns with the surface.
    """
    chosen, last = spaced(path_world, spacing)
    normals = [normal_world]
    for step in np.diff(path_world[chosen], axis=0):
        turned = normals[-1] - (normals[-1] @ step) / (step @ step) * step
        normals.append(turned / max(float(np.linalg.norm(turned)), 1e-9))
    return np.array(normals)[last]


def _hops(ticks: Ticks, normals: Float) -> NDArray[np.bool_]:
    """Return the ticks (n,) in which the ball is above a path through its neighbours."""
    sigma = np.sqrt(np.einsum("ni,nij,nj->n", normals, ticks.covariance, normals))
    high = _heights(ticks.tip_world, normals) > np.maximum(5.0 * sigma, _HOP_MM)
    return np.asarray(scipy.ndimage.binary_dilation(high, iterations=_FLANK))


def _heights(path: Float, normals: Float) -> Float:
    """Return the height of each tick (n,), mm, above a parabola through its neighbours.

    Neighbours far above it count little, so that it is the lower envelope.
    """
    n = len(path)
    count = min(2 * _REACH + 1, n)
    first = np.clip(np.arange(n) - _REACH, 0, n - count)
    found = np.empty(n)
    for part in np.array_split(np.arange(n), max(n // 2048, 1)):
        near = first[part, None] + np.arange(count)
        arms = path[near] - path[part][:, None]
        h = np.einsum("nki,ni->nk", arms, normals[part])
        flat = arms - h[:, :, None] * normals[part][:, None]
        ways = flat[np.arange(len(part)), -1] - flat[np.arange(len(part)), 0]
        ways /= np.maximum(np.linalg.norm(ways, axis=1), 1e-9)[:, None]
        d = np.einsum("nki,ni->nk", flat, ways)
        rows = np.stack([np.ones_like(d), d, d**2], axis=2)
        weights = (np.linalg.norm(flat, axis=2) < _NEAR_MM).astype(np.float64)
        ridge = 1e-9 * np.eye(3)
        for _ in range(4):
            weighted = rows * weights[:, :, None]
            normal = weighted.transpose(0, 2, 1) @ rows + ridge
            fit = np.linalg.solve(normal, np.einsum("nkj,nk->nj", weighted, h)[:, :, None])
            left = h - (rows @ fit)[:, :, 0]
            spread = 1.5 * np.median(abs(left), axis=1)[:, None]
            weights = np.where(left > 2.5 * spread, _OUTSIDE, 1.0) * (weights > 0.0)
        found[part] = -fit[:, 0, 0]
    return found


@dataclass(frozen=True, slots=True)
class PathSurface:
    """Surface under each tick of a path."""

    normals: Float
    """(n, 3), unit, world: from the material towards the probe."""
    heights: Float
    """(n,), mm: of the ball above an element through the whole path."""


@dataclass(frozen=True, slots=True)
class PathPoints:
    """Points along a path, before they belong to a feature."""

    stations: list[StablePoint]
    normals: Float
    """(n, 3), unit, world, of each: from the material towards the probe."""
    lifted_ms: float
    fast_ms: float
    """`lifted_ms`, `fast_ms`: time without points, as without contact or too fast."""
    length_mm: float
    raised_mm: float
    """Height, mm, of a part of the path that may be the surface or a lifted ball; 0 without one."""
    back_mm: float = 0.0
    """Length of path against the direction of the gates, without points."""


def points_along(
    ticks: Ticks, surface: PathSurface, rule: Thinning, exposure_s: float = 0.0
) -> PathPoints:
    """Return points along a path on a surface.

    ``exposure_s``: largest error of the exposure times.
    """
    normals = surface.normals
    line = scipy.ndimage.uniform_filter1d(ticks.tip_world, _SMOOTH, axis=0, mode="nearest")
    lifted = _hops(ticks, normals)
    above = surface.heights - np.median(surface.heights)
    high = above > max(_LIFT_MM, _OUTLYING * float(np.median(abs(above))))
    raised = 0.0
    parts, _ = scipy.ndimage.label(scipy.ndimage.binary_dilation(high, iterations=_FLANK))
    for (part,) in scipy.ndimage.find_objects(parts):
        first, end = part.start, part.stop
        lasted = float(ticks.time_s[end - 1] - ticks.time_s[first])
        # Pressed before the contact, or released after it; anything else may be the surface.
        if first > 0 and end < len(ticks) and lasted > _LONGEST_HOP_S:
            raised = max(raised, float(above[first:end].max()))
        lifted[first:end] = True
    ahead = np.minimum(np.arange(len(ticks)) + _SMOOTH // 2, len(ticks) - 1)
    behind = np.maximum(np.arange(len(ticks)) - _SMOOTH // 2, 0)
    seconds = np.maximum(ticks.time_s[ahead] - ticks.time_s[behind], 1e-9)
    speed = np.linalg.norm(line[ahead] - line[behind], axis=1) / seconds
    # Rays at 10 degrees to each other cross eleven times as far away.
    untimed = 11.0 * exposure_s * speed
    fast = ((speed > FASTEST_MM_S) | (untimed > _MOST_UNTIMED_MM)) & ~lifted
    usable = ~(lifted | fast)
    whole = float(np.linalg.norm(np.diff(line[:: 2 * _SMOOTH], axis=0), axis=1).sum())
    places = np.flatnonzero(usable)
    back = 0.0
    if len(places):
        times = max(np.ceil(whole / MOST_POINTS / rule.spacing), 1.0)
        rule = replace(rule, spacing=times * rule.spacing)
        kept, back = thinned(line[places], ticks.time_s[places], rule)
        places = places[kept]
    windows = [_window(line, usable, index, 0.5 * _WINDOW_MM) for index in places.tolist()]
    return PathPoints(
        [
            _station(ticks, line, *window, normals[index], float(untimed[index]))
            for index, window in zip(places, windows, strict=True)
        ],
        normals[places],
        1e3 * TICK_S * float(lifted.sum()),
        1e3 * TICK_S * float(fast.sum()),
        float(np.linalg.norm(np.diff(line[places], axis=0), axis=1).sum()),
        raised,
        back,
    )


def _window(line: Float, usable: NDArray[np.bool_], index: int, reach: float) -> tuple[int, int]:
    """Return first and end of the consecutive usable ticks within ``reach``, mm, of one."""
    start = max(index - _MOST_TICKS, 0)
    some = slice(start, index + _MOST_TICKS)
    near = usable[some] & (np.linalg.norm(line[some] - line[index], axis=1) <= reach)
    here = index - start
    before, after = np.flatnonzero(~near[:here]), np.flatnonzero(~near[here:])
    first = int(before[-1]) + 1 if len(before) else 0
    return start + first, index + int(after[0]) if len(after) else start + len(near)


def _station(
    ticks: Ticks, line: Float, first: int, stop: int, normal: Float, untimed_mm: float
) -> StablePoint:
    part = slice(first, stop)
    counts = ticks.n_frames[part].astype(np.float64)
    share = counts / counts.sum()

    def mean(values: Float) -> Float:
        return np.asarray(np.tensordot(share, values[part], axes=1))

    covariance = np.tensordot(share**2, ticks.covariance[part], axes=1)
    bend = _bend(line[part], normal, share) if stop - first > _SMOOTH else 0.0
    motion = bend**2 * np.outer(normal, normal) + np.eye(3) * (untimed_mm**2 / 3.0)
    reference = ticks.reference_spots
    return StablePoint(
        time_s=float(mean(ticks.time_s)),
        first_frame=int(ticks.first_frame[first]),
        last_frame=int(ticks.last_frame[stop - 1]),
        n_frames=int(counts.sum()),
        tip_world=mean(ticks.tip_world) + bend * normal,
        random_covariance=covariance + motion,
        motion_covariance=motion,
        rotation_world_from_probe=mean_rotation(ticks.rotation_world_from_probe[part]),
        spots=mean(ticks.spots),
        chi2_per_dof=float(mean(ticks.chi2_per_dof)),
        tip_rig=mean(ticks.tip_rig),
        reference_spots=None if reference is None else mean(reference),
    )


def _bend(piece: Float, normal: Float, share: Float) -> float:
    """Return how far, mm, a bent piece of a path is above its average, along the normal.

    Of a parabola over its chord L with sagitta s: ``4 s / L^2`` times the variance of the places
    along it, s / 3 at even speed. ``share``: weights (n,) of the average. Components along the
    surface do not matter: they lead to another place of it.
    """
    arms, chord = piece - piece[0], piece[-1] - piece[0]
    # Of 1; a path that turns back has hardly a chord.
    along = arms @ chord / max(float(chord @ chord), 1e-6)
    variance = float(share @ (along - share @ along) ** 2)
    middle = (len(piece) - 1) // 2
    height = float((arms[middle] - along[middle] * chord) @ normal)
    sagitta = height / max(4.0 * along[middle] * (1.0 - along[middle]), 0.5)
    return float(sagitta * min(4.0 * variance, 1.0 / 3.0))
