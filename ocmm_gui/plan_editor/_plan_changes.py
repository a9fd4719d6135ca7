"""Changes of a plan by the editor's keys, which may fail, and the item selected afterwards."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ocmm_core.errors import InputError
from ocmm_core.inspection.plan import (
    Plan,
    add_characteristic,
    add_construction,
    add_feature,
    move_item,
    remove_item,
    replace_item,
    with_alignment,
    with_head,
    with_picture,
)
from ocmm_gui.plan_editor._plan_items import ALIGNMENT, HEAD, LISTS, ItemKey, place_of
from ocmm_gui.plan_editor._proposals import new_characteristic, new_construction, new_feature
from ocmm_gui.views import read_picture


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
    """Return a plan with a picture for the selected feature.

    Raises InputError if it is no picture, or the plan has no file yet.
    """
    if picture.is_file() and read_picture(picture) is None:
        raise InputError(
            "plan.no_picture", f"{picture}: not a readable picture.", "Choose a PNG or JPEG file."
        )
    name = chosen.name if chosen.group == "features" else ""
    return with_picture(plan, path, name, picture)


def _place_after(plan: Plan, chosen: ItemKey, group: str) -> int | None:
    """Return the index after the selected item of a list; None for its end."""
    return place_of(plan, chosen) + 1 if chosen.group == group else None
