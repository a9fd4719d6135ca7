"""What is drawn for an item of a plan."""

from __future__ import annotations

import math

from ocmm_core.camera import Vector3
from ocmm_core.features.measured import nominal_geometries
from ocmm_core.features.shapes import (
    ACROSS,
    DIRECTION,
    HALF_ANGLE,
    POINT,
    RADIUS,
    SECOND,
    NominalFeature,
    Shape,
)
from ocmm_core.geometry import Float
from ocmm_core.inspection.plan import Plan, usual_points
from ocmm_gui.plan_editor._plan_items import ItemKey, item_of

_OUTLINES = (Shape.ELLIPSE, Shape.ROUND_SLOT, Shape.SQUARE_SLOT, Shape.RECTANGLE)


def drawn_of(plan: Plan, key: ItemKey) -> NominalFeature | None:
    """Return the feature that is drawn for an item: itself, or the first that it is about.

    Of a construction it is what the nominals make of it. None where there is nothing to draw.
    """
    name = key.name
    if key.group == "characteristics":
        name = item_of(plan, key).features[0]
    elif key.group not in ("features", "constructions"):
        return None
    for feature in plan.features:
        if feature.name == name:
            return feature
    geometry = nominal_geometries(plan.features, plan.constructions).get(name)
    return None if geometry is None else _drawn(name, plan.shapes[name], geometry)


def _drawn(name: str, shape: Shape, geometry: Float) -> NominalFeature:
    outline = shape in _OUTLINES
    direction = _vector(geometry[DIRECTION])
    return NominalFeature(
        name=name,
        shape=shape,
        points=usual_points(shape),
        point=_vector(geometry[POINT]),
        direction=direction if any(direction) else (0.0, 0.0, 1.0),
        diameter=0.0 if outline else 2.0 * float(geometry[RADIUS]),
        length=2.0 * float(geometry[RADIUS]) if outline else 0.0,
        width=2.0 * float(geometry[SECOND]),
        angle_deg=2.0 * math.degrees(float(geometry[HALF_ANGLE])),
        across=_vector(geometry[ACROSS]) if outline else (1.0, 0.0, 0.0),
    )


def _vector(values: Float) -> Vector3:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
