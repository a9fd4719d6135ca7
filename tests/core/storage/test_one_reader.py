"""Readers find every whole point after full disks, cut logs and cut checkpoints."""

from __future__ import annotations

import hashlib
import inspect
import os
import random
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from ocmm_core.errors import StorageError
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage import JobFile, JobHead, read_job, read_summary
from ocmm_core.storage._job_content import read_log
from tests.core.storage.conftest import sample_point
from tests.host import HANG_S, private_mounts

# The long form reads 131,070 files.
pytestmark = pytest.mark.timeout(3600)
MakePoint = Callable[[int], MeasuredPoint]
Repeats = Callable[[int, int], int]

_LAST = 64 << 10
"""Bytes at the end of the log or of the file that are cut."""
_IMPORTS = """
import shutil, subprocess, sys
from pathlib import Path
import numpy as np
from ocmm_core.errors import StorageError
from ocmm_core.measuring._point import MeasuredPoint
from ocmm_core.storage._job_file import JobFile
from ocmm_core.storage._rows import JobHead
HEAD = JobHead("a", "2024-05-06T07:08:09+00:00", *"cdefghi")
"""
_FILL = """
place, kept = Path(sys.argv[1]), Path(sys.argv[2])
for size in map(int, sys.argv[3:]):
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}k", "none", place], check=True)
    path, stored = place / "full.ocmm", -1
    try:
        job = JobFile.create(path, HEAD)
        stored = 0
        while stored < 2000:
            job.append_point(sample_point(stored + 1))
            stored += 1
    except StorageError as error:
        assert error.code in ("job.disk_full", "job.not_writable"), error
    if stored >= 0:
        for word in ("killed", "closed"):
            shutil.copytree(place, kept / f"{size}-{word}-{stored}")
            job.close()
    subprocess.run(["umount", place], check=True)
"""


def test_reads_every_point_after_a_full_disk(tmp_path: Path, repeats: Repeats) -> None:
    place, kept = tmp_path / "disk", tmp_path / "kept"
    place.mkdir()
    kept.mkdir()
    sizes = [str(size) for size in range(64, 704, 640 // repeats(13, 160))]
    script = _IMPORTS + inspect.getsource(sample_point) + _FILL
    subprocess.run(
        [*private_mounts(), sys.executable, "-c", script, str(place), str(kept), *sizes],
        check=True, timeout=HANG_S,
    )  # fmt: skip
    read = 0
    for folder in kept.iterdir():
        stored = int(folder.name.rpartition("-")[2])
        with JobFile.read(folder / "full.ocmm") as job:
            assert [point.number for point in job.points()] == list(range(1, stored + 1)), folder
            assert [one for one in job.verify() if "audit" in one.lower()] == []
        read += 1
    assert read >= len(sizes)


@pytest.fixture
def measured(tmp_path: Path, head: JobHead) -> Path:
    """Return a job that is being measured: 30 points, the last 20 of them in its log."""
    path = tmp_path / "job" / "a.ocmm"
    path.parent.mkdir()
    job = JobFile.create(path, head)
    for number in range(1, 11):
        job.append_point(sample_point(number))
    job.close()
    job = JobFile.open(path)
    for number in range(11, 31):
        job.append_point(sample_point(number))
    kept = tmp_path / "kept"
    shutil.copytree(path.parent, kept)
    job.close()
    # The file after the checkpoint, to build cut ones.
    shutil.copy(path, tmp_path / "after.ocmm")
    return kept / "a.ocmm"


def _places(n: int, seed: int) -> list[int]:
    if n >= _LAST - 1:
        return [*range(1, _LAST)]
    return random.Random(seed).sample(range(1, _LAST), n)  # noqa: S311 - places, no secret


class Reader:
    """Read a job by the door of all readers; equal contents are judged once."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.judged: dict[bytes, int] = {}

    def read(self) -> tuple[int, str]:
        """Return the number of points, all of them whole, and the omissions."""
        content = read_job(self.path)
        key = hashlib.sha256(content.file).digest()
        if key not in self.judged:
            with JobFile.in_memory(self.path, content.file, content.left_out) as job:
                numbers = [point.number for point in job.points()]
                assert numbers == list(range(1, len(numbers) + 1))
                assert not [one for one in job.verify() if "audit" in one.lower()]
            assert len(read_summary(self.path).events) == 0
            self.judged[key] = len(numbers)
        return self.judged[key], content.left_out


def test_reads_whole_steps_of_a_log_cut_at_any_byte(measured: Path, repeats: Repeats) -> None:
    log, reader = measured.with_name("a.ocmm-wal"), Reader(measured)
    whole = log.read_bytes()
    assert len(whole) > _LAST
    for place in sorted(_places(repeats(40, _LAST), seed=1)):
        os.truncate(log, len(whole) - place)
        points, left_out = reader.read()
        assert points >= 10
        if place % (4096 + 24):
            assert "complete step" in left_out
    assert len(reader.judged) > 1


def test_reads_all_points_during_a_checkpoint_cut_at_any_byte(
    measured: Path, tmp_path: Path, repeats: Repeats
) -> None:
    before, after = measured.read_bytes(), (tmp_path / "after.ocmm").read_bytes()
    reader, last = Reader(measured), len(after)
    assert len(after) > len(before)
    measured.write_bytes(after)
    with measured.open("r+b", buffering=0) as file:
        for place in sorted(_places(min(repeats(30, _LAST), len(after) - 1), seed=2)):
            # A checkpoint writes pages in their order, and the disk was full or the power failed.
            cut = len(after) - place
            os.truncate(measured, max(cut, len(before)))
            file.seek(cut)
            file.write(before[cut:last])
            last = cut
            assert reader.read() == (30, "")
    assert measured.read_bytes() == after[:last] + before[last:]


@pytest.mark.parametrize("end", ["head", "short", "other"])
def test_reads_the_file_without_a_log_that_lost_its_head(measured: Path, end: str) -> None:
    log = measured.with_name("a.ocmm-wal")
    content = log.read_bytes()
    log.write_bytes(
        {"head": bytes(32) + content[32:], "short": content[:20], "other": b"#!/bin/sh\n" * 99}[end]
    )
    with JobFile.read(measured) as job:
        assert len(job.points()) == 10
        assert "no valid head" in job.left_out


def test_recovers_a_log_as_sqlite_does(tmp_path: Path, repeats: Repeats) -> None:
    draw = random.Random(3)  # noqa: S311 - contents, no secret
    for size in (512, 4096, 65536):
        path = tmp_path / f"{size}.db"
        db = sqlite3.connect(path, isolation_level=None)
        for setting in (f"page_size = {size}", "journal_mode = WAL", "wal_autocheckpoint = 0"):
            db.execute(f"PRAGMA {setting}").fetchall()
        db.execute("CREATE TABLE t (a, b)")
        for k in range(30):
            db.execute("INSERT INTO t VALUES (?, ?)", (k, draw.randbytes(draw.randrange(5000))))
        file, log = path.read_bytes(), path.with_name(f"{path.name}-wal").read_bytes()
        for trial in range(repeats(20, 500)):
            changed = bytearray(log)
            if trial % 2:
                del changed[draw.randrange(len(log)) :]
            else:
                changed[draw.randrange(len(log))] ^= draw.randrange(1, 256)
            other = tmp_path / "other.db"
            other.write_bytes(file)
            other.with_name("other.db-wal").write_bytes(changed)
            with sqlite3.connect(other) as recovered:
                recovered.execute("PRAGMA query_only = ON")
                count = recovered.execute("SELECT count(*) FROM sqlite_master").fetchone()
                expected = recovered.serialize() if count[0] else b""
            recovered.close()
            found = read_log(
                lambda at, n, held=changed: bytes(held[at : at + n]),  # type: ignore[misc] # bound
                len(changed),
                1 << 30,
            )
            joined = bytearray(file.ljust(found.n_pages * size, b"\0"))
            for number, page in found.pages.items():
                joined[(number - 1) * size : number * size] = page
            if expected:
                assert bytes(joined) == expected
        db.close()


def test_refuses_a_file_that_holds_no_pages(measured: Path) -> None:
    measured.with_name("a.ocmm-wal").unlink()
    with measured.open("r+b") as stream:
        stream.truncate(900 << 20)
    with pytest.raises(StorageError, match="holes"):
        read_job(measured)
