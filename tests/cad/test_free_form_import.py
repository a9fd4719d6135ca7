"""Free-form faces from the file to the plan: location, targets, refusals."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from ocmm_cad.profiles import with_profiles
from ocmm_cad.step import Choice, StepModel, chosen, faces_account, offers_of, read_model
from ocmm_cli import app
from ocmm_core.alignment import DatumReferenceFrame, ModelBestFit
from ocmm_core.errors import InputError
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.plan import Plan, load_plan, new_plan, with_alignment
from ocmm_core.part_model import nearest_feet, searched
from tests.cad.free_form_models import FREE_FORM_MODELS, written_model
from tests.cad.step_models import off_mm
from tests.host import needs_package

pytestmark = pytest.mark.usefixtures("kept_readers")

BALL_MM = 6.0
TENTH_OF_A_MICROMETRE = 1e-4


def read(folder: Path, name: str) -> tuple[Path, StepModel]:
    needs_package("OCP", "the extra 'step'")
    path = written_model(folder, name)
    return path, read_model(path, BALL_MM)


@pytest.mark.parametrize("name", FREE_FORM_MODELS)
def test_places_and_faces_are_those_of_the_library(name: str, tmp_path: Path) -> None:
    path, model = read(tmp_path, name)
    (free,) = model.free_forms
    assert len(free.targets) == len(free.normals) == 20
    assert off_mm(path, free.targets).max() < 1e-6
    # Of places up to 1.5 mm off, to both sides, by the library's own search over the whole part.
    rng = np.random.default_rng(18)
    places, normals = np.array(free.targets), np.array(free.normals)
    off = rng.uniform(0.1, 1.5, len(places))[:, None] * normals
    for sign in (1.0, -1.0):
        points = places + sign * off + rng.uniform(-0.3, 0.3, places.shape)
        found = nearest_feet(points, [searched(free.face)])
        assert found.doubts == ("",) * 20
        library = off_mm(path, [tuple(point) for point in points.tolist()])
        assert np.abs(np.abs(found.distances) - library).max() < TENTH_OF_A_MICROMETRE
    balls = nearest_feet(places + 0.5 * BALL_MM * normals, [searched(free.face)])
    assert balls.distances == pytest.approx(0.5 * BALL_MM, abs=1e-6)
    assert balls.edge_gaps.min() >= 0.5 * BALL_MM + 1.0 - 1e-6


def test_they_are_offered_and_taken_only_where_their_zone_is_known(tmp_path: Path) -> None:
    _, model = read(tmp_path, "wavy")
    offers = offers_of(model)
    (free,) = (one for one in offers if one.free_form is not None)
    assert (free.kind, free.against, free.feature.name) == ("free form", "", "FREE FORM 1")
    assert free not in chosen(offers, Choice())
    assert free not in chosen(offers, Choice(everything=True))
    assert free in chosen(offers, Choice(profiles=True))
    assert chosen(offers, Choice(only=("FREE*",))) == (free,)
    assert chosen(offers, Choice(kinds=("Free form",), profiles=True)) == (free,)
    # A measurable kind of surface is not listed among the unmeasurable ones.
    assert not any("BSpline" in why for why, _ in faces_account(model, ()).left_out)


def test_a_ball_that_has_no_room_on_a_free_form_is_said(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    model = read_model(written_model(tmp_path, "uneven"), 32.0)
    assert model.free_forms == ()
    (why,) = (why for why, _ in faces_account(model, ()).left_out if "free form" in why)
    assert "a ball of 32 mm has room for" in why


def test_the_profile_is_in_the_datum_system_of_the_plan_or_fits_best(tmp_path: Path) -> None:
    _, model = read(tmp_path, "wavy")
    planes = [one for one in model.features if one.shape is Shape.PLANE]
    names = (planes[0].name, planes[1].name, "BALL")
    ball = NominalFeature(name="BALL", shape=Shape.SPHERE, points=9, point=(0, 0, 50), diameter=9)
    bare = new_plan("P", "P")
    bare = Plan(
        schema=bare.schema, unit="mm", name="P", part="P", features=[*planes, ball],
        characteristics=[],
    )  # fmt: skip
    held = with_profiles(
        with_alignment(bare, DatumReferenceFrame(datums=names)), model.free_forms, 0.2
    )
    (item,) = held.characteristics
    assert (item.kind, item.upper, item.datums) == ("surface profile", 0.2, list(names))
    assert item.features == [f"FREE FORM 1 {number}" for number in range(1, 21)]
    free = with_profiles(bare, model.free_forms, 0.2)
    assert isinstance(free.alignment, ModelBestFit)
    assert free.alignment.points == tuple(item.features)
    assert free.characteristics[0].datums == []


def test_the_command_writes_a_plan_with_profiles(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    path, plan = written_model(tmp_path, "wavy"), tmp_path / "wavy.toml"

    def run(*more: str) -> str:
        arguments = ["plan", "import", str(path), "--no-sight", *more]
        result = CliRunner().invoke(app, arguments, catch_exceptions=False)
        assert result.exit_code == 0, result.output
        return " ".join(result.output.split())

    listed = json.loads(run("--list", "--json"))
    assert [one["name"] for one in listed["offers"] if one["shape"] == "free form"] == [
        "FREE FORM 1"
    ]
    with pytest.raises(InputError, match="FREE FORM 1 is a free form, and the width of its zone"):
        run("-o", str(plan), "--only", "FREE FORM 1")
    assert "1 free-form face can be measured as profiles: give --profile" in run("-o", str(plan))
    assert load_plan(plan).characteristics == []
    run("-o", str(plan), "--profile", "0.05", "--overwrite")
    loaded = load_plan(plan)
    assert [item.upper for item in loaded.characteristics] == [0.05]
    assert sum(item.shape is Shape.POINT for item in loaded.features) == 20
