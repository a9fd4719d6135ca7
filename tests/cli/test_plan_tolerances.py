"""``ocmm plan import``: tolerances of a model are taken, and what became of each is printed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ocmm_core.inspection.plan import load_plan
from tests.cad.step_models import MODELS
from tests.cad.test_pmi_models import toleranced
from tests.commands import Ocmm
from tests.host import needs_package

pytestmark = pytest.mark.usefixtures("kept_readers")


def test_the_account_is_printed_and_the_code_tells(ocmm_here: Ocmm, tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    model = toleranced(tmp_path / "bored.stp", MODELS["bored"][0]())
    plan = tmp_path / "plan.toml"
    ask = ("plan", "import", model, "-o", plan, "--overwrite", "--no-reach", "--no-model")
    done = ocmm_here(*ask)
    assert done.returncode == 0, done.stderr
    # Line breaks depend on the length of the folder's name.
    assert "2 characteristics" in " ".join(done.stdout.split())
    assert "diameter 12 +0.1 -0.2 mm" in done.stdout
    assert "dimension: 1 (1 taken)" in done.stdout
    assert ocmm_here("plan", "check", plan).returncode == 0
    # An impossible limit: the plan is written without it, and the exit code shows that.
    text = model.read_text()
    assert "MEASURE_WITH_UNIT(-0.2," in text
    model.write_text(text.replace("MEASURE_WITH_UNIT(-0.2,", "MEASURE_WITH_UNIT(0.2,"))
    done = ocmm_here(*ask, "--json")
    assert done.returncode == 1
    said = json.loads(done.stdout)
    assert said["counts"]["dimension"] == {"taken": 0, "partly": 0, "refused": 1}
    (refused,) = [item for item in said["items"] if item["status"] == "refused"]
    assert "is below the lower one" in refused["why"]
    assert [one.kind for one in load_plan(plan).characteristics] == ["flatness"]
    done = ocmm_here(*ask, "--no-tolerances")
    assert done.returncode == 0
    assert load_plan(plan).characteristics == []
    done = ocmm_here(*ask, "--general", "iso2768-x")
    assert done.returncode == 2
    assert "iso2768-m" in done.stderr
