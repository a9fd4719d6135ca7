"""The whole wire without hardware and without root.

A private user and network namespace holds a virtual cable with software cameras on one end and the
bus process on the other. It is isolated from this computer's network and ends with the process that
started it: the kernel removes namespace and cable with the last process inside.
"""

from __future__ import annotations

import contextlib
import math
import select
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, NoReturn

import msgspec

from ocmm_core.acquisition import bus_process
from ocmm_core.acquisition.frames import FrameRing
from ocmm_core.errors import OcmmError
from ocmm_core.fieldbus.wire import (
    CAMERA_INTERFACE,
    HOST_INTERFACE,
    make_link,
    namespace_command,
    tool,
)
from ocmm_sim.bus._camera_process import SegmentConfig, make_wire

if TYPE_CHECKING:
    from ocmm_sim.scene import Missing

_MODULE = "ocmm_sim.bus._virtual_bus"
_ERRAND, _ORDERS = "errand", "orders"
_STOP_S = 2.0
_FAREWELL_S = 10.0
"""Time for a stopping bus process to release its cameras."""
_AHEAD, _PATIENCE_S = 8, 2.0
"""Frames ahead of those that are joined, and of those that the station reads; longest wait."""


class VirtualWire(bus_process.ChildProcess):
    """Software cameras and what reads them in a private namespace, as an `Acquisition`.

    `module` is the program that runs both, see `run_both`; `lines` are its standard input.
    """

    def __init__(self, module: str, lines: bytes, ring: FrameRing) -> None:
        self._orders: socket.socket | None = None
        super().__init__([sys.executable, "-m", module], lines, ring)

    def start(self) -> None:
        """Start both ends; BusError if namespaces are forbidden or a tool is missing."""
        tool("ip")
        self._orders, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._orders.setblocking(False)
        with theirs:
            self._inherited = (theirs.fileno(),)
            self._command = [*namespace_command(), *self._command, _ORDERS, str(theirs.fileno())]
            super().start()

    def touch_again(self, missing: Missing, after_frame: int) -> None:
        """Let the scripted operator make touches after a frame not exposed yet."""
        if self._orders is not None:
            # Cameras that have ended are reported by the bus.
            with contextlib.suppress(OSError):
                self._orders.send(msgspec.json.encode((missing, after_frame)))

    def join(self, timeout_s: float) -> bool:
        if self._orders is not None:
            self._orders.close()
        return super().join(timeout_s)


class VirtualBus(VirtualWire):
    """Software cameras and bus process.

    Interfaces of the configurations are filled in; ``ring`` is the one named in ``bus``.
    """

    def __init__(self, bus: bus_process.BusConfig, segment: SegmentConfig, ring: FrameRing) -> None:
        cameras = msgspec.structs.replace(
            segment, interface=CAMERA_INTERFACE, ring_path=str(ring.path)
        )
        master = msgspec.structs.replace(bus, interface=HOST_INTERFACE, stretched=True)
        super().__init__(_MODULE, cameras.to_json() + master.to_json(), ring)


def errand_virtual(
    segment: SegmentConfig, errand: bus_process.WireErrand
) -> tuple[list[str], bytes]:
    """Return the command of a task on the virtual wire, and its input."""
    cameras = msgspec.structs.replace(segment, interface=CAMERA_INTERFACE)
    told = msgspec.structs.replace(errand, interface=HOST_INTERFACE)
    command = [*namespace_command(), sys.executable, "-m", _MODULE, _ERRAND, errand.module]
    return command, cameras.to_json() + told.to_json()


def main() -> None:
    """Inside the namespace: create the cable, start the bus command, run the cameras."""
    run_inside(_run)


def run_inside(run: Callable[[], int]) -> NoReturn:
    """End the program inside a namespace with the code of ``run``, or with an error's sentence."""
    try:
        sys.exit(run())
    except OcmmError as error:
        sys.stderr.write(f"{error}\n")
        sys.exit(2)


def _run() -> int:
    command = bus_process.bus_command()
    if sys.argv[1:2] == [_ERRAND]:
        command = [*command[:-1], sys.argv[2]]
    content = bus_process.read_first_line(sys.stdin.fileno())
    config = msgspec.json.decode(content, type=SegmentConfig)
    make_link(HOST_INTERFACE, config.interface)
    wire = make_wire(config)

    def serve(ended: Callable[[], bool]) -> None:
        # After starting the bus process, which sets its own priority.
        bus_process.take_priority(bus_process.CAMERA_PRIORITY)
        wire.run(ended)

    try:
        return run_both(command, wire.chain.units[0].provider, serve)
    finally:
        wire.close()


def run_both(
    command: Sequence[str], provider: object, serve: Callable[[Callable[[], bool]], None]
) -> int:
    """Start the reader, run the cameras until it has ended; return its exit code.

    `command`: of the reader, which inherits the standard streams. `provider`: the rig in view of
    the cameras, for touches of `VirtualWire.touch_again`. `serve` runs the cameras until its
    argument returns True.
    """
    orders = socket.socket(fileno=int(sys.argv[2])) if sys.argv[1:2] == [_ORDERS] else None
    # Standard input, from its second line on, and the other streams belong to the bus process.
    bus = subprocess.Popen(command)  # noqa: S603 - our own interpreter and modules, no shell
    parent = select.poll()
    parent.register(sys.stdin.fileno(), 0)
    deadline = math.inf

    def ended() -> bool:
        # End of its input, detected without reading, stops the bus process. The cameras keep
        # answering until it has released them.
        nonlocal deadline
        if deadline == math.inf and parent.poll(0):
            deadline = time.monotonic() + _FAREWELL_S
        if orders is not None:
            _obey(orders, provider)
        return bus.poll() is not None or time.monotonic() > deadline

    try:
        serve(ended)
    finally:
        try:
            code = bus.wait(_STOP_S)
        except subprocess.TimeoutExpired:
            bus.kill()
            code = bus.wait()
    return code


def paced(ring: FrameRing, ended: Callable[[], bool], ready: Callable[[], bool]) -> Iterator[int]:
    """Yield the numbers of the frames to send, a few ahead of their reader and of the station.

    Of a station far behind, the scripted operator learns only after the script that a touch is
    missing.
    """
    frame = missing = 0
    sent_s = time.monotonic()
    while not ended():
        books = ring.books
        ahead = frame - missing - books.frames - books.frames_lost
        unread = ring.capacity - ring.free()
        waits = max(ahead, unread) > _AHEAD and time.monotonic() - sent_s < _PATIENCE_S
        if waits or not ready():
            time.sleep(1e-3)
            continue
        # Frames before the first one that arrived are in no account.
        missing += max(0, ahead - _AHEAD)
        sent_s = time.monotonic()
        yield frame
        frame += 1


def _obey(orders: socket.socket, provider: object) -> None:
    """Give the operator in view of the cameras the touches of `VirtualWire.touch_again`."""
    try:
        content = orders.recv(1 << 16, socket.MSG_DONTWAIT)
    except OSError:
        return
    from ocmm_sim.scene import Missing, PixelFrames, VirtualRig

    missing, after_frame = msgspec.json.decode(content, type=tuple[Missing, int])
    rig = provider.rig if isinstance(provider, PixelFrames) else provider
    if isinstance(rig, VirtualRig):
        rig.complete(missing, after_frame)


if __name__ == "__main__":
    main()
