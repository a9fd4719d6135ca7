"""A virtual bus on a computer that is too slow: it slows down, loses nothing, and reports it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec
import numpy as np
import pytest

from benchmarks.faulty_cameras import FaultyBus
from ocmm_core.acquisition.bus_process import BusConfig, EthercatSource, SteppedTime
from ocmm_core.acquisition.frames import (
    SUBPIXEL,
    AcquisitionState,
    AcquisitionStatus,
    FrameBlock,
    FrameRing,
    RingHeaderField,
    read_status,
)
from ocmm_core.errors import BusError
from ocmm_core.fieldbus.cycle import BusSettings
from ocmm_core.fieldbus.device import CameraIdentity
from ocmm_core.fieldbus.report import Alarm, decode_report
from ocmm_core.fieldbus.wire import is_virtual_cable
from ocmm_sim.bus import SegmentConfig, VirtualBus, VirtualWire
from ocmm_sim.slave import TestPattern
from tests.host import HANG_S, private_network

# The assertions hold on any computer; the load would disturb parallel tests.
pytestmark = pytest.mark.timing

CAMERAS = (CameraIdentity("left", 1001, 1), CameraIdentity("right", 1002, 2))
PATTERN = msgspec.Raw(b'{"pattern":"test"}')
_STOP_S = 0.5
"""Longer than a camera of the real world keeps its frames (128 ms) and its watchdog waits."""


@contextmanager
def running(ring: FrameRing, drop: float = 0.0) -> Iterator[VirtualWire]:
    """Run a virtual bus that fills ``ring``; it has stopped at the end."""
    private_network()
    config = BusConfig(interface="", ring_path=str(ring.path), cameras=CAMERAS)
    segment = SegmentConfig(interface="", cameras=CAMERAS, provider=PATTERN)
    bus: VirtualWire = (
        FaultyBus(config, segment, ring, drop=drop) if drop else VirtualBus(config, segment, ring)
    )
    bus.start()
    try:
        wait_until(ring, lambda status: status.state is AcquisitionState.RUNNING)
        yield bus
    finally:
        bus.request_stop()
        bus.join(HANG_S)


def wait_until(ring: FrameRing, fulfilled: Callable[[AcquisitionStatus], bool]) -> None:
    end = time.monotonic() + HANG_S
    while not fulfilled(status := read_status(ring)):
        assert time.monotonic() < end, status
        assert status.state is not AcquisitionState.STOPPED, status.message
        time.sleep(0.005)


def drained(ring: FrameRing, cycles: int) -> list[FrameBlock]:
    """Read until the given number of cycles has passed."""
    blocks = []

    def enough(status: AcquisitionStatus) -> bool:
        while (block := ring.read(ring.capacity)) is not None:
            blocks.append(block)
        return status.elapsed >= cycles

    wait_until(ring, enough)
    return blocks


def assert_whole(blocks: list[FrameBlock], status: AcquisitionStatus) -> None:
    """Check that every exposure from the first one on is present, as shown by the cameras."""
    counter = np.concatenate([block.counter for block in blocks])
    np.testing.assert_array_equal(counter, np.arange(len(counter)))
    assert len(counter) == status.frames > 0
    assert (status.frames_lost, status.overrun) == (0, 0)
    for camera in range(2):
        _valid, _flags, uv = TestPattern().camera_frames(camera, 0, len(counter))
        # Half a step of the wire's fixed point.
        found = np.concatenate([block.uv[:, camera] for block in blocks])
        np.testing.assert_allclose(found, uv, rtol=0, atol=0.5 * SUBPIXEL + 1e-12)


def processes_of(bus: VirtualWire) -> tuple[int, int]:
    """Return the numbers of the software cameras and of the bus process."""
    assert bus.pid is not None
    children = Path(f"/proc/{bus.pid}/task/{bus.pid}/children").read_text(encoding="ascii")
    return bus.pid, int(children.split()[0])


@contextmanager
def one_burdened_core() -> Iterator[None]:
    """Leave one core to all that is started here, and let something else compute on it."""
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(allowed)})
    # Without the caller's priority: that would take all of the core.
    work = (
        "import os; os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))\nwhile True: pass"
    )
    burner = subprocess.Popen([sys.executable, "-c", work])
    try:
        yield
    finally:
        burner.kill()
        burner.wait()
        os.sched_setaffinity(0, allowed)


def test_a_slow_computer_makes_it_slower_and_loses_nothing() -> None:
    ring = FrameRing.create(2)
    blocks: list[FrameBlock] = []
    try:
        with one_burdened_core(), running(ring) as bus:
            for turn in range(2):
                for stopped in processes_of(bus):
                    blocks += drained(ring, read_status(ring).elapsed + 300 * (turn + 1))
                    os.kill(stopped, signal.SIGSTOP)
                    time.sleep(_STOP_S)
                    os.kill(stopped, signal.SIGCONT)
            # The pace is reported for whole seconds.
            blocks += drained(ring, read_status(ring).elapsed + 2500)
        blocks += drained_rest(ring)
        status = read_status(ring)
        assert (status.lost, status.bad, status.late) == (0, 0, 0)
        assert status.good == status.elapsed
        assert_whole(blocks, status)
        assert status.mean_pace is not None
        # It paused four times for half a second, of which each makes up for a tenth.
        assert status.mean_pace < 1.0
        report = decode_report(ring.report())
        assert report is not None
        assert report.pace is not None
        told = [event.what for event in report.events if event.code == Alarm.STRETCHED]
        assert told
        for words in told:
            assert words.startswith("Virtual bus at 0.")
            assert words.endswith("of real time: this computer is too slow for 1.0.")
    finally:
        ring.close()


def drained_rest(ring: FrameRing) -> list[FrameBlock]:
    """Read the rest from a stopped bus."""
    rest = []
    while (block := ring.read(ring.capacity)) is not None:
        rest.append(block)
    return rest


def test_a_slow_reader_makes_it_slower_and_loses_nothing() -> None:
    ring = FrameRing.create(2, 4096)
    try:
        with running(ring):
            blocks = drained(ring, 100)
            # It polls without reading, like a calculation: twice the ring would have arrived.
            begin = time.monotonic()
            while time.monotonic() - begin < 1.2:
                ring.set_word(RingHeaderField.READS, ring.word(RingHeaderField.READS) + 1)
                assert ring.free() > ring.capacity // 2
                time.sleep(0.01)
            blocks += drained(ring, read_status(ring).elapsed + 500)
        blocks += drained_rest(ring)
        assert_whole(blocks, read_status(ring))
    finally:
        ring.close()


def test_without_a_reader_it_goes_on() -> None:
    ring = FrameRing.create(2, 1024)
    try:
        with running(ring):
            wait_until(ring, lambda status: status.frames > 4 * ring.capacity)
    finally:
        ring.close()


def test_what_gets_lost_on_purpose_is_counted() -> None:
    ring = FrameRing.create(2)
    try:
        with running(ring, drop=0.02):
            blocks = drained(ring, 1500)
        blocks += drained_rest(ring)
        status = read_status(ring)
        dropped = ring.word(RingHeaderField.FRAMES_TAKEN) - ring.word(
            RingHeaderField.FRAMES_ANSWERED
        )
        # A cycle has two frames. Without the one it is lost, without the other bad; a cycle that
        # missed both is lost once. The last frames go while the bus is being closed.
        disturbed = status.lost + status.bad
        assert 0 < status.lost <= dropped
        assert dropped - 4 <= 2 * disturbed
        assert disturbed <= dropped
        assert_whole(blocks, status)
    finally:
        ring.close()


def test_real_interfaces_are_not_stretched() -> None:
    assert not is_virtual_cable("lo")
    assert not is_virtual_cable("nope0")
    ring = FrameRing.create(2)
    try:
        assert read_status(ring).pace is None
        with pytest.raises(BusError, match="cannot wait for this computer"):
            EthercatSource(BusSettings("lo", CAMERAS), host_time=SteppedTime(ring))
    finally:
        ring.close()


def test_its_time_stands_still_between_two_cycles_and_goes_on_from_there() -> None:
    ring = FrameRing.create(2)
    try:
        stepped = SteppedTime(ring)
        stepped.hold()
        begin = stepped.now_ns()
        assert stepped.now_ns() == begin
        assert stepped.passage(begin - 5, begin + 7) == (begin, begin)
        stepped.wait_until(begin + 1_000_000)
        assert stepped.now_ns() == begin + 1_000_000
        stepped.flow()
        flowing = stepped.now_ns()
        assert flowing >= begin + 1_000_000
        time.sleep(0.001)
        assert stepped.now_ns() > flowing
    finally:
        ring.close()
