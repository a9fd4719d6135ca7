"""Resolve ambiguous minimum zones of outlines: minimise every side in turn.

Three points at one side of a rectangle may determine its minimum zone, leaving the other sides
free. Remaining freedom is resolved in the same way: the greatest distance of the other points is
minimised with the determining ones held at their bounds, and so on until nothing is free (strict
approximation of J. Rice, Bull. Amer. Math. Soc. 68, 1962).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from ocmm_core.features.zones._certificate import FLAT_CURVATURE, Balance
from ocmm_core.features.zones._elements import ZoneTask
from ocmm_core.features.zones._kernel import narrowest_zone
from ocmm_core.features.zones._settle_kernel import SETTLED
from ocmm_core.features.zones._solver import after, natural_steps, zone_at
from ocmm_core.features.zones._surfaces import ElementPose, distances, possible, second_derivatives
from ocmm_core.geometry import Float, Int

MAX_STEPS = 60
POLISHES = 4
WIDER = 1.0 + 1e-9
"""Relative width up to which a zone counts as equally narrow."""
NO_SHARE = 1e-10
"""Force of a contact that counts as zero."""
RANK = 1e-9
"""Relative effect on the distances that counts as zero."""


@dataclass(frozen=True, slots=True)
class ZoneLevel:
    """Points that hold a zone in directions left free by the previous levels."""

    rows: Int
    signs: Float
    """`rows`, `signs`: (c,): the points; +1 outside, -1 inside."""
    weights: Float
    """(c,): force, with the sign of the side."""
    half: float


def levels_of(
    task: ZoneTask, placed: ElementPose, balance: Balance
) -> tuple[ElementPose, list[ZoneLevel]]:
    """Return the fully determined outline, and contacts by level, widest zone first.

    For a family with a symmetric zone.
    """
    found, _ = distances(task.surface, placed.local(task.points), placed.sizes)
    half = float(np.abs(found).max())
    holding = balance.forces > NO_SHARE
    signs = balance.signs[holding]
    levels = [ZoneLevel(balance.contacts[holding], signs, signs * balance.forces[holding], half)]
    steps = natural_steps(task.surface, task.points, placed)
    settled = placed
    while True:
        moved, level = _next_level(task, settled, steps, levels)
        if level is None:
            break
        settled = moved
        levels.append(level)
    settled = _polished(task, settled, steps, levels)
    if zone_at(task.surface, task.points, settled).width > half * WIDER:
        # If a point changes sides, the remaining freedom keeps its present value.
        return placed, levels[:1]
    return settled, levels


def response(task: ZoneTask, placed: ElementPose, levels: list[ZoneLevel]) -> tuple[Int, Float]:
    """Return the contact points (c,), and the derivatives of free entries by them (k, 3 c)."""
    rows = np.concatenate([level.rows for level in levels])
    matrix, _, pins = _system(task, placed, np.eye(len(task.surface.free)), levels)
    right = np.zeros((len(matrix), len(rows), 3))
    local = placed.local(task.points)[rows]
    weights = np.concatenate([level.weights for level in levels])
    _, by_points, mixed = second_derivatives(task.surface, local, placed.sizes, weights)
    right[np.arange(len(rows)), np.arange(len(rows))] = -by_points
    first, row = 0, len(rows)
    for level, pin in zip(levels, pins, strict=True):
        own = slice(first, first + len(level.rows))
        bent = mixed[own][:, list(task.surface.free)]
        right[row : row + pin.shape[1], own] = -np.einsum("kq,ckj->qcj", pin, bent)
        first, row = own.stop, row + pin.shape[1]
    answer: Float = np.asarray(
        np.linalg.lstsq(matrix, right.reshape(len(right), -1), rcond=1e-13)[0], dtype=np.float64
    )
    return rows.astype(np.int64), answer[: len(task.surface.free)]


def _loose(
    task: ZoneTask, placed: ElementPose, steps: Float, levels: list[ZoneLevel]
) -> tuple[Float, list[Float], list[Float]]:
    """Return the free directions (k, f), pinned curvature of each level, and Hessians (k, k)."""
    local = placed.local(task.points)
    free = np.eye(len(steps))
    pins, hessians = [], []
    places = list(task.surface.free)
    for level in levels:
        at = local[level.rows]
        _, jacobian = distances(task.surface, at, placed.sizes)
        touch = jacobian[:, places] @ steps @ free
        free = free @ scipy.linalg.null_space(touch, rcond=RANK)
        curvature, _, _ = second_derivatives(task.surface, at, placed.sizes, level.weights)
        hessian = steps.T @ curvature[np.ix_(places, places)] @ steps
        bends, turns = np.linalg.eigh(free.T @ hessian @ free)
        pinned = np.abs(bends) > FLAT_CURVATURE * max(float(np.abs(hessian).max()), 1e-300)
        pins.append(free @ turns[:, pinned])
        hessians.append(hessian)
        free = free @ turns[:, ~pinned]
    return free, pins, hessians


def _next_level(
    task: ZoneTask, placed: ElementPose, steps: Float, levels: list[ZoneLevel]
) -> tuple[ElementPose, ZoneLevel | None]:
    """Return the outline that minimises the greatest distance of the other points, and these."""
    surface, places = task.surface, list(task.surface.free)
    held = np.concatenate([level.rows for level in levels])
    radius = levels[0].half
    rest, basis, multipliers = held[:0], held[:0], np.zeros(0)
    half = 0.0
    for _ in range(MAX_STEPS):
        free, _, _ = _loose(task, placed, steps, levels)
        found, jacobian = distances(surface, placed.local(task.points), placed.sizes)
        by_step = jacobian[:, places] @ steps @ free
        strong = np.linalg.norm(by_step, axis=1) > RANK
        strong[held] = False
        rest = np.flatnonzero(strong).astype(np.int64)
        if not free.shape[1] or not len(rest):
            return placed, None
        m = free.shape[1] + 1
        both = np.concatenate([found[rest], -found[rest]])
        by_both = np.concatenate([by_step[rest], -by_step[rest]])
        solution, basis, multipliers = np.zeros(m), np.zeros(m, dtype=np.int64), np.zeros(m)
        narrowest_zone(
            both, by_both, np.full(m - 1, radius), False, 0.0, solution, basis, multipliers
        )
        half = float(both.max())
        gain = half - float((both + by_both @ solution[: m - 1]).max())
        if gain <= SETTLED:
            break
        moved = _restored(
            task, after(surface, placed, steps @ free @ solution[: m - 1]), steps, levels
        )
        won = -np.inf
        if moved is not None:
            there, _ = distances(surface, moved.local(task.points), moved.sizes)
            # Points with zero derivative may still become active once another side is nearer.
            if float(np.abs(there).max()) <= levels[0].half * WIDER:
                won = half - float(np.abs(there[rest]).max())
        if moved is not None and won > 0.25 * gain:
            placed, radius = moved, 2.0 * radius
        else:
            radius = 0.25 * min(radius, float(np.abs(solution[: m - 1]).max()))
            if radius < 1e-16:
                break
    holding = (basis < 2 * len(rest)) & (multipliers > NO_SHARE)
    if not holding.any():
        return placed, None
    codes = basis[holding]
    signs = np.where(codes < len(rest), 1.0, -1.0)
    return placed, ZoneLevel(rest[codes % len(rest)], signs, signs * multipliers[holding], half)


def _restored(
    task: ZoneTask, placed: ElementPose, steps: Float, levels: list[ZoneLevel]
) -> ElementPose | None:
    """Return the outline with the levels' points at their bounds, by minimum-norm steps."""
    rows = np.concatenate([level.rows for level in levels])
    bounds = np.concatenate([level.signs * level.half for level in levels])
    places = list(task.surface.free)
    for _ in range(3):
        if not possible(task.surface, placed):
            return None
        found, jacobian = distances(task.surface, placed.local(task.points[rows]), placed.sizes)
        step = np.linalg.lstsq(jacobian[:, places] @ steps, bounds - found, rcond=RANK)[0]
        placed = after(task.surface, placed, steps @ step)
        if np.abs(step).max() < 1e-14:
            break
    return placed if possible(task.surface, placed) else None


def _system(
    task: ZoneTask, placed: ElementPose, steps: Float, levels: list[ZoneLevel]
) -> tuple[Float, Float, list[Float]]:
    """Return matrix, gaps and pins of the conditions: contacts touch, curvature at rest."""
    surface, places = task.surface, list(task.surface.free)
    k = len(places)
    _, pins, hessians = _loose(task, placed, steps, levels)
    rows, gaps = [], []
    jacobian_of = []
    for number, level in enumerate(levels):
        found, jacobian = distances(surface, placed.local(task.points[level.rows]), placed.sizes)
        by_step = jacobian[:, places] @ steps
        by_half = np.zeros((len(level.rows), len(levels)))
        by_half[:, number] = -level.signs
        rows.append(np.hstack([by_step, by_half]))
        gaps.append(found - level.signs * level.half)
        jacobian_of.append(by_step)
    for level, pin, hessian, by_step in zip(levels, pins, hessians, jacobian_of, strict=True):
        rows.append(np.hstack([pin.T @ hessian, np.zeros((pin.shape[1], len(levels)))]))
        gaps.append(pin.T @ (level.weights @ by_step))
    matrix = np.concatenate(rows)
    return matrix.reshape(-1, k + len(levels)), np.concatenate(gaps), pins


def _polished(
    task: ZoneTask, placed: ElementPose, steps: Float, levels: list[ZoneLevel]
) -> ElementPose:
    """Return the outline after Newton steps, with contacts exact to rounding."""
    for _ in range(POLISHES):
        matrix, gaps, _ = _system(task, placed, steps, levels)
        step = np.linalg.lstsq(matrix, -gaps, rcond=1e-13)[0][: len(steps)]
        moved = after(task.surface, placed, steps @ step)
        if not possible(task.surface, moved) or np.abs(step).max() > 1e-5:
            break
        placed = moved
        if np.abs(step).max() < 1e-15:
            break
    return placed
