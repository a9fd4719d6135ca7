"""Cone by orthogonal distance, cold start without an axis."""

from __future__ import annotations

from functools import cache, partial

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features import search
from ocmm_core.features.elements._ball import LARGEST_RADIUS, WORST_CONDITION, not_converged
from ocmm_core.features.shapes import GEOMETRY_SIZE, Fit, Shape, element, make_fit
from ocmm_core.geometry import Float, Points3

RANKING_POINTS = 60
ANGLES = np.arange(-87.5, 90.0, 5.0)
"""deg between the surface and trial axes."""
FARTHEST = 100.0
"""Radius of a bend, relative to the size of the points, beyond which it is not visible."""
FLATTEST = np.deg2rad(89.9)
"""Half angle from which a cone counts as a plane."""
NEAR_HINT = np.deg2rad(2.0)
"""Allowed difference from the expected half angle of a cone through few points."""


def fit_cone(points: Points3, half_angle_hint: float | None = None) -> Fit:
    """Return the cone of ``points`` (n, 3), mm; residuals are positive outside.

    Its direction points to growing radius. ``half_angle_hint``, rad, may decide between rivals, of
    which many pass through six points. FitError if the points do not determine one cone.
    """
    points = search.checked_points(Shape.CONE, points)
    flat = search.degenerate(
        Shape.CONE,
        "they lie in a plane, on one circle or on too small a patch",
        "Take points around the cone at two heights or more.",
    )
    centroid, about, size = search.centred_solid(Shape.CONE, points, flat)
    expected, asked = None, _families(about)
    if half_angle_hint is not None:
        expected = partial(_from_plan, expected=half_angle_hint)
        asked = (*asked, search.planned(asked, slice(6, 7), np.array([half_angle_hint])))
    solutions = search.minima(search.CONE, about, asked, _possible)
    if not solutions:
        raise not_converged(Shape.CONE)
    one_sided = [solution for solution in solutions if solution.parameters[7] > 0.0]
    if not one_sided:
        raise search.degenerate(
            Shape.CONE,
            "they lie on both sides of its apex",
            "Take the points on one side of the apex.",
        )
    build = partial(_fit, centroid=centroid, about=about, size=size, flat=flat)
    return search.decided(search.candidates(Shape.CONE, one_sided, len(points), expected), build)


def _fit(best: Float, *, centroid: Float, about: Float, size: float, flat: FitError) -> Fit:
    """Return the fit of parameters (8,); raise ``flat`` if undetermined."""
    if best[6] < 0.0:
        best[3:7] *= -1.0
    residuals, jacobian, _ = search.derivatives(search.CONE, about, best)
    inverse, condition = search.sensitivity(jacobian)
    if condition > WORST_CONDITION:
        raise flat
    half_angle = float(best[6])
    radius = float(best[7] / np.cos(half_angle))
    geometry = element(centroid + size * best[0:3], best[3:6], size * radius, half_angle=half_angle)
    by_points = _by_points(best, about, -inverse)
    by_points[3:6] /= size
    by_points[8] /= size
    return make_fit(Shape.CONE, geometry, by_points, size * residuals)


def _from_plan(parameters: Float, expected: float) -> float:
    return float(abs(abs(parameters[6]) - expected) / NEAR_HINT)


def _possible(parameters: Float) -> bool:
    return abs(float(parameters[6])) < FLATTEST and abs(float(parameters[7])) < LARGEST_RADIUS


def _families(points: Float) -> tuple[search.Family, ...]:
    quadrics = cache(partial(search.quadric_axes, points))
    return (
        lambda: _starts(points, search.trial_axes(points)),
        lambda: _by_curvature(points, quadrics()),
        lambda: _starts(points, np.concatenate([quadrics(), search.many_axes(points)])),
    )


def _by_curvature(points: Float, quadrics: Float) -> Float:
    """Return start parameters (m, 8): cones from patch curvatures, and quadrics' axes.

    A cone bends in one direction only. Its axis is in the plane of the other one and the normal, at
    the half angle from the surface, and passes through the centre of the bend.
    """
    patch = search.curved_patch(points)
    bend = int(np.argmax(np.abs(patch.curvatures)))
    curvature = float(patch.curvatures[bend])
    curvature = np.copysign(max(abs(curvature), 1.0 / FARTHEST), curvature)
    along = patch.directions[1 - bend]
    angles = np.deg2rad(ANGLES)
    axes = np.cos(angles)[:, None] * along + np.sin(angles)[:, None] * patch.normal
    first = _starts(points, np.concatenate([axes, quadrics]))
    centre = patch.foot + patch.normal / curvature
    # The axis passes through the centre of the bend; seen from there the points open to one side.
    feet = centre - (axes @ centre)[:, None] * axes
    bent = np.column_stack([feet, axes, np.zeros((len(axes), 2))])
    search.flanks(search.sampled(points, RANKING_POINTS), bent)
    return np.concatenate([first, bent])


def _starts(points: Float, axes: Float) -> Float:
    """Return start parameters (m, 8): two cones for every trial axis.

    About the foot of a quadric of revolution, and of Taubin's circle, for narrow cones and short
    arcs.
    """
    sample, m = search.sampled(points, RANKING_POINTS), len(axes)
    found = np.zeros((2 * m, 8))
    search.quadric_feet(sample, axes, found[:m])
    search.circles(sample, axes, found[m:])
    search.flanks(sample, found)
    return found


def _by_points(p: Float, points: Float, inverse: Float) -> Float:
    """Return d(geometry) / d(points), (12, 3 n), of the scaled cone from ``inverse`` (6, n)."""
    n = len(points)
    axis, cosine, sine = p[3:6], np.cos(p[6]), np.sin(p[6])
    basis = np.stack(search.across_axes(axis))
    by_shift = np.zeros((GEOMETRY_SIZE, n))
    by_shift[0:3] = basis.T @ inverse[0:2]
    by_shift[3:6] = basis.T @ inverse[2:4]
    # A rotation of the axis moves the foot of a centroid off the axis, to another radius.
    along = -p[0:3] @ by_shift[3:6]
    by_shift[0:3] += np.outer(axis, along)
    by_shift[8] = inverse[4]
    by_distance = inverse[5] + sine * along
    by_shift[6] = by_distance / cosine + p[7] * sine / cosine**2 * inverse[4]
    arms = points - p[0:3]
    outward = arms - np.outer(arms @ axis, axis)
    outward /= np.maximum(np.linalg.norm(outward, axis=1), 1e-12)[:, None]
    normals = cosine * outward - sine * axis
    by_points = by_shift[:, :, None] * normals
    by_points[0:3] += np.outer(axis, axis)[:, None, :] / n
    by_points[6] += sine / cosine * axis / n
    flat: Float = by_points.reshape(GEOMETRY_SIZE, 3 * n)
    return flat
