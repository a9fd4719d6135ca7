"""Frames are joined by exposure time, and every exposure is given out or counted as lost."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from ocmm_core.acquisition.frames import FrameBlock, FrameJoiner, quantise
from ocmm_core.fieldbus.device import FRAME_DTYPE, decode_spots, encode_frames
from ocmm_sim.slave import TestPattern
from tests.core.fieldbus.plain_joiner import PlainJoiner

START, PERIOD = 10_000_000_000, 125_000


def push_raw(joiner: FrameJoiner, camera: int, first: int, frames: NDArray[np.void]) -> int:
    return joiner.push(camera, first, memoryview(frames.tobytes()))


def push(joiner: FrameJoiner, camera: int, first: int, count: int) -> int:
    frames = encode_frames(*TestPattern().camera_frames(camera, first, count))
    return push_raw(joiner, camera, first, frames)


def test_nothing_is_given_out_before_all_cameras_have_it() -> None:
    joiner = FrameJoiner(2, START, PERIOD)
    push(joiner, 0, 0, 30)
    assert joiner.pull().frames is None
    push(joiner, 1, 0, 10)
    block = joiner.pull().frames
    assert block is not None
    np.testing.assert_array_equal(block.counter, np.arange(10))
    np.testing.assert_array_equal(block.time_ns, START + np.arange(10) * PERIOD)
    for camera in range(2):
        valid, _flags, uv = TestPattern().camera_frames(camera, 0, 10)
        np.testing.assert_array_equal(block.valid[:, camera], valid)
        np.testing.assert_array_equal(block.uv[:, camera], quantise(uv))


def assert_same_block(found: FrameBlock | None, expected: FrameBlock | None) -> None:
    if found is None or expected is None:
        assert found is expected
        return
    for name in FrameBlock.__slots__:
        one, other = getattr(found, name), getattr(expected, name)
        assert one.dtype == other.dtype
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("capacity", [16, 100, 4096])
def test_joined_frames_are_those_of_the_plain_joiner_to_the_last_bit(capacity: int) -> None:
    """Three cameras, 1,500 pushes: random bytes, gaps, repeats, and leads beyond the capacity."""
    rng = np.random.default_rng(41)
    joiner = FrameJoiner(3, START, PERIOD, capacity)
    plain = PlainJoiner(3, START, PERIOD, capacity)
    upto, given, lost, skipped = [0, 0, 0], 0, 0, 0
    for _ in range(1500):
        camera = int(rng.integers(3)) if rng.random() < 0.1 else int(np.argmin(upto))
        step = int(rng.integers(-20, 40)) if rng.random() < 0.05 else 0
        first, count = max(0, upto[camera] + step), int(rng.integers(0, 13))
        content = rng.bytes(count * FRAME_DTYPE.itemsize)
        frames = np.frombuffer(content, FRAME_DTYPE)
        known = joiner.push(camera, first, memoryview(content))
        skipped += known
        times = START + (first + np.arange(count)) * PERIOD
        expected = plain.push(camera, times, frames["flags"], frames["valid"], decode_spots(frames))
        assert known == expected
        upto[camera] = max(upto[camera], first + count)
        if rng.random() < 0.7:
            found, right = joiner.pull(), plain.pull()
            assert found.lost == right.lost
            assert_same_block(found.frames, right.frames)
            lost += found.lost
            given += 0 if found.frames is None else len(found.frames)
    assert given > 800
    assert lost > 80
    assert skipped > 80


def test_the_button_of_any_camera_is_the_button() -> None:
    joiner = FrameJoiner(2, START, PERIOD)
    frames = encode_frames(*TestPattern().camera_frames(0, 0, 4))
    for camera, button in ((0, [0, 1, 0, 1]), (1, [0, 0, 1, 1])):
        frames["flags"] = button
        push_raw(joiner, camera, 0, frames)
    block = joiner.pull().frames
    assert block is not None
    np.testing.assert_array_equal(block.flags, [0, 1, 1, 1])


def test_a_gap_of_one_camera_is_lost_once_and_exactly() -> None:
    joiner = FrameJoiner(2, START, PERIOD)
    push(joiner, 0, 0, 10)
    push(joiner, 0, 13, 7)
    push(joiner, 1, 0, 20)
    joined = joiner.pull()
    assert joined.frames is not None
    np.testing.assert_array_equal(joined.frames.counter, [*range(10), *range(13, 20)])
    assert joined.lost == 3
    assert joiner.pull().lost == 0


def test_frames_that_come_again_are_left_out() -> None:
    joiner = FrameJoiner(2, START, PERIOD)
    assert push(joiner, 0, 0, 10) == 0
    assert push(joiner, 0, 4, 10) == 6
    push(joiner, 1, 0, 14)
    joined = joiner.pull()
    assert joined.frames is not None
    np.testing.assert_array_equal(joined.frames.counter, np.arange(14))
    assert joined.lost == 0


def test_a_camera_that_stays_away_costs_frames_but_no_memory() -> None:
    joiner = FrameJoiner(2, START, PERIOD, capacity=64)
    lost = 0
    for first in range(0, 1000, 10):
        push(joiner, 0, first, 10)
        joined = joiner.pull()
        assert joined.frames is None
        lost += joined.lost
    assert lost == 1000 - 64
    push(joiner, 1, 0, 1000)
    joined = joiner.pull()
    assert joined.frames is not None
    np.testing.assert_array_equal(joined.frames.counter, np.arange(1000 - 64, 1000))
    assert lost + joined.lost + len(joined.frames) == 1000


def test_random_arrival_accounts_for_every_exposure() -> None:
    rng = np.random.default_rng(5)
    joiner = FrameJoiner(3, START, PERIOD, capacity=256)
    upto = np.zeros(3, dtype=int)
    given: list[int] = []
    lost = 0
    sent: list[set[int]] = [set(), set(), set()]
    for _ in range(2000):
        camera = int(rng.integers(3))
        first = int(upto[camera]) + (int(rng.integers(1, 5)) if rng.random() < 0.05 else 0)
        count = int(rng.integers(1, 13))
        if first + count > upto.min() + 200:
            continue
        push(joiner, camera, first, count)
        sent[camera].update(range(first, first + count))
        upto[camera] = first + count
        joined = joiner.pull()
        lost += joined.lost
        if joined.frames is not None:
            given.extend(joined.frames.counter.tolist())
    assert given == sorted(set.intersection(*sent) & set(range(int(upto.min()))))
    assert len(given) + lost == upto.min()
