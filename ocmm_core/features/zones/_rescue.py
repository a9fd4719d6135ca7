"""Fallbacks for zones that do not settle, or have balanced but sliding contacts.

Settling uses linear steps, which become short if contacts curve strongly along a narrow valley.
Sequential quadratic programming, which learns the curvature, continues from there (D. Kraft's
SLSQP). It is slow and inexact, so it only provides a start from which settling succeeds.
"""

from __future__ import annotations

import numpy as np
import scipy

from ocmm_core.features.zones import _solver as solver
from ocmm_core.features.zones._surfaces import ElementFamily, ElementPose, distances, full_step
from ocmm_core.geometry import Float, Int

NEAREST = 40
"""Number of points used, nearest to either bound."""
ROUNDS = 6
LONGEST = 0.3
"""Largest step of a round, relative to distances."""
GAPS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
"""Relative to the width of the zone."""
NEWTON_STEPS = 4
GAINS = 1e-9
"""Relative gain of width that ends the rounds."""
SLIDES = (1e-4, 1e-2, 1.0)
"""Slides of contacts, in zones."""
NARROWER = 1e-7
"""Relative gain of width from which another zone counts as narrower."""


def descended(surface: ElementFamily, points: Float, zone: solver.Zone) -> solver.Zone:
    """Return an equally wide or narrower zone, further down the valley of ``zone``."""
    best = zone
    for _ in range(ROUNDS):
        width = best.width
        moved = _quadratic_round(surface, points, best)
        if moved.width < best.width:
            best = moved
        best = _held(surface, points, best)
        steps = solver.natural_steps(surface, points, best.placed)
        moved = solver.settle(surface, points, best.placed, steps, width)
        if moved.width <= best.width:
            best = moved
        if best.settled or best.width > width * (1.0 - GAINS):
            break
    return best


def _held(surface: ElementFamily, points: Float, zone: solver.Zone) -> solver.Zone:
    """Return the zone after Newton steps on contacts, tried for several gap widths."""
    best = zone
    for gap in GAPS:
        there = best
        for _ in range(NEWTON_STEPS):
            contacts, forces = _forces(surface, points, there, gap * abs(there.width))
            moved = solver.polished(surface, points, there, contacts, forces, np.inf)
            if not moved.width < there.width:
                break
            there = moved
        if there.width < best.width:
            best = there
    return best


def _forces(
    surface: ElementFamily, points: Float, zone: solver.Zone, gap: float
) -> tuple[Int, Float]:
    """Return contacts (c,), coded as in `_kernel`, nearer than ``gap``, and their forces."""
    placed = zone.placed
    found, jacobian = distances(surface, placed.local(points), placed.sizes)
    by_step = jacobian[:, surface.free] @ solver.natural_steps(surface, points, placed)
    above = np.flatnonzero(found >= found.max() - gap)
    below = np.flatnonzero(found <= found.min() + gap) if surface.lower else above[:0]
    signs = np.concatenate([np.ones(len(above)), -np.ones(len(below))])
    rows = np.concatenate([above, below])
    sides = np.abs(solver.by_bounds(surface, signs).T)
    touch = np.concatenate([by_step[rows].T * signs, sides])
    right = np.concatenate([np.zeros(by_step.shape[1]), np.ones(len(sides))])
    forces, _ = scipy.optimize.nnls(touch, right)
    held = forces > 0.0
    coded = np.where(signs > 0.0, 0, len(points)) + rows
    return coded[held].astype(np.int64), forces[held]


def slid(
    surface: ElementFamily, points: Float, zone: solver.Zone, slide: Float, noise: float
) -> solver.Zone | None:
    """Return a narrower zone reached by sliding balanced contacts, or None.

    ``slide`` (k,), a step of free entries, keeps contacts at their bounds; ``noise`` is rounding.
    """
    steps = solver.natural_steps(surface, points, zone.placed)
    least = zone.width - max(noise, NARROWER * abs(zone.width))
    found: solver.Zone | None = None
    for size in SLIDES:
        for way in (size, -size):
            begun = solver.after(surface, zone.placed, way * abs(zone.width) * slide)
            there = solver.settle(surface, points, begun, steps, 0.1 * size * abs(zone.width))
            if there.width < least:
                found, least = there, there.width
    return found


def _quadratic_round(surface: ElementFamily, points: Float, zone: solver.Zone) -> solver.Zone:
    placed, scale = zone.placed, max(abs(zone.width), 1e-12) if surface.lower else 1.0
    steps = scale * solver.natural_steps(surface, points, placed)
    local, middle = placed.local(points), solver.middle_of(surface, zone)
    near = _nearest(surface, local, placed)
    k, bounds = len(surface.free), 2 if surface.lower else 1

    def gaps(unknown: Float) -> tuple[Float, Float]:
        found, jacobian = distances(
            surface, local[near], placed.sizes, full_step(surface, steps @ unknown[:k])
        )
        found, jacobian = (found - middle) / scale, jacobian[:, surface.free] @ steps / scale
        one, zero = np.ones((len(near), 1)), np.zeros((len(near), 1))
        if not surface.lower:
            return unknown[k] - found, np.concatenate([-jacobian, one], axis=1)
        below = np.concatenate([jacobian, zero, -one], axis=1)
        above = np.concatenate([-jacobian, one, zero], axis=1)
        return (
            np.concatenate([unknown[k] - found, found - unknown[k + 1]]),
            np.concatenate([above, below]),
        )

    downhill = np.zeros(k + bounds)
    downhill[k:] = (1.0, -1.0)[:bounds]
    start = np.zeros(k + bounds)
    start[k:] = [(bound - middle) / scale for bound in (zone.upper, zone.lower)][:bounds]
    longest = LONGEST / np.maximum(np.abs(steps).max(axis=0), 1e-300)
    box = np.append(longest, [np.inf] * bounds)

    def width(unknown: Float) -> tuple[float, Float]:
        return float(downhill @ unknown), downhill

    result = scipy.optimize.minimize(
        width,
        start,
        jac=True,
        method="SLSQP",
        bounds=scipy.optimize.Bounds(-box, box),
        constraints=scipy.optimize.NonlinearConstraint(
            lambda unknown: gaps(unknown)[0], 0.0, np.inf, jac=lambda unknown: gaps(unknown)[1]
        ),
        tol=1e-14,
    )
    if not np.isfinite(result.x).all():
        return zone
    return solver.zone_at(surface, points, solver.after(surface, placed, steps @ result.x[:k]))


def _nearest(surface: ElementFamily, local: Float, placed: ElementPose) -> Int:
    order = np.argsort(distances(surface, local, placed.sizes)[0])
    if not surface.lower:
        return np.asarray(order[-NEAREST:])
    return np.unique(np.concatenate([order[:NEAREST], order[-NEAREST:]]))
