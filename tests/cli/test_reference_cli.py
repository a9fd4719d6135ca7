"""The option --reference as a stranger uses it."""

from __future__ import annotations

import csv
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from ocmm_core.documents import resource

Ocmm = Callable[..., subprocess.CompletedProcess[str]]

PLAN = """
schema = "ocmm.plan/1"
unit = "mm"
name = "STEP"
part = "DEMO_PART"

[[features]]
name = "BLOCK_TOP"
shape = "Plane"
points = 3
point = [-72.0, 0.0, 20.34]
direction = [0.0, 0.0, 1.0]

[[characteristics]]
name = "Flatness"
kind = "form"
features = ["BLOCK_TOP"]
nominal = 0.0
lower = 0.0
upper = 0.1
"""


def test_a_job_with_a_reference_body_names_it_in_its_report(
    ocmm_here: Ocmm, tmp_path: Path, slow_rig: Path
) -> None:
    plan = tmp_path / "step.toml"
    plan.write_text(PLAN, encoding="utf-8")
    done = ocmm_here(
        "measure", "--rig", slow_rig, "--plan", plan, "--out", "out",
        "--probe", resource("probes", "standard4.toml"),
        "--reference", resource("references", "plate.toml"), "--incomplete",
    )  # fmt: skip
    # Three points do not determine form: the plan is incomplete.
    assert (done.returncode, done.stderr) == (2, "INCOMPLETE: Flatness not measured.\n")
    assert "Reference  plate " in done.stdout
    (report,) = (tmp_path / "out").glob("STEP-001_SIMULATED_INCOMPLETE_report.csv")
    with report.open(newline="", encoding="ascii") as stream:
        (row,) = csv.DictReader(stream)
    assert row["Reference"].startswith("plate ")


def test_a_job_that_lacks_a_value_gives_no_report_unless_it_is_asked_for(
    ocmm_here: Ocmm, tmp_path: Path, slow_rig: Path
) -> None:
    plan = tmp_path / "step.toml"
    plan.write_text(PLAN, encoding="utf-8")
    done = ocmm_here("measure", "--rig", slow_rig, "--plan", plan, "--out", "out")
    assert done.returncode == 2
    assert done.stderr == (
        "INCOMPLETE: Flatness not measured. No report written; ocmm report out/STEP-001.ocmm "
        "--incomplete writes one.\n"
    )
    lines = done.stdout.splitlines()
    assert lines[-4:] == [
        "SIMULATED: No real part was measured.",
        "INCOMPLETE: Missing: Flatness.",
        "NOT MEASURED: Flatness",
        "NOT COMPLETE",
    ]
    # The table is printed all the same, and the points are safe.
    assert any(line.strip().startswith("Flatness") for line in lines)
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["STEP-001.ocmm"]


@pytest.mark.parametrize(
    ("source", "probe", "reference", "words"),
    [
        ("ethercat:virtual", "standard.toml", "plate.toml", "have 10 LEDs together"),
        ("simulated", "standard4.toml", "missing.toml", "file not found"),
    ],
)
def test_a_reference_body_that_cannot_be_used_is_refused_in_one_sentence(
    ocmm_here: Ocmm, source: str, probe: str, reference: str, words: str
) -> None:
    done = ocmm_here(
        "measure", "--source", source, "--plan", resource("plans", "quick.toml"), "--out", "out",
        "--probe", resource("probes", probe), "--reference", resource("references", reference),
    )  # fmt: skip
    assert done.returncode == 2
    assert words in " ".join(done.stderr.split())
    assert "Traceback" not in done.stderr
