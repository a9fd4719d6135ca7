"""Files of any kind next to a job are refused by name at once, and nothing outside changes."""

from __future__ import annotations

import os
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from ocmm_bench.campaign import MAKERS, Make
from ocmm_core.errors import StorageError
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.side_files import Trusted, open_guarded
from ocmm_core.storage import LEFT_OUT, JobFile, JobHead, open_in_place, read_summary
from ocmm_core.storage._guard import GuardedConnection

HARMLESS = ("empty", "unreadable", "another user's")
_PRINT = "import sys; sys.path.insert(0, ''); from ocmm_cli import main; main()"


@pytest.fixture
def kept(tmp_path: Path, head: JobHead, make_point: Callable[[int], MeasuredPoint]) -> Path:
    path = tmp_path / "a.ocmm"
    with JobFile.create(path, head) as job:
        job.append_point(make_point(1))
    return path


@pytest.mark.parametrize("end", ["-journal", "-wal", "-shm"])
@pytest.mark.parametrize("word", sorted(MAKERS))
def test_refuses_what_this_program_never_makes_there(
    kept: Path, tmp_path: Path, word: str, end: str
) -> None:
    secret = tmp_path / "secret.txt"
    secret.write_text("outside")
    make: Make = MAKERS[word]
    side = kept.with_name(f"{kept.name}{end}")
    make(side, secret)
    is_fine = end != "-journal" and word in (*HARMLESS, "hot journal")
    if word == "another user's" and end != "-journal":
        # Its owner is neither that of the job nor root.
        is_fine = os.getuid() != 0
    for door in (JobFile.read, JobFile.open, read_summary):
        if is_fine and not (word == "unreadable" and os.getuid() != 0):
            found = door(kept)
            if isinstance(found, JobFile):
                found.close()
            if door is JobFile.open:
                # Without a step in it the log is gone.
                break
        else:
            with pytest.raises(StorageError) as caught:
                door(kept)
            assert str(side) in caught.value.what
    assert secret.read_text() == "outside"


@pytest.mark.parametrize(
    "late",
    [("hot journal", "-journal"), ("link", "-wal"), ("second name", "-wal"), ("pipe", "-wal")],
)
def test_refuses_what_appears_after_the_check_of_the_names(
    kept: Path, tmp_path: Path, late: tuple[str, str]
) -> None:
    word, end = late
    secret = tmp_path / "secret.txt"
    secret.write_text("outside")

    class Late(GuardedConnection):
        def __init__(self, *args: Any, **options: Any) -> None:
            MAKERS[word](kept.with_name(f"{kept.name}{end}"), secret)
            super().__init__(*args, **options)

    with pytest.raises((OSError, sqlite3.Error)):
        open_in_place(kept, Late, Trusted.JOB, wait_s=0.0)
    assert secret.read_text() == "outside"
    kept.with_name(f"{kept.name}{end}").unlink(missing_ok=True)
    with JobFile.open(kept) as job:
        assert (len(job.points()), job.verify()) == (1, [])


def test_never_adds_to_a_job_through_a_link(kept: Path, tmp_path: Path) -> None:
    link = tmp_path / "link.ocmm"
    link.symlink_to(kept)
    with JobFile.read(link) as job:
        assert len(job.points()) == 1
    with pytest.raises(StorageError, match="is a link"):
        JobFile.open(link)


def test_opens_no_file_through_a_link_to_make_it(tmp_path: Path) -> None:
    link, target = tmp_path / "lock", tmp_path / "target"
    link.symlink_to(target)
    with pytest.raises(OSError, match="link"):
        open_guarded(link, flags=os.O_RDWR | os.O_CREAT)
    assert not target.exists()


@pytest.mark.parametrize(
    ("redirected", "code"), [(">&-", 0), ("2>&-", 0), ("<&-", 0), (">/dev/full", 2)]
)
def test_ends_with_a_code_of_the_table_without_its_streams(redirected: str, code: int) -> None:
    done = subprocess.run(
        ["/bin/sh", "-c", f'exec "$0" -c "{_PRINT}" settings show {redirected}', sys.executable],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr


def test_a_continued_job_states_what_was_left_out(
    kept: Path, tmp_path: Path, make_point: Callable[[int], MeasuredPoint]
) -> None:
    cut = tmp_path / "cut" / "a.ocmm"
    cut.parent.mkdir()
    with JobFile.open(kept) as job:
        job.append_point(make_point(2))
        job.append_point(make_point(3))
        for name in (kept.name, f"{kept.name}-wal"):
            shutil.copy(kept.with_name(name), cut.with_name(name))
    log = cut.with_name(f"{cut.name}-wal")
    with log.open("ab") as stream:
        # The beginning of a step that was never acknowledged.
        stream.write(bytes(100))
    with JobFile.open(cut) as job:
        assert job.left_out
        told = job.left_out
        job.append_point(make_point(4))
        job.append_point(make_point(5))
    with JobFile.read(cut) as job:
        assert [event.text for event in job.events() if event.kind == LEFT_OUT] == [told]
        assert (len(job.points()), job.verify(), job.left_out) == (5, [], "")
