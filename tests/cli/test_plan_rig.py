"""``ocmm plan rig``: the prediction on the terminal and as files."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ocmm_core.documents import resource
from ocmm_planner import read_sheet
from tests.commands import Ocmm


@pytest.mark.slow
def test_writes_json_map_and_sheet(ocmm_here: Ocmm, tmp_path: Path) -> None:
    plan = resource("rig_plans", "thesis.toml")
    ran = ocmm_here("plan", "rig", str(plan), "--out", str(tmp_path), "--search", "0", "--pdf")
    assert ran.returncode == 0, ran.stderr
    assert "U of the tip (k = 2, longest half axis)" in ran.stdout
    assert "2 x OCMM smart camera" in ran.stdout
    sheet = read_sheet(tmp_path / "thesis_rig.json")
    assert sheet.best.measurable == sum(one is not None for one in sheet.u_um) > 0
    assert (tmp_path / "thesis_rig.pdf").read_bytes().startswith(b"%PDF")
    assert "<svg" in (tmp_path / "thesis_rig.svg").read_text("utf-8")
    rig = str(resource("rigs", "recommended.toml"))
    options = ("--out", str(tmp_path), "--search", "0", "--json", "--rig", rig)
    found = json.loads(ocmm_here("plan", "rig", str(plan), *options).stdout)
    assert found["schema"] == "ocmm.rig_prediction/1"
    # It is 135 mm farther out, and its calibration is as deep as the volume.
    assert found["calibrated"]["away_mm"] == pytest.approx([135.0, 135.0], abs=0.5)
    assert 0.3 < found["calibrated"]["ratios"][0] < 0.9


@pytest.mark.parametrize("folder", ["/proc/nothing", "/etc/passwd"])
def test_a_folder_that_cannot_be_used_is_named(ocmm_here: Ocmm, folder: str) -> None:
    plan = resource("rig_plans", "thesis.toml")
    ran = ocmm_here("plan", "rig", str(plan), "--out", folder, "--search", "0")
    assert ran.returncode == 2
    assert folder in " ".join(ran.stderr.split())
