"""``ocmm plan import``: a table or a model becomes a plan, and omissions are reported."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ocmm_core.features.shapes import Shape
from ocmm_core.inspection.plan import load_plan
from tests.cad.step_models import MODELS, TESSELLATED, written
from tests.commands import Ocmm
from tests.host import needs_package

pytestmark = pytest.mark.usefixtures("kept_readers")

TABLE = "name,shape,x,y,z,diameter,side\nTOP,Plane,0,0,0,,\nBORE,Circle,1,2,3,9.5,inner\n"


def test_a_table_becomes_a_plan_and_no_file_is_lost(ocmm_here: Ocmm, tmp_path: Path) -> None:
    table, plan = tmp_path / "table.csv", tmp_path / "plan.toml"
    table.write_text(TABLE, encoding="utf-8")
    assert "2 features" in ocmm_here("plan", "import", table, "-o", plan).stdout
    assert [feature.name for feature in load_plan(plan).features] == ["TOP", "BORE"]
    refused = ocmm_here("plan", "import", table, "-o", plan)
    assert refused.returncode == 2
    assert "already exists" in refused.stderr
    assert ocmm_here("plan", "import", table, "-o", plan, "--overwrite").returncode == 0


def test_a_model_becomes_a_plan_with_what_is_left_out(ocmm_here: Ocmm, tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    model, plan = written(tmp_path / "shaft.STP", MODELS["stepped shaft"][0]()), tmp_path / "a.toml"
    done = ocmm_here("plan", "import", model, "-o", plan, "--no-reach")
    assert done.returncode == 0, done.stderr
    assert "5 features." in done.stdout
    assert "2  a ball of 6 mm has no room for 9 points" in done.stdout
    assert all(feature.targets for feature in load_plan(plan).features)
    # A smaller ball reaches the shoulders; a larger one must not produce targets in the air.
    done = ocmm_here(
        "plan", "import", model, "-o", plan, "--overwrite", "--ball", "2", "--no-reach"
    )
    assert "Left out" not in done.stdout
    assert len(load_plan(plan).features) == 7
    ocmm_here("plan", "import", model, "-o", plan, "--overwrite", "--all", "--no-reach")
    loaded = load_plan(plan).features
    assert len(loaded) == 7
    assert [feature.shape for feature in loaded if not feature.targets] == [Shape.PLANE] * 2


def test_what_no_probe_reaches_is_left_out_with_the_face_in_its_way(
    ocmm_here: Ocmm, tmp_path: Path
) -> None:
    needs_package("OCP", "the extra 'step'")
    model, plan = written(tmp_path / "block.step", MODELS["block"][0]()), tmp_path / "a.toml"
    done = ocmm_here("plan", "import", model, "-o", plan)
    assert done.returncode == 0, done.stderr
    assert "5 features." in done.stdout
    # It lies on a face; turned over, that one is on top.
    assert "1  the stylus would touch face" in done.stdout
    ocmm_here("plan", "import", model, "-o", plan, "--overwrite", "--up=-z")
    (top,) = [one for one in load_plan(plan).features if one.direction == (0.0, 0.0, -1.0)]
    assert len(top.targets) == 18


def test_what_a_model_offers_is_listed_and_chosen_from(ocmm_here: Ocmm, tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    model, plan = written(tmp_path / "clevis.step", MODELS["clevis"][0]()), tmp_path / "a.toml"
    listed = ocmm_here("plan", "import", model, "--list", "--json")
    assert listed.returncode == 0, listed.stderr
    offers = {offer["name"]: offer for offer in json.loads(listed.stdout)["offers"]}
    assert len(offers) == 12
    first, second = (name for name in offers if name.startswith("BORE"))
    assert {first, second} == {"BORE 20 X5 Y30 Z40", "BORE 20 X95 Y30 Z40"}
    bore = offers[first]
    assert (bore["size_mm"], bore["side"], bore["against"]) == (20.0, "inner", "")
    (below,) = [offer for offer in offers.values() if offer["against"]]
    assert "the stylus would touch face" in below["against"]
    assert not plan.exists()

    def taken(*choice: str) -> list[str]:
        done = ocmm_here("plan", "import", model, "-o", plan, "--overwrite", *choice)
        assert done.returncode == 0, done.stderr
        return [feature.name for feature in load_plan(plan).features]

    assert taken("--kind", "cylinder") == [first, second]
    assert taken("--only", "bore*", "--without", str(bore["faces"][0])) == [second]
    assert taken("--most", "30") == [first, second]
    assert taken("--only", below["name"]) == [below["name"]]
    refused = ocmm_here("plan", "import", model, "-o", plan, "--overwrite", "--only", "SLOT*")
    assert refused.returncode == 2
    assert "'SLOT*'" in refused.stderr
    assert ocmm_here("plan", "import", model).returncode == 2


def test_a_tessellated_model_is_refused_with_what_to_do(
    ocmm_here: Ocmm, tmp_path: Path, reference: Path
) -> None:
    needs_package("OCP", "the extra 'step'")
    path = reference / "step" / TESSELLATED
    refused = ocmm_here("plan", "import", path, "-o", tmp_path / "a.toml")
    assert refused.returncode == 2
    assert "tessellated model: 273 faces" in refused.stderr
    assert "Export the model with exact geometry" in refused.stderr
    assert not (tmp_path / "a.toml").exists()


def test_findings_of_an_imported_plan_give_code_1_and_are_in_the_json(
    ocmm_here: Ocmm, tmp_path: Path
) -> None:
    """Two rows of one plane: the plan is written, but no job can be started by it."""
    table, plan = tmp_path / "table.csv", tmp_path / "plan.toml"
    table.write_text(f"{TABLE}LID,Plane,0,0,0,,\n", encoding="utf-8")
    done = ocmm_here("plan", "import", table, "-o", plan)
    assert done.returncode == 1
    assert "TOP and LID are the same plane" in done.stdout
    done = ocmm_here("plan", "import", table, "-o", plan, "--overwrite", "--json")
    told = json.loads(done.stdout)
    assert (done.returncode, told["valid"], told["table"]["rows"]) == (1, False, 3)
    assert [(one["item"], one["error"]) for one in told["findings"]] == [("LID", True)]
    table.write_text(TABLE, encoding="utf-8")
    done = ocmm_here("plan", "import", table, "-o", plan, "--overwrite", "--json")
    assert (done.returncode, json.loads(done.stdout)["valid"]) == (0, True)
