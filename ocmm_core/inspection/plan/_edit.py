"""Changes of a plan: each takes a plan and returns another one; nothing is changed in place.

A change that would make the plan unmeasurable is refused with the message of `load_plan`. Nominals
are taught on a master part: measured values, rounded.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from ocmm_core.alignment import Alignment
from ocmm_core.errors import FitError, InputError
from ocmm_core.features.measured import ActualFeature, Construction
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.inspection.plan._plan import SCHEMA, Plan, check_plan
from ocmm_core.tolerances.zones import Characteristic

Item = TypeVar("Item")

HEAD_FIELDS = ("name", "part", "rule", "compensation", "cameras", "material", "environment")
"""Fields of a plan other than its lists and its alignment."""

EDITED = Path("the plan")
"""File name in messages about an unsaved plan."""

_REFERENCES = {
    "constructions": frozenset({"features", "towards", "plane"}),
    "characteristics": frozenset({"features", "datums"}),
    "features": frozenset({"projection"}),
    "requirements": frozenset({"nominals"}),
    "alignment": frozenset({
        "primary", "secondary", "origin", "towards", "plane", "axis", "point", "points", "datums",
        "feature",
    }),
}  # fmt: skip
"""Fields that hold names of features, by part of the plan."""


def new_plan(name: str, part: str) -> Plan:
    """Return an empty plan; it can be saved once it has a feature."""
    return Plan(schema=SCHEMA, unit="mm", name=name, part=part, features=[], characteristics=[])


def usual_points(shape: Shape) -> int:
    return shape.spec.usual_points


def add_feature(plan: Plan, feature: NominalFeature, place: int | None = None) -> Plan:
    """Return the plan with an added feature, last or before ``place``; InputError if faulty."""
    features = _inserted(plan.features, feature, place)
    return _checked(msgspec.structs.replace(plan, features=features))


def add_construction(plan: Plan, item: Construction, place: int | None = None) -> Plan:
    """Return the plan with an added construction; InputError if faulty."""
    constructions = _inserted(plan.constructions, item, place)
    return _checked(msgspec.structs.replace(plan, constructions=constructions))


def add_characteristic(plan: Plan, item: Characteristic, place: int | None = None) -> Plan:
    """Return the plan with an added characteristic; InputError if faulty."""
    characteristics = _inserted(plan.characteristics, item, place)
    return _checked(msgspec.structs.replace(plan, characteristics=characteristics))


def replace_item(
    plan: Plan, name: str, item: NominalFeature | Construction | Characteristic
) -> Plan:
    """Return the plan with a feature, construction or characteristic replaced.

    A new name is carried to all references. Changed limits count as set, no longer as proposed.
    InputError if the item is unknown, or the plan would become unmeasurable.
    """
    group = _group_of(item)
    items = list(getattr(plan, group))
    index = _index(items, group, name)
    if item.name != name:
        plan = _renamed(plan, group, name, item.name)
    old, items = items[index], list(getattr(plan, group))
    if isinstance(item, Characteristic) and (item.lower, item.upper) != (old.lower, old.upper):
        item = msgspec.structs.replace(item, limits="set")
    items[index] = item
    return _checked(msgspec.structs.replace(plan, **{group: items}))


def with_alignment(plan: Plan, rule: Alignment | None) -> Plan:
    """Return the plan with another alignment, or none; InputError if invalid."""
    return _checked(msgspec.structs.replace(plan, alignment=rule))


def with_head(plan: Plan, head: Plan) -> Plan:
    """Return the plan with name, part, rules, material, climate of another; InputError if bad."""
    changes = {field: getattr(head, field) for field in HEAD_FIELDS}
    return _checked(msgspec.structs.replace(plan, **changes))


def remove_item(plan: Plan, name: str, group: str = "") -> Plan:
    """Return the plan without a feature, construction or characteristic.

    ``group``: its list, for a characteristic with the name of a feature. InputError if the item is
    unknown, or others need it: they are named.
    """
    group = group or group_of_name(plan, name)
    items = [item for item in getattr(plan, group) if item.name != name]
    users = users_of(plan, name) if group != "characteristics" else []
    if users:
        raise InputError(
            "plan.in_use",
            f"{name} is used by {', '.join(users)}.",
            f"Remove or change {'it' if len(users) == 1 else 'them'} first.",
        )
    changed = msgspec.structs.replace(plan, **{group: items})
    return changed if not changed.features else _checked(changed)


def move_item(plan: Plan, name: str, place: int, group: str = "") -> Plan:
    """Return the plan with an item moved within its list (`remove_item`) to a clipped place."""
    group = group or group_of_name(plan, name)
    items = list(getattr(plan, group))
    item = items.pop(_index(items, group, name))
    items.insert(min(max(place, 0), len(items)), item)
    return msgspec.structs.replace(plan, **{group: items})


def users_of(plan: Plan, name: str) -> list[str]:
    """Return the references to a feature or construction, in words."""
    users = [
        item.name
        for group in ("features", "constructions", "characteristics")
        for item in getattr(plan, group)
        if name in _names_in(msgspec.to_builtins(item), _REFERENCES[group])
    ]
    if plan.alignment is not None and name in plan.alignment.features:
        users.append("the alignment")
    return users


def group_of_name(plan: Plan, name: str) -> str:
    """Return the list of the plan that holds ``name``; InputError if none does."""
    for group in ("features", "constructions", "characteristics"):
        if any(item.name == name for item in getattr(plan, group)):
            return group
    raise InputError(
        "plan.no_item", f"The plan has no item named {name!r}.", "Choose one from its list."
    )


def _group_of(item: NominalFeature | Construction | Characteristic) -> str:
    if isinstance(item, NominalFeature):
        return "features"
    return "characteristics" if isinstance(item, Characteristic) else "constructions"


def _inserted(items: list[Item], item: Item, place: int | None) -> list[Item]:
    at = len(items) if place is None else min(max(place, 0), len(items))
    return [*items[:at], item, *items[at:]]


def _index(items: list[Any], group: str, name: str) -> int:
    for index, item in enumerate(items):
        if item.name == name:
            return index
    raise InputError(
        "plan.no_item",
        f"The {group} of the plan have no item named {name!r}.",
        "Choose one from the list.",
    )


def _renamed(plan: Plan, group: str, old: str, new: str) -> Plan:
    data = msgspec.to_builtins(plan)
    for item in data[group]:
        if item["name"] == old:
            item["name"] = new
    references = _REFERENCES
    if group == "characteristics":
        references = {"requirements": frozenset({"characteristics"})}
    for part, keys in references.items():
        data[part] = _replaced(data[part], keys, old, new)
    return msgspec.convert(data, Plan)


def _replaced(data: Any, keys: frozenset[str], old: str, new: str, key: str = "") -> Any:
    if isinstance(data, Mapping):
        return {name: _replaced(value, keys, old, new, name) for name, value in data.items()}
    if isinstance(data, list | tuple):
        return [_replaced(value, keys, old, new, key) for value in data]
    return new if key in keys and data == old else data


def _names_in(data: Any, keys: frozenset[str], key: str = "") -> set[str]:
    if isinstance(data, Mapping):
        return {n for name, value in data.items() for n in _names_in(value, keys, name)}
    if isinstance(data, list | tuple):
        return {n for value in data for n in _names_in(value, keys, key)}
    return {data} if key in keys and isinstance(data, str) and data else set()


def _checked(plan: Plan) -> Plan:
    check_plan(EDITED, plan)
    return plan


_DIRECTION_DECIMALS = 6


def taught_plan(
    plan: Plan,
    actual: Mapping[str, ActualFeature | FitError],
    T_part_from_world: RigidTransform | None,
    decimals: int = 3,
) -> Plan:
    """Return the plan with the nominals of all measured features, in the part frame.

    ``actual``: as measured on the master part, world frame; ``decimals`` of mm. InputError if the
    part frame is not measured: nominals in the world would be meaningless.
    """
    if T_part_from_world is None:
        raise InputError(
            "plan.no_frame",
            "Nominals are taught in the part frame, which is not measured yet.",
            "Give the plan an alignment and measure its features.",
        )
    features = []
    for nominal in plan.features:
        feature = actual.get(nominal.name)
        features.append(
            _taught(nominal, feature, T_part_from_world, decimals)
            if isinstance(feature, ActualFeature)
            else nominal
        )
    return msgspec.structs.replace(plan, features=features)


def _taught(
    nominal: NominalFeature, feature: ActualFeature, T: RigidTransform, decimals: int
) -> NominalFeature:
    fit = feature.fit
    changes: dict[str, object] = {"point": _vector(T.apply(fit.point), decimals)}
    spec = nominal.shape.spec
    if spec.has_direction:
        changes["direction"] = _vector(T.rotation @ fit.direction, _DIRECTION_DECIMALS)
    if spec.has_across:
        changes["across"] = _vector(T.rotation @ fit.across, _DIRECTION_DECIMALS)
    for size in spec.sizes:
        changes[size.field] = round(size.whole(fit.geometry), decimals)
    return msgspec.structs.replace(nominal, **changes)


def _vector(values: Float, decimals: int) -> tuple[float, float, float]:
    # Adding zero turns -0.0 into 0.0.
    x, y, z = (round(float(value), decimals) + 0.0 for value in values)
    return (x, y, z)
