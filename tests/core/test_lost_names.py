"""Histories, recordings and outboxes whose file is lost while written; rings without room."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import msgspec
import numpy as np
import pytest

from ocmm_core.acquisition.frames import FrameBlock, FrameRing, SourceDescription
from ocmm_core.acquisition.recording import FrameRecorder, ReplaySource
from ocmm_core.camera import load_rig
from ocmm_core.chain_file import ChainFile
from ocmm_core.documents import resource
from ocmm_core.errors import AcquisitionError, StorageError
from ocmm_core.host import HOST
from ocmm_core.named_file import rescue_folders
from ocmm_shop.archive.outbox import Outbox


class Entry(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A line of a chain."""

    number: int


def _saved(pattern: str) -> Path:
    return max(rescue_folders()[-1].glob(pattern), key=lambda path: path.stat().st_mtime_ns)


@pytest.mark.parametrize("loss", ["removed", "replaced", "folder moved"])
def test_a_history_that_is_lost_keeps_its_entries(tmp_path: Path, loss: str) -> None:
    path = tmp_path / "store" / "events.jsonl"
    chain = ChainFile(path, Entry)
    for number in (1, 2):
        chain.append(Entry(number))
    if loss == "folder moved":
        path.parent.rename(tmp_path / "away")
    else:
        path.unlink()
    if loss == "replaced":
        path.write_bytes(b"")
    with pytest.raises(StorageError, match="entries before are saved in"):
        chain.append(Entry(3))
    with pytest.raises(StorageError, match="events-rescued"):
        chain.require_name()
    assert path.exists() == (loss == "replaced")
    assert ChainFile(_saved("events-*.jsonl"), Entry).items == (Entry(1), Entry(2))


@pytest.mark.parametrize("noticed", ["by the next frames", "at the end"])
def test_a_recording_that_is_lost_keeps_its_frames(tmp_path: Path, noticed: str) -> None:
    rig = load_rig(resource("rigs", "recommended.toml"))
    serials = tuple(camera.serial for camera in rig.cameras)
    source = SourceDescription("test", serials, 125_000, 1_000_000, False, True)
    recorder = FrameRecorder(tmp_path / "a.ocmr", source, rig)
    counter = np.arange(40, dtype=np.int64)
    block = FrameBlock(
        counter=counter,
        time_ns=counter * 125_000,
        flags=np.zeros(40, dtype=np.uint32),
        valid=np.full((40, len(serials)), 0xFF, dtype=np.uint64),
        uv=np.full((40, len(serials), 8, 2), 1.0),
    )
    recorder.append(block)
    recorder.path.unlink()
    if noticed == "by the next frames":
        with pytest.raises(AcquisitionError, match="it was removed"):
            recorder.append(block)
    with pytest.raises(AcquisitionError, match="a-rescued"):
        recorder.close()
    replay = ReplaySource(_saved("a-*.ocmr"))
    assert len(replay.recording) == 40
    replay.close()


def test_an_outbox_that_is_lost_takes_no_job(tmp_path: Path) -> None:
    with Outbox(tmp_path / "box") as box:
        (tmp_path / "box").rename(tmp_path / "away")
        (tmp_path / "box" / "files").mkdir(parents=True)
        with pytest.raises(StorageError, match="put them in again"):
            box.put_content(b"job", tmp_path / "a.ocmm")


def test_a_ring_without_room_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(descriptor: int, size: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    # The answer of a small /dev/shm; a file with only its length would end by SIGBUS.
    monkeypatch.setattr(HOST, "shared_memory", lambda: tmp_path)
    monkeypatch.setattr(HOST, "reserve", full)
    with pytest.raises(AcquisitionError, match="no room for the frame ring"):
        FrameRing.create(2)
    assert list(tmp_path.iterdir()) == []


def test_a_ring_has_room_for_all_of_its_size() -> None:
    ring = FrameRing.create(2, 1000)
    try:
        state = ring.path.stat()
        assert state.st_blocks * 512 >= state.st_size
    finally:
        ring.close()
