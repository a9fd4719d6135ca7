"""The virtual rig as a source: whole, paced, hovering, extended, and read by a real worker."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import numpy as np
import pytest

from ocmm_core.acquisition.frames import (
    AcquisitionWorker,
    CycleVerdict,
    FrameRing,
    FrameSource,
    StopReason,
    read_status,
)
from ocmm_core.errors import InputError
from ocmm_sim.scene import Missing, SimulatedSource, VirtualRig
from tests.host import BUSY, HANG_S

MakeRig = Callable[..., VirtualRig]


def test_every_frame_comes_once_and_the_last_block_says_that_it_is_the_last(
    make_rig: MakeRig,
) -> None:
    rig = make_rig([("CORNER", 1)])
    source = SimulatedSource(rig)
    assert isinstance(source, FrameSource)
    source.open()
    cycles = [source.read()]
    while not cycles[-1].finished:
        cycles.append(source.read())
    source.close()
    blocks = [cycle.frames for cycle in cycles if cycle.frames is not None]
    counter = np.concatenate([block.counter for block in blocks])
    np.testing.assert_array_equal(counter, np.arange(rig.n_frames))
    assert {len(block) for block in blocks[:-1]} == {80}
    assert all(cycle.verdict is CycleVerdict.GOOD and cycle.elapsed == 1 for cycle in cycles)
    np.testing.assert_array_equal(
        np.concatenate([block.uv for block in blocks]), rig.frames(0, rig.n_frames).uv
    )


def test_the_description_tells_the_periods(make_rig: MakeRig) -> None:
    description = SimulatedSource(make_rig(frame_rate_hz=500)).description
    assert description.name == "simulated (recommended, seed 1)"
    assert description.frame_period_ns == 2_000_000
    assert description.cycle_period_ns == 10_000_000
    assert not description.live
    assert len(description.camera_serials) == 2


def test_a_worker_takes_the_whole_script_and_accounts_for_every_cycle(make_rig: MakeRig) -> None:
    rig = make_rig([("CORNER", 2)], frame_rate_hz=2000)
    ring = FrameRing.create(2, 1024)
    try:
        worker = AcquisitionWorker(SimulatedSource(rig), ring)
        worker.start()
        frames = 0
        deadline = time.monotonic() + HANG_S
        while frames < rig.n_frames and time.monotonic() < deadline:
            block = ring.read(512)
            frames += 0 if block is None else len(block)
        assert worker.join(HANG_S)
        status = read_status(ring)
        assert (frames, status.frames, status.overrun) == (rig.n_frames, rig.n_frames, 0)
        assert status.stop_reason is StopReason.FINISHED
        assert status.good == status.elapsed == -(-rig.n_frames // 20)
    finally:
        ring.close()


def test_at_the_end_the_probe_hovers_at_home_if_asked(make_rig: MakeRig) -> None:
    rig = make_rig([("CORNER", 1)], frame_rate_hz=500)
    source = SimulatedSource(rig, hover=True)
    source.open()
    for _ in range(rig.n_frames // 5 + 100):
        cycle = source.read()
        assert not cycle.finished
        assert cycle.frames is not None
        assert len(cycle.frames) == 5
    assert cycle.frames is not None
    last = int(cycle.frames.counter[-1])
    assert last > rig.n_frames
    np.testing.assert_array_equal(rig.motion(last, 1).tip_world, rig.motion(0, 1).tip_world)
    assert cycle.frames.valid.all()


def test_touches_that_are_added_while_hovering_begin_after_now(make_rig: MakeRig) -> None:
    rig = make_rig([("CORNER", 1)], frame_rate_hz=500)
    source = SimulatedSource(rig, hover=True)
    source.open()
    for _ in range(rig.n_frames // 5 + 200):
        cycle = source.read()
    assert cycle.frames is not None
    now = int(cycle.frames.counter[-1])
    source.extend([("SPHERE", 1)])
    added = rig.truth.touches[-1]
    assert added.feature == "SPHERE"
    assert now + 10 < added.first_frame < now + 3 * 500
    # The block that a reader may be about to take is left alone.
    np.testing.assert_array_equal(
        rig.motion(now, 6).tip_world, np.broadcast_to(rig.motion(0, 1).tip_world, (6, 3))
    )


def test_what_is_missing_at_the_end_is_touched_where_it_was_touched(make_rig: MakeRig) -> None:
    rig = make_rig([("SPHERE", 5)], frame_rate_hz=500)
    source = SimulatedSource(rig)
    first = np.array([touch.tip_world for touch in rig.truth.touches])
    answers = [
        Missing([("SPHERE", 2), ("BED", 0)], {"SPHERE": first[[0, 2, 4]].tolist()}),
        Missing([("SPHERE", 1)], {"SPHERE": first[[0, 1, 2, 4]].tolist()}),
        Missing([], {}),
    ]
    source.ask = lambda: answers.pop(0)
    source.open()
    while not source.read().finished:
        pass
    again = np.array([touch.tip_world for touch in rig.truth.touches[5:]])
    assert not answers
    np.testing.assert_allclose(again, first[[1, 3, 3]], atol=1e-9)


def test_touches_can_be_added_while_another_thread_reads(make_rig: MakeRig) -> None:
    rig = make_rig([("CORNER", 1)], frame_rate_hz=500)
    source = SimulatedSource(rig, hover=True)
    source.open()
    counters: list[int] = []
    failures: list[BaseException] = []

    def read() -> None:
        try:
            for _ in range(600):
                block = source.read().frames
                assert block is not None
                counters.extend(block.counter.tolist())
        except BaseException as error:
            failures.append(error)
            raise

    reader = threading.Thread(target=read)
    reader.start()
    for _ in range(20):
        source.extend([("BED", 1)])
    reader.join(HANG_S)
    assert not failures
    assert counters == list(range(3000))
    assert len(rig.truth.touches) == 21


@pytest.mark.timing
def test_a_paced_source_keeps_time(make_rig: MakeRig) -> None:
    source = SimulatedSource(make_rig(frame_rate_hz=500), speed=5.0)
    source.open()
    start = time.monotonic()
    for _ in range(100):
        source.read()
    took = time.monotonic() - start
    # 1 s of the rig at five times real time; a busy machine may come late, never early.
    assert 0.195 < took < BUSY * 0.2


@pytest.mark.timing
def test_a_fast_source_rests_in_the_time_of_the_clock_and_hurries_again(make_rig: MakeRig) -> None:
    rig = make_rig([("CORNER", 1)], frame_rate_hz=500)
    source = SimulatedSource(rig, hover=True, rest_speed=0.1)
    source.open()

    def took(blocks: int) -> float:
        start = time.monotonic()
        for _ in range(blocks):
            source.read()
        return time.monotonic() - start

    # Blocks of 10 ms: at the speed of the rest each of them would take 0.1 s.
    script = rig.n_frames // 5
    assert took(script) < 0.5 * 0.1 * script
    took(2)
    assert 0.95 < took(10) < BUSY * 1.0
    source.extend([("BED", 3)])
    added = rig.n_frames // 5 - script - 14
    assert took(added) < 0.5 * 0.1 * added


@pytest.mark.parametrize("speed", [-1.0, 0.01, 1e6, float("nan")])
def test_an_impossible_speed_is_refused(make_rig: MakeRig, speed: float) -> None:
    with pytest.raises(InputError, match="speed of the virtual rig"):
        SimulatedSource(make_rig(), speed=speed)
