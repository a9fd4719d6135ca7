"""``ocmm plan``: check, new and import."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from ocmm_cli import app
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.inspection.plan import load_plan


def run(*arguments: str) -> str:
    result = CliRunner().invoke(app, ["plan", *arguments], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    # Line breaks depend on the width of the terminal.
    return " ".join(result.output.split())


def test_a_plan_is_imported_checked_and_not_overwritten(tmp_path: Path) -> None:
    table, plan = tmp_path / "t.csv", tmp_path / "bracket.toml"
    table.write_text(
        "name,shape,x,y,z,diameter,side\nTOP,Plane,0,0,5,,\nBORE,Circle,1,2,5,8,inner\n"
    )
    assert "2 features" in run("import", str(table), "-o", str(plan), "--part", "P 1")
    loaded = load_plan(plan)
    assert (loaded.name, loaded.part) == ("bracket", "P 1")
    assert [feature.name for feature in loaded.features] == ["TOP", "BORE"]
    told = run("check", str(plan))
    assert "2 features with 17 points" in told
    assert "No alignment" in told
    assert "TOP; no targets" in told
    with pytest.raises(InputError, match="already"):
        run("import", str(table), "-o", str(plan))
    run("import", str(table), "-o", str(plan), "--overwrite")


def test_a_new_plan_can_be_measured_and_the_examples_are_good(tmp_path: Path) -> None:
    run("new", "-o", str(tmp_path / "first.toml"))
    assert load_plan(tmp_path / "first.toml").features[0].name == "DATUM_A"
    assert "good" in run("check", str(resource("plans", "demo.toml")))


def test_check_says_which_picture_is_missing(tmp_path: Path) -> None:
    text = resource("plans", "quick.toml").read_text()
    plan = tmp_path / "p.toml"
    plan.write_text(text.replace('name = "BED"', 'name = "BED"\npicture = "bed.png"', 1))
    assert "bed.png not found" in run("check", str(plan))
    (tmp_path / "bed.png").write_bytes(b"x")
    assert "bed.png" not in run("check", str(plan))
