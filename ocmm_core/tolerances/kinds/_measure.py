"""Values that follow from geometry alone: sizes, distances, coordinates and angles."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ocmm_core.alignment import AnyAlignment, frame_of
from ocmm_core.errors import FitError
from ocmm_core.features.shapes import (
    DIRECTION,
    HALF_ANGLE,
    POINT,
    RADIUS,
    SECOND,
    Shape,
    shapes_where,
)
from ocmm_core.geometry import Float
from ocmm_core.tolerances.kinds._angle import angle_value
from ocmm_core.tolerances.zones import Characteristic

XYZ = "xyz"

_LINES = shapes_where(lambda spec: spec.is_long)
_PARALLEL = np.cos(np.deg2rad(10.0))
"""Axes at less than 10 degrees are meant to be parallel: their crossing point means nothing."""


def geometry_value(
    characteristic: Characteristic,
    geometries: Mapping[str, Float],
    shapes: Mapping[str, Shape],
    alignment: AnyAlignment | None,
) -> float:
    """Return a size, distance or coordinate, mm, or an angle, deg.

    Parameters
    ----------
    geometries
        Geometry vectors (12,) by name (`features.shapes.element`), in one frame.
    shapes
        Of the same features.
    alignment
        Rule of the part frame; what has an axis needs it, and an angle near a right one may.

    Raises
    ------
    FitError
        There is no part frame.
    KeyError
        A feature of the characteristic is not among the geometries.
    """
    names = characteristic.features
    first = geometries[names[0]]
    match characteristic.kind:
        case "diameter" if characteristic.datums:
            return _gauge_diameter(first, geometries[characteristic.datums[0]], characteristic.at)
        case "diameter" | "length":
            return 2.0 * float(first[RADIUS])
        case "radius":
            return float(first[RADIUS])
        case "width":
            return 2.0 * float(first[SECOND])
        case "angle":
            return angle_value(characteristic, geometries, shapes, alignment)
        case "distance" if not characteristic.axis:
            second = geometries[names[1]]
            return _distance(first, shapes[names[0]], second, shapes[names[1]])
    if alignment is None:
        raise FitError(
            "characteristic.no_frame",
            f"{characteristic.name} needs a part frame, and the plan has no alignment.",
            "Add an alignment to the plan.",
        )
    T_part_from_world = frame_of(alignment, geometries)
    axis = XYZ.index(characteristic.axis)
    place = float(T_part_from_world.apply(first[POINT])[axis])
    if characteristic.kind == "coordinate":
        return place
    return abs(float(T_part_from_world.apply(geometries[names[1]][POINT])[axis]) - place)


def _gauge_diameter(cone: Float, plane: Float, at: float) -> float:
    """Return the diameter of a cone where its axis is ``at`` mm from a plane, along its normal."""
    towards = float(cone[DIRECTION] @ plane[DIRECTION])
    along = (at - float((cone[POINT] - plane[POINT]) @ plane[DIRECTION])) / towards
    return 2.0 * float(cone[RADIUS] + along * np.tan(cone[HALF_ANGLE]))


def _distance(first: Float, shape: Shape, second: Float, other: Shape) -> float:
    """Return the distance of two elements, never negative.

    From a plane along its normal to the point of the other; between two planes along the second
    one's normal at the first one's centroid; from an axis square to it; between two axes at the
    first one's point where they are nearly parallel, else along their common perpendicular; else
    between the centres.
    """
    arm = first[POINT] - second[POINT]
    if other is Shape.PLANE:
        return abs(float(arm @ second[DIRECTION]))
    if shape is Shape.PLANE:
        return abs(float(arm @ first[DIRECTION]))
    if shape in _LINES and other in _LINES:
        if abs(float(first[DIRECTION] @ second[DIRECTION])) < _PARALLEL:
            common = np.cross(first[DIRECTION], second[DIRECTION])
            return abs(float(arm @ common)) / float(np.linalg.norm(common))
        return float(np.linalg.norm(np.cross(arm, second[DIRECTION])))
    if other in _LINES:
        return float(np.linalg.norm(np.cross(arm, second[DIRECTION])))
    if shape in _LINES:
        return float(np.linalg.norm(np.cross(arm, first[DIRECTION])))
    return float(np.linalg.norm(arm))
