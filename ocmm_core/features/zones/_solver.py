"""Find the narrowest zone from one start, and the best over many starts.

A linear step within a trust region identifies the contact points (`_kernel`); a Newton step on
these contacts, including curvature, converges quadratically. Method: R. Fletcher and E. Sainz de la
Maza, Mathematical Programming 43 (1989); for geometry in coordinate metrology D. Hutzschenreuter
and others, J. Sens. Sens. Syst. 7 (2018) reach 1e-14 with a similar one. For many points only those
near the bounds are used, until the result holds for all.

Distances curve, so a zone may have several local minima, whose widths differ by about the width
squared over the radius. The starts are at elements with residuals larger by about the zone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ocmm_core.features.zones._distance_kernel import FIRST_SIZE, TURN
from ocmm_core.features.zones._settle_kernel import CLOSE, SETTLED, newton_step, settle_zone
from ocmm_core.features.zones._surfaces import (
    ANGLES,
    DistanceKind,
    ElementFamily,
    ElementPose,
    distances,
    full_step,
    possible,
)
from ocmm_core.geometry import Float, Int

MAX_STEPS = 200
FEWER_STEPS = 40
"""For further starts; most settle within fifteen."""
ALL_POINTS, NEAREST, FURTHER, EXCHANGES = 150, 40, 10, 20
"""Number of points that are all used. Above it: number nearest to either bound, number of further
ones if these do not hold the zone of all, and number of rounds.
"""
LARGEST_LEAN = 0.7
"""Limit of a step's tilt of the axis and opening of a cone; for lengths, twice the size."""
NEARLY_FLAT = 1e-4
"""Effect of a direction, relative to the strongest, below which steps in it do not grow further."""


@dataclass(frozen=True, slots=True)
class Zone:
    """An element with the bounds of its zone; centred and scaled."""

    placed: ElementPose
    upper: float
    lower: float
    """`upper`, `lower`: Greatest and smallest distance (with the sign of the surface); ``lower`` is
    zero for zones without a lower bound and symmetric zones, whose ``upper`` is half the width.
    Infinite if no such element exists."""
    settled: bool
    """Converged: no step improves the zone to first order."""

    @property
    def width(self) -> float:
        """Return the minimised quantity."""
        return self.upper - self.lower


def zone_at(surface: ElementFamily, points: Float, placed: ElementPose) -> Zone:
    """Return the zone of ``points`` (n, 3) about a fixed element."""
    if not possible(surface, placed):
        return Zone(placed, np.inf, 0.0, settled=False)
    found, _ = distances(surface, placed.local(points), placed.sizes)
    return Zone(placed, *_bounds(surface, found), settled=False)


def _bounds(surface: ElementFamily, found: Float) -> tuple[float, float]:
    greatest = np.abs(found).max() if surface.even else found.max()
    return float(greatest), float(found.min()) if surface.lower else 0.0


def middle_of(surface: ElementFamily, zone: Zone) -> float:
    """Return the reference distance that keeps differences exact."""
    if surface.even:
        return 0.0
    return 0.5 * (zone.upper + zone.lower) if surface.lower else zone.upper


def natural_steps(surface: ElementFamily, points: Float, placed: ElementPose) -> Float:
    """Return steps (k, k), columns, each with an RMS effect of one on the distances.

    Near an axis or circle through all points, the sign of distances is undefined; there a step
    changes the vectors from it by one.
    """
    local = placed.local(points)
    if surface.kind is DistanceKind.AXIS and not surface.lower:
        along = max(float(np.sqrt(np.mean(local[:, 2] ** 2))), NEARLY_FLAT)
        return np.diag([1.0 if place < 3 else 1.0 / along for place in surface.free])
    _, jacobian = distances(surface, local, placed.sizes)
    jacobian = jacobian[:, surface.free]
    if surface.lower:
        jacobian = jacobian - jacobian.mean(axis=0)
    if surface.kind is DistanceKind.RING and not surface.lower:
        _, radial = distances(replace(surface, kind=DistanceKind.AXIS), local, placed.sizes)
        _, level = distances(replace(surface, kind=DistanceKind.HEIGHT), local, placed.sizes)
        radial[:, FIRST_SIZE] = -1.0
        jacobian = np.concatenate([radial[:, surface.free], level[:, surface.free]])
    _, strength, directions = np.linalg.svd(jacobian / np.sqrt(len(points)), full_matrices=False)
    if len(strength) < jacobian.shape[1]:
        return np.eye(jacobian.shape[1])
    steps: Float = directions.T / np.maximum(strength, NEARLY_FLAT * strength[0])
    return steps


def settle(
    surface: ElementFamily, points: Float, start: ElementPose, steps: Float, radius: float,
    most: int = MAX_STEPS,
) -> Zone:  # fmt: skip
    """Return the local optimum reached from ``start``.

    ``points`` (n, 3) are centred and scaled; ``radius`` is the initial trust region in ``steps``
    (k, k), see `natural_steps`; ``most`` limits the number of steps.
    """
    radii = (radius, _greatest(_delicate(surface), steps))
    return _by_few(surface, points, start, steps, radii, most, None)[0]


def _greatest(delicate: NDArray[np.bool_], steps: Float) -> float:
    limit = np.where(delicate, LARGEST_LEAN, 2.0)
    return float(np.min(limit[:, None] / np.maximum(np.abs(steps), 1e-300)))


def _by_few(
    surface: ElementFamily, points: Float, start: ElementPose, steps: Float,
    radii: tuple[float, float], most: int, chosen: Int | None,
) -> tuple[Zone, Int | None]:  # fmt: skip
    """Return the result of `settle`, and indices used, or None for all; guess: ``chosen``."""
    if len(points) <= ALL_POINTS:
        return _settled(surface, points, start, steps, radii, most), None
    if chosen is None:
        found, _ = distances(surface, start.local(points), start.sizes)
        chosen = _extremes(surface, found, NEAREST)
    for _ in range(EXCHANGES):
        there = _settled(surface, points[chosen], start, steps, radii, most)
        if not there.settled:
            break
        found, _ = distances(surface, there.placed.local(points), there.placed.sizes)
        full = replace(there, upper=_bounds(surface, found)[0], lower=_bounds(surface, found)[1])
        beyond = full.width - there.width
        if beyond <= SETTLED * max(1.0, float(np.abs(found).max())):
            # Contacts of some points that hold against all points are those of all.
            return full, chosen
        start, radii = there.placed, (max(beyond, CLOSE), radii[1])
        chosen = np.union1d(chosen, _extremes(surface, found, FURTHER))
    return _settled(surface, points, start, steps, radii, most), chosen


def _extremes(surface: ElementFamily, found: Float, count: int) -> Int:
    """Return the indices of the ``count`` distances (n,) nearest to either bound of their zone."""
    values = np.abs(found) if surface.even else found
    order = np.argpartition(values, (count, len(values) - count) if surface.lower else -count)
    rows = order[-count:]
    return np.sort(np.concatenate([order[:count], rows]) if surface.lower else rows)


def _settled(
    surface: ElementFamily, points: Float, start: ElementPose, steps: Float,
    radii: tuple[float, float], most: int,
) -> Zone:  # fmt: skip
    frame, origin, sizes = start.frame.copy(order="C"), start.origin.copy(), start.sizes.copy()
    upper, lower, settled = settle_zone(
        surface.code, surface.sign, surface.lower, surface.even, surface.rows,
        np.ascontiguousarray(points), frame, origin, sizes,
        np.ascontiguousarray(steps), min(radii), radii[1], most,
    )  # fmt: skip
    return Zone(ElementPose(frame, origin, sizes), upper, lower, settled=settled)


def _delicate(surface: ElementFamily) -> NDArray[np.bool_]:
    """Return which free entries of a step must stay small, (k,)."""
    return np.isin(surface.free, (TURN,) if surface.outline else ANGLES)


def after(surface: ElementFamily, placed: ElementPose, free_step: Float) -> ElementPose:
    """Return the element after a step (k,) of the free entries of its family."""
    return placed.moved(full_step(surface, free_step))


def by_bounds(surface: ElementFamily, signs: Float) -> Float:
    """Return d(contact gaps)/d(bounds), (c, 1 or 2); gaps +1 above and -1 below."""
    if surface.even:
        return -signs[:, None]
    upper, lower = np.where(signs > 0.0, -1.0, 0.0), np.where(signs < 0.0, -1.0, 0.0)
    return np.stack([upper, lower] if surface.lower else [upper], axis=1)


def start_pattern(k: int, count: int) -> Float:
    """Return unit directions (count, k): every axis both ways, then R. Roberts' sequence."""
    along = np.concatenate([np.eye(k), -np.eye(k)])
    ratio = 2.0
    for _ in range(40):
        ratio = (1.0 + ratio) ** (1.0 / (k + 1))
    turns = np.arange(1, max(count - 2 * k, 0) + 1)[:, None] / ratio ** np.arange(1, k + 1)
    spread = 2.0 * ((0.5 + turns) % 1.0) - 1.0
    spread /= np.maximum(np.linalg.norm(spread, axis=1), 1e-9)[:, None]
    return np.concatenate([along, spread])[:count]


def best_zone(
    surface: ElementFamily, points: Float, start: ElementPose, starts: int, reach: float = 1.0
) -> Zone:
    """Return the narrowest zone found from the least-squares element and around it.

    ``points`` (n, 3) are centred and scaled. ``starts`` further starts are at ``reach`` from it, in
    zones of the start.
    """
    first = zone_at(surface, points, start)
    steps = natural_steps(surface, points, start)
    found, _ = distances(surface, start.local(points), start.sizes)
    spread = float(np.ptp(found))
    delicate = _delicate(surface)
    radii = (max(spread, 1e-12), _greatest(delicate, steps))
    best, chosen = _by_few(surface, points, start, steps, radii, MAX_STEPS, None)
    if best.width > first.width:
        best = first
    for direction in reach * spread * start_pattern(len(surface.free), starts):
        free_step = steps @ direction
        lean = np.abs(free_step[delicate]).max(initial=0.0)
        free_step *= min(1.0, LARGEST_LEAN / max(lean, 1e-300))
        begun = after(surface, start, free_step)
        if not possible(surface, begun):
            continue
        # Points that held other zones may hold this one; if not, the check shows it.
        there, chosen = _by_few(surface, points, begun, steps, radii, FEWER_STEPS, chosen)
        if there.settled and (there.width < best.width or not best.settled):
            best = there
    return best


def polished(
    surface: ElementFamily, points: Float, zone: Zone, contacts: Int, multipliers: Float,
    longest: float = CLOSE,
) -> Zone:  # fmt: skip
    """Return the zone after one Newton step on given contacts, unless that is wider.

    ``contacts`` (c,) are coded as in `_kernel`; ``multipliers`` (c,) are their forces.
    """
    placed = zone.placed
    steps = natural_steps(surface, points, placed)
    local = placed.local(points)
    found, jacobian = distances(surface, local, placed.sizes)
    middle = middle_of(surface, zone)
    step = np.empty(len(steps))
    touched = newton_step(
        surface.code, surface.sign, surface.lower, surface.even, surface.rows,
        np.ascontiguousarray(local), placed.sizes, middle, found - middle,
        jacobian[:, surface.free] @ steps, np.ascontiguousarray(steps), contacts, multipliers,
        longest, step,
    )  # fmt: skip
    if not touched:
        return zone
    moved = zone_at(surface, points, after(surface, placed, steps @ step))
    rounding = 4.0 * SETTLED * max(1.0, float(np.abs(found).max()))
    return replace(moved, settled=True) if moved.width <= zone.width + rounding else zone
