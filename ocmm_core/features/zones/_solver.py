"""The narrowest zone that is reached from one start, and the best of those from many.

A linear step within a trust region names the points that will touch (`_kernel`); a Newton step
on these contacts, curvature included, then goes to the optimum quadratically. Method: R. Fletcher
and E. Sainz de la Maza, Mathematical Programming 43 (1989); for geometry in coordinate metrology
D. Hutzschenreuter and others, J. Sens. Sens. Syst. 7 (2018) reach 1e-14 with one of its kind.

Distances curve, thus a zone may have several local minima, whose widths differ by about the width
squared over the radius. The starts lie where the least-squares residuals grow by about the zone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ocmm_core.features.zones._kernel import narrowest_zone
from ocmm_core.features.zones._outlines import FIRST_SIZE, TURN
from ocmm_core.features.zones._surfaces import (
    ANGLES,
    DistanceKind,
    ElementFamily,
    Placed,
    distances,
    full_step,
    possible,
    second_derivatives,
)
from ocmm_core.geometry import Float, Int

MAX_STEPS = 200
FEWER_STEPS = 40
"""From a further start; most settle within fifteen."""
FARTHEST = 1e3
"""Distance of an axis or centre from the points, against their size, where a start is given up."""
SETTLED = 4e-16
"""Predicted gain of zone width, against the distances, that is rounding."""
POLISHES = 3
"""Newton steps after the width has settled."""
CLOSE = 1e-5
"""Longest of these, against the distances."""
LARGEST_LEAN = 0.7
"""A step leans the axis and opens a cone by no more than this; lengths by twice the size."""
NEARLY_FLAT = 1e-4
"""Effect of a direction, against the strongest, below which steps along it do not grow further."""


@dataclass(frozen=True, slots=True)
class Zone:
    """An element with the bounds of its zone; centred and scaled.

    Attributes
    ----------
    placed
        Where it stands.
    upper, lower
        Greatest and smallest distance (with the sign of the surface); ``lower`` is zero where the
        zone has no lower bound, and where it is even, so that ``upper`` is half of its breadth.
        Infinite where there is no such element.
    settled
        The iteration came to rest: no step improves the zone to first order.
    """

    placed: Placed
    upper: float
    lower: float
    settled: bool

    @property
    def width(self) -> float:
        """Return what was minimised."""
        return self.upper - self.lower


def zone_at(surface: ElementFamily, points: Float, placed: Placed) -> Zone:
    """Return the zone of ``points`` (n, 3) about an element that is not moved."""
    if not possible(surface, placed):
        return Zone(placed, np.inf, 0.0, settled=False)
    found, _ = distances(surface, placed.local(points), placed.sizes)
    return Zone(placed, *_bounds(surface, found), settled=False)


def _bounds(surface: ElementFamily, found: Float) -> tuple[float, float]:
    greatest = np.abs(found).max() if surface.even else found.max()
    return float(greatest), float(found.min()) if surface.lower else 0.0


def middle_of(surface: ElementFamily, zone: Zone) -> float:
    """Return what distances are counted from so that their differences stay exact."""
    if surface.even:
        return 0.0
    return 0.5 * (zone.upper + zone.lower) if surface.lower else zone.upper


def natural_steps(surface: ElementFamily, points: Float, placed: Placed) -> Float:
    """Return steps (k, k), columns, that each change the distances by one (root mean square).

    About an axis or circle that all points may lie near, distances turn with every step; there a
    step changes the vectors from it by one, whichever way.
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
    surface: ElementFamily, points: Float, start: Placed, steps: Float, radius: float,
    most: int = MAX_STEPS,
) -> Zone:  # fmt: skip
    """Return the local optimum that is reached from ``start``.

    Parameters
    ----------
    surface
        The family of elements.
    points
        (n, 3), centred and scaled.
    start
        Where to begin.
    steps
        (k, k): see `natural_steps`.
    radius
        First size of the trust region, in these.
    most
        Number of steps after which it is given up.
    """
    zone = zone_at(surface, points, start)
    limit = np.where(_delicate(surface), LARGEST_LEAN, 2.0)
    greatest = float(np.min(limit[:, None] / np.maximum(np.abs(steps), 1e-300)))
    radius = min(radius, greatest)
    polishes = 0
    for _ in range(most):
        placed = zone.placed
        local = placed.local(points)
        found, jacobian = distances(surface, local, placed.sizes)
        scale = max(1.0, float(np.abs(found).max()))
        middle = middle_of(surface, zone)
        found = found - middle
        by_step = jacobian[:, surface.free] @ steps
        step, basis, multipliers, gain = _linear_step(surface, found, by_step, radius)
        held = basis < 2 * len(points)
        newton = _newton_step(
            surface, local, placed.sizes, middle, found, by_step, steps, basis[held],
            multipliers[held], greatest,
        )  # fmt: skip
        if gain <= SETTLED * scale:
            settled = replace(zone, settled=True)
            # Where curvature holds the element, its place is still rough when its width is not.
            if newton is None or polishes == POLISHES or np.abs(newton).max() > CLOSE * scale:
                return settled
            moved = zone_at(surface, points, after(surface, placed, steps @ newton))
            if moved.width > zone.width + 4.0 * SETTLED * scale:
                return settled
            zone, polishes = moved, polishes + 1
            continue
        if newton is not None:
            moved = zone_at(surface, points, after(surface, placed, steps @ newton))
            if zone.width - moved.width > 0.25 * gain:
                zone, radius = moved, min(max(radius, 2.0 * np.abs(newton).max()), greatest)
                continue
        moved = zone_at(surface, points, after(surface, placed, steps @ step))
        won = zone.width - moved.width
        if won < 0.25 * gain:
            radius = 0.25 * float(min(radius, np.abs(step).max()))
        elif won > 0.75 * gain:
            radius = min(2.0 * radius, greatest)
        if won > 0.0:
            zone = moved
        elif radius < 1e-17:
            break
        if np.abs(zone.placed.origin).max() > FARTHEST:
            break
    return zone


def _delicate(surface: ElementFamily) -> NDArray[np.bool_]:
    """Return which of the free entries of a step must stay small, (k,)."""
    return np.isin(surface.free, (TURN,) if surface.outline else ANGLES)


def _linear_step(
    surface: ElementFamily, found: Float, by_step: Float, radius: float
) -> tuple[Float, Int, Float, float]:
    """Return the step of the linear problem, its basis, multipliers and the width it gains."""
    k = by_step.shape[1]
    m = k + 2 if surface.lower else k + 1
    solution, basis, multipliers = np.zeros(m), np.zeros(m, dtype=np.int64), np.zeros(m)
    if surface.even:
        # Every point counts with either sign; row n + i is then point i below, as it always is.
        found, by_step = np.concatenate([found, -found]), np.concatenate([by_step, -by_step])
    narrowest_zone(
        found, np.ascontiguousarray(by_step), np.full(k, radius), surface.lower, 0.0,
        solution, basis, multipliers,
    )  # fmt: skip
    step = solution[:k]
    linear = found + by_step @ step
    gain = np.ptp(found) - np.ptp(linear) if surface.lower else found.max() - linear.max()
    return step, basis, multipliers, float(gain)


def after(surface: ElementFamily, placed: Placed, free_step: Float) -> Placed:
    """Return the element after a step (k,) of what its family frees."""
    return placed.moved(full_step(surface, free_step))


def _newton_step(
    surface: ElementFamily, local: Float, sizes: Float, middle: float, found: Float, by_step: Float,
    steps: Float, contacts: Int, multipliers: Float, limit: float,
) -> Float | None:  # fmt: skip
    """Return the step to where all ``contacts`` touch and their forces balance.

    None where there is no such step shorter than ``limit``. Distances ``found`` are counted from
    ``middle``.
    """
    n, k = by_step.shape
    rows = contacts % n
    signs = np.where(contacts < n, 1.0, -1.0)
    free = list(surface.free)
    hessian = np.zeros((k, k))
    if len(contacts) < (k + 2 if surface.lower else k + 1):
        curvature, _, _ = second_derivatives(surface, local[rows], sizes, signs * multipliers)
        hessian = steps.T @ curvature[np.ix_(free, free)] @ steps
    touch = np.concatenate([by_step[rows], by_bounds(surface, signs)], axis=1)
    unknowns = touch.shape[1]
    matrix = np.zeros((unknowns + len(rows), unknowns + len(rows)))
    matrix[:k, :k] = hessian
    matrix[unknowns:, :unknowns] = touch
    matrix[:unknowns, unknowns:] = (signs[:, None] * touch).T
    right = np.zeros(len(matrix))
    right[unknowns:] = -found[rows]
    right[k] = -1.0
    if surface.lower:
        right[k + 1] = 1.0
    step: Float = np.zeros(k)
    for _ in range(2):
        # The second round counts with the distances after the first: contacts that curve away
        # would else undo what a step along them gains (N. Maratos).
        try:
            step = np.asarray(np.linalg.solve(matrix, right)[:k], dtype=np.float64)
        except np.linalg.LinAlgError:
            return None
        if not np.abs(step).max() < limit:
            return None
        there, _ = distances(surface, local[rows], sizes, full_step(surface, steps @ step))
        right[unknowns:] = -(there - middle - by_step[rows] @ step)
    return step


def by_bounds(surface: ElementFamily, signs: Float) -> Float:
    """Return how gaps at contacts, +1 above and -1 below, answer to the bounds, (c, 1 or 2)."""
    if surface.even:
        return -signs[:, None]
    upper, lower = np.where(signs > 0.0, -1.0, 0.0), np.where(signs < 0.0, -1.0, 0.0)
    return np.stack([upper, lower] if surface.lower else [upper], axis=1)


def start_pattern(k: int, count: int) -> Float:
    """Return ``count`` directions (count, k) of length one: both ways along every axis, then more.

    The further ones follow R. Roberts' additive sequence, evenly spread and the same every time.
    """
    along = np.concatenate([np.eye(k), -np.eye(k)])
    ratio = 2.0
    for _ in range(40):
        ratio = (1.0 + ratio) ** (1.0 / (k + 1))
    turns = np.arange(1, max(count - 2 * k, 0) + 1)[:, None] / ratio ** np.arange(1, k + 1)
    spread = 2.0 * ((0.5 + turns) % 1.0) - 1.0
    spread /= np.maximum(np.linalg.norm(spread, axis=1), 1e-9)[:, None]
    return np.concatenate([along, spread])[:count]


def best_zone(
    surface: ElementFamily, points: Float, start: Placed, starts: int, reach: float = 1.0
) -> Zone:
    """Return the narrowest zone found from ``start`` and around it.

    Parameters
    ----------
    surface
        The family of elements.
    points
        (n, 3), centred and scaled.
    start
        The least-squares element.
    starts
        Further starts.
    reach
        How far around, in zones of the start.
    """
    first = zone_at(surface, points, start)
    steps = natural_steps(surface, points, start)
    found, _ = distances(surface, start.local(points), start.sizes)
    spread = float(np.ptp(found))
    best = settle(surface, points, start, steps, max(spread, 1e-12))
    if best.width > first.width:
        best = first
    for direction in reach * spread * start_pattern(len(surface.free), starts):
        free_step = steps @ direction
        lean = np.abs(free_step[_delicate(surface)]).max(initial=0.0)
        free_step *= min(1.0, LARGEST_LEAN / max(lean, 1e-300))
        begun = after(surface, start, free_step)
        if not possible(surface, begun):
            continue
        there = settle(surface, points, begun, steps, spread, FEWER_STEPS)
        if there.settled and (there.width < best.width or not best.settled):
            best = there
    return best


def polished(
    surface: ElementFamily, points: Float, zone: Zone, contacts: Int, multipliers: Float,
    longest: float = CLOSE,
) -> Zone:  # fmt: skip
    """Return the zone after one Newton step on given contacts, or the same if that is wider.

    Parameters
    ----------
    surface, points
        As in `settle`.
    zone
        A settled one.
    contacts
        (c,): coded as in `_kernel`.
    multipliers
        (c,): their forces.
    longest
        Of a step that is taken.
    """
    placed = zone.placed
    steps = natural_steps(surface, points, placed)
    local = placed.local(points)
    found, jacobian = distances(surface, local, placed.sizes)
    middle = middle_of(surface, zone)
    step = _newton_step(
        surface, local, placed.sizes, middle, found - middle, jacobian[:, surface.free] @ steps,
        steps, contacts, multipliers, longest,
    )  # fmt: skip
    if step is None:
        return zone
    moved = zone_at(surface, points, after(surface, placed, steps @ step))
    rounding = 4.0 * SETTLED * max(1.0, float(np.abs(found).max()))
    return replace(moved, settled=True) if moved.width <= zone.width + rounding else zone
