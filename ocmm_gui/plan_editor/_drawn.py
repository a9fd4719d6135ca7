from __future__ import annotations

from ocmm_core.camera import Vector3
from ocmm_core.features.measured import nominal_geometries
from ocmm_core.features.shapes import ACROSS, DIRECTION, POINT, NominalFeature, Shape
from ocmm_core.geometry import Float
from ocmm_core.inspection.plan import Plan, usual_points
from ocmm_gui.plan_editor._plan_items import ItemKey, item_of


def drawn_of(plan: Plan, key: ItemKey) -> NominalFeature | None:
    """Return the feature drawn for an item: itself, or the first that it is about; or None."""
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
    sizes = {size.field: size.whole(geometry) for size in shape.spec.sizes}
    direction = _vector(geometry[DIRECTION])
    return NominalFeature(
        name=name,
        shape=shape,
        points=usual_points(shape),
        point=_vector(geometry[POINT]),
        direction=direction if any(direction) else (0.0, 0.0, 1.0),
        diameter=sizes.get("diameter", 0.0),
        length=sizes.get("length", 0.0),
        width=sizes.get("width", 0.0),
        angle_deg=sizes.get("angle_deg", 0.0),
        across=_vector(geometry[ACROSS]) if shape.spec.has_across else (1.0, 0.0, 0.0),
    )


def _vector(values: Float) -> Vector3:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
