"""A job whose program was killed between saving and handing over is found again, once."""

from __future__ import annotations

import os
import shutil
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from ocmm_core.errors import StorageError
from ocmm_shop.archive.outbox import Courier, ItemState, JobNote, Outbox, sweep
from tests.shop.archive.conftest import Place
from tests.shop.archive.real_jobs import RealJobs


@pytest.fixture
def outbox(tmp_path: Path) -> Iterator[Outbox]:
    with Outbox(tmp_path / "outbox") as opened:
        yield opened


def program_that_measures(outbox: Path, job: Path) -> int:
    """Start a process that notes a job and goes on; return it when the note is there."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            note = JobNote(outbox, job)
            os.write(write, b"noted")
            while note is not None:
                time.sleep(60.0)
        finally:
            os._exit(1)
    os.close(write)
    with os.fdopen(read, "rb") as stream:
        assert stream.read(5) == b"noted"
    return child


def killed(child: int) -> None:
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)


def test_a_job_of_a_killed_program_is_swept_into_the_outbox_once(
    outbox: Outbox, place: Place, real_jobs: RealJobs, tmp_path: Path
) -> None:
    job = Path(shutil.copy(real_jobs.finished, tmp_path / "job.ocmm"))
    child = program_that_measures(outbox.folder, job)
    try:
        # As long as it measures, it will put it in itself.
        assert sweep(outbox) == 0
    finally:
        killed(child)
    assert outbox.count(ItemState.WAITING) == 0
    assert sweep(outbox) == 1
    assert sweep(outbox) == 0
    courier = Courier(outbox, place.open, "S")
    assert courier.send_waiting().sent == 1
    courier.close()


def test_a_job_that_was_put_in_is_not_swept_again(
    outbox: Outbox, real_jobs: RealJobs, tmp_path: Path
) -> None:
    job = Path(shutil.copy(real_jobs.finished, tmp_path / "job.ocmm"))
    note = JobNote(outbox.folder, job)
    outbox.put(job)
    note.done()
    note.done()
    assert list((outbox.folder / "measuring").iterdir()) == []
    # Killed after it was put in and before the note was taken away.
    JobNote(outbox.folder, job).let_go()
    assert sweep(outbox) == 0
    assert outbox.count(ItemState.WAITING) == 1


def test_what_is_no_job_any_more_does_not_stop_the_sweep(
    outbox: Outbox, real_jobs: RealJobs, tmp_path: Path
) -> None:
    damaged, good = tmp_path / "damaged.ocmm", tmp_path / "good.ocmm"
    damaged.write_bytes(b"\0" * 5000)
    shutil.copy(real_jobs.finished, good)
    for path in (tmp_path / "gone.ocmm", damaged, good, tmp_path):
        JobNote(outbox.folder, path).let_go()
    (outbox.folder / "measuring" / "empty").touch()
    assert sweep(outbox) == 2
    assert {item.name for item in outbox.waiting()} == {"damaged.ocmm", "good.ocmm"}
    courier = Courier(outbox, lambda: Place(str(tmp_path / "a.sqlite"), "sqlite").open(), "S")
    handed = courier.send_waiting()
    courier.close()
    # The damaged one is named instead of being lost.
    assert (handed.sent, handed.aside) == (1, 1)
    assert sweep(outbox) == 0


def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "outbox").write_text("a file in the place of the folder")
    with pytest.raises(StorageError, match="cannot be written"):
        JobNote(tmp_path / "outbox", tmp_path / "job.ocmm")
