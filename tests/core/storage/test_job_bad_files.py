"""Files that are no good jobs, and older and newer ones: one sentence each, and nothing changed."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from pathlib import Path

import pytest

from ocmm_core.errors import StorageError
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage import JobFile, JobHead
from ocmm_core.storage._audit import APPLICATION_ID, MIGRATIONS, backup_older, bring_up_to_date

MakePoint = Callable[[int], MeasuredPoint]


@pytest.fixture
def job_path(tmp_path: Path, head: JobHead, make_point: MakePoint) -> Path:
    """Return a closed job with 40 points."""
    path = tmp_path / "a.ocmm"
    with JobFile.create(path, head) as job:
        for number in range(1, 41):
            job.append_point(make_point(number))
    return path


def refusal(path: Path, *, read_only: bool = False) -> str:
    """Return the code with which the file is refused; it must not change by that."""
    before = path.read_bytes() if path.is_file() else None
    with pytest.raises(StorageError) as caught:
        JobFile.open(path, read_only=read_only)
    assert str(path) in caught.value.what
    assert caught.value.what.count(".\n") == 0
    assert caught.value.remedy.endswith(".")
    assert (path.read_bytes() if path.is_file() else None) == before
    return caught.value.code


@pytest.mark.parametrize("read_only", [False, True])
def test_a_missing_file_is_not_made(tmp_path: Path, read_only: bool) -> None:
    assert refusal(tmp_path / "none.ocmm", read_only=read_only) == "job.missing"
    assert refusal(tmp_path, read_only=read_only) == "job.missing"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("content", [b"", b"x,y,z\r\n1,2,3\r\n" * 400, b"SQLite format 3\0 not"])
@pytest.mark.parametrize("read_only", [False, True])
def test_a_foreign_file_is_refused(tmp_path: Path, content: bytes, read_only: bool) -> None:
    path = tmp_path / "a.ocmm"
    path.write_bytes(content)
    assert refusal(path, read_only=read_only) == "job.foreign"


def test_another_sqlite_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.ocmm"
    db = sqlite3.connect(path)
    db.execute("CREATE TABLE head (id)")
    db.close()
    assert refusal(path) == "job.foreign"


@pytest.mark.parametrize("read_only", [False, True])
def test_a_newer_job_is_refused(job_path: Path, read_only: bool) -> None:
    db = sqlite3.connect(job_path)
    db.execute(f"PRAGMA user_version = {len(MIGRATIONS) + 1}")
    db.close()
    assert refusal(job_path, read_only=read_only) == "job.newer"


@pytest.mark.parametrize("keep", [0.3, 0.6, 0.95])
def test_a_cut_off_job_is_refused(job_path: Path, keep: float) -> None:
    content = job_path.read_bytes()
    job_path.write_bytes(content[: int(len(content) * keep)])
    assert refusal(job_path) == "job.damaged"


def test_a_job_with_a_damaged_page_is_refused(job_path: Path) -> None:
    content = bytearray(job_path.read_bytes())
    content[4096:8192] = b"\xa5" * 4096
    job_path.write_bytes(content)
    assert refusal(job_path) == "job.damaged"


def test_one_flipped_bit_in_any_stored_array_is_never_given_out(
    job_path: Path, make_point: MakePoint
) -> None:
    content = bytearray(job_path.read_bytes())
    at = content.index(make_point(17).spots.tobytes())
    content[at + 5] ^= 0x10
    job_path.write_bytes(content)
    with JobFile.open(job_path) as job:
        assert job.verify() == ["The observation 17 was changed after it was stored."]
        with pytest.raises(StorageError, match="point 17 was changed after it was stored"):
            job.points()


def test_a_job_whose_making_was_interrupted_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.ocmm"
    db = sqlite3.connect(path, isolation_level=None)
    bring_up_to_date(db, path)
    db.close()
    assert refusal(path) == "job.damaged"


@pytest.mark.parametrize("folder", ["file.txt", "nowhere", "/proc"])
def test_a_job_in_an_impossible_folder_is_refused(
    tmp_path: Path, head: JobHead, folder: str
) -> None:
    (tmp_path / "file.txt").write_text("a file, no folder")
    with pytest.raises(StorageError) as caught:
        JobFile.create(tmp_path / folder / "a.ocmm", head)
    assert caught.value.code == "job.not_writable"
    assert [item.name for item in tmp_path.iterdir()] == ["file.txt"]


def test_a_head_that_cannot_be_stored_leaves_no_file(tmp_path: Path, head: JobHead) -> None:
    bad = JobHead(**{name: getattr(head, name) for name in head.__slots__} | {"operator": "\udcff"})
    with pytest.raises(StorageError, match="not valid text"):
        JobFile.create(tmp_path / "a.ocmm", bad)
    assert list(tmp_path.iterdir()) == []


def test_the_latest_version_is_made_from_an_empty_file(tmp_path: Path) -> None:
    db = sqlite3.connect(tmp_path / "a.ocmm", isolation_level=None)
    bring_up_to_date(db, tmp_path / "a.ocmm")
    assert db.execute("PRAGMA user_version").fetchone() == (len(MIGRATIONS),)
    assert db.execute("PRAGMA application_id").fetchone() == (APPLICATION_ID,)
    db.close()
    assert [item.name for item in tmp_path.iterdir()] == ["a.ocmm"]


def _add_colour(db: sqlite3.Connection) -> None:
    db.execute("ALTER TABLE event ADD COLUMN colour TEXT NOT NULL DEFAULT 'red'")


def _fail_half_way(db: sqlite3.Connection) -> None:
    db.execute("ALTER TABLE event ADD COLUMN size INTEGER")
    db.execute("SELECT * FROM there_is_no_such_table")


def test_an_older_job_is_stepped_up_after_a_backup(job_path: Path) -> None:
    before = sqlite3.connect(job_path)
    old = before.serialize()
    before.close()
    db = sqlite3.connect(job_path, isolation_level=None)
    backup_older(db, job_path, (*MIGRATIONS, _add_colour))
    bring_up_to_date(db, job_path, (*MIGRATIONS, _add_colour))
    assert db.execute("PRAGMA user_version").fetchone() == (len(MIGRATIONS) + 1,)
    db.execute("SELECT colour FROM event")
    db.close()
    backup = job_path.with_name(f"a.ocmm.v{len(MIGRATIONS)}.bak")
    assert backup.read_bytes() == old
    with JobFile.open(backup) as job:
        assert len(job.points()) == 40
        assert job.verify() == []


def test_a_step_that_fails_leaves_the_version_before_it(job_path: Path) -> None:
    db = sqlite3.connect(job_path, isolation_level=None)
    steps = (*MIGRATIONS, _add_colour, _fail_half_way)
    with pytest.raises(sqlite3.OperationalError):
        bring_up_to_date(db, job_path, steps)
    assert db.execute("PRAGMA user_version").fetchone() == (len(MIGRATIONS) + 1,)
    columns = [row[1] for row in db.execute("PRAGMA table_info(event)")]
    assert columns == ["id", "time_utc", "kind", "text", "colour"]
    db.close()


def test_without_a_backup_there_is_no_step(job_path: Path) -> None:
    job_path.with_name(f"a.ocmm.v{len(MIGRATIONS)}.bak").mkdir()
    db = sqlite3.connect(job_path, isolation_level=None)
    with pytest.raises(StorageError) as caught:
        backup_older(db, job_path, (*MIGRATIONS, _add_colour))
    assert caught.value.code == "job.backup"
    assert db.execute("PRAGMA user_version").fetchone() == (len(MIGRATIONS),)
    db.close()
