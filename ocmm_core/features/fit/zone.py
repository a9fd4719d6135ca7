"""Minimum-zone elements (Chebyshev): the smallest greatest distance, with the points that prove it.

The zone starts from the least-squares element and is never wider than that one's.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.fit.ball import LARGEST_RADIUS
from ocmm_core.features.fit.common import centred, checked_points, degenerate
from ocmm_core.features.fit.zone_certificate import Balance, balance_of
from ocmm_core.features.fit.zone_elements import (
    ZONES,
    Task,
    geometry_derivatives,
    task_of,
    unscaled,
)
from ocmm_core.features.fit.zone_solver import Zone, best_zone, polished, zone_at
from ocmm_core.features.fit.zone_surfaces import (
    CONE,
    FLAT_LINE,
    TORUS,
    Surface,
    distances,
    second_derivatives,
)
from ocmm_core.features.shapes import (
    ACROSS,
    DIRECTION,
    GEOMETRY_SIZE,
    Criterion,
    Fit,
    Shape,
    element,
    make_fit,
)
from ocmm_core.geometry import Float, Points3, unit

STARTS = 12
"""Starts around the least-squares element; more where the zone is broad or the points are few."""
STARTS_BROAD = 30
STARTS_STRAIGHT = 4
"""Of line and plane, whose zones are all but convex."""
BROAD_STRAIGHT = 0.1
BROAD = 0.03
"""Width of the zone against the size of the points from which local minima lie far apart."""
FEW_POINTS = 12
POLISHES = 4
ONE_PLANE = 1e-11
"""Extent, against the size of the points, that is none."""
WELL_BALANCED = 1e-12


def fit_zone(start: Fit, points: Points3) -> Fit:
    """Return the element with the smallest zone about ``points``.

    Straightness of a line in space is the diameter of the thinnest cylinder about the points;
    roundness is taken in the plane of ``start``.

    Parameters
    ----------
    start
        Least-squares fit of the same points.
    points
        (n, 3), mm.

    Returns
    -------
    Its ``contacts`` are the points that hold the zone; its jacobian is what follows from them. A
    point that does not touch moves nothing but the foot of the centroid along the element. Where
    all points lie on the element to rounding, there are no contacts, and the geometry and
    jacobian are those of ``start``.

    Raises
    ------
    FitError
        The shape has no minimum zone here, the points do not determine it, or no zone was found
        that its contacts prove to be a smallest one.
    """
    points = checked_points(start.shape, points)
    if start.shape is Shape.LINE and _in_one_plane(points):
        # The thinnest cylinder about them has its axis in that plane, where it has a kink.
        return fit_zone_line_in_plane(start, points)
    surface = ZONES.get(start.shape)
    if surface is None:
        raise FitError(
            "fit.no_criterion",
            f"A minimum zone is not offered for a {start.shape.value.lower()}.",
            "Choose least squares.",
        )
    task = task_of(start, points, surface)
    found = settled_fit(task, start, Criterion.MINIMUM_ZONE, search(task))
    if found.form > start.form and start.shape is not Shape.LINE:
        # Rounding alone leads here; a zone is never stated wider than that of least squares.
        return replace(
            found, geometry=start.geometry, residuals=start.residuals, rms=start.rms,
            form=start.form,
        )  # fmt: skip
    return found


def fit_zone_line_in_plane(
    start: Fit, points: Points3, plane_normal: Float | None = None
) -> Fit:
    """Return the line in a plane with the two closest parallel lines about the points.

    Parameters
    ----------
    start
        Least-squares line of the same points.
    points
        (n, 3), mm; they are projected into the plane through their centroid.
    plane_normal
        (3,): of that plane, any length; without it the points' own least-squares plane. The
        jacobian takes it as given.

    Returns
    -------
    Residuals are signed, positive along `Fit.across`, which lies in the plane.

    Raises
    ------
    FitError
        The points do not determine a line in that plane.
    """
    points = checked_points(Shape.LINE, points)
    _, about, _ = centred(Shape.LINE, points)
    if plane_normal is None:
        _, _, axes = np.linalg.svd(about, full_matrices=True)
        across = axes[1] - start.direction * (axes[1] @ start.direction)
        normal = np.cross(start.direction, unit(across))
    else:
        normal = unit(np.asarray(plane_normal, dtype=np.float64))
    direction = start.direction - normal * (normal @ start.direction)
    if np.linalg.norm(direction) < 0.1:
        raise degenerate(
            Shape.LINE,
            "they run square to the plane in which straightness is asked for",
            "Name the plane in which the line lies.",
        )
    # The start is the line of the projected points, or its zone might not be the wider one.
    flat = about - np.outer(about @ normal, normal)
    principal = np.linalg.svd(flat, full_matrices=False)[2][0]
    along = unit(principal if principal @ direction > 0.0 else -principal)
    across = np.cross(normal, along)
    geometry = element(points.mean(axis=0), along, across=across)
    task = task_of(replace(start, geometry=geometry), points, FLAT_LINE)
    jacobian = np.zeros((GEOMETRY_SIZE, points.size))
    jacobian[0:3] = start.jacobian[0:3]
    runs = about @ along
    turn = np.kron(runs / (task.size * (runs @ runs)), across)
    jacobian[DIRECTION], jacobian[ACROSS] = np.outer(across, turn), -np.outer(along, turn)
    flat_start = make_fit(
        Shape.LINE, geometry, jacobian, task.size * (about @ across)
    )
    fit = settled_fit(task, flat_start, Criterion.MINIMUM_ZONE, search(task))
    if plane_normal is None:
        fit.jacobian[DIRECTION] += np.outer(normal, normal) @ start.jacobian[DIRECTION]
    return fit


def _in_one_plane(points: Points3) -> bool:
    """Return whether points that are not on a line lie in a plane, to rounding."""
    centroid, about, size = centred(Shape.LINE, points)
    extents = np.linalg.svd(about, compute_uv=False)
    rounding = ONE_PLANE * (1.0 + 1e-3 * float(np.abs(centroid).max()) / size)
    return len(points) > 2 and bool(extents[1] > 1e3 * rounding and extents[2] < rounding)


def search(task: Task) -> Zone:
    """Return the best zone from as many starts as the points call for."""
    first = zone_at(task.surface, task.points, task.start)
    found, _ = distances(task.surface, task.start.local(task.points), task.start.size)
    if np.ptp(found) <= _noise(task, found):
        return first
    few = len(task.points) <= FEW_POINTS
    if task.shape in (Shape.LINE, Shape.PLANE):
        # Distances are lengths of what is linear in the step, but for the cosine of the lean.
        starts = STARTS if few or np.ptp(found) > BROAD_STRAIGHT else STARTS_STRAIGHT
    else:
        starts = STARTS_BROAD if few or np.ptp(found) > BROAD else STARTS
    return balanced(task, best_zone(task.surface, task.points, task.start, starts))


def balanced(task: Task, zone: Zone) -> Zone:
    """Return the zone with its contacts in balance to rounding, as far as Newton steps reach."""
    found, _ = distances(task.surface, zone.placed.local(task.points), zone.placed.size)
    for _ in range(POLISHES):
        balance = balance_of(task, zone.placed, _noise(task, found))
        if balance.unbalanced < WELL_BALANCED:
            break
        coded = np.where(balance.signs > 0.0, 0, len(task.points)) + balance.contacts
        zone = polished(task.surface, task.points, zone, coded, balance.forces)
    return zone


def _noise(task: Task, found: Float) -> float:
    return 8.0 * task.noise * max(1.0, float(np.abs(found).max()))


def settled_fit(task: Task, start: Fit, criterion: Criterion, zone: Zone) -> Fit:
    """Return the fit of a zone, or raise where nothing proves it.

    Raises
    ------
    FitError
        See `fit_zone`.
    """
    surface, placed = task.surface, zone.placed
    found, _ = distances(surface, placed.local(task.points), placed.size)
    offset = _offset(surface, task.shape, zone)
    noise = _noise(task, found)
    if max(abs(offset), float(np.abs(placed.origin).max()), placed.size) > LARGEST_RADIUS:
        raise degenerate(
            task.shape,
            "the smallest zone belongs to an element that is all but flat",
            "Spread the points over more of the feature.",
        )
    thin = abs(zone.width) if task.shape is Shape.LINE else float(np.ptp(found))
    if thin <= noise:
        return replace(start, criterion=criterion)
    balance = balance_of(task, placed, noise)
    if not balance.holds:
        raise unproven(task.shape, balance)
    geometry, by_points = zone_derivatives(task, zone, offset, balance)
    geometry, by_points = unscaled(task, geometry, by_points)
    if surface == CONE and (geometry[6] <= 0.0 or not 0.0 < geometry[8] < np.pi / 2.0):
        raise degenerate(task.shape, "they lie on both sides of its apex", "Take other points.")
    if surface == TORUS and not 0.0 < geometry[7] < geometry[6]:
        raise degenerate(
            task.shape, "its tube would be thicker than its ring", "Spread the points."
        )
    if task.shape is Shape.CIRCLE:
        # The plane is that of the start, as in `circle.fit_circle`.
        by_points[DIRECTION] = start.jacobian[DIRECTION]
        lift = -np.outer(start.direction, geometry[0:3] - task.centroid)
        by_points[0:3] += lift @ start.jacobian[DIRECTION]
        geometry[DIRECTION] = start.direction
    residuals = surface.sign * found - offset
    if task.shape is Shape.LINE and surface != FLAT_LINE:
        residuals = found * _sides(task, zone, int(balance.contacts[0]))
    contacts = tuple(int(i) for i in np.unique(balance.contacts))
    return make_fit(
        task.shape, geometry, by_points, task.size * residuals,
        criterion=criterion, contacts=contacts,
    )  # fmt: skip


def unproven(shape: Shape, balance: Balance) -> FitError:
    """Return the error for a zone whose contacts do not hold it."""
    return FitError(
        "fit.not_converged",
        f"No smallest zone of the {shape.value.lower()} was found: {len(balance.contacts)} "
        f"points touch it, but do not hold it ({balance.unbalanced:.0e}).",
        "Check that the points belong to one feature and spread them over more of it.",
    )


def _offset(surface: Surface, shape: Shape, zone: Zone) -> float:
    if surface.lower:
        return 0.5 * (zone.upper + zone.lower)
    return 0.0 if shape is Shape.LINE else surface.sign * zone.upper


def _sides(task: Task, zone: Zone, contact: int) -> Float:
    """Return +1 or -1 (n,): the side of every point of a line, as one contact sees it.

    Forces at the contacts balance, so that some lie on either side of the first, and the signed
    distances range over the whole diameter.
    """
    across = zone.placed.local(task.points)[:, :2]
    return np.where(across @ across[contact] < 0.0, -1.0, 1.0)


def zone_derivatives(
    task: Task, zone: Zone, offset: float, balance: Balance
) -> tuple[Float, Float]:
    """Return geometry (12,) and its derivatives by points (12, 3 n), both scaled.

    The conditions of the optimum (contacts touch, forces balance) are differentiated.
    """
    surface, placed, rows = task.surface, zone.placed, balance.contacts
    local = placed.local(task.points)[rows]
    free = list(surface.free)
    k, c = len(free), len(rows)
    weights = balance.signs * balance.forces
    _, slopes = distances(surface, local, placed.size)
    curvature, by_points, mixed = second_derivatives(surface, local, placed.size, weights)
    bounds = 2 if surface.lower else 1
    touch = np.zeros((c, k + bounds))
    touch[:, :k] = slopes[:, free]
    touch[balance.signs > 0.0, k] = -1.0
    if surface.lower:
        touch[balance.signs < 0.0, k + 1] = -1.0
    matrix = np.zeros((k + bounds + c, k + bounds + c))
    matrix[:k, :k] = curvature[np.ix_(free, free)]
    matrix[k + bounds :, : k + bounds] = touch
    matrix[: k + bounds, k + bounds :] = touch.T
    right = np.zeros((len(matrix), c, 3))
    right[:k] = -mixed[:, free].transpose(1, 0, 2)
    right[k + bounds + np.arange(c), np.arange(c)] = -by_points
    # Least change where contacts do not pin the element: a slide that changes no form.
    answer = np.linalg.lstsq(matrix, right.reshape(len(matrix), 3 * c), rcond=1e-13)[0]
    geometry, by_step, by_offset, by_centroid = geometry_derivatives(task, placed, offset)
    by_contact = by_step[:, free] @ answer[:k]
    if surface.lower:
        by_contact += np.outer(by_offset, 0.5 * (answer[k] + answer[k + 1]))
    elif task.shape is not Shape.LINE:
        by_contact += surface.sign * np.outer(by_offset, answer[k])
    n = len(task.points)
    by_all = np.tile(by_centroid[:, None, :] / n, (1, n, 1))
    world = by_contact.reshape(GEOMETRY_SIZE, c, 3) @ placed.frame.T
    for i, row in enumerate(rows):
        by_all[:, row] += world[:, i]
    return geometry, by_all.reshape(GEOMETRY_SIZE, 3 * n)
