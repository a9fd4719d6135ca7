"""The worker accounts for every cycle, gives the reason of its end, and stops on request."""

from __future__ import annotations

import dataclasses
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest

from ocmm_core.acquisition.frames import (
    AcquisitionState,
    AcquisitionWorker,
    Cycle,
    CycleVerdict,
    FrameBlock,
    FrameRing,
    FrameSource,
    RingHeaderField,
    SourceDescription,
    StopReason,
    read_status,
)
from ocmm_core.errors import AcquisitionError, BusError, InternalError
from tests.host import HANG_S

MakeBlock = Callable[[int, int], FrameBlock]


class ScriptedSource:
    """A source that gives the cycles of a script, then repeats the last one for ever."""

    def __init__(
        self,
        description: SourceDescription,
        script: Sequence[Cycle | Exception],
        fails_to_open: bool = False,
    ) -> None:
        self._description = description
        self._script = list(script)
        self._fails_to_open = fails_to_open
        self.opened = 0
        self.closed = 0
        self.reads = 0

    @property
    def description(self) -> SourceDescription:
        return self._description

    def open(self) -> None:
        self.opened += 1
        if self._fails_to_open:
            raise BusError("bus.missing", "There is no interface 'eth9'.", "Name another one.")

    def read(self) -> Cycle:
        step = self._script[min(self.reads, len(self._script) - 1)]
        self.reads += 1
        if isinstance(step, Exception):
            raise step
        return step

    def close(self) -> None:
        self.closed += 1


@pytest.fixture
def ring() -> Iterator[FrameRing]:
    ring = FrameRing.create(2, 32)
    yield ring
    ring.close()


def test_whoever_looks_while_it_runs_finds_every_cycle_in_one_account(
    ring: FrameRing, description: SourceDescription
) -> None:
    script = [Cycle(CycleVerdict.GOOD), Cycle(CycleVerdict.LOST, elapsed=3)] * 50_000
    worker = AcquisitionWorker(ScriptedSource(description, script), ring)
    before, torn, looks = sys.getswitchinterval(), 0, 0
    # The thread is interrupted at every other instruction, as another process does it.
    sys.setswitchinterval(1e-6)
    try:
        worker.start()
        end = time.monotonic() + HANG_S
        while looks < 1000 and time.monotonic() < end:
            status = read_status(ring)
            looks += 0 < status.elapsed < 200_000
            torn += status.good + status.late + status.lost + status.bad != status.elapsed
    finally:
        worker.request_stop()
        worker.join(HANG_S)
        sys.setswitchinterval(before)
    # However busy the computer is: there are enough cycles for some looks in the middle.
    assert looks > 10
    assert torn == 0


def test_every_cycle_is_accounted_for(
    ring: FrameRing, description: SourceDescription, make_block: MakeBlock
) -> None:
    script = [
        Cycle(CycleVerdict.GOOD, frames=make_block(0, 8)),
        Cycle(CycleVerdict.GOOD, frames=make_block(8, 8), elapsed=4),
        Cycle(CycleVerdict.LATE, "The host came late.", frames=make_block(20, 4), frames_lost=4),
        Cycle(CycleVerdict.LOST, "A frame did not come back."),
        Cycle(CycleVerdict.BAD, "Camera 2 has left OP.", elapsed=2),
        Cycle(CycleVerdict.GOOD, finished=True),
    ]
    source = ScriptedSource(description, script)
    assert isinstance(source, FrameSource)
    assert AcquisitionWorker(source, ring).run() is StopReason.FINISHED
    status = read_status(ring)
    assert (status.good, status.late, status.lost, status.bad) == (3, 5, 1, 1)
    assert status.elapsed == 10
    assert (status.frames, status.frames_lost, status.overrun) == (20, 4, 0)
    assert (status.state, status.stop_reason) == (AcquisitionState.STOPPED, StopReason.FINISHED)
    assert status.message == "Camera 2 has left OP."
    assert (source.opened, source.closed) == (1, 1)
    assert ring.word(RingHeaderField.FRAME_PERIOD_NS) == 125_000
    block = ring.read(100)
    assert block is not None
    assert block.counter.tolist() == [*range(16), *range(20, 24)]


def test_a_new_ring_says_idle(ring: FrameRing) -> None:
    status = read_status(ring)
    assert (status.state, status.stop_reason) == (AcquisitionState.IDLE, StopReason.NONE)


def test_an_open_that_fails_is_told_in_one_sentence(
    ring: FrameRing, description: SourceDescription
) -> None:
    source = ScriptedSource(description, [Cycle(CycleVerdict.GOOD)], fails_to_open=True)
    assert AcquisitionWorker(source, ring).run() is StopReason.FAILED
    status = read_status(ring)
    assert status.message == "There is no interface 'eth9'. Name another one."
    assert (status.state, status.stop_reason) == (AcquisitionState.STOPPED, StopReason.FAILED)
    assert (source.reads, source.closed) == (0, 1)


def test_a_read_that_fails_ends_the_acquisition(
    ring: FrameRing, description: SourceDescription, make_block: MakeBlock
) -> None:
    fault = BusError("bus.gone", "The interface is gone.", "Plug it in.")
    good = Cycle(CycleVerdict.GOOD, frames=make_block(0, 8))
    source = ScriptedSource(description, [good, fault])
    assert AcquisitionWorker(source, ring).run() is StopReason.FAILED
    assert read_status(ring).message == "The interface is gone. Plug it in."
    assert read_status(ring).frames == 8
    assert source.closed == 1


def test_an_internal_error_is_told_with_its_cause_and_its_log(
    ring: FrameRing, description: SourceDescription
) -> None:
    source = ScriptedSource(description, [ZeroDivisionError("x")])
    assert AcquisitionWorker(source, ring).run() is StopReason.FAILED
    status = read_status(ring)
    assert status.message.startswith("The acquisition failed: ZeroDivisionError: x (")
    assert "Traceback" in Path(status.message.rpartition(": ")[2]).read_text("utf-8")
    assert status.internal
    assert isinstance(status.error("x", "y"), InternalError)
    assert (status.state, status.stop_reason) == (AcquisitionState.STOPPED, StopReason.FAILED)
    assert source.closed == 1


class UnclosableSource(ScriptedSource):
    def close(self) -> None:
        super().close()
        raise BusError("bus.close", "The bus does not close.", "Pull the plug.")


def test_a_close_that_fails_does_not_leave_it_running(
    ring: FrameRing, description: SourceDescription
) -> None:
    source = UnclosableSource(description, [Cycle(CycleVerdict.GOOD, finished=True)])
    assert AcquisitionWorker(source, ring).run() is StopReason.FAILED
    status = read_status(ring)
    assert (status.state, status.internal) == (AcquisitionState.STOPPED, False)
    assert status.message == "The bus does not close. Pull the plug."


@pytest.mark.parametrize("by_word", [False, True])
def test_it_stops_when_asked_from_either_side(
    ring: FrameRing, description: SourceDescription, make_block: MakeBlock, by_word: bool
) -> None:
    source = ScriptedSource(description, [Cycle(CycleVerdict.GOOD, frames=make_block(0, 8))])
    worker = AcquisitionWorker(source, ring)
    worker.start()
    with pytest.raises(AcquisitionError, match="already started"):
        worker.start()
    until = time.monotonic() + HANG_S
    while read_status(ring).frames < 80 and time.monotonic() < until:
        time.sleep(0.001)
    if by_word:
        ring.set_word(RingHeaderField.STOP_REQUEST, 1)
    else:
        worker.request_stop()
        worker.request_stop()
    assert worker.join(HANG_S)
    status = read_status(ring)
    assert status.stop_reason is StopReason.REQUESTED
    assert status.elapsed == status.good == source.reads
    assert status.frames == 8 * source.reads
    # A live source does not wait for a reader that never reads.
    assert status.frames > 32


def test_a_source_that_is_not_live_waits_for_the_reader(
    ring: FrameRing, description: SourceDescription, make_block: MakeBlock
) -> None:
    waiting = dataclasses.replace(description, live=False)
    script = [Cycle(CycleVerdict.GOOD, frames=make_block(8 * i, 8)) for i in range(40)]
    source = ScriptedSource(waiting, [*script, Cycle(CycleVerdict.GOOD, finished=True)])
    worker = AcquisitionWorker(source, ring)
    worker.start()
    counters: list[int] = []
    until = time.monotonic() + HANG_S
    while len(counters) < 320 and time.monotonic() < until:
        block = ring.read(5)
        if block is not None:
            counters += block.counter.tolist()
    assert worker.join(HANG_S)
    assert counters == list(range(320))
    assert read_status(ring).overrun == 0
    assert read_status(ring).stop_reason is StopReason.FINISHED


def test_a_waiting_source_can_be_stopped(
    ring: FrameRing, description: SourceDescription, make_block: MakeBlock
) -> None:
    waiting = dataclasses.replace(description, live=False)
    source = ScriptedSource(waiting, [Cycle(CycleVerdict.GOOD, frames=make_block(0, 20))])
    worker = AcquisitionWorker(source, ring)
    worker.start()
    assert not worker.join(0.05)
    worker.request_stop()
    assert worker.join(HANG_S)
    assert read_status(ring).stop_reason is StopReason.REQUESTED
    block = ring.read(100)
    assert block is not None
    assert len(block) == 20


@pytest.mark.parametrize("live", [False, True])
def test_a_block_larger_than_the_ring_is_told_instead_of_waited_for(
    ring: FrameRing, description: SourceDescription, make_block: MakeBlock, live: bool
) -> None:
    source = ScriptedSource(
        dataclasses.replace(description, live=live),
        [Cycle(CycleVerdict.GOOD, frames=make_block(0, 33))],
    )
    assert AcquisitionWorker(source, ring).run() is StopReason.FAILED
    assert "33 frames" in read_status(ring).message


def test_a_worker_that_never_started_has_ended(
    ring: FrameRing, description: SourceDescription
) -> None:
    source = ScriptedSource(description, [Cycle(CycleVerdict.GOOD)])
    assert AcquisitionWorker(source, ring).join(0.0)
