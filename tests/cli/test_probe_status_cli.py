"""The tips of a probe on the command line: status, history, mounting; measuring with them."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from ocmm_cli import app
from ocmm_core.documents import resource
from ocmm_core.errors import CalibrationError
from tests.commands import Ocmm
from tests.core.calibration.fresh_tips import TIP, Tips


def test_what_is_said_about_a_tip(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    runner = CliRunner()
    of_tips = ["--probes", str(tmp_path / "tips")]
    never = runner.invoke(app, ["calibrate", "probe-status", *of_tips])
    assert never.exit_code == 1
    assert "probe never calibrated" in never.stdout
    tips = Tips(tmp_path / "tips")
    good = runner.invoke(app, ["calibrate", "probe-status", *of_tips])
    assert good.exit_code == 0
    assert f"{TIP} (mounted)" in good.stdout
    assert "State    VALID" in good.stdout
    assert "Ball     6.0000 mm" in good.stdout
    assert "at 20.5 C" in good.stdout
    mounted = runner.invoke(app, ["calibrate", "mount-tip", TIP, *of_tips, "--who", "Ada"])
    assert "quick tip check (one minute)" in mounted.stdout
    status = runner.invoke(app, ["calibrate", "probe-status", *of_tips])
    assert status.exit_code == 1
    assert "was mounted and has not been checked since" in status.stdout
    tips.check()
    history = runner.invoke(app, ["calibrate", "probe-history", *of_tips]).stdout
    kinds = ["probe calibrated", "tip qualified", "tip mounted", "tip check passed"]
    assert [one for one in kinds if one in history] == kinds
    assert "Ada" in history


@pytest.mark.parametrize("command", ["relocate", "verify", "sensors"])
def test_cameras_are_not_calibrated_with_a_tip_that_is_not_known(
    tmp_path: Path, command: str
) -> None:
    Tips(tmp_path / "tips")
    folders = ["--calibrations", str(tmp_path / "cal"), "--probes", str(tmp_path / "tips")]
    done = CliRunner().invoke(app, ["calibrate", command, *folders, "--tip", "long"])
    assert isinstance(done.exception, CalibrationError)
    assert "never calibrated with tip 'long'" in str(done.exception)


def test_a_tip_that_failed_its_check_is_not_measured_with(ocmm_here: Ocmm, tmp_path: Path) -> None:
    Tips(tmp_path / "tips").check(passed=False)
    plan = resource("plans", "quick.toml")
    done = ocmm_here("measure", "--plan", plan, "--out", "out", "--probes", "tips", "--speed", "1")
    assert done.returncode == 2
    assert "Probe  SUSPECT standard/6 mm" in done.stdout
    assert f"SUSPECT: The last check of tip '{TIP}' failed." in done.stderr
    assert "With --uncalibrated, points are taken but prove nothing" in done.stderr


def test_a_tip_whose_records_are_not_whole_is_not_used_and_says_what_to_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    runner = CliRunner()
    tips = Tips(tmp_path / "tips")
    tips.check()
    of_tips = ["--probes", str(tmp_path / "tips")]
    good = runner.invoke(app, ["calibrate", "probe-status", *of_tips])
    assert good.stdout.startswith("Probe    standard, by ")
    assert "whole: history of 3 events, 3 records, 0 sessions" in good.stdout
    check = tips.store.events[-1].record
    (tips.store.folder / f"{check}.json").unlink()
    lost = runner.invoke(app, ["calibrate", "probe-status", *of_tips])
    assert lost.exit_code == 1
    assert f"Record {check[:12]} in {tips.store.folder} is missing." in lost.stdout
    assert "If there is none, run the quick tip check" in lost.stdout
    folders = ["--calibrations", str(tmp_path / "cal"), *of_tips]
    refused = runner.invoke(app, ["calibrate", "verify", *folders])
    assert isinstance(refused.exception, CalibrationError)
    assert "is missing" in refused.exception.what
    # The remedy of the sentence works.
    tips.check()
    renewed = runner.invoke(app, ["calibrate", "probe-status", *of_tips])
    assert (renewed.exit_code, "State    VALID" in renewed.stdout) == (0, True)
