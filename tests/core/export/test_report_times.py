"""An invalid time: no job file contains one, and no format writes one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ocmm_bench.campaign import forged
from ocmm_cli import app
from ocmm_core.errors import StorageError
from ocmm_core.export.report import head_table, last_moment, paper_facts
from tests.core.export.sample_report import sample_report, sample_view, write_incomplete
from tests.core.inspection.conftest import Bench, bench, quick_touches

__all__ = ["bench", "quick_touches"]


@pytest.fixture
def measured(bench: Bench) -> Path:
    with bench.job() as job:
        session = bench.session(job)
        for touch in bench.touches[:4]:
            session.touches.record_touch(touch)
    return job.path


@pytest.mark.parametrize("time_utc", ["yesterday", "2026-11-26T01:00:00", ""])
def test_a_job_file_with_such_a_time_is_refused_by_every_format(
    measured: Path, tmp_path: Path, time_utc: str
) -> None:
    path = tmp_path / "forged.ocmm"
    with forged(measured, path) as db:
        db.execute("UPDATE audit SET time_utc = ? WHERE subject = 'observation'", (time_utc,))
    for name in ("qif", "dfq"):
        said = CliRunner().invoke(
            app, ["report", str(path), "--format", name, "--incomplete", "--out", str(tmp_path)]
        )
        assert isinstance(said.exception, StorageError)
        assert "the time of point 1 is no ISO 8601 time" in said.exception.what
        assert str(path) in said.exception.what


@pytest.mark.parametrize("name", ["qif", "dfq"])
def test_a_report_of_a_script_with_such_a_time_gets_a_sentence(name: str, tmp_path: Path) -> None:
    data = sample_report(sample_view())
    wrong = replace(data, taken_utc=dict.fromkeys(data.taken_utc or {1: ""}, "yesterday"))
    with pytest.raises(StorageError, match="'yesterday', which is no ISO 8601 time"):
        write_incomplete(wrong, [name], tmp_path)


def test_the_latest_is_the_latest_in_any_zone() -> None:
    # As texts the first one is the later one.
    found = last_moment("", ["2026-11-26T09:00:00+08:00", "2026-11-26T02:00:00+00:00"])
    assert found.isoformat() == "2026-11-26T02:00:00+00:00"
    assert last_moment("2026-11-26T02:00:00+00:00", []).hour == 2


def test_head_and_paper_say_the_latest_moment_in_utc() -> None:
    data = sample_report(sample_view())
    times = {1: "2026-11-26T09:00:00+08:00", 2: "2026-11-26T02:00:00+00:00"}
    zones = replace(data, taken_utc=times)
    rows = {row[0]: row[1] for row in head_table(zones).rows}
    assert rows["Last point (UTC)"] == "2026-11-26T02:00:00+00:00"
    ends = [one.value for one in paper_facts(zones) if one.name == "End (UTC)"]
    assert ends == ["2026-11-26 02:00:00"]
    assert replace(data, taken_utc={}).last_taken_utc == ""
