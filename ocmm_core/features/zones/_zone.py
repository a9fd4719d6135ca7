"""Minimum-zone elements (Chebyshev) with their contact points as proof.

The search starts from the least-squares element; the result is never wider than its zone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

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
from ocmm_core.features.zones._elements import task_of, zone_surface
from ocmm_core.features.zones._settled import search, settled_fit
from ocmm_core.features.zones._surfaces import FLAT_LINE
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
