"""Minimum-zone elements (Chebyshev) with their contact points as proof, and bounding elements.

The search starts from the least-squares element; the result is never wider than its zone.

Largest inscribed and smallest circumscribed circle, sphere and cylinder: circumscribed circle and
sphere are convex problems with one optimum. An inscribed element is a local optimum, as outside of
the points it could grow without limit: the largest one surrounded by its contacts is meant. For
circle and sphere every such element is the circumcircle of a Delaunay triangle, or circumsphere of
a tetrahedron, that contains its own centre; all of them are examined, and the largest is the global
optimum. For cylinders, inscribed and circumscribed, it is the best of the optima around the
least-squares cylinder.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy

from ocmm_core.errors import FitError
from ocmm_core.features.search import centred, checked_points, degenerate
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
from ocmm_core.features.zones._elements import BOUNDED, ZoneTask, task_of, zone_surface
from ocmm_core.features.zones._kernel import narrowest_zone
from ocmm_core.features.zones._settled import balanced, search, settled_fit
from ocmm_core.features.zones._solver import Zone, natural_steps, settle
from ocmm_core.features.zones._surfaces import FLAT_LINE, ElementPose
from ocmm_core.geometry import Float, Points3, unit

ONE_PLANE = 1e-11
"""Relative extent of points that counts as zero."""


def fit_zone(start: Fit, points: Points3, offset: float = 0.0) -> Fit:
    """Return the element with the smallest zone about ``points`` (n, 3), mm.

    Straightness of a line in space is the diameter of the thinnest cylinder about the points.
    Circle, ellipse, slot and rectangle are found in the plane of ``start``, the least-squares fit;
    a circle fitted in space as one problem gets the thinnest tube about it, plane included.
    ``offset``, mm, ellipse only: distance of the points outside of it, as in `ellipse.fit_ellipse`.

    Its ``contacts`` are the points that hold the zone; its jacobian follows from them. Other points
    only move the foot of the centroid along the element. If all points are on the element to
    rounding, there are no contacts, and geometry and jacobian are those of ``start``. FitError if
    the shape has no minimum zone here, or no zone was proven minimal by its contacts.
    """
    points = checked_points(start.shape, points)
    if start.shape is Shape.LINE and _in_one_plane(points):
        # The thinnest cylinder has its axis in that plane, where the problem has a kink.
        return fit_zone_line_in_plane(start, points)
    surface = zone_surface(start)
    if surface is None:
        raise FitError(
            "fit.no_criterion",
            f"A minimum zone is not available for a {start.shape.value.lower()}.",
            "Choose least squares.",
        )
    task = task_of(start, points, surface, offset)
    found = settled_fit(task, start, Criterion.MINIMUM_ZONE, search(task))
    own = 2.0 * float(np.abs(start.residuals).max()) if surface.even else start.form
    if found.form > own and not task.tube:
        # Only by rounding; a reported zone is never wider than that of least squares.
        return replace(
            found, geometry=start.geometry, residuals=start.residuals, rms=start.rms, form=own
        )
    return found


def fit_zone_line_in_plane(start: Fit, points: Points3, plane_normal: Float | None = None) -> Fit:
    """Return the line in a plane with the two closest parallel lines about the points.

    ``points`` (n, 3), mm, of the least-squares line ``start``, are projected into the plane through
    their centroid; its normal (3,), any length, is constant for the jacobian; default the
    least-squares plane. Residuals are positive along `Fit.across`, which is in the plane. FitError
    if the points do not determine a line in that plane.
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
            "they run normal to the plane of the straightness",
            "Name the plane in which the line lies.",
        )
    # Start from the line of the projected points, which guarantees a zone not wider than its own.
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
    flat_start = make_fit(Shape.LINE, geometry, jacobian, task.size * (about @ across))
    fit = settled_fit(task, flat_start, Criterion.MINIMUM_ZONE, search(task))
    if plane_normal is None:
        fit.jacobian[DIRECTION] += np.outer(normal, normal) @ start.jacobian[DIRECTION]
    return fit


def _in_one_plane(points: Points3) -> bool:
    """Return whether non-collinear points are in a plane, to rounding."""
    centroid, about, size = centred(Shape.LINE, points)
    extents = np.linalg.svd(about, compute_uv=False)
    rounding = ONE_PLANE * (1.0 + 1e-3 * float(np.abs(centroid).max()) / size)
    return len(points) > 2 and bool(extents[1] > 1e3 * rounding and extents[2] < rounding)


SURROUNDED = 1e-6
"""Least sine of the angle by which points extend beyond any half space through the centre."""
OWN_CENTRE = -1e-9
"""Least barycentric coordinate of a centre counted as inside its simplex."""
TRIED = 3
"""Number of largest circumcircles to refine; rounding may have swapped their order."""


def fit_bounded(start: Fit, points: Points3, criterion: Criterion) -> Fit:
    """Return the largest inscribed or smallest circumscribed element.

    ``start`` is the least-squares circle, sphere or cylinder of ``points`` (n, 3), mm; a circle
    must not be fitted in space as one problem, and stays in its plane. Residuals are signed
    distances, positive outside: nonnegative for an inscribed element, nonpositive for a
    circumscribed one. Contacts and jacobian as in `zone.fit_zone`.

    FitError if the shape has no such element, the points do not surround the axis or centre (an arc
    up to 180 degrees), so that no inscribed element exists, or no contacts hold one.
    """
    points = checked_points(start.shape, points)
    surface = BOUNDED.get((start.shape, criterion))
    if surface is None or start.free:
        raise FitError(
            "fit.no_criterion",
            f"The criterion {criterion.value} is not available for a "
            f"{start.shape.value.lower()}{' in space' if start.free else ''}.",
            "Choose least squares, or a circle in its own plane, sphere or cylinder.",
        )
    task = task_of(start, points, surface)
    inside = criterion is Criterion.INSCRIBED
    if inside and not _surround(task, task.start):
        raise _not_around(start.shape)
    if start.shape is Shape.CYLINDER:
        zone = search(task)
    elif inside:
        zone = _largest_held(task)
    else:
        # Convex, so any start suffices; the least-squares centre of a small patch is far away.
        middle = ElementPose(task.start.frame, np.zeros(3))
        steps = natural_steps(surface, task.points, middle)
        zone = balanced(task, settle(surface, task.points, middle, steps, 1.0))
    if inside and not _surround(task, zone.placed):
        raise _not_around(start.shape)
    return settled_fit(task, start, criterion, zone)


def _not_around(shape: Shape) -> FitError:
    return FitError(
        "fit.not_around",
        f"No largest inscribed {shape.value.lower()}: the points lie on one side of it, so it "
        "could grow without limit.",
        "Take points on more than half of the circumference, or choose least squares.",
    )


def _arms(task: ZoneTask, placed: ElementPose) -> Float:
    """Return points in the relevant coordinates: two across an axis, or three."""
    local = placed.local(task.points)
    return local if task.shape is Shape.SPHERE else local[:, :2]


def _surround(task: ZoneTask, placed: ElementPose) -> bool:
    """Return whether every half space through the centre contains points."""
    arms = _arms(task, placed)
    outward = arms / np.maximum(np.linalg.norm(arms, axis=1), 1e-12)[:, None]
    d = outward.shape[1]
    solution, basis, multipliers = np.zeros(d + 1), np.zeros(d + 1, dtype=np.int64), np.zeros(d + 1)
    narrowest_zone(
        np.zeros(len(arms)), np.ascontiguousarray(outward), np.ones(d), False, 0.0,
        solution, basis, multipliers,
    )  # fmt: skip
    return float(np.max(outward @ solution[:d])) > -SURROUNDED


def _largest_held(task: ZoneTask) -> Zone:
    """Return the largest empty circle or sphere held by points around its centre."""
    arms = _arms(task, task.start)
    starts = [np.zeros(3)]
    for centre in _held_centres(arms)[:TRIED]:
        starts.append(np.append(centre, np.zeros(3 - len(centre))))
    steps = natural_steps(task.surface, task.points, task.start)
    zones = []
    for centre in starts:
        there = ElementPose(task.start.frame, task.start.origin + task.start.frame @ centre)
        zone = settle(task.surface, task.points, there, steps, 0.01)
        if zone.settled and _surround(task, zone.placed):
            zones.append(zone)
    if not zones:
        raise _not_around(task.shape)
    return balanced(task, min(zones, key=lambda zone: zone.width))


def _held_centres(points: Float) -> Float:
    """Return centres (m, d) of empty circumspheres inside their own simplex, largest first."""
    d = points.shape[1]
    try:
        simplices = points[scipy.spatial.Delaunay(points).simplices]
    except scipy.spatial.QhullError:
        # Degenerate, such as points on one exact circle; start from the least-squares centre.
        return np.zeros((0, d))
    edges = simplices[:, 1:] - simplices[:, :1]
    flat = np.abs(np.linalg.det(edges)) < 1e-12
    edges[flat] = np.eye(d)
    half_squares = 0.5 * np.sum(edges**2, axis=2)
    arms = np.linalg.solve(edges, half_squares[:, :, None])[:, :, 0]
    shares = np.linalg.solve(np.swapaxes(edges, 1, 2), arms[:, :, None])[:, :, 0]
    held = ~flat & (shares.min(axis=1) > OWN_CENTRE) & (shares.sum(axis=1) < 1.0 - OWN_CENTRE)
    order = np.argsort(-np.sum(arms[held] ** 2, axis=1), kind="stable")
    centres: Float = (simplices[held, 0] + arms[held])[order]
    return centres
