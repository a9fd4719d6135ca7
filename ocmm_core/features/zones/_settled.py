"""From a search to a fit: number of starts, balanced contacts, derivatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features import shapes
from ocmm_core.features.elements import LARGEST_RADIUS
from ocmm_core.features.search import degenerate, oriented
from ocmm_core.features.zones._certificate import IN_BALANCE, Balance, balance_of, formless
from ocmm_core.features.zones._elements import ZoneTask, geometry_derivatives, unscaled
from ocmm_core.features.zones._levels import levels_of, response
from ocmm_core.features.zones._rescue import descended, slid
from ocmm_core.features.zones._solver import (
    Zone,
    after,
    best_zone,
    by_bounds,
    natural_steps,
    polished,
    settle,
    zone_at,
)
from ocmm_core.features.zones._surfaces import (
    CONE,
    TORUS,
    ElementPose,
    distances,
    second_derivatives,
)
from ocmm_core.geometry import Float, Int

STARTS = 12
"""Starts around the least-squares element; more for a broad zone or few points."""
STARTS_BROAD = 30
STARTS_STRAIGHT = 4
"""For line and plane, whose zones are almost convex."""
BROAD_STRAIGHT = 0.1
BROAD = 0.03
"""Width of the zone relative to the size of the points above which local minima are far apart."""
FEW_POINTS = 12
POLISHES = 4
RESCUES = 5
"""Attempts to continue an unsettled zone."""
SADDLES = 4
"""Attempts to leave a saddle in the direction of decreasing width."""
SHRUNK = 30
"""Number of tried lengths of such a step, each half of the previous one."""
WELL_BALANCED = 1e-12


def search(task: ZoneTask) -> Zone:
    """Return the best zone, with a number of starts that suits the points."""
    first = zone_at(task.surface, task.points, task.start)
    found, _ = distances(task.surface, task.start.local(task.points), task.start.sizes)
    if formless(task, first, found, _noise(task, found)):
        return first
    few = len(task.points) <= FEW_POINTS
    if task.shape in (shapes.Shape.LINE, shapes.Shape.PLANE):
        # Distances are lengths of linear functions of the step, except for the cosine of the tilt.
        starts = STARTS if few or np.ptp(found) > BROAD_STRAIGHT else STARTS_STRAIGHT
    else:
        starts = STARTS_BROAD if few or np.ptp(found) > BROAD else STARTS
    zone = balanced(task, best_zone(task.surface, task.points, task.start, starts))
    for _ in range(SADDLES):
        lower = _beside_saddle(task, zone)
        if lower is None:
            break
        zone = balanced(task, lower)
    return zone if task.surface.outline else rescued(task, zone)


def rescued(task: ZoneTask, zone: Zone) -> Zone:
    """Return the zone, or a narrower one if it did not settle or its contacts slide."""
    for _ in range(RESCUES):
        found, _ = distances(task.surface, zone.placed.local(task.points), zone.placed.sizes)
        noise = _noise(task, found)
        balance = balance_of(task, zone.placed, noise)
        if balance.holds:
            break
        lower: Zone | None = None
        if balance.unbalanced < IN_BALANCE:
            lower = slid(task.surface, task.points, zone, balance.way, noise)
        lower = balanced(task, lower or descended(task.surface, task.points, zone))
        if not lower.width < zone.width:
            break
        zone = lower
    return zone


def _opened(task: ZoneTask, zone: Zone) -> Zone:
    """Return the zone of a cone with the axis towards the growing radius and a positive angle."""
    placed, angle = zone.placed, float(zone.placed.sizes[0])
    if 0.0 < angle < 0.5 * np.pi:
        return zone
    whole = (angle + np.pi) % (2.0 * np.pi) - np.pi
    beyond = abs(whole) > 0.5 * np.pi
    # Each of the two changes reverses the axis.
    turns = [1.0, -1.0, -1.0] if (whole < 0.0) != beyond else [1.0, 1.0, 1.0]
    sizes = np.array([np.pi - abs(whole) if beyond else abs(whole), *placed.sizes[1:]])
    turned = ElementPose(placed.frame * turns, placed.origin, sizes)
    return replace(zone_at(task.surface, task.points, turned), settled=zone.settled)


def _beside_saddle(task: ZoneTask, zone: Zone) -> Zone | None:
    """Return a narrower zone if forces balance but a move along the contacts is better.

    Exactly symmetric points lead to such saddles: a cylinder with all contacts in one section can
    tilt either way. None if there is no such move.
    """
    surface, points = task.surface, task.points
    found, _ = distances(surface, zone.placed.local(points), zone.placed.sizes)
    balance = balance_of(task, zone.placed, _noise(task, found))
    if balance.holds or balance.unbalanced >= IN_BALANCE:
        return None
    steps = natural_steps(surface, points, zone.placed)
    tried = [
        (zone_at(surface, points, after(surface, zone.placed, way * size * balance.way)), size)
        for size in zone.width * 0.5 ** np.arange(SHRUNK)
        for way in (1.0, -1.0)
    ]
    lower, size = min(tried, key=lambda item: item[0].width)
    if not lower.width < zone.width:
        return None
    there = settle(surface, points, lower.placed, steps, float(size))
    return there if there.width < zone.width else lower


def balanced(task: ZoneTask, zone: Zone) -> Zone:
    """Return the zone with contacts balanced to rounding, as far as Newton steps converge."""
    found, _ = distances(task.surface, zone.placed.local(task.points), zone.placed.sizes)
    for _ in range(POLISHES):
        balance = balance_of(task, zone.placed, _noise(task, found))
        if balance.unbalanced < WELL_BALANCED:
            break
        coded = np.where(balance.signs > 0.0, 0, len(task.points)) + balance.contacts
        zone = polished(task.surface, task.points, zone, coded, balance.forces)
    return zone


def _noise(task: ZoneTask, found: Float) -> float:
    return 8.0 * task.noise * max(1.0, float(np.abs(found).max()))


def settled_fit(
    task: ZoneTask, start: shapes.Fit, criterion: shapes.Criterion, zone: Zone
) -> shapes.Fit:
    """Return the fit of a zone, or raise FitError without a proof; see `zone.fit_zone`."""
    surface = task.surface
    if surface == CONE:
        zone = _opened(task, zone)
    placed = zone.placed
    found, _ = distances(surface, placed.local(task.points), placed.sizes)
    offset = _offset(task, zone)
    noise = _noise(task, found)
    lengths = [abs(offset), *np.abs(placed.origin), *np.abs(placed.sizes)]
    if max(lengths) > LARGEST_RADIUS:
        raise degenerate(
            task.shape,
            "the minimum zone belongs to a nearly flat element",
            "Spread the points over more of the feature.",
        )
    if formless(task, zone, found, noise):
        return replace(start, criterion=criterion)
    balance = balance_of(task, placed, noise)
    if surface.outline and balance.holds:
        placed = _upright(levels_of(task, placed, balance)[0])
        balance = balance_of(task, placed, noise)
    if not balance.holds:
        raise unproven(task.shape, balance)
    if surface.outline:
        placed, levels = levels_of(task, placed, balance)
        rows, answer = response(task, placed, levels)
        found, _ = distances(surface, placed.local(task.points), placed.sizes)
    else:
        rows, answer = balance.contacts, held_response(task, placed, balance)
    geometry, by_points = zone_derivatives(task, placed, offset, rows, answer)
    geometry, by_points = unscaled(task, geometry, by_points)
    if surface == CONE and (geometry[6] <= 0.0 or not 0.0 < geometry[8] < np.pi / 2.0):
        raise degenerate(task.shape, "they lie on both sides of its apex", "Take other points.")
    if surface == TORUS and not 0.0 < geometry[7] < geometry[6]:
        raise degenerate(
            task.shape, "its tube would be thicker than its ring", "Spread the points."
        )
    if surface.outline or (task.shape is shapes.Shape.CIRCLE and not task.tube):
        # The plane is that of the start, as in `flat.fit_in_own_plane`.
        normal, tilt = start.direction, start.jacobian[shapes.DIRECTION]
        geometry[shapes.DIRECTION], by_points[shapes.DIRECTION] = normal, tilt
        by_points[0:3] -= np.outer(normal, geometry[0:3] - task.centroid) @ tilt
        by_points[shapes.ACROSS] -= np.outer(normal, geometry[shapes.ACROSS]) @ tilt
    residuals = surface.sign * found - offset
    if task.tube and task.shape is shapes.Shape.LINE:
        residuals = found * _sides(task, placed, int(rows[0]))
    elif task.tube:
        local = placed.local(task.points)
        residuals = np.copysign(found, np.hypot(local[:, 0], local[:, 1]) - placed.sizes[0])
    contacts = tuple(int(i) for i in np.unique(rows))
    fit = shapes.make_fit(
        task.shape, geometry, by_points, task.size * residuals,
        criterion=criterion, contacts=contacts,
    )  # fmt: skip
    if task.tube and task.shape is shapes.Shape.CIRCLE:
        return replace(fit, form=2.0 * task.size * zone.upper, free=True)
    return fit


def unproven(shape: shapes.Shape, balance: Balance) -> FitError:
    """Return the error for a zone whose contacts do not hold it."""
    return FitError(
        "fit.not_converged",
        f"No minimum zone of the {shape.value.lower()} found: {len(balance.contacts)} contact "
        f"points do not constrain it ({balance.unbalanced:.0e}).",
        "Check that the points belong to one feature and spread them over more of it.",
    )


def _upright(placed: ElementPose) -> ElementPose:
    """Return the same outline with its longer size first, its length as `flat` orients it."""
    frame, (long, short, offset) = placed.frame, placed.sizes
    x, y, z = frame.T
    if short > long:
        long, short, x = short, long, y
    x = oriented(x, None)
    return ElementPose(np.stack([x, np.cross(z, x), z], axis=1), placed.origin,
                  np.array([long, short, offset]))  # fmt: skip


def _offset(task: ZoneTask, zone: Zone) -> float:
    """Return the distance of the element from the reference of distances."""
    if task.surface.lower:
        return 0.5 * (zone.upper + zone.lower)
    return 0.0 if task.tube or task.surface.even else task.surface.sign * zone.upper


def _sides(task: ZoneTask, placed: ElementPose, contact: int) -> Float:
    """Return the side, +1 or -1 (n,), of every point of a line, relative to one contact.

    Forces at the contacts balance, so contacts are on either side of the first, and the signed
    distances cover the whole diameter.
    """
    across = placed.local(task.points)[:, :2]
    return np.where(across @ across[contact] < 0.0, -1.0, 1.0)


def held_response(task: ZoneTask, placed: ElementPose, balance: Balance) -> Float:
    """Return d(free entries and bounds)/d(contacts), (k + 1 or 2, 3 c), scaled.

    The optimality conditions (contacts touch, forces balance) are differentiated.
    """
    surface, rows = task.surface, balance.contacts
    local = placed.local(task.points)[rows]
    free = list(surface.free)
    k, c = len(free), len(rows)
    weights = balance.signs * balance.forces
    _, slopes = distances(surface, local, placed.sizes)
    curvature, by_points, mixed = second_derivatives(surface, local, placed.sizes, weights)
    touch = np.concatenate([slopes[:, free], by_bounds(surface, balance.signs)], axis=1)
    bounds = touch.shape[1] - k
    matrix = np.zeros((k + bounds + c, k + bounds + c))
    matrix[:k, :k] = curvature[np.ix_(free, free)]
    matrix[k + bounds :, : k + bounds] = touch
    matrix[: k + bounds, k + bounds :] = touch.T
    right = np.zeros((len(matrix), c, 3))
    right[:k] = -mixed[:, free].transpose(1, 0, 2)
    right[k + bounds + np.arange(c), np.arange(c)] = -by_points
    # Minimum-norm change if contacts do not pin the element: a slide that changes no form.
    answer = np.linalg.lstsq(matrix, right.reshape(len(matrix), 3 * c), rcond=1e-13)[0]
    return np.asarray(answer[: k + bounds])


def zone_derivatives(
    task: ZoneTask, placed: ElementPose, offset: float, rows: Int, answer: Float
) -> tuple[Float, Float]:
    """Return geometry (12,) and its derivatives by points (12, 3 n), both scaled.

    ``answer`` (k or more, 3 c) has the derivatives of the free entries, then of the bounds, by the
    contacts ``rows`` (c,). ``offset`` as in `geometry_of`.
    """
    surface, c = task.surface, len(rows)
    free = list(surface.free)
    k = len(free)
    geometry, by_step, by_offset, by_centroid = geometry_derivatives(task, placed, offset)
    by_contact = by_step[:, free] @ answer[:k]
    if surface.lower:
        by_contact += np.outer(by_offset, 0.5 * (answer[k] + answer[k + 1]))
    elif not (task.tube or surface.even):
        by_contact += surface.sign * np.outer(by_offset, answer[k])
    n = len(task.points)
    by_all = np.tile(by_centroid[:, None, :] / n, (1, n, 1))
    world = by_contact.reshape(shapes.GEOMETRY_SIZE, c, 3) @ placed.frame.T
    for i, row in enumerate(rows):
        by_all[:, row] += world[:, i]
    return geometry, by_all.reshape(shapes.GEOMETRY_SIZE, 3 * n)
