"""Master, cable and cameras as separate processes with fault injection.

::

    bus process -- host ~~~~ near -- proxy -- far ~~~~ cameras -- software cameras

Everything runs in the network namespace of the calling process, which should be private.
"""

from __future__ import annotations

import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

import msgspec

from benchmarks.camera_faults import CameraDeed, DeedAnswer, FaultKind
from benchmarks.faulty_cameras import CLOCK, MODULE, FaultySegment
from benchmarks.faulty_line import LineLog, LineOrder, LineRule, ProxyConfig
from ocmm_core.acquisition.bus_process import BusConfig, BusProcess
from ocmm_core.acquisition.frames import AcquisitionState, FrameRing, RingHeaderField, read_status
from ocmm_core.errors import BusError
from ocmm_core.fieldbus.device import CameraIdentity
from ocmm_core.fieldbus.wire import make_link, remove_link, set_link, tool
from ocmm_sim.bus import READY

HOST, NEAR, FAR, CAMERAS = "host0", "near0", "far0", "cameras0"
_LINE, _ROOT = "benchmarks.faulty_line", Path(__file__).resolve().parents[1]
_READY_S = 20.0
_ANSWER_S = 3.0
_STOP_S = 5.0
_ANSWER_BYTES = 1 << 18
_POLL_S = 0.002

Answer = TypeVar("Answer")


class FaultRig:
    """The whole wire with fault injection; a context manager.

    ``present``: cameras created, default `expected`; ``unplugged``: not on the wire at first.
    """

    def __init__(
        self,
        folder: Path,
        expected: Sequence[CameraIdentity],
        present: Sequence[CameraIdentity] = (),
        unplugged: Sequence[int] = (),
        seed: int = 0,
    ) -> None:
        self._folder = folder
        self._expected = tuple(expected)
        self._present = tuple(present) or self._expected
        self._unplugged = tuple(unplugged)
        self._seed = seed
        self._switched_on = 0
        self._children: dict[str, subprocess.Popen[bytes]] = {}
        self._ask = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._ask.bind(str(folder / "asker"))
        self._ask.settimeout(_ANSWER_S)
        self.bus: BusProcess | None = None
        self.ring: FrameRing | None = None
        """`bus`, `ring`: bus process as in the application; None before `start_bus`."""

    def __enter__(self) -> FaultRig:
        """Create cables, proxy and cameras."""
        try:
            make_link(HOST, NEAR)
            make_link(FAR, CAMERAS)
            self.start_cameras()
            proxy = ProxyConfig(
                master_side=NEAR, camera_side=FAR, control=self._path("proxy"), seed=self._seed
            )
            self._start("proxy", _LINE, msgspec.json.encode(proxy) + b"\n")
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        """End all processes and remove the cables."""
        self.stop_bus()
        for child in self._children.values():
            if child.stdin is not None:
                child.stdin.close()
        for child in self._children.values():
            try:
                child.wait(_STOP_S)
            except subprocess.TimeoutExpired:
                child.kill()
                child.wait()
            if child.stdout is not None:
                child.stdout.close()
        self._children.clear()
        self._ask.close()
        for cable in (HOST, FAR):
            remove_link(cable)

    def start_cameras(self) -> None:
        """Start the cameras, each power-on with the next boot counter."""
        segment = FaultySegment(
            interface=CAMERAS,
            cameras=self._present,
            provider=CLOCK,
            control=self._path("cameras"),
            switched_on=self._switched_on,
        )
        self._switched_on += 1
        self._start("cameras", MODULE, segment.to_json())
        for number in self._unplugged:
            self.command(FaultKind.UNPLUG, number)

    def kill_cameras(self) -> None:
        """Kill the process of all cameras."""
        child = self._children.pop("cameras")
        child.kill()
        child.wait()
        for stream in (child.stdin, child.stdout):
            if stream is not None:
                stream.close()

    def start_bus(self) -> None:
        """Start the bus process and wait for operation; raise BusError if it fails."""
        self.ring = ring = FrameRing.create(len(self._expected))
        config = BusConfig(interface=HOST, ring_path=str(ring.path), cameras=self._expected)
        self.bus = BusProcess(config, ring)
        self.bus.start()
        deadline = time.monotonic() + _READY_S
        while not ring.books.frames:
            state = AcquisitionState(ring.word(RingHeaderField.STATE))
            if state is AcquisitionState.STOPPED or time.monotonic() > deadline:
                raise BusError("rig.bus", f"No frames: {read_status(ring)}.", "See its message.")
            time.sleep(_POLL_S)

    def stop_bus(self) -> bool:
        """Stop the bus process; return whether it ended in time."""
        in_time = True
        if self.bus is not None:
            self.bus.request_stop()
            in_time = self.bus.join(_STOP_S)
            self.bus = None
        if self.ring is not None:
            self.ring.close()
            self.ring = None
        return in_time

    def command(self, do: FaultKind, camera: int = 0, value: int = 0, code: int = 0) -> DeedAnswer:
        """Inject a fault into a camera and return the result."""
        asked = CameraDeed(do=do, camera=camera, value=value, code=code)
        answer = self._control("cameras", asked, DeedAnswer)
        if answer.error:
            raise BusError("rig.deed", f"'{do}' was not done: {answer.error}.", "Correct it.")
        return answer

    def line(self, *rules: LineRule, new_log: bool = False) -> LineLog:
        """Set the rules of the cable (none: intact); return the log so far."""
        return self._control("proxy", LineOrder(rules=rules, new_log=new_log), LineLog)

    def line_log(self, *, new_log: bool = False) -> LineLog:
        """Return the log of the cable so far."""
        return self._control("proxy", LineOrder(new_log=new_log), LineLog)

    def link(self, name: str, *, up: bool) -> int:
        """Set an interface up or down; return the time of the change."""
        set_link(name, up=up)
        return time.monotonic_ns()

    def delete_near_cable(self) -> int:
        """Remove the interface of the bus process; return the time of removal."""
        remover = subprocess.Popen([tool("ip"), "link", "delete", HOST])  # noqa: S603 - a fixed tool and name, no shell
        gone_ns = 0
        # The tool starts and ends slower than a bus cycle.
        while remover.poll() is None and not gone_ns:
            if HOST not in {name for _, name in socket.if_nameindex()}:
                gone_ns = time.monotonic_ns()
        if remover.wait():
            raise BusError("rig.ip", f"Interface '{HOST}' was not removed.", "Correct it.")
        return gone_ns or time.monotonic_ns()

    def make_near_cable(self) -> int:
        """Recreate the interface of the bus process; return the time."""
        make_link(HOST, NEAR)
        return time.monotonic_ns()

    def stall_bus(self, seconds: float) -> int:
        """Suspend the bus process; return the time of resumption."""
        if self.bus is None or self.bus.pid is None:
            raise BusError("rig.bus", "The bus process is not there.", "Start it.")
        os.kill(self.bus.pid, signal.SIGSTOP)
        time.sleep(seconds)
        os.kill(self.bus.pid, signal.SIGCONT)
        return time.monotonic_ns()

    def _control(self, who: str, message: msgspec.Struct, kind: type[Answer]) -> Answer:
        self._ask.sendto(msgspec.json.encode(message), self._path(who))
        return msgspec.json.decode(self._ask.recv(_ANSWER_BYTES), type=kind)

    def _path(self, who: str) -> str:
        return str(self._folder / who)

    def _start(self, name: str, module: str, first_line: bytes) -> None:
        child = self._children[name] = subprocess.Popen(  # noqa: S603 - our own interpreter and modules, no shell
            [sys.executable, "-m", module], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            env=os.environ | {"PYTHONPATH": str(_ROOT)},
        )  # fmt: skip
        if child.stdin is None or child.stdout is None:
            raise OSError("no pipe to a child process")
        child.stdin.write(first_line)
        child.stdin.flush()
        ready, _, _ = select.select([child.stdout], [], [], _READY_S)
        if not ready or child.stdout.readline().strip() != READY.encode():
            raise BusError("rig.start", f"{module} does not start.", "See what it says.")
