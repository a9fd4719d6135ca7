"""``ocmm msa linearity``, ``part`` and ``part-use`` on real job files, as a stranger reads them."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from ocmm_cli import app
from ocmm_core.errors import InputError
from ocmm_shop.studies import save_part_study
from tests.cli.msa_jobs import touches_of, write_job
from tests.shop.studies.test_part_study import DOCUMENT, study


@pytest.fixture(scope="module")
def jobs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with three measurements of one part, whose step is 20.302 mm."""
    folder = tmp_path_factory.mktemp("jobs")
    for seed in range(3):
        touches = touches_of(folder, "20.302", seed)
        write_job(folder / f"P0-{seed}.ocmm", "P0", touches)
    return folder


@pytest.mark.slow
def test_part_says_bias_u_and_that_three_results_are_too_few(jobs: Path) -> None:
    said = CliRunner().invoke(
        app,
        ["msa", "part", str(jobs), "--characteristic", "Block step", "--certified", "20.302",
         "--U-cal", "0.0008"],
    )  # fmt: skip
    told = " ".join(said.output.split())
    assert said.exit_code == 1, said.output
    assert "N 3, bias " in told
    # The true step is known: the mean of three scatters by 1 to 2 um, so that 10 um is wrong.
    bias = float(told.split("bias ")[1].split(",")[0])
    assert abs(bias) < 0.010
    assert "20 results are the least: this U is not used. Measure the part again" in told
    assert "E_n" in told


@pytest.mark.slow
def test_linearity_of_one_part_is_refused_with_what_it_needs(jobs: Path) -> None:
    name = ["--characteristic", "Block step"]
    few = ["msa", "linearity", str(jobs), *name, "--reference", "P0=20.302"]
    said = CliRunner().invoke(app, few)
    assert isinstance(said.exception, InputError)
    assert "5 with 10 are the least" in said.exception.what
    # An invalid reference is reported before a job is read.
    said = CliRunner().invoke(app, [*few, "--reference", "P1=wide"])
    assert isinstance(said.exception, InputError)
    assert "'P1=wide' is no reference" in said.exception.what


def test_part_use_prints_u_of_a_kept_study_and_refuses_another_task(tmp_path: Path) -> None:
    path = save_part_study(tmp_path, study(simulated=True))
    task = tmp_path / "task.toml"
    task.write_text(DOCUMENT, encoding="utf-8")
    given = ["msa", "part-use", str(path), "--task", str(task), "--temperature", "22.5",
             "--temperature-u", "0.0001"]  # fmt: skip
    said = CliRunner().invoke(app, given)
    told = " ".join(said.output.split())
    assert said.exit_code == 0, said.output
    assert told.startswith("SIMULATED")
    assert "BORE: U 0.009541" in told
    task.write_text(DOCUMENT.replace("vice", "magnet"), encoding="utf-8")
    said = CliRunner().invoke(app, given)
    assert isinstance(said.exception, InputError)
    assert "does not hold here" in said.exception.what


def test_part_use_needs_the_thermometer_and_holds_at_both_ends(tmp_path: Path) -> None:
    kept = study(simulated=True)
    path = save_part_study(tmp_path, kept)
    task = tmp_path / "task.toml"
    task.write_text(DOCUMENT, encoding="utf-8")
    low, high = kept.temperatures
    given = ["msa", "part-use", str(path), "--task", str(task), "--temperature"]
    for celsius, u, words in (
        ("22.5", "", "without the uncertainty of its thermometer"),
        (f"{high - 0.05:g}", "0.2", "the study holds for"),
        (f"{low + 0.05:g}", "0.2", "the study holds for"),
    ):
        said = CliRunner().invoke(app, [*given, celsius, *(["--temperature-u", u] if u else [])])
        assert isinstance(said.exception, InputError)
        assert words in said.exception.what
