"""Rows of real job files: from the file alone, and nothing of an altered one counts."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest

from ocmm_core.inspection.finished import reopen_job
from ocmm_shop.archive.checks import verify_archive
from ocmm_shop.archive.records import Delivery, extract_job, snapshot
from ocmm_shop.archive.stores import open_archive
from tests.shop.archive.made_jobs import made_sender
from tests.shop.archive.real_jobs import RealJobs


def test_rows_say_what_the_job_says(real_jobs: RealJobs) -> None:
    path = real_jobs.finished
    job = reopen_job(path)
    made = extract_job(snapshot(path), path.name, "Station 1")
    row = made.record.job
    assert row.state == "finished"
    assert row.fault == ""
    assert row.seal == "SIGNED"
    assert row.station == "Station 1"
    assert row.verdict == job.view.part_verdict.word.value
    assert len(made.record.results) == len(job.view.characteristics)
    for one, result in zip(made.record.results, job.view.characteristics, strict=True):
        assert one.verdict == result.verdict.value
        stated = result.stated
        assert (one.value, one.uncertainty) == (
            (None, None) if stated is None else (stated[0], stated[2])
        )
    assert {use.kind for use in made.record.uses} >= {"plan", "probe", "rig"}


def test_the_same_file_gives_the_same_rows_also_after_the_job_went_on(real_jobs: RealJobs) -> None:
    paused = real_jobs.paused_content
    first = extract_job(paused, "job.ocmm", "Station 1")
    # This computer has read the later job: the paused version is not a suspect older copy.
    reopen_job(real_jobs.went_on)
    again = extract_job(paused, "other name.ocmm", "Station 1")
    assert first.record == again.record
    assert first.record.job.state == "paused"
    assert first.record.job.fault == ""


def test_a_version_that_goes_on_is_none_that_was_altered(real_jobs: RealJobs) -> None:
    paused = extract_job(real_jobs.paused_content, "job.ocmm", "S").record.job
    later = extract_job(
        snapshot(real_jobs.went_on), "job.ocmm", "S", {paused.steps: paused.head}
    ).record.job
    assert later.job_uuid == paused.job_uuid
    assert later.steps > paused.steps
    assert later.fault == ""
    other = extract_job(
        snapshot(real_jobs.went_on), "job.ocmm", "S", {paused.steps: "0" * 64}
    ).record.job
    assert other.fault.startswith("Altered after it was archived")


def test_nothing_of_an_altered_file_counts(real_jobs: RealJobs, tmp_path: Path) -> None:
    path = tmp_path / "altered.ocmm"
    path.write_bytes(snapshot(real_jobs.finished))
    with sqlite3.connect(path) as db:
        names = [
            row[0] for row in db.execute("SELECT name FROM sqlite_master WHERE type='trigger'")
        ]
        for name in names:
            db.execute(f"DROP TRIGGER {name}")
        db.execute("UPDATE observation SET chi2_per_dof = chi2_per_dof + 1 WHERE number = 1")
    db.close()
    row = extract_job(path.read_bytes(), "altered.ocmm", "S").record
    sound = extract_job(snapshot(real_jobs.finished), "x.ocmm", "S").record
    assert "altered.ocmm: the job file is damaged (point 1 was changed" in row.job.fault
    assert row.results == ()
    assert (row.job.job_uuid, row.job.head) == (sound.job.job_uuid, sound.job.head)
    # At equal steps the copy that was altered displaces nothing.
    sender = made_sender("S")
    with open_archive(str(tmp_path / "archive.sqlite")) as archive:
        for sequence, (record, content) in enumerate(
            ((sound, snapshot(real_jobs.finished)), (row, path.read_bytes())), start=1
        ):
            archive.put(
                Delivery(
                    sender=sender,
                    sequence=sequence,
                    sent_utc=sound.job.created_utc,
                    record=record,
                    content=content,
                )
            )
        assert archive.query("SELECT fault, others FROM archived_job").rows == (("", 1),)
        assert len(archive.query("SELECT * FROM archived_result").rows) == len(sound.results)
        assert [why for _, why in verify_archive(archive).faults] == [row.job.fault]


def test_a_snapshot_of_a_job_that_is_measured_holds_what_was_stored(real_jobs: RealJobs) -> None:
    with real_jobs.measuring() as (path, points):
        made = extract_job(snapshot(path), path.name, "S")
        assert made.record.job.points == points
        assert made.record.job.state == "open"


@pytest.mark.parametrize("name", ["../../x.ocmm", "", "/", "a\0b.ocmm"])
def test_a_hostile_name_of_a_file_writes_nowhere_else(real_jobs: RealJobs, name: str) -> None:
    made = extract_job(real_jobs.paused_content, name, "S")
    assert made.record.job.state == "paused"
