"""Files of version 0.1.0 open: each kind by the command that users take."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import pytest

from tests.commands import Ocmm

GOLDEN = Path(__file__).parents[1] / "golden" / "0.1" / "station"


@pytest.fixture
def station(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a copy of the station's files; its key and settings are in force."""
    shutil.copytree(GOLDEN, tmp_path, dirs_exist_ok=True)
    for folder in (tmp_path / "home").iterdir():
        monkeypatch.setenv(folder.name.upper(), str(folder))
    # Version control keeps no permissions; other users' keys are refused.
    (tmp_path / "home/xdg_data_home/ocmm/keys/station.key").chmod(0o600)
    return tmp_path


def _rows(report: Path) -> list[dict[str, str]]:
    with report.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_a_finished_job_reports_the_same_values(station: Path, ocmm_here: Ocmm) -> None:
    done = ocmm_here("report", "jobs/BALL-001.ocmm", "--out", "reports", "--format", "polyworks")
    assert done.returncode == 0, done.stderr
    (report,) = (station / "reports").glob("*_report.csv")
    assert _rows(report) == _rows(station / "jobs/BALL-001_SIMULATED_report.csv")


def test_jobs_and_reports_keep_their_signatures(station: Path, ocmm_here: Ocmm) -> None:
    done = ocmm_here("audit", "verify", "jobs")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "6 of 6 files are as they were written" in done.stdout


def test_an_interrupted_job_resumes(station: Path, ocmm_here: Ocmm) -> None:
    done = ocmm_here("measure", "--continue", "open/BALL-001.ocmm", "--archive", "off")
    # 1: the plan's narrow tolerance is not proven.
    assert done.returncode in (0, 1), done.stderr
    assert "Ball diameter" in done.stdout


def test_a_plan_and_its_release_hold(station: Path, ocmm_here: Ocmm) -> None:
    done = ocmm_here("plan", "check", "ball.toml")
    assert done.returncode == 0, done.stderr
    assert "Q. Engineer" in done.stdout
    assert "NOT released" not in done.stdout


def test_a_recording_replays(station: Path, ocmm_here: Ocmm) -> None:
    done = ocmm_here(
        "measure", "--plan", "ball.toml", "--source", "replay:frames.rec", "--archive", "off",
        "--out", "replayed",
    )  # fmt: skip
    # 2: 0.1 s of frames contain no touch.
    assert done.returncode == 2, done.stderr
    assert "800 delivered, 0 lost" in done.stdout


def test_an_acceptance_record_recomputes(station: Path, ocmm_here: Ocmm) -> None:
    (record,) = (station / "acceptance/records").iterdir()
    done = ocmm_here("acceptance", "recompute", record)
    assert done.returncode == 0, done.stdout + done.stderr
    (session,) = (station / "acceptance/sessions").iterdir()
    listed = ocmm_here("acceptance", "status", "--folder", "acceptance")
    assert session.name not in listed.stderr
    assert "PASS" in listed.stdout


def test_an_archive_verifies_and_lists_its_job(station: Path, ocmm_here: Ocmm) -> None:
    done = ocmm_here("archive", "verify", "--archive", "archive.sqlite")
    assert done.returncode == 0, done.stderr
    assert "Checked 1, wrong 0" in done.stdout


def test_settings_of_station_and_user_are_in_force(station: Path, ocmm_here: Ocmm) -> None:
    assert ocmm_here("settings", "check").returncode == 0
    shown = json.loads(ocmm_here("settings", "show", "--json").stdout)
    values = {one["key"]: one["value"] for one in shown["settings"]}
    assert values["window.theme"] == "light"
    assert values["instrument.source"] == "ethercat:service"


def test_a_gauge_study_continues(station: Path, ocmm_here: Ocmm) -> None:
    done = ocmm_here("msa", "status", "study.toml", "jobs")
    assert done.returncode in (0, 1), done.stderr
    assert "20" in done.stdout
