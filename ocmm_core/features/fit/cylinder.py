"""A cylinder by orthogonal distance, cold: nothing is known of its axis.

A hemisphere of trial axes is ranked by Taubin's circle through the points projected along each;
the best are refined and the best of the results is kept. The fit has local minima, above all for
few points and short arcs, and one start finds one of them.
"""

from __future__ import annotations

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.fit.axis_kernel import CYLINDER
from ocmm_core.features.fit.ball import (
    LARGEST_RADIUS,
    WORST_CONDITION,
    not_converged,
    taubin_centre,
    taubin_moments,
)
from ocmm_core.features.fit.common import (
    FLAT,
    centred,
    checked_points,
    degenerate,
    oriented,
    principal_axes,
)
from ocmm_core.features.fit.solver import Solution, derivatives, minimise, sensitivity
from ocmm_core.features.shapes import GEOMETRY_SIZE, Fit, Shape, element, make_fit
from ocmm_core.geometry import Float, Points3

TRIAL_AXES = 60
"""Trial axes over the hemisphere; more lie around the principal axes of the points."""
RINGS = np.deg2rad([1.5, 4.0, 10.0])
"""How far around; the patch of a long cylinder's narrow arc has a narrow basin there."""
RANKING_POINTS = 250
"""The trial axes are ranked with at most about twice this many of the points."""
REFINED = 8
"""Trial axes that are refined; many more where points are so few that minima abound."""
REFINED_FEW = 30
FEW_POINTS = 8
APART = np.cos(np.deg2rad(6.0))
"""Axes nearer to each other than this lead to the same minimum."""
EXACT = 1e-10
"""Residual against the size of the points below which a cylinder passes through a point."""

NEAR_HINT = 0.05
"""Relative difference from the expected radius that a cylinder through few points may show."""


def fit_cylinder(
    points: Points3, direction_hint: Float | None = None, radius_hint: float | None = None
) -> Fit:
    """Return the cylinder of ``points`` (n, 3), mm; residuals are positive outside.

    Parameters
    ----------
    points
        (n, 3), mm.
    direction_hint
        (3,): orients the axis.
    radius_hint
        mm: decides only where several cylinders pass through all points, as up to six do
        through five points, and only if just one of them has about this radius.

    Raises
    ------
    FitError
        Too few points, or they do not determine one cylinder.
    """
    points = checked_points(Shape.CYLINDER, points)
    centroid, about, size = centred(Shape.CYLINDER, points)
    extents, _ = principal_axes(about)
    flat = degenerate(
        Shape.CYLINDER,
        "they lie in a plane, on one circle or on too small a patch",
        "Take points around the cylinder at two heights or more.",
    )
    if extents[2] < FLAT * extents[0]:
        raise flat
    solutions = _minima(about)
    if not solutions:
        raise not_converged(Shape.CYLINDER)
    hint = None if radius_hint is None else radius_hint / size
    best = _chosen(solutions, len(points), hint)
    best[3:6] = oriented(best[3:6], direction_hint)
    residuals, jacobian, _ = derivatives(CYLINDER, about, best)
    inverse, condition = sensitivity(jacobian)
    if condition > WORST_CONDITION:
        raise flat
    geometry = element(centroid + size * best[0:3], best[3:6], size * best[6])
    by_points = _by_points(best, about, -inverse, jacobian)
    by_points[3:6] /= size
    return make_fit(Shape.CYLINDER, geometry, by_points, size * residuals)


def _minima(points: Float) -> list[Solution]:
    """Return the minima that were found, best first, each once."""
    few = len(points) <= FEW_POINTS
    found: list[Solution] = []
    for start in _starts(points, REFINED_FEW if few else REFINED):
        solution = minimise(CYLINDER, points, start)
        if solution.converged and 0.0 < solution.parameters[6] < LARGEST_RADIUS:
            known = [_same(solution.parameters, other.parameters) for other in found]
            if not any(known):
                found.append(solution)
    return sorted(found, key=lambda solution: solution.cost)


def _same(first: Float, second: Float) -> bool:
    """Return whether two minima are one (their feet and radii; axes without sense)."""
    near = float(np.abs(first[[0, 1, 2, 6]] - second[[0, 1, 2, 6]]).max())
    turned = float(np.linalg.norm(np.cross(first[3:6], second[3:6])))
    return near < 1e-6 * (1.0 + abs(float(first[6]))) and turned < 1e-6


def _chosen(solutions: list[Solution], n: int, radius_hint: float | None) -> Float:
    exact = [solution for solution in solutions if solution.cost < n * EXACT**2]
    if len(exact) < 2:
        return solutions[0].parameters.copy()
    if radius_hint is not None:
        near = [
            solution
            for solution in exact
            if abs(float(solution.parameters[6]) - radius_hint) < NEAR_HINT * radius_hint
        ]
        if len(near) == 1:
            return near[0].parameters.copy()
    raise FitError(
        "fit.ambiguous",
        f"{len(exact)} different cylinders pass through the {n} points of a cylinder.",
        "Take more points.",
    )


def _starts(points: Float, count: int) -> list[Float]:
    """Return up to ``count`` start parameters, the most promising trial axis first."""
    sample = points[:: max(1, len(points) // RANKING_POINTS)]
    # The sample has its own centroid; the feet are taken back to that of all points.
    middle = sample.mean(axis=0)
    sample = sample - middle
    principal = np.linalg.svd(sample, full_matrices=False)[2]
    rings = [ring(principal, k, RINGS) for k in range(3)]
    axes = np.concatenate([principal, *rings, hemisphere(TRIAL_AXES)])
    frames = np.stack(across_axes(axes), axis=1)
    projected = (sample @ frames.reshape(-1, 3).T).T.reshape(len(axes), 2, -1)
    moments, mean_square = taubin_moments(np.swapaxes(projected, 1, 2))
    values, vectors = np.linalg.eigh(moments)
    centres, radii = taubin_centre(vectors[..., 0], mean_square)
    chosen: list[int] = []
    for i in np.argsort(values[:, 0], kind="stable"):
        if len(chosen) < count and not np.any(np.abs(axes[chosen] @ axes[i]) > APART):
            chosen.append(int(i))
    feet = np.einsum("dk,dkx->dx", centres, frames) + middle
    feet -= axes * np.sum(feet * axes, axis=1)[:, None]
    return [np.concatenate([feet[i], axes[i], [radii[i], 0.0]]) for i in chosen]


def ring(principal: Float, k: int, tilts: Float) -> Float:
    """Return eight axes at every tilt around the principal axis ``k``, (8 t, 3)."""
    turns = np.arange(8) * np.pi / 4.0
    side = np.outer(np.cos(turns), principal[k - 1]) + np.outer(np.sin(turns), principal[k - 2])
    return np.concatenate([np.cos(t) * principal[k] + np.sin(t) * side for t in tilts])


def across_axes(axis: Float) -> tuple[Float, Float]:
    """Return two unit vectors (..., 3) square to ``axis`` (..., 3) and to each other.

    The form of T. Duff and others, Building an orthonormal basis, revisited, JCGT 6 (2017):
    without branches, thus for many axes at once, and quick for one.
    """
    x, y, z = axis[..., 0], axis[..., 1], axis[..., 2]
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    first = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=-1)
    second = np.stack([b, sign + y * y * a, -y], axis=-1)
    return first, second


def hemisphere(count: int) -> Float:
    """Return directions (count, 3) spread evenly over a hemisphere (Fibonacci spiral)."""
    index = np.arange(count) + 0.5
    height = index / count
    turn = np.pi * (1.0 + np.sqrt(5.0)) * index
    ring = np.sqrt(1.0 - height**2)
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1)


def _by_points(parameters: Float, points: Float, inverse: Float, jacobian: Float) -> Float:
    """Return d(geometry) / d(points), (12, 3 n), of the centred and scaled cylinder."""
    n = len(points)
    axis = parameters[3:6]
    basis = np.stack(across_axes(axis))
    by_shift = np.zeros((GEOMETRY_SIZE, n))
    by_shift[0:3] = basis.T @ inverse[0:2]
    by_shift[3:6] = basis.T @ inverse[2:4]
    by_shift[6] = inverse[4]
    # A turn of the axis moves the foot of a centroid that is not on it.
    by_shift[0:3] += np.outer(axis, -parameters[0:3] @ by_shift[3:6])
    radial = -jacobian[:, 0:2] @ basis
    by_points = by_shift[:, :, None] * radial
    by_points[0:3] += np.outer(axis, axis)[:, None, :] / n
    return by_points.reshape(GEOMETRY_SIZE, 3 * n)
