"""A fence around pysoem, the EtherCAT master, and the only module that imports it.

pysoem does not check the size of the process image, the length of outputs or the interface
name, leaves a socket open after a failed open, and waits 8 ms for an answer whatever it is asked
(measured). Everything that could go wrong that way is checked here or by the modules beside it.
One thread owns a master from open to close.
"""

from __future__ import annotations

import contextlib
import os
import select
import socket
import struct
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import pysoem

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.camera_objects import IDENTITY, IDENTITY_SERIAL
from ocmm_core.fieldbus.camera_slave import INPUT_DTYPE, OUTPUT_STRUCT
from ocmm_core.fieldbus.identity import FoundDevice
from ocmm_core.fieldbus.mapping import check_room
from ocmm_core.fieldbus.sockets import drain, listen, packet_sockets

INIT: int = pysoem.INIT_STATE
PREOP: int = pysoem.PREOP_STATE
SAFEOP: int = pysoem.SAFEOP_STATE
OP: int = pysoem.OP_STATE
STATE_NAMES = {INIT: "INIT", PREOP: "PREOP", SAFEOP: "SAFEOP", OP: "OP"}

_SDO_TIMEOUT_US = 300_000
_STATE_TIMEOUT_S = 3.0
_STATE_POLL_S = 0.002
_SETTLE_US = 300
_ALIAS_REGISTER = 0x0012
_TRIES = 3
_OBJECT_BYTES = 512

_CALL_ERRORS = (
    pysoem.WkcError,
    pysoem.MailboxError,
    pysoem.PacketError,
    pysoem.SdoError,
    AssertionError,  # pysoem asserts on its shared error list instead of raising
)


@dataclass(frozen=True, slots=True)
class DeviceState:
    """AL state of a device, whether its error bit is set, and its status code."""

    state: int
    error: bool
    code: int


class Master:
    """One open EtherCAT master; devices are named by their position on the wire, 0 first.

    Parameters
    ----------
    interface
        A network interface that `check_interface` accepted.

    Raises
    ------
    BusError
        It cannot be opened.
    """

    def __init__(self, interface: str) -> None:
        self._interface = interface
        self._devices: list[Any] = []
        self._own: socket.socket | None = None
        self._monitor: socket.socket | None = None
        self._answers = 0
        before = packet_sockets()
        self._master = pysoem.Master()
        self._master.always_release_gil = True
        self._master.sdo_read_timeout = self._master.sdo_write_timeout = _SDO_TIMEOUT_US
        try:
            try:
                self._master.open(interface)
            except ConnectionError as error:
                raise BusError(
                    "bus.unusable",
                    f"Interface '{interface}' cannot be opened for EtherCAT.",
                    "Check the adapter, its driver and that no other master uses it.",
                ) from error
            opened = packet_sockets() - before
            if len(opened) != 1:
                raise BusError(
                    "bus.socket",
                    "The socket of the EtherCAT master was not found.",
                    "Install the version of pysoem that this program names.",
                )
            self._own = socket.socket(fileno=os.dup(opened.pop()))
            self._monitor = listen(interface)
        except BaseException:
            self.close()
            raise

    @property
    def clock_ns(self) -> int:
        """Return the bus clock as of the last answer, ns."""
        return int(self._master.dc_time)

    @property
    def expected_working_counter(self) -> int:
        """Return the working counter of a cycle in which every device took part."""
        return int(self._master.expected_wkc)

    def scan(self) -> list[FoundDevice]:
        """Find the devices, bring them to PREOP and return what they say they are."""
        if self._master.config_init(False, release_gil=True) <= 0:
            raise BusError(
                "bus.no_cameras",
                f"No camera answers on interface '{self._interface}'.",
                "Check the cable and that the cameras are switched on.",
            )
        self._devices = list(self._master.slaves)
        check_room(len(self._devices))
        self.reach(PREOP)
        return [self._identify(position) for position in range(len(self._devices))]

    def read_object(
        self, position: int, name: str, index: int, sub: int, room: int = _OBJECT_BYTES
    ) -> bytes:
        """Return a value of a device's object dictionary.

        Parameters
        ----------
        position, name
            Which device, and what to call it in messages.
        index, sub
            Which value.
        room
            How many bytes it has at most.
        """
        device = self._devices[position]
        return _call(lambda: bytes(device.sdo_read(index, sub, room)), name, f"object {index:#06x}")

    def write_object(self, position: int, name: str, index: int, sub: int, value: bytes) -> None:
        """Change a value of a device's object dictionary; ``name`` is for messages."""
        device = self._devices[position]

        def write() -> bytes:
            device.sdo_write(index, sub, value)
            return b""

        _call(write, name, f"object {index:#06x}")

    def read_register(self, position: int, name: str, address: int, length: int) -> bytes:
        """Return registers of a device's controller; ``name`` is for messages."""
        device = self._devices[position]
        return _call(
            lambda: bytes(device._fprd(address, length)),  # noqa: SLF001 - pysoem has no other register access
            name,
            f"register {address:#06x}",
        )

    def write_register(self, position: int, name: str, address: int, value: bytes) -> None:
        """Change registers of a device's controller; ``name`` is for messages."""
        device = self._devices[position]

        def write() -> bytes:
            device._fpwr(address, value)  # noqa: SLF001 - pysoem has no other register access
            return b""

        _call(write, name, f"register {address:#06x}")

    def map(self) -> None:
        """Lay out the process data and measure the delays of the distributed clocks."""
        self._master.manual_state_change = 1
        try:
            self._master.config_map()
        except pysoem.ConfigMapError as error:
            raise BusError(
                "bus.map",
                "The process data of the cameras could not be mapped.",
                "Switch the cameras off and on and start again.",
            ) from error
        sizes = {(len(device.input), len(device.output)) for device in self._devices}
        if sizes != {(INPUT_DTYPE.itemsize, OUTPUT_STRUCT.size)}:
            raise BusError(
                "bus.map",
                f"The process data of the cameras could not be mapped completely: {sizes}.",
                "Check the cables of the cameras and start again.",
            )
        if not self._master.config_dc():
            raise BusError(
                "bus.clock",
                "The cameras have no distributed clock.",
                "Check that all devices on the bus are cameras of this kind.",
            )

    def request(self, state: int) -> None:
        """Ask all devices for a state."""
        self._master.state = state
        self._master.write_state()

    def reach(self, state: int, meanwhile: Callable[[], object] = lambda: None) -> None:
        """Wait until all devices are in a state; pysoem's own wait would hold the GIL."""
        deadline = time.monotonic() + _STATE_TIMEOUT_S
        while self._master.read_state() != state:
            meanwhile()
            if time.monotonic() > deadline:
                raise BusError(
                    "bus.state",
                    self._stuck(state),
                    "Switch the cameras off and on; if that does not help, call the service.",
                )
            time.sleep(_STATE_POLL_S)

    def states(self) -> list[DeviceState]:
        """Return the state of every device, 0 where it did not answer."""
        with self._patience():
            self._master.read_state()
        return [
            DeviceState(device.state & 0x0F, bool(device.state & 0x10), device.al_status)
            for device in self._devices
        ]

    def lift(self, position: int, now: DeviceState) -> None:
        """Bring a device that fell back to SAFEOP one step nearer to OP."""
        device = self._devices[position]
        device.state = SAFEOP + pysoem.STATE_ACK if now.error else OP
        with self._patience():
            device.write_state()

    def first_cycle(self) -> None:
        """Exchange process data once, patiently, and from then on wait exactly as told.

        While it configures, pysoem relies on waiting longer than it says; after that its socket
        must not block.
        """
        drain(self._monitor)
        self._master.send_processdata()
        self._master.receive_processdata(10_000)
        self._answers = max(1, drain(self._monitor))
        self._set_blocking(blocking=False)

    def pump_clock(self) -> None:
        """Pass the reference time on once, without a look at what comes back."""
        self._master.send_processdata()
        self._master.receive_processdata(2000)

    def set_output(self, position: int, content: bytes) -> None:
        """Set what a device gets in the next cycle."""
        if len(content) != OUTPUT_STRUCT.size:
            raise BusError(
                "bus.output",
                f"Outputs of {len(content)} bytes do not fit.",
                "Report this as a fault of the program.",
            )
        self._devices[position].output = content

    def inputs(self, positions: Sequence[int]) -> tuple[bytes, ...]:
        """Return what the devices sent in the last cycle."""
        return tuple(self._devices[position].input for position in positions)

    def cycle(self, timeout_ns: int) -> int:
        """Exchange process data; return the working counter, or less than 1 where answers miss.

        A cycle of several Ethernet frames is waited for on a socket of our own that sees the same
        answers: pysoem would spin for the second one and take the processor from the others.
        """
        deadline = time.monotonic_ns() + timeout_ns
        drain(self._monitor)
        drain(self._own)
        if self._master.send_processdata() <= 0 or self._monitor is None:
            return 0
        missing = self._answers
        while missing > 0:
            rest = deadline - time.monotonic_ns()
            ready, _, _ = select.select([self._monitor], [], [], max(0.0, rest * 1e-9))
            if not ready:
                break
            missing -= drain(self._monitor)
        # Also without an answer, because pysoem frees its buffers here.
        counter: int = self._master.receive_processdata(_SETTLE_US if missing <= 0 else 0)
        return counter if missing <= 0 else 0

    def close(self) -> None:
        """Leave the devices in INIT and give the interface back; may be called twice."""
        for channel in (self._own, self._monitor):
            if channel is not None:
                channel.close()
        self._own = self._monitor = None
        with contextlib.suppress(pysoem.NetworkInterfaceNotOpenError):
            if self._devices:
                self.request(INIT)
        self._devices = []
        # Needed after a failed open as well: the socket stays open otherwise.
        self._master.close()

    @contextlib.contextmanager
    def _patience(self) -> Iterator[None]:
        """Let pysoem sleep while it waits.

        On a socket that does not block it spins; a bus process with real-time priority then keeps
        the processor from whoever should answer.
        """
        # pysoem tells answers apart by 16 numbers only; one that came late must not be taken.
        drain(self._own)
        self._set_blocking(blocking=True)
        try:
            yield
        finally:
            self._set_blocking(blocking=False)

    def _set_blocking(self, *, blocking: bool) -> None:
        if self._own is not None:
            # Only the flag of the open file, which pysoem's own descriptor shares.
            os.set_blocking(self._own.fileno(), blocking)

    def _identify(self, position: int) -> FoundDevice:
        device = self._devices[position]
        serial: int | None = None
        with contextlib.suppress(*_CALL_ERRORS):
            serial = struct.unpack("<I", device.sdo_read(IDENTITY, IDENTITY_SERIAL))[0]
        alias = self.read_register(position, f"at position {position + 1}", _ALIAS_REGISTER, 2)
        return FoundDevice(
            device.man, device.id, device.rev, serial, int.from_bytes(alias, "little")
        )

    def _stuck(self, state: int) -> str:
        for position, device in enumerate(self._devices, start=1):
            if device.state != state:
                why = pysoem.al_status_code_to_string(device.al_status)
                return (
                    f"The camera at position {position} of the bus does not reach the state "
                    f"{STATE_NAMES[state]} (AL status {device.al_status:#06x}: {why})."
                )
        return f"The cameras do not reach the state {STATE_NAMES[state]}."


def _call(action: Callable[[], bytes], name: str, what: str) -> bytes:
    """Try again what a lost frame may have spoiled; then say which camera did not answer."""
    for attempt in range(_TRIES):
        try:
            return action()
        except pysoem.SdoError as error:
            raise BusError(
                "bus.refused",
                f"Camera {name} refuses {what} (abort code {error.abort_code:#010x}: "
                f"{error.desc}).",
                "Install the firmware of the camera that belongs to this program.",
            ) from error
        except _CALL_ERRORS as error:
            if attempt == _TRIES - 1:
                raise BusError(
                    "bus.no_answer",
                    f"Camera {name} does not answer as it should ({what}).",
                    "Check its cable; switch the camera off and on.",
                ) from error
    raise AssertionError("the last try returns or raises")
