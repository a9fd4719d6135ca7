"""Surface points under the ball, with derivatives by all measured points.

The ball touches at a surface normal through its centre. The associated element gives that normal
better than the probing direction: a contact point is the ball's centre less one radius along it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.elements import distance_derivatives, fit_circle_projected
from ocmm_core.features.measured import ActualFeature, Touches, fit_shape
from ocmm_core.features.search import unambiguous
from ocmm_core.features.shapes import GEOMETRY_SIZE, Criterion, Fit, Shape
from ocmm_core.geometry import Float, Int, Points3, unit
from ocmm_core.measuring import Rows

_STEP = 1e-5
"""Step of the differences: mm, and of directions a fraction of one."""


@dataclass(frozen=True, slots=True)
class SurfacePoints:
    """Contact points of one feature."""

    feature: ActualFeature
    points: Points3
    """(n, 3), mm, world."""
    normals: Points3
    """(n, 3), unit, world: from the material towards the ball."""

    def pull_back(self, weights: Float) -> Rows:
        """Return the gradient, one row, of the sum of points weighted by (n, 3), mostly zero."""
        touches = _own(self.feature)[0]
        rows = np.flatnonzero(np.any(weights != 0.0, axis=1))
        chosen, tips = weights[rows], touches.tips[rows]
        geometry = self.feature.fit.geometry
        radius = touches.tip_radius

        nothing = np.zeros(1)
        by_geometry = np.zeros(GEOMETRY_SIZE)
        for k in np.flatnonzero(self.feature.jacobian.moving()).tolist():
            step = np.zeros(GEOMETRY_SIZE)
            step[k] = _STEP
            by_geometry[k] = -radius * np.sum(
                chosen * _difference(self.feature, rows, (tips, geometry), (nothing, step))
            )
        by_element = by_geometry @ self.feature.jacobian
        by_tips = chosen.copy()
        for k in range(3):
            step = np.zeros(3)
            step[k] = _STEP
            by_tips[:, k] -= radius * np.sum(
                chosen * _difference(self.feature, rows, (tips, geometry), (step, nothing)), axis=1
            )
        own = Rows.of_points(np.asarray(touches.places)[rows], by_tips.ravel())
        return (by_element + own).with_radius(-float(np.sum(chosen * self.normals[rows])))


def surface_points(feature: ActualFeature) -> SurfacePoints:
    """Return the contact points of a feature; FitError for a construction."""
    touches, _ = _own(feature)
    rows = np.arange(len(touches.tips))
    normals = _normals(feature, rows, touches.tips, feature.fit.geometry)
    return SurfacePoints(feature, touches.tips - touches.tip_radius * normals, normals)


def own_fit(feature: ActualFeature) -> tuple[Touches, Fit]:
    """Return the touches of a feature and the fit of their centres; FitError if constructed."""
    return _own(feature)


def least_squares(feature: ActualFeature) -> Fit:
    """Return the least-squares element of the centres; FitError: constructed, undetermined."""
    touches, raw = _own(feature)
    if raw.criterion is Criterion.LEAST_SQUARES:
        # Derived fits stay in its plane, even if that was found together with the circle.
        return replace(raw, free=False)
    if raw.shape.spec.may_be_free:
        return fit_circle_projected(touches.tips, raw.direction)[0]
    fit = fit_shape(
        raw.shape, touches.tips, direction_hint=raw.direction, radius_hint=raw.radius,
        second_hint=raw.second, half_angle_hint=raw.half_angle or None,
        offset=kept_offset(feature),
    )  # fmt: skip
    return unambiguous(fit)


def kept_offset(feature: ActualFeature) -> float:
    """Return the offset, mm, of centres outside an element that keeps the ball, else zero.

    Other shapes have centres on an element of the same shape. FitError for a construction.
    """
    touches, raw = _own(feature)
    if raw.shape.spec.ball != "kept":
        return 0.0
    return touches.tip_radius if feature.nominal.side == "outer" else -touches.tip_radius


def _own(feature: ActualFeature) -> tuple[Touches, Fit]:
    if feature.touches is None or feature.raw is None:
        raise FitError(
            "characteristic.no_points",
            f"{feature.nominal.name} is constructed and has no surface points of its own.",
            "Tolerance a probed feature.",
        )
    return feature.touches, feature.raw


def _difference(
    feature: ActualFeature, rows: Int, at: tuple[Float, Float], step: tuple[Float, Float]
) -> Float:
    """Return the central difference of the normals (m, 3) by ball centres or geometry."""
    ahead = _normals(feature, rows, at[0] + step[0], at[1] + step[1])
    behind = _normals(feature, rows, at[0] - step[0], at[1] - step[1])
    difference: Float = (ahead - behind) / (2.0 * _STEP)
    return difference


def _normals(feature: ActualFeature, rows: Int, tips: Points3, geometry: Float) -> Points3:
    """Return the unit normals (m, 3) from material to ball centres; any direction length."""
    touches, raw = _own(feature)
    shape = feature.nominal.shape
    mean = touches.directions.mean(axis=0)
    if shape is Shape.POINT:
        return np.tile(mean, (len(tips), 1))
    direction = geometry[3:6]
    length = float(np.linalg.norm(direction))
    direction = direction / length if length > 0.0 else direction
    if shape is Shape.PLANE:
        return np.tile(direction, (len(tips), 1))
    if shape is Shape.LINE:
        return np.tile(unit(mean - (mean @ direction) * direction), (len(tips), 1))
    turned = geometry.copy()
    turned[3:6] = direction
    near = replace(raw, geometry=turned, residuals=raw.residuals[rows])
    sign = 1.0 if feature.nominal.side == "outer" else -1.0
    outward: Points3 = sign * unit(distance_derivatives(near, tips)[1])
    return outward
