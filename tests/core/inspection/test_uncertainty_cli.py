"""``ocmm uncertainty`` on a measured job: budgets are those of the results; and a simulation."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from ocmm_cli import app
from ocmm_core.errors import InputError
from ocmm_core.inspection.evaluation import job_uncertainty
from ocmm_core.inspection.finished import reopen_job
from ocmm_core.measuring import MeasuredPoint
from tests.core.inspection.conftest import Bench


@pytest.fixture
def measured(bench: Bench) -> Path:
    """Return the file of a job with all its points."""
    with bench.job() as job:
        session = bench.session(job)
        session.conditions.note_calibration(
            "DESIGN " + "0" * 64, "DESIGN standard: " + "1" * 64, ""
        )
        session.conditions.note_climate()
        for touch in bench.touches:
            assert isinstance(session.touches.record_touch(touch), MeasuredPoint)
    return bench.folder / "job.ocmm"


def run(*arguments: str) -> str:
    found = CliRunner().invoke(app, ["uncertainty", *arguments], catch_exceptions=False)
    assert found.exit_code == 0, found.output
    return found.output


def test_budgets_and_tasks_are_those_of_the_results(measured: Path) -> None:
    job = reopen_job(measured)
    found = job_uncertainty(job.plan, job.points, job.sensitivities, job.rig, job.body, job.options)
    stated = [item for item in job.view.characteristics if item.uncertainty is not None]
    assert set(found.budgets) == {item.name for item in stated}
    for item in stated:
        budget = found.budgets[item.name]
        assert budget.expanded == pytest.approx(item.uncertainty, rel=1e-9)
        names = {row.name for row in budget.rows}
        assert {"Image noise", "Sensor pattern", "Cameras"} <= names
    simulated = [item.name for task in found.tasks for item in task.characteristics]
    assert sorted(simulated) == sorted(found.budgets)
    # The virtual part has no form error: the estimate comes from noise of a few micrometres.
    assert max(float(np.abs(task.form).max()) for task in found.tasks) < 0.02**2


def test_the_command_prints_rows_rule_and_simulation(measured: Path) -> None:
    told = run(str(measured))
    assert "Sensor pattern" in told
    assert "U (95 %)" in told
    assert "(iso14253-1/2)" in told
    assert re.search(r"TUR \d", told)
    job = reopen_job(measured)
    size = next(item.name for item in job.plan.characteristics if item.kind == "diameter")
    told = run(str(measured), "--only", size, "--monte-carlo", "--trials", "10000", "--digits", "1")
    assert "10000" in told
    assert "seed 1" in told
    with pytest.raises(InputError, match="no characteristic named 'nothing'"):
        run(str(measured), "--only", "nothing")
