"""Elements through the centres or through the touched points of several features."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.elements import distance_derivatives, surface_normals
from ocmm_core.features.measured._actual import ActualFeature
from ocmm_core.features.measured._fit import fit_shape
from ocmm_core.features.search import unambiguous
from ocmm_core.features.shapes import Fit, Shape
from ocmm_core.geometry import Float, Points3
from ocmm_core.measuring import Rows

_SHOWS = 0.05
"""Relative size of the ordered triangle needed to define the sense."""


@dataclass(frozen=True, slots=True)
class Through:
    """An element through points that themselves depend on the points of the job."""

    fit: Fit
    jacobian: Rows
    """(12,): d(geometry) / d(ball centres, tip radius)."""
    residual_jacobian: Rows
    """(n,): d(residuals) / d(the same)."""

    @classmethod
    def of(cls, fit: Fit, points: Points3, moves: Rows) -> Through:
        """Return a fit to ``points`` (n, 3) with derivatives ``moves``, 3 n rows."""
        jacobian = fit.jacobian @ moves
        by_geometry, normals = distance_derivatives(fit, points)
        own = moves.reshaped(len(points), 3).along(normals)
        return cls(fit, jacobian, by_geometry @ jacobian + own)


def fit_through_centres(shape: Shape, centres: Points3) -> Fit:
    """Return the least-squares element through points (n, 3), mm.

    A line points from the first point to the last; a plane or circle faces the side on which the
    ordered points run anticlockwise. The sense then agrees with the nominals for any pose of the
    part.
    """
    return unambiguous(fit_shape(shape, centres, direction_hint=_sense(shape, centres)))


def fit_through_points(shape: Shape, features: Sequence[ActualFeature]) -> Through:
    """Return the least-squares element through the touched points of probed features.

    Each ball centre is compensated along the normal of its own feature. The uncertainty of this
    normal moves the point tangentially only, without first-order effect if the features are parts
    of the element. FitError if a feature has no normal, or the points do not determine the element.
    """
    surface, moves = [], []
    for feature in features:
        touches, raw = feature.touches, feature.raw
        if touches is None or raw is None or not raw.shape.spec.has_normals:
            raise FitError(
                "construction.no_normals",
                f"{feature.nominal.name} does not define the surface normal at its points.",
                "Take the best fit through centres, or through features that are surfaces.",
            )
        normals = surface_normals(raw, touches.tips)
        approach = np.sum(touches.directions * normals, axis=1, keepdims=True)
        outward = np.where(approach < 0.0, -normals, normals)
        surface.append(touches.tips - touches.tip_radius * outward)
        centres = Rows.of_points(touches.places, np.eye(touches.tips.size))
        moves.append(centres.with_radius(-outward.ravel()))
    points = np.vstack(surface)
    hint = next((f.fit.direction for f in features if f.fit.shape is shape), None)
    fit = unambiguous(fit_shape(shape, points, direction_hint=hint))
    return Through.of(fit, points, Rows.stacked(moves))


def _sense(shape: Shape, centres: Points3) -> Float | None:
    if shape is Shape.LINE:
        along: Float = centres[-1] - centres[0]
        return along if float(np.linalg.norm(along)) > 0.0 else None
    if shape not in (Shape.PLANE, Shape.CIRCLE):
        return None
    # The area in the order of the points; if it cancels, the first sufficiently large triangle.
    arms = centres - centres[0]
    areas = np.cross(arms[:, None], arms[None, :])
    area: Float = areas[np.arange(len(arms) - 1), np.arange(1, len(arms))].sum(axis=0)
    largest = float(np.linalg.norm(areas, axis=2).max())
    if float(np.linalg.norm(area)) > _SHOWS * largest > 0.0:
        return area
    shows = np.argwhere(np.triu(np.linalg.norm(areas, axis=2)) > 0.5 * largest)
    if not len(shows):
        return None
    triangle: Float = areas[shows[0, 0], shows[0, 1]]
    return triangle
