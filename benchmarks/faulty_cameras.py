"""Faulty software cameras: a segment whose cameras have faults on command.

A process in place of `ocmm_sim.bus._camera_process`, with `FaultySegment` as one line on standard
input: it prints ``ready``, accepts `CameraDeed` over its control socket, and ends with its standard
input. `FaultyBus` is `VirtualBus` with these cameras.
"""

from __future__ import annotations

import socket
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from unittest.mock import patch

import msgspec
import numpy as np

from benchmarks.camera_faults import CameraDeed, DeedAnswer, FaultCommands
from benchmarks.clock_pattern import ClockPattern, ClockUnit
from ocmm_core.acquisition import bus_process
from ocmm_core.acquisition.frames import FrameRing
from ocmm_core.fieldbus.wire import CAMERA_INTERFACE, HOST_INTERFACE, make_link
from ocmm_sim.bus import (
    READY,
    Chain,
    SegmentConfig,
    SteppedCameraTime,
    Unit,
    VirtualWire,
    Wire,
    input_ended,
    make_provider,
    make_units,
    run_both,
    run_inside,
)
from ocmm_sim.slave import OP

MODULE = "benchmarks.faulty_cameras"
CLOCK = msgspec.Raw(b'{"pattern":"clock"}')
"""Provider of a segment whose cameras show a `ClockPattern`."""
_ORDERS = "orders"
_DEED_BYTES = 4096


class FaultySegment(SegmentConfig, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Software cameras with faults; ``provider`` may also be `CLOCK`."""

    drop: float = 0.0
    """Fraction of answers lost in operation, 0 to 1."""
    seed: int = 0
    control: str = ""
    """Unix datagram socket for `CameraDeed` as JSON, answered by `DeedAnswer`; empty: none."""


class FaultyWire(Wire):
    """Wire that loses answers in operation, and executes the commands of a control socket."""

    def __init__(
        self,
        interface: str,
        chain: Chain,
        second_interface: str = "",
        ring_path: str = "",
        *,
        drop: float = 0.0,
        seed: int = 0,
        control: str = "",
    ) -> None:
        self._drop, self._random = drop, np.random.default_rng(seed)
        self._deeds = FaultCommands(chain)
        self._control: socket.socket | None = None
        self._control_path = Path(control)
        time_of_ring = SteppedCameraTime(ring_path) if ring_path else None
        super().__init__(interface, chain, second_interface, time_of_ring)
        if control:
            self._control = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
            # Left by a killed process.
            self._remove_control()
            self._control.bind(control)

    def run(self, stopping: Callable[[], bool]) -> None:
        """Answer until `stopping`, polled as the commands every few ms, returns True."""

        def obeyed() -> bool:
            self._obey()
            return stopping()

        super().run(obeyed)

    def close(self) -> None:
        """Close the interfaces and the control socket."""
        super().close()
        if self._control is not None:
            self._control.close()
            self._remove_control()

    def _remove_control(self) -> None:
        """Remove the name of the socket; any other file of that name stays."""
        if self._control_path.is_socket():
            self._control_path.unlink(missing_ok=True)

    def _work_on(self, frame: bytearray, number: int, now_ns: int) -> int | None:
        leaves = super()._work_on(frame, number, now_ns)
        return None if leaves is None or self._lose() else leaves

    def _lose(self) -> bool:
        if not self._drop:
            return False
        if any(unit.slave.esc.state != OP for unit in self.chain.units):
            return False
        return bool(self._random.random() < self._drop)

    def _obey(self) -> None:
        """Execute the commands of the control socket."""
        while self._control is not None:
            try:
                content, sender = self._control.recvfrom(_DEED_BYTES)
            except BlockingIOError:
                return
            try:
                answer = self._deeds.do(
                    msgspec.json.decode(content, type=CameraDeed), self._time.now_ns()
                )
            except msgspec.DecodeError as error:
                answer = DeedAnswer(
                    monotonic_ns=time.monotonic_ns(), utc_ns=time.time_ns(), error=str(error)
                )
            if sender:
                self._control.sendto(msgspec.json.encode(answer), sender)


def make_faulty_wire(config: FaultySegment) -> FaultyWire:
    """Return the segment of `config`, warmed up."""
    text = bytes(config.provider)
    provider = ClockPattern() if text == bytes(CLOCK) else make_provider(text)
    kind = ClockUnit if isinstance(provider, ClockPattern) else Unit
    units = make_units(config, provider, kind)
    return FaultyWire(
        config.interface,
        Chain(units, ends=2 if config.second_interface else 1),
        config.second_interface,
        config.ring_path,
        drop=config.drop,
        seed=config.seed,
        control=config.control,
    )


class FaultyBus(VirtualWire):
    """Virtual bus with `FaultySegment`; see `VirtualBus`."""

    def __init__(
        self,
        bus: bus_process.BusConfig,
        segment: SegmentConfig,
        ring: FrameRing,
        *,
        drop: float = 0.0,
        control: str = "",
    ) -> None:
        fields = {one: getattr(segment, one) for one in segment.__struct_fields__}
        fields |= {"interface": CAMERA_INTERFACE, "ring_path": str(ring.path)}
        cameras = FaultySegment(**fields, drop=drop, control=control)
        master = msgspec.structs.replace(bus, interface=HOST_INTERFACE, stretched=True)
        super().__init__(MODULE, cameras.to_json() + master.to_json(), ring)


@contextmanager
def faulty_stations(control: str) -> Iterator[None]:
    """Give stations that are built meanwhile faulty cameras on the virtual wire."""
    bus = partial(FaultyBus, control=control)
    with patch("ocmm_sim.sources._feed_makers.VirtualBus", bus):
        yield


def main() -> None:
    """Run the faulty cameras: on an interface, or in the namespace of a `FaultyBus`."""
    if sys.argv[1:2] == [_ORDERS]:
        run_inside(_run_virtual)
    config = msgspec.json.decode(sys.stdin.buffer.readline(), type=FaultySegment)
    wire = make_faulty_wire(config)
    bus_process.take_priority(bus_process.CAMERA_PRIORITY)
    try:
        sys.stdout.write(f"{READY}\n")
        sys.stdout.flush()
        wire.run(input_ended)
    finally:
        wire.close()


def _run_virtual() -> int:
    content = bus_process.read_first_line(sys.stdin.fileno())
    config = msgspec.json.decode(content, type=FaultySegment)
    make_link(HOST_INTERFACE, config.interface)
    wire = make_faulty_wire(config)

    def serve(ended: Callable[[], bool]) -> None:
        # After starting the bus process, which sets its own priority.
        bus_process.take_priority(bus_process.CAMERA_PRIORITY)
        wire.run(ended)

    try:
        return run_both(bus_process.bus_command(), wire.chain.units[0].provider, serve)
    finally:
        wire.close()


if __name__ == "__main__":
    main()
