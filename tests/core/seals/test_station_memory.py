"""The memory of the station: complete or reported, trusted only if write-protected from others."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec
import pytest

from benchmarks.station_memory import MEMORIES, old_memory
from ocmm_core.calibration.records import CalibrationStore, State
from ocmm_core.errors import StorageError
from ocmm_core.export.audits import audit
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.seals import KeyFolder, KnownEnd, memory_folder, recall, remember, start_memory
from ocmm_core.storage import JobFile, JobHead
from tests.core.calibration.made_records import MADE, make_record, make_verification
from tests.core.storage.conftest import head as head
from tests.core.storage.conftest import make_point as make_point
from tests.host import needs_root, on_linux_only
from tests.other_station import histories, other_station

NOW = MADE + timedelta(days=2)
MakePoint = Callable[[int], MeasuredPoint]


@pytest.fixture(autouse=True)
def _own_station(tmp_path: Path) -> object:
    """Simulate a station never told of its missing memory."""
    with other_station(tmp_path / "home"):
        yield


@pytest.fixture
def store(tmp_path: Path) -> CalibrationStore:
    store = CalibrationStore(tmp_path / "calibrations" / "recommended")
    store.accept(make_record(), "technician", "new", MADE)
    store.verify(make_verification(make_record()), MADE)
    return store


def doubts(path: Path) -> str:
    with JobFile.open(path, read_only=True) as job:
        return " ".join(job.verify())


@on_linux_only
@pytest.mark.parametrize("damage", MEMORIES[1:], ids=lambda one: one.__name__.strip("_"))
def test_a_damaged_memory_is_reported_with_its_path(
    damage: Callable[[Path], None], store: CalibrationStore, head: JobHead, tmp_path: Path
) -> None:
    path = tmp_path / "job.ocmm"
    JobFile.create(path, head).close()
    assert doubts(path) == ""
    damage(memory_folder())
    said = CalibrationStore(store.folder).status(NOW)
    assert said.state is State.SUSPECT
    assert str(memory_folder()) in said.reason
    assert "memory" in said.reason
    assert str(memory_folder()) in doubts(path)


@on_linux_only
@pytest.mark.parametrize(("mode", "folder"), [(0o666, 0o700), (0o600, 0o777), (0o622, 0o700)])
def test_a_ring_of_keys_that_others_can_write_is_not_trusted(
    store: CalibrationStore, mode: int, folder: int
) -> None:
    keys = KeyFolder()
    keys.trust(bytes(range(32)), "Cell 3", "Ada", "compared", NOW)
    assert len(keys.known()) == 1
    ring = keys.folder / "known_keys.json"
    ring.chmod(mode)
    keys.folder.chmod(folder)
    if mode == 0o622:
        os.chown(ring, -1, os.getegid() + 1)
    with pytest.raises(StorageError, match="other users can write") as caught:
        keys.known()
    path = ring if folder == 0o700 else keys.folder
    assert str(path) in caught.value.what
    assert caught.value.remedy.endswith(f"{path}.")
    assert "chmod" in caught.value.remedy
    with pytest.raises(StorageError, match="other users can write"):
        CalibrationStore(store.folder)


@on_linux_only
def test_a_memory_of_another_user_is_not_trusted(store: CalibrationStore) -> None:
    needs_root("give files away")
    for one in memory_folder().iterdir():
        os.chown(one, 4711, 4711)
    said = CalibrationStore(store.folder).status(NOW)
    assert said.state is State.SUSPECT
    assert "belongs to another user" in said.reason


def test_a_memory_of_version_0_1_is_taken_over(store: CalibrationStore, tmp_path: Path) -> None:
    """A golden memory, as 0.1 wrote it: by path, and by the first line of the history."""
    former = tmp_path / "former"
    store.folder.rename(former)
    again = CalibrationStore(store.folder)
    again.accept(make_record(points=401), "technician", "again", MADE + timedelta(hours=1))
    again.verify(make_verification(make_record(points=401)), MADE + timedelta(hours=1))
    newest = _golden(former, store.folder)
    assert CalibrationStore(store.folder).status(NOW).state is State.VALID
    assert not any(one.name in newest for one in histories().iterdir())
    said = CalibrationStore(former).status(NOW)
    assert said.state is State.SUSPECT
    assert "another one took its place" in said.reason
    # The latest time of any history is that of the station.
    assert CalibrationStore(store.folder).seen_utc.startswith("2026")


def _golden(former: Path, there: Path) -> set[str]:
    """Write the memory of 0.1 of two histories that were in one folder, one after the other."""
    kept = memory_folder().with_name("golden")
    old_memory(there, memory_folder())
    shutil.copytree(memory_folder(), kept)
    old_memory(former, memory_folder())
    for one in memory_folder().iterdir():
        text = one.read_text("utf-8")
        if '"name":"folder ' not in text:
            # It was in the folder of the other station, last read in 2026.
            text = text.replace(str(former), str(there))
            text = text.replace('"utc":""', '"utc":"2026-01-15T08:00:00+00:00"')
            (kept / one.name).write_text(text, "utf-8")
    shutil.rmtree(memory_folder())
    kept.rename(memory_folder())
    return {
        one.name for one in memory_folder().iterdir()
        if '"name":"folder ' in one.read_text("utf-8")
    }  # fmt: skip


def test_a_memory_says_what_it_was_told_last() -> None:
    seen = KnownEnd(name="job x", count=3, link="a" * 64, place="/jobs/x.ocmm")
    assert recall("job x") is None
    remember(seen)
    assert recall("job x") == seen
    remember(KnownEnd(name="job x", count=4, link="b" * 64))
    assert recall("job x") == KnownEnd(name="job x", count=4, link="b" * 64)


def test_a_key_without_its_memory_is_accepted_by_name_for_the_past_only(
    store: CalibrationStore, head: JobHead, make_point: MakePoint, tmp_path: Path
) -> None:
    path = tmp_path / "job.ocmm"
    JobFile.create(path, head).close()
    shutil.rmtree(memory_folder())
    assert "memory of it is missing" in doubts(path)
    assert "ocmm key restored" in doubts(path)
    start_memory(KeyFolder(), "Ada", "new computer", datetime.now(UTC))
    assert doubts(path) == ""
    assert "starts at" in audit(path).proofs[0]
    assert "by Ada: new computer." in audit(path).proofs[0]
    assert CalibrationStore(store.folder).status(NOW).state is State.VALID
    with JobFile.open(path) as job:
        job.append_point(make_point(1))
    # Later signatures must be in the memory.
    for one in memory_folder().glob("*.json"):
        one.unlink()
    assert "memory of it is missing" in doubts(path)
    # Nobody else starts the memory.
    with other_station(tmp_path / "stranger"):
        start_memory(KeyFolder(), "Mallory", "please", datetime(9999, 1, 1, tzinfo=UTC))
        forged = (memory_folder() / "start.signed").read_bytes()
    (memory_folder() / "start.signed").write_bytes(forged)
    assert "memory of it is missing" in doubts(path)


def test_the_clock_is_one_for_the_station(store: CalibrationStore, tmp_path: Path) -> None:
    cameras = tuple(
        msgspec.structs.replace(one, serial=one.serial + 9) for one in make_record().cameras
    )
    other = make_record(cameras=cameras)
    second = CalibrationStore(tmp_path / "second" / "recommended")
    second.accept(other, "technician", "new", MADE)
    second.verify(make_verification(other), MADE)
    for one in (store, second):
        assert one.status(NOW).state is State.VALID
    assert CalibrationStore(store.folder).status(MADE + timedelta(days=600)).state is State.EXPIRED
    moved = tmp_path / "elsewhere" / "recommended"
    moved.parent.mkdir()
    store.folder.rename(moved)
    store.folder.symlink_to(moved, target_is_directory=True)
    # Cameras that were not checked on that day expire as well.
    for folder in (moved, store.folder, second.folder):
        said = CalibrationStore(folder).status(NOW)
        assert said.state is State.EXPIRED
        assert "set back" in said.reason
    # A measurement proves the time.
    again = CalibrationStore(second.folder)
    again.verify(make_verification(other), NOW)
    assert again.status(NOW).state is State.VALID
    assert CalibrationStore(moved).status(NOW).state is State.EXPIRED


@on_linux_only
def test_a_key_that_is_a_pipe_is_not_waited_for() -> None:
    keys = KeyFolder()
    keys.folder.mkdir(parents=True)
    os.mkfifo(keys.folder / "station.key", 0o600)
    with pytest.raises(StorageError, match="the key of this station cann"):
        keys.station_key()
