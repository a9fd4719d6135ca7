from __future__ import annotations

import msgspec

from ocmm_core.features.measured import Construction, PartOf
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.plan import Plan, add_feature, new_plan, usual_points
from ocmm_core.tolerances.zones import Characteristic
from ocmm_gui.kit import tr
from ocmm_gui.plan_editor._plan_items import ItemKey, item_of


def fresh_plan() -> Plan:
    """Return a plan with one feature, to start with."""
    empty = new_plan(tr("PLAN"), tr("PART"))
    return add_feature(empty, new_feature(empty, ItemKey("plan")))


def new_feature(plan: Plan, chosen: ItemKey) -> NominalFeature:
    """Return a feature like the selected one, or a plane, under a free name."""
    if chosen.group == "features":
        feature: NominalFeature = item_of(plan, chosen)
        return msgspec.structs.replace(
            feature, name=_free_name(plan, feature.name), text="", picture=""
        )
    return NominalFeature(
        name=_free_name(plan, tr("FEATURE")),
        shape=Shape.PLANE,
        points=usual_points(Shape.PLANE),
        point=(0.0, 0.0, 0.0),
    )


def new_construction(plan: Plan, chosen: ItemKey) -> Construction | None:
    """Return a construction like the selected one, or the selected feature under another name.

    None if neither is selected and the plan has no feature.
    """
    if chosen.group == "constructions":
        like: Construction = item_of(plan, chosen)
        return msgspec.structs.replace(like, name=_free_name(plan, like.name))
    names = [feature.name for feature in plan.features]
    if not names:
        return None
    feature = chosen.name if chosen.group == "features" else names[0]
    return PartOf(name=_free_name(plan, tr("CONSTRUCTION")), features=(feature,))


def new_characteristic(plan: Plan, chosen: ItemKey) -> Characteristic | None:
    """Return the usual characteristic of the selected feature; None without one.

    For a construction it is the distance from the first feature.
    """
    if chosen.group == "constructions":
        return _of(plan, [plan.features[0].name, chosen.name], "distance", 0.0, -0.1)
    if chosen.group != "features":
        return None
    feature: NominalFeature = item_of(plan, chosen)
    if feature.shape.spec.is_radial:
        return _of(plan, [feature.name], "diameter", feature.diameter, -0.1)
    return _of(plan, [feature.name], "form", 0.0, 0.0)


def _of(plan: Plan, features: list[str], kind: str, nominal: float, lower: float) -> Characteristic:
    return Characteristic(
        name=_free_name(plan, f"{features[-1]} {kind}"),
        kind=kind,
        features=features,
        nominal=nominal,
        lower=lower,
        upper=0.1,
        limits="proposed",
    )


def _free_name(plan: Plan, name: str) -> str:
    taken = {item.name for item in (*plan.features, *plan.constructions, *plan.characteristics)}
    if name not in taken:
        return name
    stem = name.rstrip("0123456789")
    numbered = (f"{stem}{number}" for number in range(2, len(taken) + 3))
    return next(free for free in numbered if free not in taken)
