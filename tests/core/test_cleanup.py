"""Files of killed programs are removed; files in use are not."""

from __future__ import annotations

import contextlib
import errno
import logging
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from ocmm_core.acquisition.frames import FrameRing
from ocmm_core.cleanup import clear_leftovers, hold, keep_folder, scratch_folder, scratch_path
from ocmm_core.documents import write_atomic, write_new
from ocmm_core.export import write_together
from ocmm_core.host import HOST
from tests.host import HANG_S

_REPOSITORY = Path(__file__).resolve().parents[2]
_PROGRAM = """
import os, sys, time
from pathlib import Path
from ocmm_core import documents
from ocmm_core.acquisition.frames import FrameRing
from ocmm_core.host import HOST
from ocmm_core.cleanup import keep_folder, scratch_folder, scratch_path

type(HOST).shared_memory = lambda self: Path(sys.argv[1])
ring = FrameRing.create(2, 100)
held = scratch_path("side")
keep_folder(held)
with scratch_folder("job") as folder:
    (folder / "content").write_bytes(b"x")
    documents.os.fsync = lambda descriptor: (
        print(ring.path, folder, held, flush=True), time.sleep(1000)
    )
    documents.write_atomic(Path(sys.argv[1]) / "a.json", b"half")
"""


@pytest.fixture(autouse=True)
def _own_places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # Programs of other tests also remove leftovers of killed programs, at any moment.
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(type(HOST), "shared_memory", lambda _self: tmp_path)


@contextlib.contextmanager
def program(folder: Path) -> Iterator[tuple[subprocess.Popen[str], list[Path]]]:
    """Run a program that is writing a file; yield it and its files."""
    with subprocess.Popen(
        [sys.executable, "-c", _PROGRAM, str(folder)],
        stdout=subprocess.PIPE,
        text=True,
        cwd=_REPOSITORY,
        env={**os.environ, "TMPDIR": str(folder)},
    ) as child:
        try:
            assert child.stdout is not None
            made = [Path(name) for name in child.stdout.readline().split()]
            (writing,) = folder.glob(".a.json.*-*.tmp")
            yield child, [*made, writing]
        finally:
            child.kill()
            child.wait(HANG_S)


def test_what_a_killed_program_leaves_is_removed_and_counted(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    foreign = tmp_path / ".a.json.1234.tmp"
    foreign.write_bytes(b"of another program")
    with program(tmp_path) as (child, made):
        assert all(path.exists() for path in made)
        # Files of a living program survive any number of starts.
        FrameRing.create(2, 100).close()
        assert clear_leftovers([tmp_path]) == 0
        assert all(path.exists() for path in made)
        child.kill()
        assert child.wait(HANG_S) == -signal.SIGKILL
        assert all(path.exists() for path in made)
        with caplog.at_level(logging.INFO):
            FrameRing.create(2, 100).close()
            # The file that was being written and two folders.
            assert clear_leftovers([tmp_path, tmp_path / "missing"]) == 3
    assert not any(path.exists() for path in made)
    assert [path.name for path in tmp_path.iterdir()] == [foreign.name]
    assert "Frame rings of killed programs removed: 1." in caplog.text
    assert "Temporary files and folders of killed programs removed: 3." in caplog.text


def test_a_report_that_was_being_written_is_cleared_by_the_next(tmp_path: Path) -> None:
    name, other = tmp_path / "JOB-001.csv", tmp_path / "JOB-001.csv.seal.json"

    def stop(_contents: object) -> None:
        # As in the middle of the work: whole files under locked names.
        assert len(list(tmp_path.glob(".JOB*.tmp"))) == 2
        assert clear_leftovers([tmp_path]) == 0
        os.kill(os.getpid(), signal.SIGKILL)

    child = os.fork()
    if child == 0:
        with contextlib.suppress(BaseException):
            write_together({name: b"half", other: b"half"}, stop)
        os._exit(1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGKILL
    assert len(list(tmp_path.iterdir())) == 2
    # The next start, or the next report of that name.
    write_together({name: b"whole"})
    assert sorted(path.name[-4:] for path in tmp_path.iterdir()) == [".csv", ".tmp"]
    assert clear_leftovers([tmp_path]) == 1
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"whole"]


def test_a_process_number_that_is_used_again_hides_nothing(tmp_path: Path) -> None:
    # The name does not show its maker: only the lock counts.
    left = tmp_path / ".a.json.ocmm-00ff00.tmp"
    left.write_bytes(b"half")
    descriptor = os.open(left, os.O_RDONLY)
    assert hold(descriptor, left)
    assert clear_leftovers([tmp_path]) == 0
    os.close(descriptor)
    assert clear_leftovers([tmp_path]) == 1
    assert not left.exists()


def test_what_was_removed_before_it_was_locked_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "new"
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT)
    path.unlink()
    assert not hold(descriptor, path)
    path.write_bytes(b"of somebody else")
    assert not hold(descriptor, path)
    os.close(descriptor)


def test_links_are_not_followed(tmp_path: Path) -> None:
    target = tmp_path / "target"
    target.write_bytes(b"kept")
    (tmp_path / ".a.ocmm-00ff00.tmp").symlink_to(target)
    assert clear_leftovers([tmp_path]) == 0
    assert target.read_bytes() == b"kept"


def test_a_folder_that_is_kept_is_there_only_once() -> None:
    folder = scratch_path("side")
    assert keep_folder(folder)
    with pytest.raises(FileExistsError):
        keep_folder(folder)


@pytest.mark.parametrize("links", [True, False], ids=["links", "no links"])
def test_a_new_file_never_replaces_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, links: bool
) -> None:
    def refused(*_names: object) -> None:
        raise PermissionError(errno.EPERM, "Operation not permitted")

    if not links:
        monkeypatch.setattr(os, "link", refused)
    path = tmp_path / "a"
    write_new(path, b"first")
    with pytest.raises(FileExistsError):
        write_new(path, b"second")
    assert path.read_bytes() == b"first"
    assert [item.name for item in tmp_path.iterdir()] == ["a"]


def test_a_sync_that_fails_is_not_tried_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[int] = []

    def fail(descriptor: int) -> None:
        synced.append(descriptor)
        raise OSError(errno.EIO, "Input/output error")

    path = tmp_path / "a"
    write_atomic(path, b"before")
    monkeypatch.setattr(os, "fsync", fail)
    for write in (write_atomic, write_new):
        synced.clear()
        with pytest.raises(OSError, match="Input/output error"):
            write(path, b"after")
        assert len(synced) == 1
        assert path.read_bytes() == b"before"
        assert [item.name for item in tmp_path.iterdir()] == ["a"]


@pytest.mark.parametrize("make", ["scratch", "keep"])
def test_a_folder_that_is_cleared_before_it_can_be_locked_is_made_again(
    make: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    open_to_lock = type(HOST).open_to_lock
    cleared: list[int] = []

    def once_cleared(self: object, folder: Path) -> int:
        if not cleared:
            cleared.append(clear_leftovers(()))
        return open_to_lock(HOST, folder)

    monkeypatch.setattr(type(HOST), "open_to_lock", once_cleared)
    if make == "keep":
        folder = scratch_path("side")
        assert keep_folder(folder)
        assert folder.is_dir()
    else:
        with scratch_folder("side") as folder:
            assert folder.is_dir()
    assert cleared == [1]
    assert clear_leftovers(()) == 0
