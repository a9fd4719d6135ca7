"""A job whose file, log or folder is lost while it is written: refused, and saved whole."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from ocmm_core.errors import StorageError
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage import RESCUED, JobFile, JobHead

MakePoint = Callable[[int], MeasuredPoint]
N = 4


def _log(path: Path) -> Path:
    return path.with_name(f"{path.name}-wal")


def _replace(path: Path) -> None:
    other = path.with_name("other")
    other.write_bytes(b"other" * 999)
    other.replace(path)


LOSSES: dict[str, tuple[Callable[[Path], object], str]] = {
    "removed": (Path.unlink, "it was removed"),
    "folder removed": (lambda path: shutil.rmtree(path.parent), "its folder was removed"),
    "moved": (lambda path: path.rename(path.with_name("b.ocmm")), "it was moved to .*b.ocmm"),
    "folder moved": (
        lambda path: path.parent.rename(path.parent.with_name("away")),
        "its folder was moved to .*away",
    ),
    "replaced": (_replace, "it was replaced by another file"),
    "emptied": (lambda path: os.truncate(path, 0), "another program has written into it"),
    "overwritten": (lambda path: path.write_bytes(b"x" * 70000), "has written into it"),
    "log removed": (lambda path: _log(path).unlink(), "its log a.ocmm-wal: it was removed"),
    "log emptied": (lambda path: os.truncate(_log(path), 0), "has written into its log"),
}


def _job(tmp_path: Path, head: JobHead, make_point: MakePoint) -> JobFile:
    (tmp_path / "jobs").mkdir()
    job = JobFile.create(tmp_path / "jobs" / "a.ocmm", head)
    for number in range(1, N + 1):
        job.append_point(make_point(number))
    return job


@pytest.mark.parametrize("noticed", ["by the next point", "by a timer", "at the end"])
@pytest.mark.parametrize("loss", LOSSES)
def test_saves_all_acknowledged_points(
    tmp_path: Path, head: JobHead, make_point: MakePoint, loss: str, noticed: str
) -> None:
    lose, words = LOSSES[loss]
    job = _job(tmp_path, head, make_point)
    lose(job.path)
    error: StorageError | None = None
    if noticed == "by the next point":
        with pytest.raises(StorageError) as refused:
            job.append_point(make_point(N + 1))
        error = refused.value
    elif noticed == "by a timer":
        error = job.check_name()
    job.close()
    error = error or job.given_up
    assert error is not None
    assert re.search(words, error.what)
    saved = job.saved_in
    assert saved is not None
    assert str(saved) in error.what
    with JobFile.open(saved) as again:
        assert [point.number for point in again.points()] == list(range(1, N + 1))
        assert again.verify() == []
        assert [event.kind for event in again.events()][-1] == RESCUED
        again.append_point(make_point(N + 1))
    # A later job of the old name would be read with the log of this one.
    assert not _log(tmp_path / "jobs" / "a.ocmm").exists()


@pytest.mark.parametrize("loss", ["removed", "overwritten"])
def test_reports_a_loss_before_the_points_are_saved(
    tmp_path: Path, head: JobHead, make_point: MakePoint, loss: str
) -> None:
    lose, words = LOSSES[loss]
    job = _job(tmp_path, head, make_point)
    told: list[tuple[StorageError, Path | None]] = []
    lose(job.path)
    final = job.check_name(lambda error: told.append((error, job.saved_in)))
    assert job.check_name(lambda error: told.append((error, job.saved_in))) is not None
    job.close()
    assert final is not None
    [(error, saved_then)] = told
    assert saved_then is None
    assert words in error.what
    assert "being saved" in error.remedy
    # The window replaces the first text by the second.
    assert final.what.startswith(error.what)
    assert str(job.saved_in) in final.what


def test_a_moved_job_keeps_its_points_as_well(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    job = _job(tmp_path, head, make_point)
    there = job.path.rename(tmp_path / "b.ocmm")
    assert job.check_name() is not None
    job.close()
    with JobFile.open(there) as moved:
        assert len(moved.points()) == N
        # It is not an older copy: the saved job has the same points.
        assert moved.verify() == []


def test_honest_changes_are_no_loss(tmp_path: Path, head: JobHead, make_point: MakePoint) -> None:
    job = _job(tmp_path, head, make_point)
    os.utime(job.path)
    job.path.chmod(0o600)
    os.link(job.path, tmp_path / "second-name.ocmm")
    assert job.check_name() is None
    job.append_point(make_point(N + 1))
    # More than one writing of the log into the file.
    for number in range(N + 2, 530):
        job.append_event("note", str(number))
        assert job.check_name() is None
    job.close()
    assert job.given_up is None


def test_saves_again_when_a_folder_takes_the_points(
    tmp_path: Path, head: JobHead, make_point: MakePoint, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocked = tmp_path / "blocked"
    blocked.write_text("a file where the data folder should be")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    job = _job(tmp_path, head, make_point)
    monkeypatch.setenv("XDG_DATA_HOME", str(blocked))
    job.path.unlink()
    error = job.check_name()
    assert error is not None
    assert job.saved_in is None
    assert "memory of this program" in error.remedy
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    assert job.check_name() is not None
    saved = job.saved_in
    job.close()
    assert saved is not None
    with JobFile.open(saved) as again:
        assert len(again.points()) == N
