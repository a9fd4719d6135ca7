"""Forged jobs: refused quickly and in one sentence, with any content."""

from __future__ import annotations

import contextlib
import os
import shutil
import sqlite3
import time
from pathlib import Path

import pytest

from ocmm_bench.campaign import Forgery, damaged_kinds, forged, job_kinds
from ocmm_core.errors import StorageError
from ocmm_core.storage import JobFile, read_summary
from ocmm_core.storage._connection import connection_in_memory
from ocmm_core.storage._guard import BASE_S
from tests.core.storage.conftest import HEAD, sample_point
from tests.other_station import forget_histories, histories

LONGEST_S = 5.0
"""Processor time of one file; a recursive view would take for ever."""
N_DAMAGED = 60

MARKS = (
    "observation",
    "event.",
    "seal.",
    "signatures more",
    "head.created_utc",
    "head.operator",
    "head.id",
)
TABLES = [kind for kind in job_kinds() if any(mark in kind.name for mark in MARKS)]
OTHERS = (*MARKS, ".", "event '", "limit ")
SCHEMAS = [kind for kind in job_kinds() if not any(mark in kind.name for mark in OTHERS)]


@pytest.fixture(scope="module")
def made_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a closed job of three points, one of them annulled.

    The memory of the station that made it is next to it.
    """
    folder = tmp_path_factory.mktemp("good")
    forget_histories()
    with JobFile.create(folder / "good.ocmm", HEAD) as job:
        for number in (1, 2, 3):
            job.append_point(sample_point(number))
        job.change(annul={2: "slipped"})
        job.append_event("note", "a text")
    shutil.copytree(histories(), folder / "histories")
    return folder


@pytest.fixture
def good(made_once: Path, tmp_path: Path) -> Path:
    """Return a copy of it at the station that made it: to make it takes ten waits for the disk."""
    shutil.copytree(made_once / "histories", histories(), dirs_exist_ok=True)
    return Path(shutil.copy(made_once / "good.ocmm", tmp_path / "good.ocmm"))


def told(path: Path) -> str:
    """Read all of a job, and its glance; return the reason of a refusal, or nothing.

    Anything except a StorageError with one short sentence about this file fails the test.
    """
    if path.is_file():
        os.utime(path, (1e9, 1e9))
    found = ""
    try:
        if path.is_file():
            read_summary(path)
    except StorageError as error:
        found = error.what
    try:
        with JobFile.open(path) as job:
            job.verify()
            job.points(), job.annulled(), job.events(), job.taken_utc(), job.reference()
            job.steps()
            return ""
    except StorageError as error:
        found = error.what
    assert str(path) in found
    assert "\n" not in found
    assert len(found) < len(str(path)) + 300
    return found


@pytest.mark.parametrize("kind", [*TABLES, *SCHEMAS], ids=lambda kind: kind.name)
def test_a_forged_job_is_refused_in_one_sentence(good: Path, tmp_path: Path, kind: Forgery) -> None:
    path = tmp_path / "forged.ocmm"
    kind.make(good, path)
    begun = time.thread_time()
    found = told(path)
    assert time.thread_time() - begun < LONGEST_S
    assert found or kind.harmless


def test_a_damaged_job_is_refused_or_read(good: Path, tmp_path: Path) -> None:
    refused = 0
    for kind in damaged_kinds(N_DAMAGED, seed=1):
        path = tmp_path / "damaged.ocmm"
        kind.make(good, path)
        found = told(path)
        refused += bool(found)
        # The one before, refused in the middle of its opening, was closed.
        assert "in use" not in found, kind.name
    assert refused > N_DAMAGED / 2


def test_a_forged_job_of_good_content_is_read(good: Path, tmp_path: Path) -> None:
    # Otherwise the forger would be refused for his forging, and nothing else would be tested.
    path = tmp_path / "forged.ocmm"
    with forged(good, path) as db:
        db.execute("UPDATE observation SET tip_radius = 1.25 WHERE number = 3")
    with JobFile.open(path) as job:
        # Nothing but the signature and the memory of this station speaks against it.
        assert job.verify() == list(job.seal().doubts) != []
        assert [point.tip_radius for point in job.points()] == [1.5003, 1.25]


def test_a_statement_without_end_is_ended(good: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # A tenth of the limit for a file.
    assert BASE_S < LONGEST_S
    monkeypatch.setattr("ocmm_core.storage._guard.BASE_S", 0.1 * BASE_S)
    with connection_in_memory(good, good.read_bytes()) as db, contextlib.closing(db):
        begun = time.thread_time()
        with pytest.raises(sqlite3.OperationalError, match="interrupted"):
            db.execute(
                "WITH RECURSIVE more(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM more) "
                "SELECT count(*) FROM more"
            ).fetchall()
        assert time.thread_time() - begun < 0.1 * LONGEST_S


def test_a_dropped_trigger_is_no_reason_to_refuse(good: Path) -> None:
    db = sqlite3.connect(good)
    db.execute("DROP TRIGGER event_no_update")
    db.close()
    assert told(good) == ""


def test_a_job_of_the_first_version_is_still_opened(good: Path) -> None:
    db = sqlite3.connect(good, isolation_level=None)
    db.execute("DROP TABLE reference_observation")
    db.execute("DROP TABLE reference")
    db.execute("DROP TABLE seal")
    db.execute("DROP TABLE part")
    db.execute("PRAGMA user_version = 1")
    db.close()
    with JobFile.open(good) as job:
        assert len(job.points()) == 2
        assert [doubt[:22] for doubt in job.verify()] == ["The job is not signed:"]
