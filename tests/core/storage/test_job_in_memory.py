"""A job is viewed by its bytes as by its file, without any access to a disk."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from pathlib import Path

import pytest

from ocmm_core.errors import StorageError
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage import JobFile, JobHead


@pytest.fixture
def content(
    tmp_path: Path, head: JobHead, make_point: Callable[[int], MeasuredPoint]
) -> tuple[Path, bytes]:
    path = tmp_path / "a.ocmm"
    with JobFile.create(path, head) as job:
        for number in (1, 2, 3):
            job.append_point(make_point(number))
        job.change(annul={2: "slipped"})
    return path, path.read_bytes()


def test_the_bytes_say_what_the_file_says(content: tuple[Path, bytes]) -> None:
    path, bytes_ = content
    called = Path("/nowhere/b.ocmm")
    with JobFile.open(path, read_only=True) as file, JobFile.in_memory(called, bytes_) as job:
        assert job.head == file.head
        assert job.seal() == file.seal()
        assert job.verify() == []
        assert [one.number for one in job.points()] == [1, 3]
        stored = file.taken_utc()
        points = {one.number: one for one in [*file.points(), *(p for p, _ in file.annulled())]}
        assert [(one.number, one.stored_utc, one.annulled) for one in job.observed()] == [
            (1, stored[1], 0), (2, stored[2], 1), (3, stored[3], 0),
        ]  # fmt: skip
        for one in job.observed():
            point = points[one.number]
            assert (one.time_s, one.first_frame, one.last_frame) == (
                point.time_s, point.first_frame, point.last_frame,
            )  # fmt: skip
        # Additions are discarded.
        job.append_event("note", "seen")
    assert path.read_bytes() == bytes_


@pytest.mark.parametrize("pages", [1, 5])
def test_bytes_that_were_cut_are_told_by_the_name_of_the_job(
    content: tuple[Path, bytes], pages: int
) -> None:
    called = Path("/nowhere/b.ocmm")
    with pytest.raises(StorageError, match=r"/nowhere/b\.ocmm"):
        JobFile.in_memory(called, content[1][: -4096 * pages])
    for no_job in (content[1][:40], b"x" + content[1]):
        with pytest.raises(StorageError, match=r"/nowhere/b\.ocmm"):
            JobFile.in_memory(called, no_job)


def test_a_point_without_its_time_is_told(content: tuple[Path, bytes]) -> None:
    path, _ = content
    with sqlite3.connect(path) as db:
        db.execute("DROP TRIGGER audit_no_delete")
        db.execute("DELETE FROM audit WHERE subject = 'observation' AND key = 3")
    db.close()
    with (
        JobFile.in_memory(path, path.read_bytes()) as job,
        pytest.raises(StorageError, match="time of point 3"),
    ):
        job.observed()
