"""An auditor who has a file, a key or a line from paper, and the commands."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest
from typer.testing import CliRunner

from benchmarks.evidence_site import cameras_in, probe_in
from ocmm_cli import app
from ocmm_core.documents import resource
from ocmm_core.export import ENDING
from ocmm_core.seals import KeyFolder
from ocmm_core.storage import JobFile, make_head
from tests.other_station import other_station


@pytest.fixture
def job(tmp_path: Path) -> Path:
    head = make_head(
        plan=resource("plans", "quick.toml"),
        rig=resource("rigs", "recommended.toml"),
        probe=resource("probes", "standard.toml"),
        operator="Ada Lovelace",
        part="DEMO_PART",
        serial="1",
    )
    path = tmp_path / "JOB-001.ocmm"
    with JobFile.create(path, head) as made:
        made.append_event("note", "begun\x1b[2J")
    return path


def run(*arguments: object) -> tuple[int, str]:
    done = CliRunner().invoke(app, [str(item) for item in arguments])
    return done.exit_code, done.output


def test_an_intact_job_says_who_when_and_what(job: Path) -> None:
    code, told = run("audit", "verify", job)
    assert code == 0
    assert f"{job}: INTACT (job)" in told
    assert "Signed   SEALED, by this station (key " in told
    assert "Ada Lovelace  job begun" in told
    # What steers a terminal is not printed.
    assert "note: begun?[2J" in told


def test_a_job_of_a_stranger_is_not_intact(job: Path, tmp_path: Path) -> None:
    with other_station(tmp_path / "home"):
        code, told = run("audit", "verify", job)
    assert code == 1
    assert "NOT INTACT (job)" in told
    assert "Signed   UNKNOWN KEY, by unknown station (key " in told
    # Another station trusts the key of this station after a person has compared it.
    code, shown = run("key", "show")
    assert code == 0
    public = shown.split("Public key")[1].split()[0]
    with other_station(tmp_path / "home"):
        answers = ("--name", "Cell 1", "--who", "Ada", "--reason", "compared")
        assert run("key", "trust", public, *answers)[0] == 0
        code, again = run("audit", "verify", job)
        assert (code, "SEALED, by Cell 1 (key " in again) == (0, True)
        assert "Cell 1  " in run("key", "show")[1]


def test_a_line_of_a_report_proves_the_file_or_does_not(job: Path) -> None:
    with JobFile.open(job) as made:
        line = made.seal().line
    code, told = run("audit", "verify", job, "--line", line)
    assert (code, "The report was made from this job at step 2." in told) == (0, True)
    code, told = run("audit", "verify", job, "--line", line.replace(":2:", ":1:", 1))
    assert (code, "not as it was signed" in told) == (1, True)
    code, told = run("audit", "verify", job, "--line", "x")
    assert (code, "not the line of a job report" in told) == (1, True)


def test_an_old_job_is_taken_over_by_name(job: Path) -> None:
    db = sqlite3.connect(job)
    db.execute("DROP TABLE seal")
    db.execute("DROP TABLE part")
    db.execute("PRAGMA user_version = 2")
    db.commit()
    db.close()
    code, told = run("audit", "verify", job)
    assert (code, "NOT SIGNED, by nobody" in told) == (1, True)
    answers = ("--who", "Ada Lovelace", "--reason", "measured in spring")
    assert run("audit", "adopt", job, *answers)[0] == 0
    code, told = run("audit", "verify", job)
    assert (code, "taken over by Ada Lovelace: measured in spring" in told) == (1, True)
    # The record of the suspicion stays in the job.
    assert "ADOPTED (job)" in told
    assert "Signed   ADOPTED, by this station" in told
    assert "The job is not signed" in told
    assert "INTACT" not in told
    code, told = run("audit", "adopt", job, *answers)
    assert (code, "sealed already" in told) == (2, True)


def test_folders_of_records_and_seals_of_reports(tmp_path: Path) -> None:
    cameras = cameras_in(tmp_path / "cal", 0).folder
    probe = probe_in(tmp_path / "probes", 0).folder
    code, told = run("audit", "verify", cameras, probe, "--all")
    assert code == 0
    assert "INTACT (calibrations of cameras)" in told
    assert "INTACT (calibrations of a probe)" in told
    assert "verification passed" in told
    nothing = tmp_path / "x"
    (tmp_path / "empty").mkdir()
    empty = tmp_path / "empty"
    code, told = run("audit", "verify", nothing, empty, tmp_path / f"a{ENDING}", tmp_path)
    # Each has its own sentence; the last one is searched for histories all the same.
    assert (code, told.count("INTACT (calibrations of")) == (2, 2)
    assert "there is no history of calibrations" in told


def test_a_replaced_key_leaves_jobs_as_they_were(job: Path, tmp_path: Path) -> None:
    with other_station(tmp_path / "home"):
        KeyFolder().station_key()
        answers = ("--who", "Ada", "--reason", "every two years")
        code, told = run("key", "replace", *answers)
        assert (code, "signs with key" in told) == (0, True)
        assert "this station  " in run("key", "show")[1]
