"""Derivatives of a frame by the points of the job, and deviations of features in it.

Deviations of features from their nominals come with their uncertainty.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ocmm_core.alignment import _rules as rules
from ocmm_core.alignment._datums import frame_of
from ocmm_core.alignment._model_fit import model_fit, model_frame_slopes
from ocmm_core.features.measured import ActualFeature, gauge_point
from ocmm_core.features.shapes import (
    DIRECTION,
    GEOMETRY_SIZE,
    HALF_ANGLE,
    POINT,
    RADIUS,
    SECOND,
    Shape,
    element,
)
from ocmm_core.geometry import Float, RigidTransform, skew, unit
from ocmm_core.measuring import COVERAGE_FACTOR, PointFactors, Rows

_POINT_PLACES = range(POINT.start, POINT.stop)

_STEPS = np.full(GEOMETRY_SIZE, 1e-5)
_STEPS[[0, 1, 2, RADIUS, SECOND]] = 1e-3
"""Steps of the central differences, mm, and for directions and angles rad.

World coordinates are at most a few metres: rounding of 1e-12 mm in them is 1e-9 in a derivative.
Geometry with significant curvature over a step has a lever of less than a millimetre, and is
refused.
"""


def frame_jacobian(
    rule: rules.AnyAlignment, actual: Mapping[str, ActualFeature], T_part_from_world: RigidTransform
) -> Rows:
    """Return the derivatives of the part frame by the points, 6 rows.

    Rotation, rad, about its axes through its origin, over shift, mm, of the part; senses are fixed.
    """
    geometries = {name: actual[name].fit.geometry for name in rule.features}
    if isinstance(rule, rules.BoundAlignment) and isinstance(rule.rule, rules.ModelBestFit):
        found = model_fit(rule.rule, geometries, rule.nominals, actual)
        return model_frame_slopes(rule.rule, found, actual)
    rows = Rows.nothing(6)
    back = T_part_from_world.inverse()
    for name in rule.features:
        by_geometry = np.zeros((6, GEOMETRY_SIZE))
        for place in np.flatnonzero(actual[name].jacobian.moving()):
            if place not in _POINT_PLACES and _only_points(rule, name):
                continue
            ends = []
            for sign in (1.0, -1.0):
                moved = geometries[name].copy()
                moved[place] += sign * _STEPS[place]
                frame = frame_of(rule, {**geometries, name: moved})
                ends.append(_small_motion(frame.compose(back)))
            by_geometry[:, place] = (ends[0] - ends[1]) / (2.0 * _STEPS[place])
        rows += by_geometry @ actual[name].jacobian
    return rows


def _only_points(rule: rules.AnyAlignment, name: str) -> bool:
    """Return whether a frame depends only on the place of a feature."""
    kind = rule.rule if isinstance(rule, rules.BoundAlignment) else rule
    if isinstance(kind, (rules.BestFit, rules.ReferencePoints)):
        return kind.start is None or name not in kind.start.features
    return isinstance(kind, rules.Relocation)


def _small_motion(motion: RigidTransform) -> Float:
    """Return rotation (rad) and shift (mm) of a small motion, (6,)."""
    rotation = motion.rotation
    turn = 0.5 * np.array(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    return np.concatenate([turn, motion.translation])


@dataclass(frozen=True, slots=True)
class Residual:
    """How far one feature lies from its nominal in the frame."""

    feature: str
    aligned: bool
    """Whether the frame depends on it; otherwise it checks the frame."""
    offset: Float
    """(3,), mm, frame: from its nominal place, in its located directions."""
    distance: float
    distance_uncertainty: float | None
    """mm, k = 2, in the least certain direction; None without point uncertainty."""
    angle: float
    """rad, of its direction, or zero."""


def residuals_of(
    bound: rules.BoundAlignment,
    measured: Mapping[str, ActualFeature],
    T_nominal_from_world: RigidTransform,
    frame_jacobian: Rows,
    factors: PointFactors | None,
) -> tuple[Residual, ...]:
    """Return the residuals of all features with a nominal, those of the frame first.

    ``frame_jacobian`` has 6 rows: derivatives of the nominals' frame (`alignment.frame_jacobian`).
    """
    nominals = _compared_with(bound)
    points = brought_together(bound.rule)
    on_model = _on_model(bound, measured)
    first = [name for name in bound.features if name in nominals]
    rest = [name for name in nominals if name in measured and name not in first]
    return tuple(
        _residual(
            measured[name],
            nominals[name],
            T_nominal_from_world,
            frame_jacobian,
            factors,
            aligned=name in first,
            whole=name in points,
            on_model=on_model.get(name),
        )
        for name in (*first, *rest)
    )


def _on_model(
    bound: rules.BoundAlignment, measured: Mapping[str, ActualFeature]
) -> dict[str, tuple[float, Float]]:
    """Return the distances of touches from their fitted faces, mm, and the normals."""
    rule = bound.rule
    if not isinstance(rule, rules.ModelBestFit):
        return {}
    geometries = {name: measured[name].fit.geometry for name in rule.points}
    found = model_fit(rule, geometries, bound.nominals, measured)
    rows = zip(rule.points, found.residuals.tolist(), found.normals, strict=True)
    return {name: (off, normal) for name, off, normal in rows}


def brought_together(rule: rules.Alignment) -> tuple[str, ...]:
    """Return the features whose centres a rule aligns as points in space."""
    match rule:
        case rules.BestFit():
            return rule.points
        case rules.ReferencePoints():
            return tuple(dict.fromkeys(item.feature for item in rule.conditions))
        case rules.Relocation():
            return rule.features
        case _:
            return ()


def _compared_with(bound: rules.BoundAlignment) -> dict[str, Float]:
    """Return the geometries to compare with; control points with their places."""
    nominals = dict(bound.nominals)
    if isinstance(bound.rule, rules.Relocation):
        nominals |= {item.feature: element(item.place) for item in bound.rule.control}
    return nominals


def _residual(
    feature: ActualFeature,
    nominal: Float,
    T_nominal_from_world: RigidTransform,
    frame_jacobian: Rows,
    factors: PointFactors | None,
    *,
    aligned: bool,
    whole: bool,
    on_model: tuple[float, Float] | None,
) -> Residual:
    shape, geometry = feature.fit.shape, feature.fit.geometry
    place, gain = geometry[POINT], feature.jacobian[POINT]
    direction = geometry[DIRECTION]
    if shape is Shape.CONE:
        # The point of a cone is at the diameter of its plan.
        place, gain = gauge_point(geometry, float(nominal[RADIUS])), _gauge_gain(feature, nominal)
    rotation = T_nominal_from_world.rotation
    at = T_nominal_from_world.apply(place)
    moved = frame_jacobian[3:] - skew(at) @ frame_jacobian[:3] + rotation @ gain
    # If places were aligned as points, the depth of a circle also counts.
    keep = np.eye(3) if whole else _directions(shape, nominal)
    offset = keep @ (at - nominal[POINT])
    if on_model is not None:
        # A touch next to its nominal place on the same face is equally valid.
        off, normal = on_model
        keep, offset = np.outer(normal, normal), off * normal
    angle = 0.0
    if np.any(nominal[DIRECTION]) and np.any(direction):
        here, there = rotation @ unit(direction), unit(nominal[DIRECTION])
        sense = 1.0 if shape.spec.has_sense or here @ there >= 0.0 else -1.0
        angle = float(np.arctan2(np.linalg.norm(np.cross(here, there)), sense * (here @ there)))
    return Residual(
        feature=feature.nominal.name,
        aligned=aligned,
        offset=offset,
        distance=float(np.linalg.norm(offset)),
        distance_uncertainty=_worst(keep @ moved, factors),
        angle=angle,
    )


def _gauge_gain(feature: ActualFeature, nominal: Float) -> Rows:
    """Return d(gauge point) / d(points), 3 rows."""
    geometry, gain = feature.fit.geometry, feature.jacobian
    slope = np.tan(geometry[HALF_ANGLE])
    along = (nominal[RADIUS] - geometry[RADIUS]) / slope
    by_angle = -along / (slope * np.cos(geometry[HALF_ANGLE]) ** 2)
    stretch = by_angle * gain[HALF_ANGLE] - gain[RADIUS] / slope
    moved: Rows = gain[POINT] + along * gain[DIRECTION] + stretch.outer(geometry[DIRECTION])
    return moved


def _directions(shape: Shape, nominal: Float) -> Float:
    """Return the projection (3, 3) on the located directions of a shape."""
    located = shape.spec.located
    if located == "everywhere":
        return np.eye(3)
    along = unit(nominal[DIRECTION])
    own: Float = np.outer(along, along)
    return own if located == "along" else np.eye(3) - own


def _worst(rows: Rows, factors: PointFactors | None) -> float | None:
    """Return U (k = 2) of a vector with derivatives, 3 rows, in its least certain direction."""
    if factors is None:
        return None
    values = np.linalg.eigvalsh(factors.covariance_of(rows))
    return COVERAGE_FACTOR * float(np.sqrt(max(values[-1], 0.0)))
