"""Contradictions of plans: all are found in generated plans, and honest plans are not accused.

The nominals of the honest plans come from the dimensions of a block, not from the code under test.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from numpy.random import Generator

from ocmm_core.alignment import Alignment, BestFit, DatumAlignment, DatumReferenceFrame
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.plan import (
    Plan,
    check_plan,
    load_plan,
    new_plan,
    plan_findings,
    release_plan,
    replace_item,
    require_consistent,
    save_plan,
)
from ocmm_core.tolerances.kinds import KINDS
from ocmm_core.tolerances.zones import Characteristic
from tests.host import amount

SEED = 20261128
ROOT = Path(__file__).resolve().parents[3]
Z, X, Y = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)


def feature(
    name: str, shape: Shape, point: tuple[float, float, float], **more: Any
) -> NominalFeature:
    return NominalFeature(
        name=name, shape=shape, points=shape.spec.usual_points, point=point, **more
    )


def item(name: str, kind: str, names: str, **more: Any) -> Characteristic:
    values: dict[str, Any] = {"upper": 0.1, **more}
    if isinstance(values.get("datums"), str):
        values["datums"] = str(values["datums"]).split()
    return Characteristic(name=name, kind=kind, features=names.split(), **values)


@cache
def honest(number: int) -> Plan:
    """Return a plan of a block with bores, a counterbore, a slot, a ball and a cone."""
    rng = np.random.default_rng([SEED, number])
    length, width, height = (
        float(x) for x in np.round(rng.uniform([80, 50, 20], [200, 90, 40]), 2)
    )
    bore, deep, ball = (float(x) for x in np.round(rng.uniform(6, 18, 3), 3))
    x1, y1, x2 = (float(x) for x in np.round(rng.uniform([15, 12, 55], [25, 20, 70]), 3))
    slot = (float(rng.integers(14, 20)), float(rng.integers(5, 9)))
    drawn = bore
    lower, upper = sorted(np.round(rng.normal(0.0, 0.05, 2), 3).tolist())
    if rng.random() < 0.3:
        # The model is drawn at the middle of its limits.
        drawn = bore + 0.5 * (lower + upper)
    features = [
        feature("TOP", Shape.PLANE, (length / 2, width / 2, height), length=length, width=width),
        feature("PAD 1", Shape.PLANE, (5.0, 5.0, 3.0), length=4.0, width=4.0),
        feature("PAD 2", Shape.PLANE, (length - 5.0, 5.0, 3.0), length=4.0, width=4.0),
        feature("BASE", Shape.PLANE, (length / 2, width / 2, 0.0), direction=(0.0, 0.0, -1.0)),
        feature("LEFT", Shape.PLANE, (0.0, width / 2, height / 2), direction=(-1.0, 0.0, 0.0)),
        feature("RIGHT", Shape.PLANE, (length, width / 2, height / 2), direction=X),
        feature("FRONT", Shape.PLANE, (length / 2, 0.0, height / 2), direction=(0.0, -1.0, 0.0)),
        feature("BORE 1", Shape.CYLINDER, (x1, y1, height / 2), diameter=drawn, side="inner",
                length=height / 2),
        feature("SINK", Shape.CYLINDER, (x1, y1, height - 2), diameter=bore + 4, side="inner",
                length=4.0),
        feature("BORE 2", Shape.CYLINDER, (x2, y1, height / 2), diameter=deep, side="inner"),
        feature("RIM", Shape.CIRCLE, (x1, y1, height), diameter=bore + 4, side="inner"),
        feature("EYE", Shape.CIRCLE, (x2, y1, height), diameter=deep, side="inner"),
        feature("BALL", Shape.SPHERE, (x2, width - 10.0, height + ball), diameter=2 * ball),
        feature("CONE", Shape.CONE, (x1, width - 12.0, height), diameter=bore, angle_deg=60.0,
                side="inner"),
        feature("SLOT", Shape.ROUND_SLOT, (x2 + 16.0, y1, height), length=slot[0], width=slot[1],
                across=X, side="inner"),
    ]  # fmt: skip
    most = round(bore + lower, 4)
    characteristics = [
        item("d1", "diameter", "BORE", nominal=bore, lower=lower, upper=upper),
        item("r2", "radius", "BORE", nominal=deep / 2, lower=-0.05),
        item("ball", "diameter", "BALL", nominal=2 * ball, lower=-0.1),
        item("long", "length", "SLOT", nominal=slot[0], lower=-0.1),
        item("wide", "width", "SLOT", nominal=slot[1], lower=-0.1),
        item("apex", "angle", "CONE", nominal=60.0, lower=-0.5, upper=0.5),
        item("square", "angle", "TOP LEFT", nominal=90.0, lower=-0.2, upper=0.2),
        item("high", "distance", "TOP BASE", nominal=height, lower=-0.1),
        item("thick", "thickness", "TOP BASE", nominal=height, lower=-0.1),
        item("apart", "distance", "", nominal=round(x2 - x1, 4), lower=-0.1),
        item("off", "distance", "LEFT", nominal=x2, lower=-0.1),
        item("flat", "form", "TOP"),
        item("level", "parallelism", "TOP", datums="BASE"),
        item("upright", "perpendicularity", "LEFT", datums="BASE"),
        item("place", "position", "", datums="BASE LEFT FRONT"),
        item("bonus", "position", "", datums="BASE", modifier="maximum material",
             material_size=most),
        item("coaxial", "coaxiality", "SINK"),
        item("centred", "concentricity", "RIM"),
        item("run", "circular runout", "SINK"),
        item("runs", "total runout", "TOP"),
        item("profile", "surface profile", "TOP", datums="BASE LEFT FRONT"),
        item("middle", "symmetry", "SLOT", datums=""),
    ]  # fmt: skip
    named = {"d1": ["BORE 1"], "r2": ["BORE 2"], "apart": ["BORE 1", "BORE 2"],
             "off": ["LEFT", "BORE 2"], "place": ["BORE 2"], "bonus": ["BORE 1"]}  # fmt: skip
    about = {"coaxial": ["BORE 1"], "centred": ["BORE 1"], "run": ["BORE 1"], "runs": ["BORE 1"],
             "middle": ["BORE 2"]}  # fmt: skip
    changed = []
    for one in characteristics:
        data = {field: getattr(one, field) for field in one.__struct_fields__}
        data["features"] = named.get(one.name, one.features)
        data["datums"] = about.get(one.name, one.datums)
        changed.append(Characteristic(**data))
    plan = new_plan("P", "PART")
    rule = _alignment(rng)
    if rule is not None:
        changed += [
            item("x", "coordinate", "BALL", nominal=x2 - _origin(rule, x1), lower=-0.1, axis="x"),
            item("step", "distance", "BALL RIM", nominal=x2 - x1, lower=-0.1, axis="x"),
        ]
    keep = rng.random(len(changed)) < 0.8
    return plan_with(
        plan, features, [c for c, kept in zip(changed, keep, strict=True) if kept], rule
    )


def plan_with(
    plan: Plan, features: list[NominalFeature], items: list[Characteristic], rule: Alignment | None
) -> Plan:
    data = {field: getattr(plan, field) for field in plan.__struct_fields__}
    made = Plan(**{**data, "features": features, "characteristics": items, "alignment": rule})
    check_plan(Path("p"), made)
    return made


def _alignment(rng: Generator) -> Alignment | None:
    rules: list[Alignment | None] = [
        None,
        DatumAlignment(primary="TOP", secondary=("RIM", "EYE"), origin="RIM"),
        DatumReferenceFrame(datums=("BASE", "LEFT", "FRONT")),
        DatumReferenceFrame(datums=("BASE", "BORE 1", "BORE 2")),
        plane_axis_point("BALL"),
        BestFit(points=("RIM", "EYE", "BALL")),
    ]
    return rules[int(rng.integers(len(rules)))]


def _origin(rule: Alignment, x1: float) -> float:
    return x1 if isinstance(rule, DatumAlignment) else 0.0


def plane_axis_point(point: str) -> Alignment:
    data = {"type": "plane-axis-point", "plane": "BASE", "axis": "BORE 1", "point": point}
    rule: Alignment = msgspec.convert(data, Alignment)
    return rule


def relocation_along_x(*names: str) -> Alignment:
    control = [{"feature": name, "place": [10.0 * k, 0.0, 0.0]} for k, name in enumerate(names)]
    data = {"type": "relocation", "name": "f", "digest": "0" * 64, "control": control}
    rule: Alignment = msgspec.convert(data, Alignment)
    return rule


def changed(plan: Plan, name: str, **more: Any) -> Plan:
    """Return the plan with an item changed, past the editor."""
    features = [_other(one, name, more) for one in plan.features]
    items = [_other(one, name, more) for one in plan.characteristics]
    return plan_with(plan, features, items, plan.alignment)


def _other(one: Any, name: str, more: dict[str, Any]) -> Any:
    data = {field: getattr(one, field) for field in one.__struct_fields__}
    return type(one)(**{**data, **(more if data["name"] == name else {})})


def more(plan: Plan, *items: Characteristic | NominalFeature) -> Plan:
    features = [*plan.features, *(one for one in items if isinstance(one, NominalFeature))]
    others = [one for one in items if isinstance(one, Characteristic)]
    return plan_with(plan, features, [*plan.characteristics, *others], plan.alignment)


def aligned(plan: Plan, rule: Alignment) -> Plan:
    # Coordinates of another frame are no part of these cases.
    items = [one for one in plan.characteristics if not one.axis]
    return plan_with(plan, plan.features, items, rule)


def again(plan: Plan, name: str, new: str, **other: Any) -> NominalFeature:
    one = next(one for one in plan.features if one.name == name)
    made: NominalFeature = _other(one, name, {"name": new, **other})
    return made


def _zone(kind: str, names: str, datums: str) -> Callable[[Plan, Generator], Plan]:
    return lambda plan, _: more(
        plan, item_of("new", kind, names.split("|"), datums=datums.split("|"))
    )


def item_of(name: str, kind: str, features: list[str], **values: Any) -> Characteristic:
    return Characteristic(name=name, kind=kind, features=features, **{"upper": 0.1, **values})


def _size(
    kind: str, *names: str, nominal: float, **values: Any
) -> Callable[[Plan, Generator], Plan]:
    """Return a change that adds a size with a nominal of the generated block plus an error."""

    def change(plan: Plan, rng: Generator) -> Plan:
        off = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.15, 5.0))
        return more(
            plan, item_of("new", kind, list(names), nominal=nominal + off, lower=-0.1, **values)
        )

    return change


def value(plan: Plan, name: str, field: str) -> float:
    return float(getattr(next(one for one in plan.features if one.name == name), field))


CONTRADICTIONS: dict[str, Callable[[Plan, Generator], Plan]] = {
    "diameter": lambda p, r: more(p, item_of("new", "diameter", ["BORE 2"], lower=-0.1,
        nominal=value(p, "BORE 2", "diameter") + r.choice([-1, 1]) * r.uniform(0.15, 3))),
    "radius": lambda p, r: more(p, item_of("new", "radius", ["BALL"], lower=-0.1,
        nominal=value(p, "BALL", "diameter"))),
    "length": lambda p, r: more(p, item_of("new", "length", ["SLOT"], lower=-0.1,
        nominal=value(p, "SLOT", "width"))),
    "width": lambda p, r: more(p, item_of("new", "width", ["SLOT"], lower=-0.1,
        nominal=value(p, "SLOT", "length") + r.uniform(1, 3))),
    "apex": _size("angle", "CONE", nominal=60.0),
    "angle": _size("angle", "TOP", "RIGHT", nominal=90.0),
    "pads apart": _size("distance", "BASE", "PAD 1", nominal=3.0),
    "distance of one plane": lambda p, r: more(
        p, item_of("new", "distance", ["PAD 1", "PAD 2"], lower=-0.1)),
    "no tolerance": lambda p, r: more(p, item_of(
        "new", "diameter", ["BORE 2"], nominal=value(p, "BORE 2", "diameter"), upper=0.0)),
    "proposed": lambda p, r: more(p, item_of("new", "form", ["TOP"], limits="proposed")),
    "parallel datums": _zone("position", "BORE 2", "BASE|TOP"),
    "coaxial datums": _zone("position", "BALL", "BORE 1|SINK"),
    "circle on the axis": _zone("position", "BALL", "BASE|BORE 1|RIM"),
    "third parallel to the first": _zone("surface profile", "RIGHT", "BASE|LEFT|PAD 1"),
    "parallel in an orientation": _zone("perpendicularity", "LEFT", "BASE|TOP"),
    "coaxiality beside": _zone("coaxiality", "BORE 2", "BORE 1"),
    "coaxiality square": _zone("coaxiality", "BALL", "BORE 1"),
    "concentricity beside": _zone("concentricity", "RIM", "BALL"),
    "run-out beside": _zone("circular runout", "CONE", "BORE 1"),
    "run-out of a wall": _zone("total runout", "LEFT", "BORE 1"),
    "symmetry beside": lambda p, r: more(changed(p, "SLOT", point=(60.0, 33.0, 20.0)),
        item_of("new", "symmetry", ["SLOT"], datums=["BORE 1"])),
    "symmetry of faces": _zone("symmetry", "LEFT|RIGHT", "PAD 1"),
    "material": lambda p, r: more(
        p,
        item_of("size", "diameter", ["BORE 2"], nominal=value(p, "BORE 2", "diameter"), lower=-0.1),
        item_of("new", "position", ["BORE 2"], datums=["BASE"], modifier="maximum material",
                material_size=value(p, "BORE 2", "diameter") + 0.1)),
    "same plane": lambda p, r: more(p, again(p, "TOP", "new")),
    "same plane turned": lambda p, r: more(p, again(p, "TOP", "new", direction=(0.0, 0.0, -1.0))),
    "same bore": lambda p, r: more(p, again(p, "BORE 1", "new", side="outer")),
    "same ball": lambda p, r: more(p, again(p, "BALL", "new")),
    "same slot": lambda p, r: more(p, again(p, "SLOT", "new")),
    "parallel frame": lambda p, r: aligned(p, DatumReferenceFrame(datums=("BASE", "TOP", "LEFT"))),
    "coaxial frame": lambda p, r: aligned(p, DatumReferenceFrame(datums=("BORE 1", "SINK"))),
    "point on the axis": lambda p, r: aligned(
        p, plane_axis_point("RIM")),
    "3-2-1 along z": lambda p, r: aligned(
        more(p, again(p, "BALL", "LOW", point=(9.0, 9.0, 9.0), diameter=5.0),
             again(p, "BALL", "HIGH", point=(9.0, 9.0, 99.0), diameter=7.0)),
        DatumAlignment(primary="TOP", secondary=("LOW", "HIGH"), origin="RIM")),
    "3-2-1 of parallels": lambda p, r: aligned(
        p, DatumAlignment(primary="TOP", secondary=("BASE",), origin="RIM")),
    "points on a line": lambda p, r: aligned(
        more(p, again(p, "BALL", "LOW", point=(9.0, 9.0, 9.0), diameter=5.0),
             again(p, "BALL", "HIGH", point=(9.0, 9.0, 99.0), diameter=7.0),
             again(p, "BALL", "MID", point=(9.0, 9.0, 49.0), diameter=8.0)),
        BestFit(points=("LOW", "MID", "HIGH"))),
    "control points on a line": lambda p, r: aligned(
        p, relocation_along_x("RIM", "EYE", "BALL")),
}  # fmt: skip


def test_honest_plans_are_not_accused() -> None:
    for number in range(amount(300, 3000)):
        plan = honest(number)
        found = plan_findings(plan)
        assert not found, (number, found[0])
    for name in ("demo.toml", "gauge.toml", "quick.toml"):
        assert plan_findings(load_plan(resource("plans", name))) == ()


@pytest.mark.parametrize("name", CONTRADICTIONS)
def test_every_contradiction_is_an_error_that_names_its_item(name: str) -> None:
    # 35 kinds of 9 plans: 315 in every run.
    for number in range(amount(9, 90)):
        rng = np.random.default_rng([SEED, number, len(name)])
        plan = CONTRADICTIONS[name](honest(number), rng)
        errors = [one for one in plan_findings(plan) if one.is_error]
        assert errors, number
        own = [one for one in errors if one.item == "new" or one.item == "alignment"]
        assert own or "plane" in name, errors
        assert all(one.remedy for one in errors)
        with pytest.raises(InputError, match="not valid"):
            require_consistent(Path("p"), plan)


def test_each_kind_of_characteristic_is_compared_with_its_features() -> None:
    """A new kind has a value on a part as drawn: by its geometry, its datums or its form."""
    names = {one.kind for number in range(40)
             for one in honest(number).characteristics}  # fmt: skip
    flat = {kind for kind, spec in KINDS.items() if spec.geometry is None and spec.form_alone}
    framed = {kind for kind, spec in KINDS.items() if spec.datums_make_frame}
    assert set(KINDS) - names - flat - framed == set()


def test_the_plan_of_the_manual_is_complete_and_valid(tmp_path: Path) -> None:
    """The German page has the same plan."""
    pages = [
        ROOT / "docs" / "inspector" / "plans.md",
        ROOT / "docs" / "de" / "inspector" / "plans.md",
    ]
    (text, german) = (
        re.findall(r"```toml\n(schema.*?)```", page.read_text(), re.DOTALL) for page in pages
    )
    assert text == german
    path = tmp_path / "bracket.toml"
    path.write_text(text[0], encoding="utf-8")
    plan = load_plan(path)
    assert plan_findings(plan) == ()
    assert plan.alignment is not None
    points = sum(feature.points for feature in plan.features)
    assert f"4 features with {points} points" in pages[0].read_text()


def test_limits_that_exclude_the_nominal_are_a_warning(tmp_path: Path) -> None:
    plan = honest(0)
    sizes = item_of("new", "diameter", ["BORE 2"], nominal=value(plan, "BORE 2", "diameter"),
                    lower=9.9, upper=10.1)  # fmt: skip
    (found,) = plan_findings(more(plan, sizes))
    assert not found.is_error
    assert "exclude the nominal" in found.what
    require_consistent(Path("p"), more(plan, sizes))


def test_proposed_limits_block_a_release_until_a_person_sets_them(tmp_path: Path) -> None:
    plan = more(honest(0), item_of("new", "form", ["TOP"], limits="proposed"))
    path = tmp_path / "p.toml"
    save_plan(plan, path)
    assert load_plan(path) == plan
    with pytest.raises(InputError, match="proposed and not yet set"):
        release_plan(path, "anna")
    old = plan.characteristics[-1]
    for other in ({"upper": 0.2}, {"limits": "set"}):
        made = replace_item(plan, "new", _other(old, "new", other))
        assert made.characteristics[-1].limits == "set"
        assert not plan_findings(made)


def test_a_side_and_its_far_side_by_a_sheet_are_two_surfaces() -> None:
    plan = honest(0)
    behind = feature("BEHIND", Shape.PLANE, (0.0, 20.0, 10.0), sheet=2.0, sheet_limit=0.1)
    near = feature("NEAR", Shape.PLANE, (0.0, 20.0, 10.0))
    both = msgspec.structs.replace(plan, features=[*plan.features, near, behind])
    assert not [one for one in plan_findings(both) if "same plane" in one.what]
    again = msgspec.structs.replace(near, name="AGAIN")
    both = msgspec.structs.replace(plan, features=[*plan.features, near, again])
    assert [one for one in plan_findings(both) if "same plane" in one.what]
