"""The application stands still for two seconds, as a long call into a library makes it.

The station is real and so is the wire, with software cameras on it. `ctypes.PyDLL` keeps the lock
of the interpreter during a call, so that no thread of the application moves, the one that reads
the ring included.
"""

from __future__ import annotations

import ctypes
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from ocmm_core.acquisition.frames import AcquisitionState
from ocmm_core.composition import DEMO_PLAN, StationRequest, build_station
from ocmm_core.station import MeasuringStation
from tests.host import HANG_S, private_network

# Processes must answer each other within a millisecond: not beside other tests.
pytestmark = [pytest.mark.timing, pytest.mark.slow]

_FREEZE_S = 2.0
_FRAMES_A_SECOND = 8000


@pytest.fixture(autouse=True)
def namespace() -> None:
    """Need a virtual wire."""
    private_network()


def wait_until_tracked(station: MeasuringStation, count: int) -> None:
    """Wait until the application itself, which may have to compile first, is so far."""
    end = time.monotonic() + HANG_S
    while station.looks.live().frame_counter < count:
        status = station.looks.acquisition()
        assert status.state is not AcquisitionState.STOPPED, status.message
        assert time.monotonic() < end, status
        time.sleep(0.01)


def freeze() -> int:
    """Stand still and return how often another thread of this process moved meanwhile."""
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
    before = moved
    ctypes.PyDLL(None).usleep(round(_FREEZE_S * 1e6))
    after = moved
    stop.set()
    other.join()
    return after - before


def test_a_frozen_application_loses_no_frame(
    tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    station = build_station(
        StationRequest(plan=DEMO_PLAN, out=tmp_path, source="ethercat:virtual")
    ).station
    try:
        station.start()
        wait_until_tracked(station, _FRAMES_A_SECOND)
        wait_until_tracked(station, station.looks.acquisition().frames)
        before = station.looks.acquisition()
        # It moves a thousand times a second while it can, and at most around the freeze.
        assert freeze() < 50
        after = station.looks.acquisition()
        # The bus process went on: without it no frame would come. A busy machine makes it slower.
        assert after.frames - before.frames > 0.05 * _FREEZE_S * _FRAMES_A_SECOND
        wait_until_tracked(station, after.frames)
        later = station.looks.acquisition()
        report = station.looks.bus_report()
        # What the bus process lost, it lost by itself.
        record_property("frames lost in the bus process", later.frames_lost - before.frames_lost)
        record_property("cycles", f"{later.good - before.good} of {later.elapsed - before.elapsed}")
        assert report is not None
        assert report.recoveries == 0
    finally:
        station.close()
    # Counters that are read while they change need not fit each other; now they stand.
    final = station.looks.acquisition()
    assert final.overrun == before.overrun
    assert final.good + final.late + final.lost + final.bad == final.elapsed
