"""The application does not run for seconds, as during a long call into a library.

The station is real, the wire is virtual, its cameras are software. `ctypes.PyDLL` keeps the lock of
the interpreter during a call: no thread of the application runs, including the one that reads the
ring.
"""

from __future__ import annotations

import ctypes
import os
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from ocmm_core.acquisition.frames import AcquisitionState, FrameRing, RingHeaderField
from ocmm_core.composition import DEMO_PLAN, StationRequest, build_station
from ocmm_core.station import MeasuringStation
from tests.host import HANG_S, private_network
from tests.programs import rings_of
from tests.waiting import wait_until

# Processes must answer each other within a millisecond: not in parallel with other tests.
pytestmark = [pytest.mark.timing, pytest.mark.slow]

_FREEZE_S = 2.0
_FRAMES_A_SECOND = 8000
_FEW, _MORE = 1000, 2000
"""Frames that wait for the application before it stops, and that come meanwhile. A virtual bus
waits for a reader that is 4096 behind."""


@pytest.fixture(autouse=True)
def namespace() -> None:
    """Need a virtual wire."""
    private_network()


def wait_until_tracked(station: MeasuringStation, count: int) -> None:
    """Wait until the application has tracked some frames; it may have to compile first."""
    end = time.monotonic() + HANG_S
    while station.looks.live().frame_counter < count:
        status = station.looks.acquisition()
        assert status.state is not AcquisitionState.STOPPED, status.message
        assert time.monotonic() < end, status
        time.sleep(0.01)


def freeze(ring: FrameRing) -> int:
    """Stop all threads until the bus process is ahead; return how often another thread ran.

    The event is the number of frames, so that a busy computer stops them for longer.
    """
    moved = 0
    ready, stop = threading.Event(), threading.Event()

    def count() -> None:
        nonlocal moved
        ready.set()
        while not stop.wait(0.001):
            moved += 1

    other = threading.Thread(target=count)
    other.start()
    ready.wait()
    library, interval = ctypes.PyDLL(None), sys.getswitchinterval()
    # Between two calls no other thread is given the lock.
    sys.setswitchinterval(HANG_S)
    try:
        before, begin, written = moved, time.monotonic(), ring.word(RingHeaderField.WRITTEN)
        while (
            time.monotonic() < begin + _FREEZE_S
            or ring.word(RingHeaderField.WRITTEN) < written + _MORE
        ):
            assert time.monotonic() < begin + HANG_S, "the bus process stopped as well"
            library.usleep(20_000)
        return moved - before
    finally:
        sys.setswitchinterval(interval)
        stop.set()
        other.join()


def test_frozen_application_loses_no_frame(
    tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    station = build_station(
        StationRequest(plan=DEMO_PLAN, out=tmp_path, source="ethercat:virtual")
    ).station
    try:
        station.start()
        wait_until_tracked(station, _FRAMES_A_SECOND)
        wait_until_tracked(station, station.looks.acquisition().frames)
        (path,) = rings_of(os.getpid())
        ring = FrameRing.attach(path)
        wait_until(lambda: ring.capacity - ring.free() < _FEW)
        before = station.looks.acquisition()
        # It runs a thousand times a second while it can: here only before and after.
        assert freeze(ring) < 50
        after = station.looks.acquisition()
        ring.close()
        assert after.frames - before.frames >= _MORE
        wait_until_tracked(station, after.frames)
        later = station.looks.acquisition()
        report = station.looks.bus_report()
        # Losses of the bus process have no other cause.
        record_property("frames lost in the bus process", later.frames_lost - before.frames_lost)
        record_property("cycles", f"{later.good - before.good} of {later.elapsed - before.elapsed}")
        assert report is not None
        assert report.recoveries == 0
    finally:
        station.close()
    # Counters that change while they are read need not agree; these no longer change.
    final = station.looks.acquisition()
    assert final.overrun == before.overrun
    assert final.good + final.late + final.lost + final.bad == final.elapsed
