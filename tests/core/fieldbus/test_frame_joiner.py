"""Frames are joined by exposure time, and every exposure is given out or counted as lost."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.acquisition.frames import FrameJoiner
from ocmm_core.errors import AcquisitionError
from ocmm_sim.slave import TestPattern

START, PERIOD = 10_000_000_000, 125_000


def push(joiner: FrameJoiner, camera: int, first: int, count: int, jitter_ns: int = 0) -> int:
    valid, flags, uv = TestPattern().camera_frames(camera, first, count)
    time_ns = START + (first + np.arange(count)) * PERIOD + jitter_ns
    return joiner.push(camera, time_ns, flags, valid, uv)


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
        np.testing.assert_array_equal(block.uv[:, camera], uv)


def test_the_short_way_gives_out_the_same() -> None:
    long, short = FrameJoiner(2, START, PERIOD), FrameJoiner(2, START, PERIOD)
    for first, count in ((0, 8), (8, 12), (20, 1)):
        for camera in range(2):
            push(long, camera, first, count)
        expected = long.pull().frames
        seen = [TestPattern().camera_frames(camera, first, count) for camera in range(2)]
        valid, flags, uv = (np.stack(values) for values in zip(*seen, strict=True))
        assert short.takes_at_once(first)
        block = short.pass_on(flags, valid, uv)
        assert expected is not None
        for name in ("counter", "time_ns", "flags", "valid", "uv"):
            np.testing.assert_array_equal(getattr(block, name), getattr(expected, name))
            assert getattr(block, name).dtype == getattr(expected, name).dtype
    # Spots of a single camera wait for the others: no shortcut then.
    assert not short.takes_at_once(20)
    push(short, 1, 21, 4)
    assert not short.takes_at_once(21)
    push(short, 0, 21, 4)
    after = short.pull().frames
    assert after is not None
    np.testing.assert_array_equal(after.counter, np.arange(21, 25))
    assert short.takes_at_once(25)


def test_the_button_of_any_camera_is_the_button() -> None:
    joiner = FrameJoiner(2, START, PERIOD)
    valid, _flags, uv = TestPattern().camera_frames(0, 0, 4)
    time_ns = START + np.arange(4) * PERIOD
    joiner.push(0, time_ns, np.array([0, 1, 0, 1], np.uint16), valid, uv)
    joiner.push(1, time_ns, np.array([0, 0, 1, 1], np.uint16), valid, uv)
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


def test_times_are_rounded_to_the_period_but_not_further() -> None:
    joiner = FrameJoiner(2, START, PERIOD)
    push(joiner, 0, 0, 3, jitter_ns=400)
    push(joiner, 1, 0, 3, jitter_ns=-400)
    block = joiner.pull().frames
    assert block is not None
    np.testing.assert_array_equal(block.time_ns, START + np.arange(3) * PERIOD)
    with pytest.raises(AcquisitionError, match="common schedule"):
        push(joiner, 0, 3, 3, jitter_ns=PERIOD // 3)


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
