"""Editing a plan, writing it down, and filling it from tables, models and master parts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from ocmm_core.alignment import DatumAlignment, DatumReferenceFrame
from ocmm_core.documents import resource
from ocmm_core.errors import InputError, StorageError
from ocmm_core.features.measured import Intersection, Offset, actual_features
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import RigidTransform, rotation_from_vector
from ocmm_core.inspection.evaluation import places_of
from ocmm_core.inspection.plan import (
    Plan,
    add_characteristic,
    add_construction,
    add_feature,
    feature_table,
    load_plan,
    move_item,
    new_plan,
    remove_item,
    replace_item,
    save_plan,
    taught_plan,
)
from ocmm_core.inspection.plan._edit import _checked, _renamed, group_of_name
from ocmm_core.inspection.plan._file import plan_text
from ocmm_core.inspection.plan._plan import picture_fault
from ocmm_core.tolerances.zones import Characteristic
from ocmm_core.wording import in_language
from tests.core.inspection.test_guidance import BALL, point_at

PLANS = sorted(resource("plans").glob("*.toml"))


def rename_item(plan: Plan, old: str, new: str) -> Plan:
    return _checked(_renamed(plan, group_of_name(plan, old), old, new))


def face(name: str, **changes: object) -> NominalFeature:
    plane = NominalFeature(name=name, shape=Shape.PLANE, points=4, point=(0.0, 0.0, 0.0))
    return msgspec.structs.replace(plane, **changes)


@pytest.fixture
def plan() -> Plan:
    made = new_plan("P", "PART")
    for name in ("A", "B", "C"):
        made = add_feature(made, face(name))
    bore = NominalFeature(
        name="BORE", shape=Shape.CIRCLE, points=8, point=(1.0, 2.0, 3.0), diameter=9.5,
        side="inner", projection="A", text='Bohrung "links"\nzuerst\\dann €', picture="pic/a.png",
    )  # fmt: skip
    made = add_feature(made, bore)
    made = add_construction(made, Intersection(name="EDGE", features=("A", "B")))
    made = add_construction(made, Offset(name="UP", features=("A",), distance=3.5, towards="BORE"))
    step = Characteristic(name="Step", kind="distance", features=["A", "C"], upper=0.1, lower=-0.1)
    return add_characteristic(made, step)


@pytest.mark.parametrize("path", PLANS, ids=lambda path: path.stem)
def test_a_plan_is_read_back_as_it_was_written(path: Path, tmp_path: Path) -> None:
    plan = load_plan(path)
    save_plan(plan, tmp_path / "again.toml")
    assert load_plan(tmp_path / "again.toml") == plan


def test_texts_and_nested_rules_survive_the_way_through_the_file(
    plan: Plan, tmp_path: Path
) -> None:
    flat = DatumReferenceFrame(datums=("A", "BORE"))
    changed = msgspec.structs.replace(plan, alignment=flat, compensation="pulled", rule="simple")
    save_plan(changed, tmp_path / "p.toml")
    assert load_plan(tmp_path / "p.toml") == changed
    assert "\x7f" not in plan_text(changed)


def test_a_faulty_plan_is_not_written_over_a_good_one(plan: Plan, tmp_path: Path) -> None:
    path = tmp_path / "p.toml"
    save_plan(plan, path)
    before = path.read_bytes()
    with pytest.raises(InputError, match="features"):
        save_plan(msgspec.structs.replace(plan, features=[]), path)
    assert path.read_bytes() == before
    with pytest.raises(StorageError, match="cannot be written"):
        save_plan(plan, tmp_path / "nowhere" / "p.toml")


def test_a_new_name_is_carried_to_all_that_refer_to_it(plan: Plan) -> None:
    aligned = msgspec.structs.replace(
        plan, alignment=DatumAlignment(primary="A", secondary=("B",), origin="BORE")
    )
    renamed = rename_item(aligned, "A", "DATUM")
    assert renamed.feature("BORE").projection == "DATUM"
    assert renamed.constructions[0].features == ("DATUM", "B")
    assert renamed.characteristics[0].features == ["DATUM", "C"]
    assert renamed.alignment is not None
    assert "DATUM" in renamed.alignment.features
    assert "A" not in plan_text(renamed).replace("PART", "").split('"')
    # The plan that was given is as before, and back again is the same.
    assert aligned.feature("BORE").projection == "A"
    assert rename_item(renamed, "DATUM", "A") == aligned


def test_a_feature_named_like_an_axis_is_renamed_and_the_axis_is_not(plan: Plan) -> None:
    named = add_feature(plan, face("x"))
    named = msgspec.structs.replace(
        named, alignment=DatumAlignment(primary="x", secondary=("B",), origin="BORE")
    )
    where = Characteristic(
        name="x", kind="coordinate", features=["BORE"], axis="x", upper=0.1, lower=-0.1
    )
    renamed = rename_item(add_characteristic(named, where), "x", "FLOOR")
    assert renamed.characteristics[-1] == where
    assert isinstance(renamed.alignment, DatumAlignment)
    assert (renamed.alignment.primary, renamed.alignment.secondary_axis) == ("FLOOR", "x")


def test_what_is_needed_by_others_is_not_removed(plan: Plan) -> None:
    with pytest.raises(InputError, match="BORE, EDGE, UP, Step") as caught:
        remove_item(plan, "A")
    assert caught.value.code == "plan.in_use"
    without = remove_item(plan, "Step")
    assert [item.name for item in remove_item(without, "C").features] == ["A", "B", "BORE"]


def test_items_move_and_are_replaced(plan: Plan) -> None:
    moved = move_item(plan, "BORE", 0)
    assert [item.name for item in moved.features] == ["BORE", "A", "B", "C"]
    assert [item.name for item in move_item(moved, "BORE", 99).features][-1] == "BORE"
    changed = replace_item(plan, "B", face("WALL", points=6))
    assert changed.feature("WALL").points == 6
    assert changed.constructions[0].features == ("A", "WALL")
    with pytest.raises(InputError, match="repeats the name"):
        replace_item(plan, "B", face("A"))
    with pytest.raises(InputError, match="needs 3 to 1000"):
        replace_item(plan, "B", face("B", points=2))


@pytest.mark.parametrize(
    "picture",
    ["../secret.png", "/etc/passwd.png", "a/../../b.png", "C:\\x.png", "a\\b.png", "x.exe",
     "//host/x.png", "file:x.png"],
)  # fmt: skip
def test_a_picture_stays_beside_the_plan(plan: Plan, picture: str) -> None:
    assert picture_fault(picture)
    with pytest.raises(InputError, match="picture"):
        add_feature(plan, face("D", picture=picture))


@pytest.mark.parametrize(("method", "shape"), [("shank", Shape.SPHERE), ("nominal", Shape.LINE)])
def test_a_way_that_says_nothing_about_a_shape_is_refused(
    plan: Plan, method: str, shape: Shape
) -> None:
    diameter = 10.0 if shape is Shape.SPHERE else 0.0
    with pytest.raises(InputError, match="compensation"):
        add_feature(plan, face("D", shape=shape, diameter=diameter, points=6, compensation=method))


CSV = """name;shape;x;y;z;i;j;k;diameter;side;points;text
TOP;Plane;0;0;10,5;;;;;;6;Touch all corners
BORE-1;circle;12,25;-3.5;10;0;0;1;8,02;inner;;
SLOT;Round slot;1;2;3;;;;;;;
"""


def test_a_table_gives_features(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text(
        CSV.replace("SLOT;Round slot", "BALL;sphere").replace("3;;;;;;;", "3;0;0;0;6;;;")
    )
    top, bore, ball = feature_table(path).features
    assert (top.point, top.points, top.text) == ((0.0, 0.0, 10.5), 6, "Touch all corners")
    assert (bore.diameter, bore.side, bore.point) == (8.02, "inner", (12.25, -3.5, 10.0))
    assert (ball.shape, ball.direction) == (Shape.SPHERE, (0.0, 0.0, 1.0))


PATHS = """name;shape;x;y;z;projection;compensation;scan;spacing;interval [ms];turn [rad];\
gate_i;gate_j;gate_k;width;sheet;sheet_limit;diameter
TOP;Plane;0;0;10;;;;0,5;;;1;0;0;;;;
BORE;Circle;0;5;10;;;Ring;1;500;;;;;;;;20
SHAFT;Plane;0;15;10;;;;1;;0,1;;;;;;;
EDGE;Line;0;0;9;TOP;;;;;;;;;2;;;
INSIDE;Point;5;5;10;;Nominal;;;;;;;;;2;0,08;
"""


def test_a_table_states_paths_sheets_and_edges(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text(PATHS)
    table = feature_table(path)
    top, bore, shaft, edge, inside = table.features
    assert (top.spacing, top.gates) == (0.5, (1.0, 0.0, 0.0))
    assert (bore.interval, bore.gates, bore.scan) == (0.5, (0.0, 0.0, 0.0), "ring")
    assert shaft.turn_deg == pytest.approx(5.7295779513, abs=1e-9)
    assert (edge.projection, edge.width) == ("TOP", 2.0)
    assert (inside.sheet, inside.sheet_limit, inside.compensation) == (2.0, 0.08, "nominal")
    assert len(table.added_to(new_plan("P", "M")).features) == len(table.features)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("name;shape;x;y;z;interval [h]\nA;Plane;1;2;3;1\n", ("line 1", "unit of time")),
        ("name;shape;x;y;z;gate_k\nA;Plane;1;2;3;2\n", ("gate_i, gate_j, gate_k", "length 2")),
        ("name;shape;x;y;z;compensation\nA;Plane;1;2;3;push\n", ("line 2", "pulled")),
        ("name,shape,x,y\nA,Plane,1,2\n", ("line 1", "lack 'z'")),
        ("name,shape,x,y,z,w\n", ("line 1", "'w'")),
        ("name,shape,x,y,z\nA,Plane,1,2,three\n", ("line 2", "column 'z'", "'three'")),
        ("name,shape,x,y,z\nA,Plane,1,5,2,3\n", ("line 2", "decimal comma")),
        ("name,shape,x,y,z\nA,Plane,1,2,3\nA,Plane,1,2,3\n", ("line 3", "line 2")),
        ("name,shape,x,y,z\n=1+1,Plane,1,2,3\n", ("line 2", "column 'name'")),
        ('name,shape,x,y,z\n"A$(x)",Plane,1,2,3\n', ("line 2", "column 'name'")),
        ("name,shape,x,y,z\nA,Blob,1,2,3\n", ("line 2", "column 'shape'", "Plane")),
        ("name;shape;x;y;z\nA;Plane;1.234;2,5;3\n", ("line 2", "'1.234' could be")),
        ("name;shape;x;y;z;diameter [in]\nA;Cylinder;1;2;3;0.4\n", ("line 1", "diameter inch")),
        ("name;shape;x;y;z;k\nA;Plane;1;2;3;25.4\n", ("line 2", "the length 25.4")),
        ("name;shape;x;y;z\nA;Plane;nan;2;3\n", ("line 2", "column 'x'")),
        ("name;shape;x;y;z\nA;Plane;1e999;2;3\n", ("line 2", "column 'x'")),
        ("name;shape;x;y;z;diameter\nA;Cylinder;1;2;3;-8\n", ("line 2", "column 'diameter'")),
        ("name;shape;x;y;z;diameter\nA;Cylinder;1;2;3;\n", ("line 2", "column 'diameter'")),
        ("name;shape;x;y;z;diameter\nA;Plane;1;2;3;8\n", ("line 2", "column 'diameter'")),
        ("name;shape;x;y;z;i;j;k\nA;Plane;1;2;3;0;0;0\n", ("line 2", "i, j, k", "length 0")),
        ("name;shape;x;y;z\n", ("no rows",)),
        ("", ("no rows",)),
    ],
)
def test_a_fault_of_a_table_names_line_and_column(
    tmp_path: Path, content: str, told: tuple[str, ...]
) -> None:
    path = tmp_path / "t.csv"
    path.write_text(content)
    with pytest.raises(InputError) as caught:
        feature_table(path)
    for word in told:
        assert word in str(caught.value)
    # A mark quoted in the reason can end the cell as well, which leaves the sentence in English.
    if "'$'" not in caught.value.what:
        assert in_language(caught.value, "de")[0] != caught.value.what


def test_nominals_are_taught_in_the_part_frame() -> None:
    T = RigidTransform(rotation_from_vector(np.array([0.1, -0.2, 0.3])), np.array([5.0, 1.0, 2.0]))
    ball = NominalFeature(
        name="BALL", shape=Shape.SPHERE, points=9, point=(0.0, 0.0, 0.0), diameter=1.0
    )
    true = msgspec.structs.replace(ball, point=(10.0, 20.0, 30.0), diameter=25.4)
    places = places_of(true, 9)
    tips = T.inverse().apply(places.points + BALL * places.normals)
    normals = places.normals @ T.rotation
    points = [
        replace(point_at(tip, number, "BALL"), direction=normal)
        for number, (tip, normal) in enumerate(zip(tips, normals, strict=True), start=1)
    ]
    plan = msgspec.structs.replace(new_plan("P", "M"), features=[ball])
    actual = actual_features([ball], points)
    taught = taught_plan(plan, actual, T)
    assert taught.features == [true]
    with pytest.raises(InputError, match="part frame"):
        taught_plan(plan, actual, None)
