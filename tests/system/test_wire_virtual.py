"""The whole wire as the application uses it: `VirtualBus`."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import msgspec
import numpy as np
import pytest

from ocmm_core.acquisition.bus_process import BusConfig, BusProcess
from ocmm_core.acquisition.frames import (
    SUBPIXEL,
    AcquisitionState,
    FrameRing,
    StopReason,
    read_status,
)
from ocmm_core.errors import BusError
from ocmm_core.fieldbus.device import CameraIdentity
from ocmm_core.fieldbus.wire import namespace_command
from ocmm_sim.bus import SegmentConfig, VirtualBus
from ocmm_sim.slave import TestPattern
from tests.host import BUSY, HANG_S, private_network

# Two processes must answer each other within a millisecond: not in parallel with other tests.
pytestmark = pytest.mark.timing

_ROOT = Path(__file__).resolve().parents[2]
CAMERAS = (CameraIdentity("left", 1001, 1), CameraIdentity("right", 1002, 2))
PATTERN = msgspec.Raw(b'{"pattern":"test"}')


@pytest.fixture
def namespace() -> list[str]:
    """Return the command prefix for a private network."""
    return private_network()


def wait_for(ring: FrameRing, state: AcquisitionState, seconds: float) -> None:
    end = time.monotonic() + seconds
    while read_status(ring).state != state:
        assert time.monotonic() < end, read_status(ring)
        time.sleep(0.005)


@pytest.mark.usefixtures("namespace")
def test_virtual_bus_delivers_what_its_cameras_show_and_leaves_nothing() -> None:
    ring = FrameRing.create(2)
    try:
        bus = VirtualBus(
            BusConfig(interface="", ring_path=str(ring.path), cameras=CAMERAS),
            SegmentConfig(interface="", cameras=CAMERAS, provider=PATTERN),
            ring,
        )
        bus.start()
        wait_for(ring, AcquisitionState.RUNNING, HANG_S)
        # On a busy computer the bus is slower than real time.
        end = time.monotonic() + HANG_S
        while read_status(ring).frames <= 2000:
            assert time.monotonic() < end, read_status(ring)
            time.sleep(0.005)
        begin = time.monotonic()
        bus.request_stop()
        assert bus.join(HANG_S)
        assert time.monotonic() - begin < BUSY * 2.0
        status = read_status(ring)
        assert status.state is AcquisitionState.STOPPED
        assert status.stop_reason is StopReason.REQUESTED
        assert status.good + status.late + status.lost + status.bad == status.elapsed
        block = ring.read(ring.capacity)
        assert block is not None
        assert len(block) == status.frames > 2000
        for camera in range(2):
            _valid, _flags, uv = TestPattern().camera_frames(camera, 0, int(block.counter[-1]) + 1)
            # Half a step of the wire's fixed point.
            np.testing.assert_allclose(
                block.uv[:, camera], uv[block.counter], rtol=0, atol=0.5 * SUBPIXEL + 1e-12
            )
        assert bus.pid is not None
        assert not Path(f"/proc/{bus.pid}").exists()
    finally:
        ring.close()


@pytest.mark.usefixtures("namespace")
def test_virtual_bus_says_why_it_failed() -> None:
    ring = FrameRing.create(2)
    try:
        strangers = (CAMERAS[0], CameraIdentity("right", 4711, 2))
        bus = VirtualBus(
            BusConfig(interface="", ring_path=str(ring.path), cameras=CAMERAS),
            SegmentConfig(interface="", cameras=strangers, provider=PATTERN),
            ring,
        )
        bus.start()
        wait_for(ring, AcquisitionState.STOPPED, HANG_S)
        assert bus.join(HANG_S)
        status = read_status(ring)
        assert status.stop_reason is StopReason.FAILED
        assert "'right' (serial 1002)" in status.message
    finally:
        ring.close()


@pytest.mark.usefixtures("namespace")
def test_virtual_bus_ends_with_the_program_that_started_it() -> None:
    """The starting process is killed; its namespace, bus process and cameras must follow."""
    program = (
        "import sys,time,msgspec\n"
        "from ocmm_core.acquisition.frames._ring import FrameRing\n"
        "import test_wire_virtual as t\n"
        "ring = FrameRing.attach(sys.argv[1])\n"
        "bus = t.VirtualBus(\n"
        "    t.BusConfig(interface='', ring_path=sys.argv[1], cameras=t.CAMERAS),\n"
        "    t.SegmentConfig(interface='', cameras=t.CAMERAS, provider=t.PATTERN), ring)\n"
        "bus.start(); print(bus.pid, flush=True); time.sleep(60)\n"
    )
    ring = FrameRing.create(2)
    path = os.pathsep.join([str(_ROOT), str(Path(__file__).parent)])
    parent = subprocess.Popen(
        [sys.executable, "-c", program, str(ring.path)],
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": path},
    )
    try:
        assert parent.stdout is not None
        child = int(parent.stdout.readline())
        wait_for(ring, AcquisitionState.RUNNING, HANG_S)
        parent.kill()
        wait_for(ring, AcquisitionState.STOPPED, HANG_S)
        # The orphan is a child of this process now (it adopts grandchildren); it must end without a
        # signal.
        end = time.monotonic() + HANG_S
        while os.waitpid(child, os.WNOHANG) == (0, 0):
            assert time.monotonic() < end
            time.sleep(0.01)
    finally:
        parent.kill()
        parent.wait()
        if parent.stdout is not None:
            parent.stdout.close()
        ring.close()


def test_missing_tools_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda *_args, **_kwargs: None)
    with pytest.raises(BusError, match=r"util-linux.*source simulated"):
        namespace_command()


def test_bus_process_reports_an_interface_that_does_not_exist() -> None:
    ring = FrameRing.create(2)
    try:
        bus = BusProcess(
            BusConfig(interface="nope0", ring_path=str(ring.path), cameras=CAMERAS), ring
        )
        bus.start()
        wait_for(ring, AcquisitionState.STOPPED, HANG_S)
        assert bus.join(HANG_S)
        status = read_status(ring)
        assert status.stop_reason is StopReason.FAILED
        assert "nope0" in status.message
        assert "Traceback" not in status.message
    finally:
        ring.close()
