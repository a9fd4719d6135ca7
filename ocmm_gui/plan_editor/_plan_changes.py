"""Proposed new items, and changes of a plan by the editor's keys, which may fail.

A change names the item that is selected afterwards.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from ocmm_core.errors import InputError
from ocmm_core.features.measured import Construction, PartOf
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.plan import (
    Plan,
    add_characteristic,
    add_construction,
    add_feature,
    move_item,
    new_plan,
    remove_item,
    replace_item,
    usual_points,
    with_alignment,
    with_head,
    with_picture,
)
from ocmm_core.tolerances.zones import Characteristic
from ocmm_gui.kit import tr
from ocmm_gui.plan_editor._plan_items import ALIGNMENT, HEAD, LISTS, ItemKey, item_of, place_of
from ocmm_gui.views import read_picture


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


@dataclass(frozen=True, slots=True)
class PlanChange:
    make: Callable[[], Plan]
    """Returns the other plan; raises `OcmmError` if impossible."""
    chosen: ItemKey


def with_feature(plan: Plan, chosen: ItemKey) -> PlanChange:
    """Return a change that adds a feature like the selected one, after it."""
    feature, place = new_feature(plan, chosen), _place_after(plan, chosen, "features")
    return PlanChange(
        lambda: add_feature(plan, feature, place), ItemKey("features", feature.name)
    )  # fmt: skip


def with_construction(plan: Plan, chosen: ItemKey) -> PlanChange | None:
    """Return a change that adds a construction of the selected feature; None without features."""
    item, place = new_construction(plan, chosen), _place_after(plan, chosen, "constructions")
    if item is None:
        return None
    return PlanChange(
        lambda: add_construction(plan, item, place), ItemKey("constructions", item.name)
    )  # fmt: skip


def with_characteristic(plan: Plan, chosen: ItemKey) -> PlanChange | None:
    """Return a change that adds a characteristic of the selected feature; None without one."""
    item = new_characteristic(plan, chosen)
    if item is None:
        return None
    return PlanChange(lambda: add_characteristic(plan, item), ItemKey("characteristics", item.name))


def with_item(plan: Plan, chosen: ItemKey, item: Any) -> PlanChange:
    """Return a change of the selected item to the form's content."""
    if chosen == HEAD:
        return PlanChange(lambda: with_head(plan, item), chosen)
    if chosen == ALIGNMENT:
        return PlanChange(lambda: with_alignment(plan, item), chosen)
    return PlanChange(
        lambda: replace_item(plan, chosen.name, item), ItemKey(chosen.group, item.name)
    )  # fmt: skip


def without(plan: Plan, chosen: ItemKey) -> PlanChange | None:
    """Return a change that removes the selected item or alignment; None if neither."""
    if chosen == ALIGNMENT:
        return PlanChange(lambda: with_alignment(plan, None), chosen)
    if chosen.group not in LISTS:
        return None
    return PlanChange(lambda: remove_item(plan, chosen.name, chosen.group), HEAD)


def moved(plan: Plan, chosen: ItemKey, way: int) -> PlanChange | None:
    """Return a change that moves the selected item up or down; None if impossible."""
    if chosen.group not in LISTS or (place := place_of(plan, chosen) + way) < 0:
        return None
    return PlanChange(lambda: move_item(plan, chosen.name, place, chosen.group), chosen)


def with_picture_of(plan: Plan, path: Path | None, chosen: ItemKey, picture: Path) -> Plan:
    """Return a plan with a picture for a feature; InputError if invalid, or unsaved plan."""
    if picture.is_file() and read_picture(picture) is None:
        raise InputError(
            "plan.no_picture", f"{picture}: not a readable picture.", "Choose a PNG or JPEG file."
        )
    name = chosen.name if chosen.group == "features" else ""
    return with_picture(plan, path, name, picture)


def _place_after(plan: Plan, chosen: ItemKey, group: str) -> int | None:
    """Return the index after the selected item of a list; None for its end."""
    return place_of(plan, chosen) + 1 if chosen.group == group else None
