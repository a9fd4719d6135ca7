"""A recording comes back bit for bit, survives a crash, and refuses to be mistaken."""

from __future__ import annotations

import dataclasses
import json
import random
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.acquisition.frames import (
    AcquisitionWorker,
    CycleVerdict,
    FrameBlock,
    FrameRing,
    FrameSource,
    SourceDescription,
    StopReason,
    read_status,
)
from ocmm_core.acquisition.recording import FrameRecorder, ReplaySource
from ocmm_core.acquisition.recording._recorder import FRAMES_PER_READ, RESERVE_BYTES
from ocmm_core.acquisition.recording._recording import Recording
from ocmm_core.camera import Rig
from ocmm_core.errors import AcquisitionError, InputError
from tests.host import BUSY, HANG_S, private_mounts

MakeBlock = Callable[[int, int], FrameBlock]

_REPOSITORY = Path(__file__).resolve().parents[3]
_CHUNK_HEAD = 20


def frames_of(blocks: list[FrameBlock]) -> bytes:
    """Return all numbers of the frames, array by array, independent of the blocks."""
    columns = [np.concatenate([getattr(b, name) for b in blocks]) for name in FrameBlock.__slots__]
    return b"".join(column.tobytes() for column in columns)


def replayed(source: ReplaySource) -> list[FrameBlock]:
    """Return the blocks of a source up to its end."""
    source.open()
    blocks = []
    for _ in range(100_000):
        cycle = source.read()
        if cycle.frames is not None:
            blocks.append(cycle.frames)
        if cycle.finished:
            source.close()
            return blocks
    pytest.fail("the replay did not finish")


@pytest.fixture
def blocks(make_block: MakeBlock) -> list[FrameBlock]:
    """Return blocks of very different lengths, 2046 frames."""
    starts = [0, 8, 16, 17, 417, 2017]
    ends = [*starts[1:], 2046]
    return [make_block(a, b - a) for a, b in zip(starts, ends, strict=True)]


@pytest.fixture
def path(
    tmp_path: Path, description: SourceDescription, rig: Rig, blocks: list[FrameBlock]
) -> Path:
    """Return a recording of the blocks."""
    path = tmp_path / "a.ocmr"
    with FrameRecorder(path, description, rig) as recorder:
        for block in blocks:
            recorder.append(block)
        assert recorder.frames == 2046
    return path


def test_a_replay_is_the_recording_bit_for_bit(path: Path, blocks: list[FrameBlock]) -> None:
    source = ReplaySource(path)
    assert isinstance(source, FrameSource)
    assert source.recording.warning == ""
    found = replayed(source)
    assert frames_of(found) == frames_of(blocks)
    assert max(len(block) for block in found) == FRAMES_PER_READ
    source.close()


def test_a_replay_says_what_was_recorded(path: Path) -> None:
    source = ReplaySource(path)
    assert source.description == SourceDescription(
        "replay (a.ocmr)", (1001, 1002), 125_000, 1_000_000, live=False, simulated=False
    )
    head = source.recording.head
    assert (head.source, head.rig_name, head.rig_identity) == ("bench", "bench", "ab" * 32)
    assert head.started_utc.endswith("+00:00")
    source.close()


def test_the_first_line_is_readable_without_this_program(path: Path) -> None:
    with path.open("rb") as stream:
        head = json.loads(stream.readline())["head"]
    assert head["schema"] == "ocmm.recording/1"
    assert head["camera_serials"] == [1001, 1002]


def test_any_frame_can_be_sought(path: Path, blocks: list[FrameBlock]) -> None:
    source = ReplaySource(path)
    source.open()
    for index in (0, 7, 8, 16, 17, 2016, 2017, 2045):
        source.seek(index)
        cycle = source.read()
        assert cycle.frames is not None
        assert cycle.frames.counter[0] == index
        assert cycle.frames_lost == 0
    source.seek(2046)
    assert source.read().finished
    for index in (-1, 2047):
        with pytest.raises(IndexError):
            source.seek(index)
    with pytest.raises(IndexError):
        source.recording.read(2046, 1)
    source.close()


def test_frames_that_were_lost_are_counted_again(
    tmp_path: Path, description: SourceDescription, rig: Rig, make_block: MakeBlock
) -> None:
    whole = make_block(20, 10)
    keep = np.array([0, 1, 2, 5, 6, 9])
    gaps = FrameBlock(*(getattr(whole, name)[keep] for name in FrameBlock.__slots__))
    with FrameRecorder(tmp_path / "a.ocmr", description, rig) as recorder:
        recorder.append(make_block(5, 10))
        recorder.append(gaps)
        recorder.append(make_block(30, 1))
    source = ReplaySource(tmp_path / "a.ocmr")
    source.open()
    assert [source.read().frames_lost for _ in range(3)] == [0, 5 + 4, 0]
    source.close()


def test_the_worker_replays_a_recording(path: Path, blocks: list[FrameBlock]) -> None:
    ring = FrameRing.create(2, 300)
    try:
        worker = AcquisitionWorker(ReplaySource(path), ring)
        worker.start()
        found: list[FrameBlock] = []
        until = time.monotonic() + HANG_S
        while sum(map(len, found)) < 2046 and time.monotonic() < until:
            block = ring.read(100)
            if block is not None:
                found.append(block)
        assert worker.join(HANG_S)
        assert frames_of(found) == frames_of(blocks)
        status = read_status(ring)
        assert (status.stop_reason, status.overrun) == (StopReason.FINISHED, 0)
        assert status.elapsed == status.good
    finally:
        ring.close()


@pytest.mark.timing
def test_recorded_time_is_kept_when_asked(path: Path) -> None:
    began = time.monotonic()
    source = ReplaySource(path, speed=4.0)
    source.open()
    longest = 0.0
    finished = False
    while not finished:
        start = time.monotonic()
        cycle = source.read()
        longest = max(longest, time.monotonic() - start)
        assert cycle.verdict is CycleVerdict.GOOD
        finished = cycle.finished
    # 2038 periods of 125 us from the end of the first block on; a quarter of that at speed 4.
    # It cannot come early; a busy machine may delay it.
    assert 2038 * 125e-6 / 4.0 <= time.monotonic() - began < BUSY * 0.5
    assert longest < BUSY * 0.1
    source.close()


@pytest.mark.timing
def test_a_long_pause_is_waited_for_in_short_reads(
    tmp_path: Path, description: SourceDescription, rig: Rig, make_block: MakeBlock
) -> None:
    with FrameRecorder(tmp_path / "a.ocmr", description, rig) as recorder:
        recorder.append(make_block(0, 1))
        recorder.append(make_block(80_000, 1))
    source = ReplaySource(tmp_path / "a.ocmr", speed=1.0)
    source.open()
    assert source.read().frames is not None
    start = time.monotonic()
    cycle = source.read()
    assert cycle.frames is None
    assert not cycle.finished
    assert time.monotonic() - start < BUSY * 0.2
    source.close()


@pytest.mark.parametrize("speed", [-1.0, float("nan"), float("inf")])
def test_an_impossible_speed_is_refused(path: Path, speed: float) -> None:
    with pytest.raises(ValueError, match="speed"):
        ReplaySource(path, speed)


def test_an_empty_recording_ends_at_once(
    tmp_path: Path, description: SourceDescription, rig: Rig, make_block: MakeBlock
) -> None:
    with FrameRecorder(tmp_path / "a.ocmr", description, rig) as recorder:
        recorder.append(make_block(0, 0))
    assert replayed(ReplaySource(tmp_path / "a.ocmr")) == []


@pytest.mark.parametrize("cut", [1, 19, 20, 21, 300, 8139])
def test_a_torn_end_is_left_out_with_a_warning(
    path: Path, blocks: list[FrameBlock], cut: int
) -> None:
    # The last chunk: 20 bytes of head and 29 frames of 280 bytes.
    content = path.read_bytes()
    path.write_bytes(content[:-cut])
    source = ReplaySource(path)
    assert f"last {20 + 29 * 280 - cut} bytes" in source.recording.warning
    assert "after 2017 frames" in source.recording.warning
    assert frames_of(replayed(source)) == frames_of(blocks[:-1])


def test_an_end_that_was_never_filled_is_left_out(path: Path, blocks: list[FrameBlock]) -> None:
    content = bytearray(path.read_bytes())
    content[-29 * 280 :] = bytes(29 * 280)
    path.write_bytes(content + bytes(5000))
    source = ReplaySource(path)
    assert "after 2017 frames" in source.recording.warning
    assert frames_of(replayed(source)) == frames_of(blocks[:-1])


def test_an_end_that_is_exactly_one_block_short_cannot_be_seen(
    path: Path, blocks: list[FrameBlock]
) -> None:
    path.write_bytes(path.read_bytes()[: -(20 + 29 * 280)])
    source = ReplaySource(path)
    assert source.recording.warning == ""
    assert frames_of(replayed(source)) == frames_of(blocks[:-1])


def test_damage_to_a_chunk_head_before_the_end_is_refused(path: Path) -> None:
    content = bytearray(path.read_bytes())
    first = content.index(b"\n") + 1
    for at in (0, 4, 8, 12, 16):
        broken = bytearray(content)
        broken[first + _CHUNK_HEAD + 8 * 280 + at] ^= 1
        path.write_bytes(broken)
        with pytest.raises(AcquisitionError) as caught:
            ReplaySource(path)
        assert caught.value.code == "recording.damaged"
        assert "block 1 at byte" in caught.value.what


def test_a_chunk_that_is_missing_is_refused(path: Path) -> None:
    content = path.read_bytes()
    first = content.index(b"\n") + 1
    path.write_bytes(content[:first] + content[first + _CHUNK_HEAD + 8 * 280 :])
    with pytest.raises(AcquisitionError, match="block 0"):
        ReplaySource(path)


def test_damaged_frames_are_never_given_out(path: Path, blocks: list[FrameBlock]) -> None:
    content = bytearray(path.read_bytes())
    content[content.index(blocks[4].uv[700].tobytes()) + 3] ^= 0x40
    path.write_bytes(content)
    source = ReplaySource(path)
    source.open()
    good = [source.read().frames for _ in range(5)]
    assert [int(block.counter[-1]) for block in good if block is not None] == [7, 15, 16, 272, 416]
    with pytest.raises(AcquisitionError, match="the frames from 417 on"):
        source.read()
    source.close()


@pytest.mark.parametrize("content", [b"", b"x,y,z\n", b"{}\n", b"[1,2]\n", b"\x00" * 100_000])
def test_a_foreign_file_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.ocmr"
    path.write_bytes(content)
    with pytest.raises(AcquisitionError) as caught:
        ReplaySource(path)
    assert caught.value.code == "recording.foreign"
    assert str(path) in caught.value.what


def test_a_head_that_is_cut_off_or_changed_is_refused(path: Path) -> None:
    content = path.read_bytes()
    end = content.index(b"\n")
    for broken in (
        content[: end // 2],
        content[:end],
        content.replace(b"[1001,1002]", b"[1001,1003]", 1),
        content.replace(b"recording/1", b"recording/2", 1),
    ):
        path.write_bytes(broken)
        with pytest.raises(AcquisitionError) as caught:
            ReplaySource(path)
        assert caught.value.code == "recording.foreign"


def test_a_missing_recording_is_one_sentence(tmp_path: Path) -> None:
    for path in (tmp_path / "none.ocmr", tmp_path):
        with pytest.raises(AcquisitionError) as caught:
            ReplaySource(path)
        assert caught.value.code == "recording.unreadable"


def test_a_recording_is_never_overwritten(
    path: Path, description: SourceDescription, rig: Rig
) -> None:
    before = path.read_bytes()
    with pytest.raises(AcquisitionError, match="already"):
        FrameRecorder(path, description, rig)
    assert path.read_bytes() == before


@pytest.mark.parametrize("folder", ["file.txt", "nowhere", "/proc"])
def test_an_impossible_folder_is_refused(
    tmp_path: Path, description: SourceDescription, rig: Rig, folder: str
) -> None:
    (tmp_path / "file.txt").write_text("a file, no folder")
    with pytest.raises(AcquisitionError) as caught:
        FrameRecorder(tmp_path / folder / "a.ocmr", description, rig)
    assert caught.value.code == "recording.not_writable"


def test_a_closed_recording_and_a_wrong_block_are_refused(
    tmp_path: Path, description: SourceDescription, rig: Rig, make_block: MakeBlock
) -> None:
    recorder = FrameRecorder(tmp_path / "a.ocmr", description, rig)
    for shape in ((3, 8), (2, 16)):
        other = dataclasses.replace(make_block(0, 2), uv=np.zeros((2, *shape, 2)))
        with pytest.raises(ValueError, match=rf"cameras and slots \({shape[0]}, {shape[1]}\)"):
            recorder.append(other)
    recorder.close()
    recorder.close()
    with pytest.raises(AcquisitionError, match="is closed"):
        recorder.append(make_block(0, 2))


def test_the_cameras_must_be_those_of_the_rig(path: Path, rig: Rig) -> None:
    source = ReplaySource(path)
    source.recording.check_rig(rig)
    source.recording.check_rig(dataclasses.replace(rig, identity="cd" * 32))
    left, right = rig.cameras
    with pytest.raises(InputError, match="camera 1 of the recording has serial number 1001"):
        source.recording.check_rig(dataclasses.replace(rig, cameras=(right, left)))
    other = dataclasses.replace(right, serial=77)
    with pytest.raises(InputError, match=r"1002, but camera 'right' of rig 'bench' has 77"):
        source.recording.check_rig(dataclasses.replace(rig, cameras=(left, other)))
    with pytest.raises(InputError, match="2 cameras, but rig 'bench' has 3"):
        source.recording.check_rig(dataclasses.replace(rig, cameras=(left, right, other)))
    source.close()


def test_a_disk_that_takes_no_more_leaves_whole_blocks(
    tmp_path: Path, description: SourceDescription, rig: Rig, make_block: MakeBlock
) -> None:
    path = tmp_path / "a.ocmr"
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    recorder = FrameRecorder(path, description, rig)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, limit[1]))
    count = 0

    def fill() -> None:
        nonlocal count
        for count in range(1000):
            recorder.append(make_block(8 * count, 8))

    try:
        with pytest.raises(AcquisitionError) as caught:
            fill()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
    assert caught.value.code == "recording.not_writable"
    with pytest.raises(AcquisitionError, match="is closed"):
        recorder.append(make_block(0, 8))
    with Recording(path) as recording:
        assert recording.warning == ""
        assert len(recording) == recorder.frames == 8 * count > 0


def test_a_disk_that_is_nearly_full_ends_the_recording_and_leaves_room_for_points(
    tmp_path: Path, description: SourceDescription, rig: Rig, make_block: MakeBlock
) -> None:
    """A small separate disk: the recording can be read, and the reserve is still free."""
    done = subprocess.run(
        [
            *private_mounts(), "sh", "-c",
            f'mount -t tmpfs -o size=17m tmpfs {tmp_path} && exec "$@"', "sh",
            sys.executable, "-c", _RECORD + _UNTIL_FULL, str(tmp_path / "a.ocmr"),
            str(Path(__file__).with_name("conftest.py")),
        ],
        capture_output=True, text=True, timeout=HANG_S, cwd=_REPOSITORY, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    code, recorded, read, free = done.stdout.split()
    assert code == "recording.disk_full"
    assert int(recorded) == int(read) > 1000
    assert RESERVE_BYTES <= int(free) < RESERVE_BYTES + 65536


_RECORD = """
import os, runpy, sys
from ocmm_core.acquisition.recording._recorder import FrameRecorder
from ocmm_core.acquisition.recording._recording import Recording
from ocmm_core.errors import AcquisitionError
from ocmm_core.acquisition.frames._frames import SourceDescription
samples = runpy.run_path(sys.argv[2])
periods = (125_000, 1_000_000)
description = SourceDescription("bench", (1001, 1002), *periods, live=True, simulated=False)
recorder = FrameRecorder(sys.argv[1], description, samples["sample_rig"]())
frame = 0
"""
_FOR_EVER = """
while True:
    recorder.append(samples["sample_block"](frame, 40))
    frame += 40
    print(frame, flush=True)
"""
_UNTIL_FULL = """
try:
    while True:
        recorder.append(samples["sample_block"](frame, 40))
        frame += 40
except AcquisitionError as error:
    print(error.code, frame)
with Recording(sys.argv[1]) as recording:
    print(len(recording))
disk = os.statvfs(sys.argv[1])
print(disk.f_bavail * disk.f_frsize)
"""


def test_a_killed_program_loses_no_frame_that_was_appended(
    tmp_path: Path, make_block: MakeBlock
) -> None:
    rng = random.Random(7)  # noqa: S311 - moments of a kill, no secret
    for trial in range(6):
        path = tmp_path / f"{trial}.ocmr"
        with subprocess.Popen(
            [sys.executable, "-c", _RECORD + _FOR_EVER, str(path),
             str(Path(__file__).with_name("conftest.py"))],
            stdout=subprocess.PIPE, cwd=_REPOSITORY,
        ) as program:  # fmt: skip
            assert program.stdout is not None
            heard = [int(program.stdout.readline()) for _ in range(rng.randint(1, 200))]
            program.kill()
            heard += [int(line) for line in program.stdout.read().split(b"\n")[:-1]]
        assert program.returncode == -signal.SIGKILL
        with Recording(path) as recording:
            assert heard[-1] <= len(recording) <= heard[-1] + 40
            found = [recording.read(start, 40) for start in range(0, len(recording), 40)]
        assert frames_of(found) == frames_of([make_block(0, len(recording))])
