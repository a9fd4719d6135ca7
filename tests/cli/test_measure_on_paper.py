"""`ocmm measure` and `ocmm report` write on the same paper, of this station and of the job."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ocmm_cli import app
from ocmm_core.documents import resource
from ocmm_core.errors import InputError

TEMPLATE = """
schema = "ocmm.report-template/1"
unit = "mm"
name = "lab"
[laboratory]
name = "Laboratory of the shop"
"""


def head(folder: Path) -> str:
    read = [json.loads(path.read_text("utf-8")) for path in folder.glob("*.json")]
    (facts,) = (one["head"] for one in read if isinstance(one.get("head"), list))
    return " ".join(f"{fact['name']} {fact['value']}" for fact in facts)


@pytest.mark.slow
def test_every_route_has_the_paper_of_the_station(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, slow_rig: Path
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    runner = CliRunner()
    plan, out = str(resource("plans", "quick.toml")), tmp_path / "out"
    measured = ["measure", "--rig", str(slow_rig), "--plan", plan, "--out"]
    measure = [*measured, str(out)]
    wrong = runner.invoke(app, [*measure, "--format", "docx"])
    assert isinstance(wrong.exception, InputError)
    assert not list(out.glob("*"))
    first = runner.invoke(app, [*measure, "--format", "json"])
    assert first.exit_code in (0, 1), first.output
    (job,) = out.glob("*.ocmm")
    lab = tmp_path / "lab.toml"
    lab.write_text(TEMPLATE, encoding="utf-8")
    options = [
        "--format",
        "json",
        "--template",
        str(lab),
        "--customer",
        "Customer AG",
        "--remember",
    ]
    reports = tmp_path / "reports"
    told = runner.invoke(app, ["report", str(job), "--out", str(reports), *options])
    assert told.exit_code == 0, told.output
    lab.unlink()
    for words in ("Laboratory of the shop", "Customer AG"):
        assert words in head(reports)
    # Now no caller names them.
    again = tmp_path / "again"
    told = runner.invoke(
        app, ["report", str(job), "--out", str(again), "--format", "json", "--format", "pdf"]
    )
    assert told.exit_code == 0, told.output
    assert head(again) == head(reports)
    assert len(list(again.glob("*.pdf"))) == 1
    fresh = tmp_path / "fresh"
    told = runner.invoke(app, [*measured, str(fresh), "--format", "json", "--format", "pdf"])
    assert told.exit_code in (0, 1), told.output
    assert "Laboratory of the shop" in head(fresh)
    # The customer is that of the other job.
    assert "Customer AG" not in head(fresh)
    assert len(list(fresh.glob("*.pdf"))) == 1
