"""Torus by orthogonal distance, cold start without an axis.

Independent families of starts: for points that surround the axis, Taubin's circle seen along a
trial axis gives the centre. A short piece of a torus is a bent tube: its tube comes from the
curvatures of the patch, or from the nearest cylinders, and the axis is tried all around it, close
for thick tubes and far for thin ones. The circle in the half plane of distance from the axis and
height gives the rest (`tubes`).
"""

from __future__ import annotations

from functools import partial

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features import search, shapes
from ocmm_core.features.elements import _cylinder as cylinder
from ocmm_core.features.elements._ball import LARGEST_RADIUS, WORST_CONDITION, not_converged
from ocmm_core.geometry import Float, Points3

RANKING_POINTS = 60
BENT = np.array([0.7, 2.0, 6.0])
"""Distances of trial centres, relative to the size of the points."""
WAYS = 8
"""Directions around a trial axis."""
REACH = np.array([1.03, 1.25, 1.7, 2.6, 5.0, 12.0, 40.0])
"""Distances of the axis from a tube, over its radius: rings are never thinner than their tube."""
TURNS = 16
"""Directions of the axis around a tube."""
CYLINDERS = 5
"""Nearest ones to be bent."""
THICKEST = 100.0
"""Radius of a tube, relative to the size of the points, beyond which no bend shows."""


def families(points: Float) -> tuple[search.Family, ...]:
    """Return the families of starts for centred and scaled points (n, 3), quickest first."""
    return (
        lambda: ring_starts(points, search.few_axes(points)),
        partial(_by_curvature, points),
        partial(_by_cylinders, points),
        lambda: ring_starts(points, search.trial_axes(points)),
    )


def ring_starts(points: Float, axes: Float) -> Float:
    """Return starts (m, 8) around trial ``axes`` (k, 3)."""
    sample = search.sampled(points, RANKING_POINTS)
    turns = np.arange(WAYS) * 2.0 * np.pi / WAYS
    bent = np.outer(BENT, np.stack([np.cos(turns), np.sin(turns)], axis=1)).reshape(-1, 2)
    starts = np.zeros((1 + len(bent), len(axes), 8))
    search.circles(sample, axes, starts[0])
    starts[1:, :, 0:3], starts[1:, :, 3:6] = (
        np.tensordot(bent, search.across_axes(axes), axes=1),
        axes,
    )
    flat: Float = starts.reshape(-1, 8)
    search.tubes(sample, flat)
    return flat


def _by_curvature(points: Float) -> Float:
    patch = search.curved_patch(points)
    radii = 1.0 / np.maximum(np.abs(patch.curvatures), 1.0 / THICKEST)
    sides = np.where(patch.curvatures < 0.0, -1.0, 1.0)
    centres = patch.foot + (sides * radii)[:, None] * patch.normal
    # Along the ring the patch bends in the other of its two directions.
    return _bent(points, centres, patch.directions[::-1], radii)


def _by_cylinders(points: Float) -> Float:
    ends = search.best_ends(
        search.CYLINDER, points, cylinder.starts(points, search.few_axes(points)), CYLINDERS
    )
    ends = ends[np.abs(ends[:, 6]) < THICKEST]
    return _bent(points, ends[:, 0:3], ends[:, 3:6], np.abs(ends[:, 6]))


def _bent(points: Float, places: Float, ways: Float, radii: Float) -> Float:
    """Return starts (m, 8) of tubes at ``places`` (k, 3) along ``ways`` (k, 3)."""
    turns = np.arange(TURNS) * 2.0 * np.pi / TURNS
    first, second = search.across_axes(ways)
    outward = np.cos(turns)[:, None, None] * first + np.sin(turns)[:, None, None] * second
    axes = np.cross(ways, outward)
    centres = places + REACH[:, None, None, None] * radii[:, None] * outward
    starts = np.zeros((*centres.shape[:3], 8))
    starts[..., 0:3], starts[..., 3:6] = centres, axes
    starts = starts.reshape(-1, 8)
    search.tubes(search.sampled(points, RANKING_POINTS), starts)
    return starts


CERTAIN_POINTS, CERTAIN_KEPT = 30, 16
"""Number of points for a certain torus from this number of starts."""
CERTAIN_RESIDUAL, CERTAIN_CONDITION = 0.01, 30.0
"""RMS residual over the radius of the tube, and condition number, for certainty."""


def fit_torus(
    points: Points3,
    direction_hint: Float | None = None,
    sizes_hint: tuple[float, float] | None = None,
) -> shapes.Fit:
    """Return the torus of ``points`` (n, 3), mm; residuals are positive outside the tube.

    ``direction_hint`` (3,) orients the axis; ``sizes_hint``, mm, radii of the centre line and of
    the tube, may decide between rivals, which exist for seven points. FitError if the points do not
    determine a torus whose tube is thinner than its ring.
    """
    points = search.checked_points(shapes.Shape.TORUS, points)
    flat = search.degenerate(
        shapes.Shape.TORUS,
        "they lie in a plane, on one circle, on a ball or on a straight tube",
        "Take points around the tube at several places of the ring.",
    )
    centroid, about, size = search.centred_solid(shapes.Shape.TORUS, points, flat)
    certain = _certain(about)
    found = [] if certain is None else [certain]
    expected, asked = None, families(about)
    if sizes_hint is not None:
        sizes = np.array(sizes_hint) / size
        expected = partial(_from_plan, expected=sizes)
        asked = (*asked, search.planned(asked, slice(6, 8), sizes))
    solutions = found or search.minima(search.TORUS, about, asked, _closed)
    if not solutions:
        raise not_converged(shapes.Shape.TORUS)
    if not _possible(solutions[0].parameters):
        raise search.degenerate(
            shapes.Shape.TORUS,
            "a tube thicker than its ring fits them better",
            "Take points around the tube at several places of the ring.",
        )
    solutions = [solution for solution in solutions if _possible(solution.parameters)]
    build = partial(
        _fit, centroid=centroid, about=about, size=size, direction_hint=direction_hint, flat=flat
    )
    return search.decided(
        search.candidates(shapes.Shape.TORUS, solutions, len(points), expected), build
    )


def _fit(
    best: Float, *, centroid: Float, about: Float, size: float, direction_hint: Float | None,
    flat: FitError,
) -> shapes.Fit:  # fmt: skip
    """Return the fit of parameters (8,); raise ``flat`` if undetermined."""
    best[3:6] = search.oriented(best[3:6], direction_hint)
    residuals, jacobian, _ = search.derivatives(search.TORUS, about, best)
    inverse, shifts, condition = search.gains(jacobian)
    if condition > WORST_CONDITION:
        raise flat
    basis = np.stack([*search.across_axes(best[3:6]), best[3:6]])
    gain = np.zeros((shapes.GEOMETRY_SIZE, inverse.shape[1]))
    gain[shapes.POINT] = -basis.T @ inverse[0:3]
    gain[shapes.DIRECTION] = -basis[0:2].T @ inverse[3:5] / size
    gain[shapes.RADIUS], gain[shapes.SECOND] = -inverse[5], -inverse[6]
    # The distance falls as the centre moves along the normal.
    normals = -jacobian[:, 0:3] @ basis
    by_points = np.zeros((shapes.GEOMETRY_SIZE, 3 * len(about)))
    search.spread(gain, shifts, normals, np.zeros((shapes.GEOMETRY_SIZE, 3)), by_points)
    geometry = shapes.element(
        centroid + size * best[0:3], best[3:6], size * best[6], second=size * float(best[7])
    )
    return shapes.make_fit(shapes.Shape.TORUS, geometry, by_points, size * residuals)


def _from_plan(parameters: Float, expected: Float) -> float:
    return float(np.max(np.abs(parameters[6:8] - expected) / (search.NEAR * expected)))


def _possible(parameters: Float) -> bool:
    return 0.0 < float(parameters[7]) < float(parameters[6]) < LARGEST_RADIUS


def _closed(parameters: Float) -> bool:
    """Return whether it is a torus, also with a tube thicker than its ring."""
    return 0.0 < float(parameters[7]) < LARGEST_RADIUS and float(parameters[6]) > 0.0


def _certain(points: Float) -> search.Solution | None:
    """Return the torus from few starts if many close points exclude any other, else None."""
    if len(points) < CERTAIN_POINTS:
        return None
    found = search.nearest_minimum(
        search.TORUS, points, ring_starts(points, search.few_axes(points)), CERTAIN_KEPT
    )
    p = found.parameters
    if not found.converged or not _possible(p):
        return None
    if found.cost > len(points) * (CERTAIN_RESIDUAL * p[7]) ** 2:
        return None
    _, _, condition = search.gains(search.derivatives(search.TORUS, points, p)[1])
    return found if condition < CERTAIN_CONDITION else None
