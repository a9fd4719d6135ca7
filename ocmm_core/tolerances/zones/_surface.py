"""Surface points under the ball, with derivatives by all measured points.

The ball touches at a surface normal through its centre. The associated element gives that normal
better than the probing direction: a contact point is the ball's centre less one radius along it.

For model faces no element is associated with the points: the deviation is the distance of the
centre from the trimmed face less the radius. To first order it only depends on motion of the centre
along the normal: the foot slides along the face.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.elements import distance_derivatives, fit_circle_projected
from ocmm_core.features.measured import ActualFeature, Touches, fit_shape
from ocmm_core.features.search import unambiguous
from ocmm_core.features.shapes import GEOMETRY_SIZE, Criterion, Fit, Shape
from ocmm_core.geometry import Float, Int, Points3, RigidTransform, unit
from ocmm_core.measuring import Rows
from ocmm_core.part_model import Feet, NominalFace, followed_feet, nearest_feet, searched
from ocmm_core.tolerances.zones._characteristic import Characteristic, Seen

_STEP = 1e-5
"""Step of the differences: mm, and of directions a fraction of one."""
_LEAST_IN_CUT = 3
_MOST_SLOPE = 0.2
"""Sine of the angle of normal and section: deviations in the section are 2 % larger."""


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


def near_cut(
    features: Sequence[ActualFeature], cut: Characteristic, T_nominal_from_world: RigidTransform
) -> list[ActualFeature]:
    """Return the features near the plane of a section, with these touches only; FitError."""
    normal, found = unit(np.array(cut.cut)), []
    for feature in features:
        touches, measured = _own(feature)[0], surface_points(feature)
        heights = (T_nominal_from_world.apply(measured.points) - np.array(cut.cut_at)) @ normal
        rows = np.flatnonzero(np.abs(heights) <= cut.within)
        if not len(rows):
            continue
        slopes = measured.normals[rows] @ (T_nominal_from_world.rotation.T @ normal)
        slope = float(np.abs(slopes).max())
        if slope > _MOST_SLOPE:
            raise FitError(
                "characteristic.slanting_cut",
                f"{cut.name}: the section is {np.degrees(np.arcsin(min(slope, 1.0))):.0f}° off the "
                f"normal of {feature.nominal.name}.",
                "Lay the section square to the surface, or tolerance the profile of the surface.",
            )
        numbers, places = (
            tuple(np.array(own)[rows].tolist()) for own in (touches.numbers, touches.places)
        )
        chosen = replace(
            touches, numbers=numbers, places=places, tips=touches.tips[rows],
            directions=touches.directions[rows],
        )  # fmt: skip
        found.append(replace(feature, touches=chosen))
    count = sum(len(one.touches.numbers) for one in found if one.touches is not None)
    if count < _LEAST_IN_CUT:
        raise FitError(
            "characteristic.empty_cut",
            f"{cut.name}: {count} points are within {cut.within:g} mm of the section.",
            f"Measure {_LEAST_IN_CUT} or more along the section, or allow a larger distance.",
        )
    return found


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
    return (ahead - behind) / (2.0 * _STEP)


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
    return sign * unit(distance_derivatives(near, tips)[1])


FAR_MM = 5.0
"""A more distant point belongs to other faces, or the alignment is wrong."""
_SLANT = 0.5
"""Cosine between approach and normal below which another face may have been touched."""


class ModelSurface:
    """Ball centres of one or more touched features against faces; searched together.

    Faces are in the frame of the nominals; ``offset``, mm, is that of the zone's middle from the
    faces, away from the material.
    """

    def __init__(
        self, features: Sequence[ActualFeature], faces: Sequence[NominalFace], offset: float = 0.0
    ) -> None:
        touched = [own_fit(feature)[0] for feature in features]
        self._offset = offset
        self._faces = [searched(face) for face in faces]
        self._feet: Feet | None = None
        self._features = tuple(
            feature.nominal.name
            for feature, touches in zip(features, touched, strict=True)
            for _ in touches.numbers
        )
        self._numbers = tuple(number for touches in touched for number in touches.numbers)
        self._places = tuple(place for touches in touched for place in touches.places)
        self._tips = np.vstack([touches.tips for touches in touched])
        self._directions = np.vstack([touches.directions for touches in touched])
        self._radii = np.concatenate(
            [np.full(len(touches.tips), touches.tip_radius) for touches in touched]
        )

    @property
    def world(self) -> Float:
        """Return the ball centres (n, 3), mm, world."""
        return self._tips

    @property
    def places(self) -> Sequence[int]:
        """Return the indices of the points in rows."""
        return self._places

    def deviations(self, points: Float) -> tuple[Float, Float]:
        """Return deviations (n,), mm, and normals (n, 3), near the previous feet."""
        if self._feet is None:
            self._feet = nearest_feet(points, self._faces)
        else:
            self._feet = followed_feet(points, self._faces, self._feet)
        return self._less_ball(self._feet)

    def checked(self, points: Float, rotation: Float) -> tuple[Float, Float]:
        """Repeat by searching all faces; FitError: on an edge, ambiguous or implausible."""
        self._feet = nearest_feet(points, self._faces)
        values, normals = self._less_ball(self._feet)
        along = np.einsum("ni,ni->n", self._directions @ rotation.T, normals)
        off = values + self._offset
        for i, (unclear, value, cosine) in enumerate(
            zip(self._feet.doubts, off.tolist(), along.tolist(), strict=True)
        ):
            doubt = unclear
            if abs(value) > FAR_MM:
                doubt = f"it lies {value:+.1f} mm off the faces that the plan names"
            elif not doubt and cosine < _SLANT:
                doubt = f"it was approached {_degrees(cosine)} off the normal"
            if doubt:
                raise FitError(
                    "characteristic.no_foot",
                    f"Point {self._numbers[i]} of {self._features[i]} gives no deviation from the "
                    f"model: {doubt}.",
                    "Touch again inside the face, square to it and away from edges and narrow "
                    "hollows, or name the faces that were touched.",
                )
        return values, normals

    def pull_back(self, weights: Float, normals: Float) -> Rows:
        """Return the gradient of the weighted sum of ball centres, less the ball."""
        own = Rows.of_points(np.asarray(self.places), weights.ravel())
        return own.with_radius(-float(np.sum(weights * normals)))

    def by_radius(self, normals: Float) -> Float:
        """Return the derivatives (n,) of deviations by the ball radius."""
        return np.full(len(normals), -1.0)

    def seen(self, values: Float, normals: Float) -> Seen:
        """Return the deviations for pictures."""
        surface = self._tips - self._radii[:, None] * normals
        return Seen(self._features, self._numbers, surface, normals, values)

    def _less_ball(self, feet: Feet) -> tuple[Float, Float]:
        return feet.distances - self._radii - self._offset, feet.normals


def _degrees(cosine: float) -> str:
    return f"{np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))):.0f}°"
