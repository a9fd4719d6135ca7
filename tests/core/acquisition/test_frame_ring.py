"""Frames pass records and the ring unchanged, and losses are counted."""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.acquisition.frames import (
    SUBPIXEL,
    Books,
    FrameBlock,
    FrameRing,
    RingHeaderField,
    frame_dtype,
    from_records,
    quantise,
    to_records,
)
from ocmm_core.errors import AcquisitionError
from tests.host import HANG_S

MakeBlock = Callable[[int, int], FrameBlock]


def same(first: FrameBlock | None, second: FrameBlock) -> bool:
    """Return whether two blocks are equal in type and every bit."""
    if first is None:
        return False
    pairs = [(getattr(first, name), getattr(second, name)) for name in FrameBlock.__slots__]
    return all(a.dtype == b.dtype and a.tobytes() == b.tobytes() for a, b in pairs)


@pytest.fixture
def ring() -> Iterator[FrameRing]:
    """Return a ring of 10 frames of two cameras."""
    ring = FrameRing.create(2, 10)
    yield ring
    ring.close()


def test_records_hold_frames_bit_for_bit(make_block: MakeBlock) -> None:
    block = make_block(-3, 7)
    records = to_records(block)
    assert records.dtype == frame_dtype(2)
    # 8 counter + 8 time + 4 flags + 2 x 2 valid + 2 x 8 x 2 x 8 spots: packed, no padding.
    assert records.dtype.itemsize == 280
    back = from_records(records)
    assert same(back, block)
    records["uv"] = 0.0
    assert same(back, block)
    assert len(block) == 7


def test_quantised_spots_are_multiples_of_the_wire_resolution() -> None:
    uv = np.random.default_rng(1).uniform(0.0, 2048.0, (100, 2, 8, 2))
    uv[0, 0, 0] = np.nan
    rounded = quantise(uv)
    steps = rounded / SUBPIXEL
    assert np.array_equal(steps, np.round(steps), equal_nan=True)
    assert np.nanmax(np.abs(rounded - uv)) <= SUBPIXEL / 2
    assert np.array_equal(np.isnan(rounded), np.isnan(uv))
    assert np.array_equal(quantise(rounded), rounded, equal_nan=True)


def test_frames_pass_the_ring_in_order_across_its_end(
    ring: FrameRing, make_block: MakeBlock
) -> None:
    for start in range(0, 700, 7):
        ring.write(make_block(start, 7))
        assert ring.free() == 3
        assert same(ring.read(4), make_block(start, 4))
        assert same(ring.read(100), make_block(start + 4, 3))
        assert ring.read(1) is None
    assert ring.word(RingHeaderField.OVERRUN) == 0


def test_a_whole_ring_at_once(ring: FrameRing, make_block: MakeBlock) -> None:
    ring.write(make_block(0, 3))
    ring.read(3)
    ring.write(make_block(3, 10))
    assert ring.free() == 0
    assert same(ring.read(50), make_block(3, 10))


def test_a_slow_reader_loses_the_oldest_frames_and_they_are_counted(
    ring: FrameRing, make_block: MakeBlock
) -> None:
    for start in range(0, 28, 7):
        ring.write(make_block(start, 7))
    assert same(ring.read(100), make_block(18, 10))
    assert ring.word(RingHeaderField.OVERRUN) == 18
    assert ring.read(1) is None


def test_frames_that_are_being_overwritten_are_not_given_out(
    ring: FrameRing, make_block: MakeBlock
) -> None:
    ring.write(make_block(0, 10))
    # A writer in the middle of its next 4 frames: announced, not yet published.
    ring.set_word(RingHeaderField.RESERVED, 14)
    assert same(ring.read(100), make_block(4, 6))
    assert ring.word(RingHeaderField.OVERRUN) == 4


def test_a_block_that_cannot_fit_is_refused(ring: FrameRing, make_block: MakeBlock) -> None:
    with pytest.raises(AcquisitionError, match="11 frames of 2 cameras"):
        ring.write(make_block(0, 11))
    other = FrameRing.create(3, 10)
    try:
        with pytest.raises(AcquisitionError, match="of 2 cameras with 8 slots does not fit"):
            other.write(make_block(0, 1))
    finally:
        other.close()
    assert ring.read(1) is None


def test_both_sides_see_the_same_words_and_text(ring: FrameRing, make_block: MakeBlock) -> None:
    other = FrameRing.attach(ring.path)
    try:
        assert (other.n_cameras, other.capacity) == (2, 10)
        ring.write(make_block(5, 2))
        assert same(other.read(9), make_block(5, 2))
        assert ring.free() == 10
        other.enter(frames=3, frames_lost=1)
        other.enter(frames=4, elapsed=2, good=1, late=1)
        assert ring.books == Books(elapsed=2, good=1, late=1, frames=7, frames_lost=1)
        assert ring.text() == ""
        other.set_text("Kamera 2 fällt aus.")
        assert ring.text() == "Kamera 2 fällt aus."
        # 1024 bytes hold 511 of these letters of two bytes after one of one byte.
        other.set_text("x" + "ä" * 2000)
        assert ring.text()[:512] == "x" + "ä" * 511
    finally:
        other.close()
    assert ring.path.exists()


def test_the_owner_removes_the_file_and_may_close_twice(make_block: MakeBlock) -> None:
    ring = FrameRing.create(2, 4)
    ring.write(make_block(0, 4))
    ring.close()
    ring.close()
    assert not ring.path.exists()


def test_a_ring_whose_owner_was_killed_is_removed_by_the_next_one() -> None:
    """Four: old and new rings, each of a killed and of a living process; age is irrelevant."""
    program = (
        "import sys; from ocmm_core.acquisition.frames import FrameRing; "
        "ring = FrameRing.create(2, 64); print(ring.path, flush=True); sys.stdin.read()"
    )
    owners = [
        subprocess.Popen(
            [sys.executable, "-c", program],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )
        for _ in range(4)
    ]  # fmt: skip
    rings = []
    for owner in owners:
        assert owner.stdout is not None
        rings.append(Path(owner.stdout.readline().strip()))
    killed, living, *_ = rings
    try:
        for owner in (owners[0], owners[2]):
            owner.kill()
            owner.wait(HANG_S)
        long_ago = time.time() - 3600.0
        for ring in (killed, living):
            os.utime(ring, (long_ago, long_ago))
        FrameRing.create(2, 64).close()
        assert [ring.exists() for ring in rings] == [False, True, False, True]
    finally:
        for owner in owners:
            owner.kill()
            owner.communicate()
        for ring in rings:
            ring.unlink(missing_ok=True)


@pytest.mark.parametrize("content", [b"", b"x" * 100, b"\0" * 8192])
def test_what_is_no_ring_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "ring"
    path.write_bytes(content)
    with pytest.raises(AcquisitionError, match="not a frame ring"):
        FrameRing.attach(path)
    with pytest.raises(AcquisitionError, match="cannot be opened"):
        FrameRing.attach(tmp_path / "none")


def test_a_ring_of_the_wrong_size_is_refused(tmp_path: Path, ring: FrameRing) -> None:
    path = tmp_path / "ring"
    path.write_bytes(ring.path.read_bytes()[:-8])
    with pytest.raises(AcquisitionError, match="not a frame ring"):
        FrameRing.attach(path)


_BLOCK = 1024
_CAPACITY = 2 * _BLOCK


def _write_frames(path: str, make_block: MakeBlock, n_blocks: int) -> None:
    ring = FrameRing.attach(path)
    # Made before: then the writer does nothing but write, and laps the reader all the time.
    blocks = [make_block(index * _BLOCK, _BLOCK) for index in range(n_blocks)]
    for block in blocks:
        ring.write(block)
    ring.close()


def test_a_reader_in_another_process_gets_only_whole_frames(make_block: MakeBlock) -> None:
    """The writer laps a reader that is too slow: frames may be lost, never mixed.

    The blocks are large against the ring, so that most reads meet a write in progress.
    """
    n_blocks = 400
    ring = FrameRing.create(2, _CAPACITY)
    context = multiprocessing.get_context("fork")
    writer = context.Process(target=_write_frames, args=(ring.path, make_block, n_blocks))
    try:
        writer.start()
        got, newest = 0, -1
        last = n_blocks * _BLOCK - 1
        until = time.monotonic() + HANG_S
        while newest < last and time.monotonic() < until:
            block = ring.read(2 * _CAPACITY)
            if block is None:
                continue
            assert block.counter[0] > newest
            assert same(block, make_block(int(block.counter[0]), len(block)))
            newest = int(block.counter[-1])
            got += len(block)
        writer.join(HANG_S)
        assert newest == last
        assert got + ring.word(RingHeaderField.OVERRUN) == last + 1
        assert ring.word(RingHeaderField.OVERRUN) > 0
    finally:
        writer.join(HANG_S)
        writer.close()
        ring.close()
