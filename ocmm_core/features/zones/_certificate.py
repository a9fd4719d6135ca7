"""Optimality certificate of a zone: balanced forces at its contact points.

At a minimum zone, nonnegative forces of the contact points are in balance (multipliers of Karush,
Kuhn and Tucker). As many contacts as unknowns pin the zone; fewer suffice if the distances curve
the right way, which second derivatives show. The proof is local, and global for convex problems:
smallest circumscribed circle and sphere.

With more contacts than needed, several sets of forces balance. Then each direction may be held by
another set with the right curvature (second-order conditions of minimax problems; J. Bonnans and A.
Shapiro, Perturbation Analysis of Optimization Problems, 2000, section 3.2). Example: contacts of a
cylinder in one section, where different forces prevent tilting in each direction.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from math import comb

import numpy as np
import scipy

from ocmm_core.features.search import refuse_masked
from ocmm_core.features.shapes import Criterion, Fit
from ocmm_core.features.zones._elements import BOUNDED, ZoneTask, task_of, zone_surface
from ocmm_core.features.zones._rescue import slid
from ocmm_core.features.zones._solver import Zone, by_bounds, natural_steps, zone_at
from ocmm_core.features.zones._surfaces import ElementPose, distances, second_derivatives
from ocmm_core.geometry import Float, Int, Points3

MOST_SETS = 5000
"""Limit of examined combinations of contacts; beyond, the result is undecided."""
BALANCED = 1e-10
RANK = 1e-10


def least_held(hessians: Float, touch: Float, right: Float) -> float | None:
    """Return the minimum over unit directions of the greatest curvature of a set of forces.

    ``hessians`` (c, m, m): second derivatives of the distances of the contacts, with the sign of
    their side, in the directions left free by the contacts. Nonnegative forces are in balance if
    ``touch @ forces``, (r, c), equals ``right`` (r,). None for more than two directions or too many
    contacts.
    """
    if not 1 <= hessians.shape[1] <= 2:
        return None
    sets = _extreme_forces(touch, right)
    if sets is None or not len(sets):
        return None
    forms = np.einsum("vc,cij->vij", sets, hessians)
    if hessians.shape[1] == 1:
        return float(forms.max())
    mean = 0.5 * (forms[:, 0, 0] + forms[:, 1, 1])
    cosine, sine = 0.5 * (forms[:, 0, 0] - forms[:, 1, 1]), forms[:, 0, 1]
    # The maximum of waves is minimal at a minimum of one, or at a crossing of two.
    turns = [np.arctan2(-sine, -cosine)]
    first, second = np.triu_indices(len(forms), 1)
    level, c, s = (wave[first] - wave[second] for wave in (mean, cosine, sine))
    height = np.hypot(c, s)
    cross = np.abs(level) < height
    apart = np.arccos(-level[cross] / height[cross])
    middle = np.arctan2(s[cross], c[cross])
    turns += [middle - apart, middle + apart]
    turn = np.concatenate(turns)[:, None]
    waves = mean + cosine * np.cos(turn) + sine * np.sin(turn)
    return float(waves.max(axis=1).min())


def _extreme_forces(touch: Float, right: Float) -> Float | None:
    """Return the extreme sets of forces (v, c) that span all others; None if too many."""
    count = touch.shape[1]
    u, strength, _ = np.linalg.svd(touch, full_matrices=False)
    kept = u[:, strength > RANK * strength[0]].T
    rank = len(kept)
    if comb(count, rank) > MOST_SETS:
        return None
    chosen = np.array(list(combinations(range(count), rank)))
    matrices = np.moveaxis((kept @ touch)[:, chosen], 1, 0)
    sound = np.abs(np.linalg.det(matrices)) > RANK * np.prod(strength[:rank])
    forces = np.linalg.solve(
        matrices[sound], np.broadcast_to(kept @ right, (sound.sum(), rank))[:, :, None]
    )[:, :, 0]
    pushing = forces.min(axis=1, initial=0.0) > -BALANCED
    sets = np.zeros((int(pushing.sum()), count))
    np.put_along_axis(sets, chosen[sound][pushing], np.maximum(forces[pushing], 0.0), axis=1)
    return sets


IN_BALANCE = 1e-9
"""Sum of forces, with total force one on each side, that counts as zero."""
ACTIVE = 1e-4
"""Largest gap to the bound of a possible contact, relative to the width of the zone."""
LARGEST_GAP = 1e-9
"""The same relative to the size of the points."""
NO_FORCE = 1e-15
SHARING = 1e6
"""Weight of balance against short vectors of forces."""
FLAT_CURVATURE = 1e-7
"""Least curvature, relative to the greatest, that does not pin the element."""


@dataclass(frozen=True, slots=True)
class Balance:
    """Contacts of a zone with their forces."""

    contacts: Int
    """(c,): indices of the points with a force."""
    signs: Float
    """(c,): +1 at the upper bound, -1 at the lower."""
    forces: Float
    unbalanced: float
    """`forces`: (c,): nonnegative; `unbalanced`: Remaining sum of forces."""
    least_curvature: float
    """Least second derivative in directions left free by the contacts, relative to the greatest;
    infinite without free directions, zero if negative without gain."""
    way: Float
    """(k,): the step of the free entries in that direction."""

    @property
    def holds(self) -> bool:
        """Return whether the zone is a local minimum."""
        return self.unbalanced < IN_BALANCE and self.least_curvature > -FLAT_CURVATURE

    @property
    def unique(self) -> bool:
        """Return whether neighbouring elements all have a wider zone."""
        return self.holds and self.least_curvature > FLAT_CURVATURE


@dataclass(frozen=True, slots=True)
class ZoneProof:
    certified: bool
    """It is a minimum zone, or the largest inscribed element."""
    sentence: str
    """"certified" with the criterion, or the reason why not."""
    contacts: tuple[int, ...] = ()
    forces: tuple[float, ...] = ()
    unbalanced: float = np.inf
    """`forces`: In the order of ``contacts``; `unbalanced`: Remaining sum of forces."""
    unique: bool = False
    """Neighbouring elements are all worse."""


def certificate(fit: Fit, points: Points3, offset: float = 0.0) -> ZoneProof:
    """Recompute the certificate of a fit of points (n, 3), mm; ``offset`` as in `zone.fit_zone`."""
    refuse_masked(fit.shape.value.lower(), points)
    if fit.criterion is Criterion.LEAST_SQUARES:
        return ZoneProof(False, "Not certified: a least-squares element has no contacts.")
    if fit.criterion is Criterion.MINIMUM_ZONE:
        surface = zone_surface(fit)
    else:
        surface = BOUNDED[fit.shape, fit.criterion]
    if surface is None:
        return ZoneProof(False, "Not certified: the shape has no minimum zone.")
    task = task_of(fit, np.asarray(points, dtype=np.float64), surface, offset)
    found, _ = distances(surface, task.start.local(task.points), task.start.sizes)
    noise = 8.0 * task.noise * max(1.0, float(np.abs(found).max()))
    if formless(task, zone_at(surface, task.points, task.start), found, noise):
        return ZoneProof(
            True, "certified: every point lies on the element to rounding", unbalanced=0.0
        )
    balance = balance_of(task, task.start, noise)
    count = len(balance.contacts)
    if balance.unbalanced >= IN_BALANCE:
        sentence = (
            f"Not certified: the forces at {count} contacts do not balance "
            f"({balance.unbalanced:.1e})."
        )
    elif not balance.holds:
        sentence = (
            f"Not certified: {count} contacts balance, but a move along them reduces the zone."
        )
    else:
        sentence = f"certified: {count} contacts in balance ({balance.unbalanced:.1e})"
        if not balance.unique:
            sentence += ", others nearby are as good"
    return ZoneProof(
        balance.holds, sentence, tuple(int(i) for i in balance.contacts),
        tuple(float(f) for f in balance.forces), balance.unbalanced, balance.unique,
    )  # fmt: skip


def formless(task: ZoneTask, zone: Zone, found: Float, noise: float) -> bool:
    """Return whether points at distances (n,) are on the element within rounding."""
    if task.tube or task.surface.even:
        return zone.width <= noise
    return bool(np.ptp(found) <= noise)


def balance_of(task: ZoneTask, placed: ElementPose, noise: float) -> Balance:
    """Return the forces that hold the zone about an element; ``noise`` rounds distances."""
    surface = task.surface
    local = placed.local(task.points)
    found, jacobian = distances(surface, local, placed.sizes)
    steps = natural_steps(surface, task.points, placed)
    by_step = jacobian[:, surface.free] @ steps
    gap = max(min(ACTIVE * float(np.ptp(found)), LARGEST_GAP), noise)
    greatest, least = found.max(), found.min()
    if surface.even:
        greatest = np.abs(found).max()
        least = -greatest
    above = np.flatnonzero(found >= greatest - gap)
    below = above[:0]
    if surface.lower or surface.even:
        below = np.flatnonzero(found <= least + gap)
    rows = np.concatenate([above, below])
    signs = np.concatenate([np.ones(len(above)), -np.ones(len(below))])
    sides = np.abs(by_bounds(surface, signs).T)
    touch = np.concatenate([by_step[rows].T * signs, sides])
    right = np.concatenate([np.zeros(by_step.shape[1]), np.ones(len(sides))])
    forces, remainder = scipy.optimize.nnls(touch, right)
    unbalanced = float(remainder)
    bend, way = _least_curvature(task, placed, local[rows], signs * forces, touch, steps)
    if bend < FLAT_CURVATURE and np.count_nonzero(forces) < len(rows) and unbalanced < IN_BALANCE:
        # More contacts than needed: the shortest vector of forces uses them all.
        heavy = np.concatenate([SHARING * touch, np.eye(len(rows))])
        forces, _ = scipy.optimize.nnls(
            heavy, np.concatenate([SHARING * right, np.zeros(len(rows))])
        )
        unbalanced = float(np.linalg.norm(touch @ forces - right))
        bend, way = _least_curvature(task, placed, local[rows], signs * forces, touch, steps)
    if bend < -FLAT_CURVATURE and unbalanced < IN_BALANCE:
        bend = max(bend, _held_by_others(task, placed, local[rows], signs, forces, touch, steps))
    if bend < -FLAT_CURVATURE and unbalanced < IN_BALANCE and not surface.outline:
        # It curves the wrong way, but other points may come into contact before any gain.
        zone = zone_at(surface, task.points, placed)
        if slid(surface, task.points, zone, way, noise) is None:
            bend = 0.0
    holding = forces > NO_FORCE
    rows = rows[holding].astype(np.int64)
    return Balance(rows, signs[holding], forces[holding], unbalanced, bend, way)


def _least_curvature(
    task: ZoneTask, placed: ElementPose, local: Float, weights: Float, touch: Float, steps: Float
) -> tuple[float, Float]:
    """Return the least curvature with loaded points at their bounds, and its direction."""
    free = list(task.surface.free)
    holding = np.abs(weights) > NO_FORCE
    curvature, _, _ = second_derivatives(
        task.surface, local[holding], placed.sizes, weights[holding]
    )
    hessian = steps.T @ curvature[np.ix_(free, free)] @ steps
    directions = _loose(touch[:, holding], len(steps))
    if not directions.shape[1]:
        return np.inf, np.zeros(len(steps))
    scale = max(float(np.abs(hessian).max()), 1e-300)
    bends, ways = np.linalg.eigh(directions.T @ hessian @ directions)
    return float(bends[0] / scale), steps @ directions @ ways[:, 0]


def _loose(touch: Float, k: int) -> Float:
    """Return the directions (k, m) in which contacts (columns) stay at their bounds."""
    directions, strength, _ = np.linalg.svd(
        scipy.linalg.null_space(touch.T, rcond=1e-10)[:k], full_matrices=False
    )
    return directions[:, strength > 1e-9]


def _held_by_others(
    task: ZoneTask, placed: ElementPose, local: Float, signs: Float, forces: Float, touch: Float,
    steps: Float,
) -> float:  # fmt: skip
    """Return the least curvature with direction-dependent forces, else minus infinity."""
    free, holding = list(task.surface.free), forces > NO_FORCE
    directions = steps @ _loose(touch[:, holding], len(steps))
    scale = 1e-300
    hessians = []
    for point, sign, force in zip(local, signs, forces, strict=True):
        bent, _, _ = second_derivatives(task.surface, point[None], placed.sizes, np.array([sign]))
        bent = bent[np.ix_(free, free)]
        hessians.append(directions.T @ bent @ directions)
        scale = max(scale, float(np.abs(force * (steps.T @ bent @ steps)).max()))
    right = touch @ forces
    least = least_held(np.array(hessians), touch, right)
    return -np.inf if least is None else least / scale
