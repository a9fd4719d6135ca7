"""The whole wire without hardware and without root.

A private user and network namespace holds a virtual cable with software cameras on one end and the
bus process on the other. It is isolated from this computer's network and ends with the process that
started it: the kernel removes namespace and cable with the last process inside.
"""

from __future__ import annotations

import contextlib
import math
import os
import select
import socket
import subprocess
import sys
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

import msgspec

from ocmm_core.acquisition.bus_process import (
    CAMERA_PRIORITY,
    BusConfig,
    ChildProcess,
    ConformConfig,
    MaintenanceConfig,
    ScanConfig,
    bus_command,
    conform_command,
    maintenance_command,
    read_first_line,
    scan_command,
    take_priority,
)
from ocmm_core.acquisition.frames import FrameRing
from ocmm_core.errors import BusError, OcmmError
from ocmm_core.host import require_linux
from ocmm_core.simulation.bus._camera_process import SegmentConfig, make_wire
from ocmm_core.simulation.bus._network import make_link, run, tool
from ocmm_core.simulation.bus._wire import Wire

if TYPE_CHECKING:
    from ocmm_core.simulation.scene import Missing

HOST_INTERFACE = "ocmm-host"
CAMERA_INTERFACE = "ocmm-cameras"
_MODULE = "ocmm_core.simulation.bus._virtual_bus"
_SCAN, _MAINTAIN, _CONFORM, _ORDERS = "scan", "maintain", "conform", "orders"
_STOP_S = 2.0
_FAREWELL_S = 10.0
"""Time for a stopping bus process to release its cameras."""
_ALTERNATIVE = (
    "Allow them (Debian, Ubuntu: sysctl kernel.unprivileged_userns_clone=1 and "
    "kernel.apparmor_restrict_unprivileged_userns=0), or run 'ocmm rig up' as root and use "
    "the source ethercat:ocmm0, or the source simulated."
)


class VirtualBus(ChildProcess):
    """Software cameras and bus process in a private namespace, as an `Acquisition`.

    Interfaces of the configurations are filled in; ``ring`` is the one named in ``bus``.
    """

    def __init__(self, bus: BusConfig, segment: SegmentConfig, ring: FrameRing) -> None:
        cameras = msgspec.structs.replace(
            segment, interface=CAMERA_INTERFACE, ring_path=str(ring.path)
        )
        self._orders: socket.socket | None = None
        master = msgspec.structs.replace(bus, interface=HOST_INTERFACE, stretched=True)
        super().__init__(
            [sys.executable, "-m", _MODULE], cameras.to_json() + master.to_json(), ring
        )

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


def namespace_command() -> list[str]:
    """Return the prefix for a private network namespace; BusError if forbidden."""
    require_linux("The virtual cable")
    unshare = tool("unshare")
    # Root keeps its right to a real-time priority outside of a user namespace.
    ways = [["-n"]] if os.geteuid() == 0 else []
    ways.append(["-r", "-n"])
    complaint: str | None = None
    for way in ways:
        complaint = run([unshare, *way, "true"])
        if complaint is None:
            return [unshare, *way]
    raise BusError(
        "bus.namespace",
        f"This system does not allow private network namespaces ({complaint}).",
        _ALTERNATIVE,
    )


def scan_virtual(segment: SegmentConfig) -> tuple[list[str], bytes]:
    """Return the command that scans virtual software cameras, and its input."""
    cameras = msgspec.structs.replace(segment, interface=CAMERA_INTERFACE)
    command = [*namespace_command(), sys.executable, "-m", _MODULE, _SCAN]
    return command, cameras.to_json() + ScanConfig(interface=HOST_INTERFACE).to_json()


def maintain_virtual(segment: SegmentConfig, config: MaintenanceConfig) -> tuple[list[str], bytes]:
    """Return the command that changes a virtual software camera, and its input."""
    cameras = msgspec.structs.replace(segment, interface=CAMERA_INTERFACE)
    command = [*namespace_command(), sys.executable, "-m", _MODULE, _MAINTAIN]
    told = msgspec.structs.replace(config, interface=HOST_INTERFACE)
    return command, cameras.to_json() + told.to_json()


def conform_virtual(segment: SegmentConfig, config: ConformConfig) -> tuple[list[str], bytes]:
    """Return the command that tests a virtual software camera, and its input."""
    # By default the first camera: the test is for one.
    serial = config.serial or segment.cameras[0].serial
    cameras = msgspec.structs.replace(segment, interface=CAMERA_INTERFACE)
    command = [*namespace_command(), sys.executable, "-m", _MODULE, _CONFORM]
    told = msgspec.structs.replace(config, interface=HOST_INTERFACE, serial=serial)
    return command, cameras.to_json() + told.to_json()


def main() -> None:
    """Inside the namespace: create the cable, start the bus command, run the cameras."""
    try:
        what = sys.argv[1] if sys.argv[1:] else ""
        errands = {_SCAN: scan_command, _MAINTAIN: maintenance_command, _CONFORM: conform_command}
        command = errands.get(what, bus_command)()
        sys.exit(_run(read_first_line(sys.stdin.fileno()), command))
    except OcmmError as error:
        sys.stderr.write(f"{error}\n")
        sys.exit(2)


def _run(content: bytes, command: Sequence[str]) -> int:
    config = msgspec.json.decode(content, type=SegmentConfig)
    make_link(HOST_INTERFACE, config.interface)
    wire = make_wire(config)
    orders = socket.socket(fileno=int(sys.argv[2])) if sys.argv[1:2] == [_ORDERS] else None
    # Standard input, from its second line on, and the other streams belong to the bus process.
    bus = subprocess.Popen(command)  # noqa: S603 - our own interpreter and modules, no shell
    # After starting the bus process, which sets its own priority.
    take_priority(CAMERA_PRIORITY)
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
            _obey(orders, wire)
        return bus.poll() is not None or time.monotonic() > deadline

    try:
        wire.run(ended)
    finally:
        wire.close()
        try:
            code = bus.wait(_STOP_S)
        except subprocess.TimeoutExpired:
            bus.kill()
            code = bus.wait()
    return code


def _obey(orders: socket.socket, wire: Wire) -> None:
    """Give the operator in view of the cameras the touches of `VirtualBus.touch_again`."""
    try:
        content = orders.recv(1 << 16, socket.MSG_DONTWAIT)
    except OSError:
        return
    from ocmm_core.simulation.scene import Missing, PixelFrames, VirtualRig

    missing, after_frame = msgspec.json.decode(content, type=tuple[Missing, int])
    provider = wire.chain.units[0].provider
    rig = provider.rig if isinstance(provider, PixelFrames) else provider
    if isinstance(rig, VirtualRig):
        rig.complete(missing, after_frame)


if __name__ == "__main__":
    main()
