"""Files of each release open, and its jobs have the same results: by the commands that users take.

A result that differs is named in CHANGELOG.md, in a section after that release:
``Golden job BALL-001 of 0.1: Ball diameter, Uncertainty 0.0240, now 0.0221.``
"""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from installer.locks import ROOT
from tests.commands import Ocmm
from tests.core.golden_station import RELEASES, copied_station

Rows = Sequence[dict[str, str]]


@pytest.fixture(params=RELEASES)
def release(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def station(release: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    return copied_station(release, tmp_path, monkeypatch)


def _rows(report: Path) -> Rows:
    with report.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def differences(title: str, before: Rows, now: Rows) -> Iterator[str]:
    """Yield each result that differs, as the changelog names it."""
    names = [row["Name"] for row in before]
    if names != [row["Name"] for row in now]:
        yield f"Golden job {title}: characteristics {names}, now {[row['Name'] for row in now]}."
        return
    for old, new in zip(before, now, strict=True):
        for column in dict.fromkeys((*old, *new)):
            was, made = old.get(column, "-"), new.get(column, "-")
            if was != made:
                yield f"Golden job {title}: {old['Name']}, {column} {was}, now {made}."


def changes_after(release: str, changelog: str) -> str:
    """Return the sections above that of a release, in one line."""
    above, heading, _ = changelog.partition(f"\n## [{release}.0]")
    assert heading, f"CHANGELOG.md has no section {release}.0"
    return " ".join(above.split())


def test_jobs_report_the_same_results_unless_the_changelog_names_them(
    release: str, station: Path, ocmm_here: Ocmm
) -> None:
    changes = changes_after(release, (ROOT / "CHANGELOG.md").read_text("utf-8"))
    jobs = sorted((station / "jobs").glob("*.ocmm"))
    compared = 0
    for job in jobs:
        done = ocmm_here("report", job, "--out", "reports", "--format", "polyworks")
        assert done.returncode in (0, 1), done.stderr
        (report,) = (station / "reports").glob(f"{job.stem}_*_report.csv")
        before, now = _rows(job.with_name(report.name)), _rows(report)
        unnamed = [
            line
            for line in differences(f"{job.stem} of {release}", before, now)
            if line not in changes
        ]
        assert not unnamed, "Name these in CHANGELOG.md:\n" + "\n".join(unnamed)
        compared += len(before)
    assert compared >= len(jobs) > 0


def test_a_result_that_differs_is_found_and_named() -> None:
    before = [{"Name": "Ball", "Measured": "20.0079", "Test": "Pass"}]
    now = [{"Name": "Ball", "Measured": "20.0080", "Test": "Pass"}]
    (line,) = differences("BALL-001 of 0.1", before, now)
    assert line == "Golden job BALL-001 of 0.1: Ball, Measured 20.0079, now 20.0080."
    wrapped = line.replace(" Ball", "\n  Ball")
    named = f"# Changelog\n\n## [0.2.0] - x\n\n- {wrapped}\n"
    assert line in changes_after("0.1", f"{named}\n## [0.1.0] - x\n")
    assert line not in changes_after("0.1", f"# Changelog\n\n## [0.1.0] - x\n\n- {line}\n")
    assert not list(differences("BALL-001 of 0.1", before, before))
    assert list(differences("BALL-001 of 0.1", before, []))


def test_the_last_release_has_golden_files() -> None:
    text = (ROOT / "CHANGELOG.md").read_text("utf-8")
    released = re.findall(r"^## \[(\d+\.\d+)\.\d+\] - ", text, re.MULTILINE)
    assert [*dict.fromkeys(reversed(released))] == RELEASES


def test_jobs_and_reports_keep_their_signatures(station: Path, ocmm_here: Ocmm) -> None:
    done = ocmm_here("audit", "verify", "jobs")
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.search(r"\b(\d+) of \1 files are as they were written", done.stdout)


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
