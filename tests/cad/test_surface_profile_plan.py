"""Faces of the model become points to touch and their profile, and the plan keeps both exactly."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from ocmm_cad.profiles import with_model_fit
from ocmm_core.alignment import DatumReferenceFrame, ModelBestFit
from ocmm_core.errors import InputError
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.plan import Plan, load_plan, save_plan
from ocmm_core.part_model import ModelFace, nearest_feet, nominal_face, searched, spread_places
from ocmm_core.tolerances.zones import Characteristic
from tests.core.part_model.model_faces import FREE_FORMS, cylinder, face_of, plane

BALL = 3.0
DATUMS = ("A", "B", "C")


def surface_profile(
    name: str, faces: list[ModelFace], count: int, datums: tuple[str, ...] = ()
) -> tuple[list[NominalFeature], Characteristic]:
    """Return points spread over faces of a model, and their profile, 0.1 mm."""
    held = tuple(nominal_face(face) for face in faces)
    places = [spread_places(searched(face), count // len(held), BALL + 1.0, BALL) for face in held]
    found = [pair for at, normals in places for pair in zip(at, normals, strict=True)]
    points = [
        NominalFeature(
            name=f"{name} {number}", shape=Shape.POINT, points=1, point=tuple(at.tolist()),
            direction=tuple(normal.tolist()),
        )
        for number, (at, normal) in enumerate(found, 1)
    ]  # fmt: skip
    names = [point.name for point in points]
    profile = Characteristic(
        name=name, kind="surface profile", features=names, datums=list(datums), upper=0.1,
        faces=held,
    )  # fmt: skip
    return points, profile


def plan_with(faces: list[ModelFace], count: int) -> Plan:
    """Return a plan of three datum planes and the profile of faces."""
    points, profile = surface_profile("Top", faces, count, DATUMS)
    planes = [
        NominalFeature(name=name, shape=Shape.PLANE, points=9, point=(0, 0, 0), direction=axis)
        for name, axis in zip(DATUMS, ((0, 0, -1), (-1, 0, 0), (0, -1, 0)), strict=True)
    ]
    return Plan(
        schema="ocmm.plan/1", unit="mm", name="P", part="Block", features=[*planes, *points],
        characteristics=[profile], alignment=DatumReferenceFrame(datums=DATUMS),
    )  # fmt: skip


@pytest.mark.parametrize("name", FREE_FORMS)
def test_points_lie_on_the_face_where_a_ball_fits(name: str) -> None:
    face = face_of(FREE_FORMS[name]())
    points, profile = surface_profile("Top", [face], 20)
    assert [item.name for item in points] == profile.features
    assert len(points) == 20
    places = np.array([item.point for item in points])
    normals = np.array([item.direction for item in points])
    held = [searched(one) for one in profile.faces]
    on_it = nearest_feet(places, held)
    assert np.abs(on_it.distances).max() < 1e-9
    assert on_it.edge_gaps.min() >= BALL + 1.0 - 1e-6
    balls = nearest_feet(places + BALL * normals, held)
    assert balls.distances == pytest.approx(BALL, abs=1e-9)
    assert balls.doubts == ("",) * 20
    apart = np.linalg.norm(places[:, None] - places, axis=2) + 1e9 * np.eye(20)
    assert apart.min() > 3.0


@pytest.mark.parametrize("name", FREE_FORMS)
def test_a_plan_with_faces_reads_back_as_it_was_written(name: str, tmp_path: Path) -> None:
    plan = plan_with([face_of(FREE_FORMS[name]()), face_of(plane(), number=2)], 20)
    path = tmp_path / "plan.toml"
    save_plan(plan, path)
    assert load_plan(path) == plan


def test_a_face_that_was_damaged_in_the_file_is_refused_by_its_place(tmp_path: Path) -> None:
    path = tmp_path / "plan.toml"
    save_plan(plan_with([face_of(plane())], 8), path)
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("degree_u = 1", "degree_u = 2"), encoding="utf-8")
    with pytest.raises(InputError, match=r"characteristics\[0\].faces\[0\]' is no face of a model"):
        load_plan(path)


def test_where_no_ball_fits_there_is_no_plan() -> None:
    narrow = face_of(cylinder(3.1), outward=False)
    with pytest.raises(InputError, match="Only 0 places of face 1 have room for a ball of 6 mm"):
        with_model_fit(bare_plan(), [narrow], count=12)
    wide = replace(narrow, spline=cylinder(6.0))
    points = with_model_fit(bare_plan(), [wide], count=12).features
    assert len(points) == 12
    # They look towards the axis.
    for item in points:
        assert np.dot(item.point[:2], item.direction[:2]) < 0.0


def test_a_hole_gets_no_point() -> None:
    outline = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
    hole = 0.5 + np.array([[0.2, 0.2], [-0.2, 0.2], [-0.2, -0.2], [0.2, -0.2]])
    face = ModelFace(4, "Plane", spline=plane(100.0, 80.0), loops=(outline, hole))
    _, profile = surface_profile("Flat", [face], 16)
    places, _ = spread_places(searched(profile.faces[0]), 16, 4.0, BALL)
    inside = np.all(np.abs(places[:, :2] - [50.0, 40.0]) < [24.0 - 1e-6, 20.0 - 1e-6], axis=1)
    assert len(places) == 16
    assert not inside.any()


def bare_plan() -> Plan:
    """Return a plan of nothing yet."""
    return Plan(
        schema="ocmm.plan/1", unit="mm", name="P", part="Block", features=[], characteristics=[]
    )  # fmt: skip


def test_a_plan_is_aligned_by_faces_of_its_model() -> None:
    faces = [replace(face_of(FREE_FORMS["waves"]()), name="Skin"), face_of(plane(), number=2)]
    bare = bare_plan()
    plan = with_model_fit(bare, faces, count=15)
    rule = plan.alignment
    assert isinstance(rule, ModelBestFit)
    assert [one.number for one in rule.faces] == [1, 2]
    # The uneven one goes to the first face; each point is called after its face.
    assert sum(name.startswith("Skin on ") for name in rule.points) == 8
    assert sum(name.startswith("FACE 2 on ") for name in rule.points) == 7
    places = np.array([plan.feature(name).point for name in rule.points])
    held = [searched(one) for one in rule.faces]
    assert np.abs(nearest_feet(places, held).distances).max() < 1e-9


def test_points_that_lie_on_the_faces_already_are_taken() -> None:
    face = face_of(FREE_FORMS["waves"]())
    first = with_model_fit(bare_plan(), [face], count=9)
    off = msgspec.structs.replace(
        first.features[0], name="OFF", point=(*first.features[0].point[:2], 400.0)
    )
    before = msgspec.structs.replace(first, features=[*first.features, off], alignment=None)
    again = with_model_fit(before, [face], count=9)
    assert again.features == before.features
    assert isinstance(again.alignment, ModelBestFit)
    assert again.alignment.points == tuple(one.name for one in first.features)
    more = with_model_fit(before, [face], count=12)
    assert isinstance(more.alignment, ModelBestFit)
    assert len(more.alignment.points) == 12
    assert "OFF" not in more.alignment.points
    assert len({one.name for one in more.features}) == len(more.features) == 13


def test_faces_without_room_and_none_at_all_are_refused() -> None:
    bare = bare_plan()
    with pytest.raises(InputError, match="No face of the model is chosen"):
        with_model_fit(bare, [])
    with pytest.raises(InputError, match="have room for a ball of 200 mm"):
        with_model_fit(bare, [face_of(FREE_FORMS["waves"]())], ball_radius=100.0)
