"""Closed job files are listed in place, open ones are not; side files stay untouched."""

from __future__ import annotations

import os
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from ocmm_core.errors import StorageError
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage import JobFile, JobHead, read_summary

NUMBERS = (1, 2, 3)
_READ = """
import sqlite3, sys
sqlite3.connect(sys.argv[1], timeout=0).execute("SELECT * FROM head")
"""


@pytest.fixture
def closed(tmp_path: Path, head: JobHead, make_point: Callable[[int], MeasuredPoint]) -> Path:
    """Return a job file that was closed a while ago."""
    path = tmp_path / "jobs" / "a.ocmm"
    path.parent.mkdir()
    with JobFile.create(path, head) as job:
        for number in NUMBERS:
            job.append_point(make_point(number))
        job.change(annul={2: "slipped"})
        job.append_event("header", "{}")
    aged(path)
    return path


def aged(path: Path) -> None:
    os.utime(path, (1e9, 1e9))


def test_a_closed_job_is_seen_in_a_folder_that_nobody_can_write(
    closed: Path, head: JobHead
) -> None:
    closed.parent.chmod(0o500)
    try:
        seen = read_summary(closed)
        assert seen.head == head
        assert seen.n_points == 2
        assert [(event.kind, event.text) for event in seen.events] == [("header", "{}")]
        assert [path.name for path in closed.parent.iterdir()] == [closed.name]
    finally:
        closed.parent.chmod(0o700)


def test_lists_a_job_that_is_held_and_keeps_its_lock(closed: Path) -> None:
    with JobFile.open(closed) as job:
        job.append_event("note", "held")
        seen = read_summary(closed)
        assert seen.events[-1].text == "held"
        # The lock of this very process is still there for another one.
        other = subprocess.run(
            [sys.executable, "-c", _READ, str(closed)], capture_output=True, text=True, check=False
        )
        assert "locked" in other.stderr
    assert read_summary(closed).events[-1].text == "held"


def test_what_is_no_job_or_is_newer_is_one_sentence(closed: Path) -> None:
    other = closed.with_name("other.ocmm")
    other.write_text("no job at all\n" * 100)
    aged(other)
    with pytest.raises(StorageError, match="not a job file"):
        read_summary(other)
    with sqlite3.connect(closed) as db:
        db.execute("PRAGMA user_version = 99")
    db.close()
    aged(closed)
    with pytest.raises(StorageError, match="99"):
        read_summary(closed)
