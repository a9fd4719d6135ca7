"""Cone by orthogonal distance, cold start without an axis."""

from __future__ import annotations

from functools import partial

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.elements._ball import (
    LARGEST_RADIUS,
    WORST_CONDITION,
    not_converged,
    taubin_centre,
    taubin_moments,
)
from ocmm_core.features.search import (
    CONE,
    Family,
    across_axes,
    candidates,
    centred_solid,
    checked_points,
    curved_patch,
    decided,
    degenerate,
    derivatives,
    many_axes,
    minima,
    planned,
    quadric_axes,
    sampled,
    sensitivity,
    trial_axes,
)
from ocmm_core.features.shapes import GEOMETRY_SIZE, Fit, Shape, element, make_fit
from ocmm_core.geometry import Float, Points3

RANKING_POINTS = 60
RIDGE = 1e-12
"""Relative to the diagonal of the normal equations of a start, to avoid singular ones."""
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
    points = checked_points(Shape.CONE, points)
    flat = degenerate(
        Shape.CONE,
        "they lie in a plane, on one circle or on too small a patch",
        "Take points around the cone at two heights or more.",
    )
    centroid, about, size = centred_solid(Shape.CONE, points, flat)
    expected, asked = None, _families(about)
    if half_angle_hint is not None:
        expected = partial(_from_plan, expected=half_angle_hint)
        asked = (*asked, planned(asked, slice(6, 7), np.array([half_angle_hint])))
    solutions = minima(CONE, about, asked, _possible)
    if not solutions:
        raise not_converged(Shape.CONE)
    one_sided = [solution for solution in solutions if solution.parameters[7] > 0.0]
    if not one_sided:
        raise degenerate(
            Shape.CONE,
            "they lie on both sides of its apex",
            "Take the points on one side of the apex.",
        )
    build = partial(_fit, centroid=centroid, about=about, size=size, flat=flat)
    return decided(candidates(Shape.CONE, one_sided, len(points), expected), build)


def _fit(best: Float, *, centroid: Float, about: Float, size: float, flat: FitError) -> Fit:
    """Return the fit of parameters (8,); raise ``flat`` if undetermined."""
    if best[6] < 0.0:
        best[3:7] *= -1.0
    residuals, jacobian, _ = derivatives(CONE, about, best)
    inverse, condition = sensitivity(jacobian)
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


def _families(points: Float) -> tuple[Family, ...]:
    return (
        lambda: _starts(points, trial_axes(points)),
        lambda: _by_curvature(points),
        lambda: _starts(points, many_axes(points)),
    )


def _by_curvature(points: Float) -> Float:
    """Return start parameters (m, 8): cones from patch curvatures, and quadrics' axes.

    A cone bends in one direction only. Its axis is in the plane of the other one and the normal, at
    the half angle from the surface, and passes through the centre of the bend.
    """
    patch = curved_patch(points)
    bend = int(np.argmax(np.abs(patch.curvatures)))
    curvature = float(patch.curvatures[bend])
    curvature = np.copysign(max(abs(curvature), 1.0 / FARTHEST), curvature)
    along = patch.directions[1 - bend]
    angles = np.deg2rad(ANGLES)
    axes = np.cos(angles)[:, None] * along + np.sin(angles)[:, None] * patch.normal
    first = _starts(points, np.concatenate([axes, quadric_axes(points)]))
    centre = patch.foot + patch.normal / curvature
    # The axis passes through the centre of the bend; seen from there the points open to one side.
    feet = centre - (axes @ centre)[:, None] * axes
    sample = sampled(points, RANKING_POINTS)
    arms = sample - feet[:, None, :]
    t = np.sum(arms * axes[:, None, :], axis=2)
    rho = np.linalg.norm(arms - t[:, :, None] * axes[:, None, :], axis=2)
    return np.concatenate([first, _flanks(feet, axes, t, rho)])


def _flanks(feet: Float, axes: Float, t: Float, rho: Float) -> Float:
    """Return starts (m, 8): around each axis the straight flank nearest to the points."""
    t_mean, rho_mean = t.mean(axis=1), rho.mean(axis=1)
    about = t - t_mean[:, None]
    spread = np.maximum(np.sum(about**2, axis=1), 1e-12)
    angle = np.arctan(np.sum(about * rho, axis=1) / spread)
    radius = rho_mean - np.tan(angle) * t_mean
    return np.column_stack([feet, axes, angle, radius * np.cos(angle)])


def _starts(points: Float, axes: Float) -> Float:
    """Return start parameters (m, 8): two cones for every trial axis.

    On a cone x^2 + y^2 - 2 a x - 2 b y is a polynomial of second order in the height: the centre
    (a, b) follows from linear equations. The other centre is that of Taubin's circle, for narrow
    cones and short arcs.
    """
    sample = sampled(points, RANKING_POINTS)
    frames = np.stack(across_axes(axes), axis=1)
    flat = sample @ frames.reshape(-1, 3).T
    x = np.ascontiguousarray(flat.reshape(len(sample), len(axes), 2).swapaxes(0, 1))
    t = axes @ sample.T
    columns = np.stack([2.0 * x[..., 0], 2.0 * x[..., 1], np.ones_like(t), t, t * t], axis=-1)
    transposed = np.swapaxes(columns, 1, 2)
    normal = transposed @ columns
    normal += RIDGE * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(5)
    target = np.sum(x**2, axis=-1)
    by_height = np.linalg.solve(normal, transposed @ target[..., None])
    middle = x.mean(axis=1)
    moments, mean_square = taubin_moments(x - middle[:, None, :])
    by_circle, _ = taubin_centre(np.linalg.eigh(moments)[1][..., 0], mean_square)
    found = []
    for centres in (by_height[:, 0:2, 0], by_circle + middle):
        rho = np.linalg.norm(x - centres[:, None, :], axis=-1)
        feet = np.einsum("mk,mkx->mx", centres, frames)
        found.append(_flanks(feet, axes, t, rho))
    return np.concatenate(found)


def _by_points(p: Float, points: Float, inverse: Float) -> Float:
    """Return d(geometry) / d(points), (12, 3 n), of the scaled cone from ``inverse`` (6, n)."""
    n = len(points)
    axis, cosine, sine = p[3:6], np.cos(p[6]), np.sin(p[6])
    basis = np.stack(across_axes(axis))
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
