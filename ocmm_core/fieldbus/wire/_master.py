"""Wrapper of pysoem, the EtherCAT master; the only module that imports it.

pysoem does not check the size of the process image, the length of outputs or the interface name,
leaves a socket open after a failed open, and waits 8 ms for an answer whatever timeout is set
(measured). These cases are checked here or in sibling modules. One thread owns an open master.
"""

from __future__ import annotations

import contextlib
import os
import socket
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from ocmm_core.errors import BusError
from ocmm_core.fieldbus import device
from ocmm_core.fieldbus.wire._datagrams import Command, Datagram
from ocmm_core.fieldbus.wire._interface import refuse_other_programs, require_pysoem
from ocmm_core.fieldbus.wire._object_calls import ObjectCalls, check_room, fuse, set_blocking
from ocmm_core.fieldbus.wire._port import HostTime, Passage, Port
from ocmm_core.fieldbus.wire._scan import stored_serial
from ocmm_core.fieldbus.wire._service import Job, ServiceChannel
from ocmm_core.fieldbus.wire._sockets import drain, packet_sockets, receive_only
from ocmm_core.fieldbus.wire._tally import N_INDICES, OWN_TOKEN
from ocmm_core.host import HOST

if HOST.is_linux_like:
    # Other systems need a network driver that is normally absent.
    require_pysoem()
    import pysoem

# ETG.1000.6, 6.4.1.
INIT, PREOP, SAFEOP, OP = 1, 2, 4, 8
STATE_NAMES = {INIT: "INIT", PREOP: "PREOP", SAFEOP: "SAFEOP", OP: "OP"}

_RET_US, _SDO_TIMEOUT_US, _STATE_US = 2000, 80_000, 100_000
_STATE_TIMEOUT_S, _STATE_POLL_S = 1.0, 0.002
_SETTLE_US, _SETTLE_RING_US, _SETTLE_LINE_US, _SETTLE_STRETCHED_US = 300, 400, 60, 50_000
_STATION_REGISTER, _ALIAS_REGISTER, _AL_CONTROL = 0x0010, 0x0012, 0x0120
_FIRST_STATION = 0x1001
"""Station address that pysoem gives the first device; the others follow."""
_TRIES, _OBJECT_BYTES, _SERIAL_BYTES = 2, 512, 4
_DEVICE_TYPE = 0x1000
"""ETG.1000.6; mandatory in every device, read only to get an answer."""
_LATE_ANSWER_S = 0.02

# pysoem asserts on its shared error list instead of raising
_CALL_ERRORS: tuple[type[Exception], ...] = (AssertionError,)
if HOST.is_linux_like:
    _CALL_ERRORS += (pysoem.WkcError, pysoem.MailboxError, pysoem.PacketError, pysoem.SdoError)


class Master:
    """An open EtherCAT master; devices are numbered by wire position, 0 first.

    ``sizes``: bytes of inputs and outputs of each camera; ``token``: position of the cycle number
    in its outputs, see `Port`. BusError if it cannot be opened.
    """

    def __init__(
        self,
        interface: str,
        redundant: str = "",
        host_time: HostTime | None = None,
        sizes: tuple[int, int] = (device.INPUT_DTYPE.itemsize, device.OUTPUT_STRUCT.size),
        token: tuple[int, int] = OWN_TOKEN,
    ) -> None:
        self._sizes = sizes
        self._time = host_time or HostTime()
        self._interface = interface
        self._devices: list[Any] = []
        self._own: list[socket.socket] = []
        self._port: Port | None = None
        interfaces = [interface, redundant] if redundant else [interface]
        _shorten_pysoem_timeouts(self._time.patience)
        before = packet_sockets()
        self._master = pysoem.Master()
        self._master.always_release_gil = True
        patient_us = self._time.patience * _SDO_TIMEOUT_US
        self._master.sdo_read_timeout = self._master.sdo_write_timeout = patient_us
        self._calls = ObjectCalls(
            lambda position: self._devices[position].sdo_read(_DEVICE_TYPE, 0),
            _CALL_ERRORS,
            self._time.patience * _LATE_ANSWER_S,
        )
        try:
            try:
                self._master.open(*interfaces)
            except ConnectionError as error:
                raise BusError(
                    "bus.unusable",
                    f"Interface '{' or '.join(interfaces)}' cannot be opened for EtherCAT.",
                    "Check the adapter, its driver and that no other master uses it.",
                ) from error
            opened = packet_sockets() - before
            if len(opened) != len(interfaces):
                raise BusError(
                    "bus.socket",
                    "The socket of the EtherCAT master was not found.",
                    "Install the pysoem version required by this program.",
                )
            self._own = [socket.socket(fileno=os.dup(number)) for number in opened]
            for own in self._own:
                receive_only(own, range(N_INDICES))
            self._port = Port(interfaces, self._time, token)
            refuse_other_programs(interfaces)
        except BaseException:
            self.close()
            raise

    @property
    def port(self) -> Port:
        """Return our own raw end of the cable."""
        if self._port is None:
            raise BusError("bus.closed", "The camera bus is not open.", "Open it first.")
        return self._port

    @property
    def clock_ns(self) -> int:
        """Return the bus clock as of the last answer, ns."""
        return int(self._master.dc_time)

    @property
    def expected_working_counter(self) -> int:
        """Return the working counter of a complete cycle."""
        return int(self._master.expected_wkc)

    @property
    def n_devices(self) -> int:
        return len(self._devices)

    def find(self) -> None:
        """Find the devices, assign addresses and request PREOP."""
        if self._master.config_init(False, release_gil=True) <= 0:
            raise BusError(
                "bus.no_cameras",
                f"No camera answers on interface '{self._interface}'.",
                "Check the cable and that the cameras are switched on.",
            )
        self._devices = list(self._master.slaves)
        check_room(len(self._devices), sum(self._sizes))
        for position in range(len(self._devices)):
            target = -position & 0xFFFF
            answers = self.port.query([Datagram(Command.APRD, target, _STATION_REGISTER, bytes(2))])
            address = 0 if answers is None else int.from_bytes(answers[0].data, "little")
            if address != self.station(position):
                raise BusError(
                    "bus.duplicate_address",
                    f"The device at position {position + 1} of the bus has the station address "
                    f"{address:#06x} instead of {self.station(position):#06x}.",
                    "Power-cycle the cameras.",
                )

    def station(self, position: int) -> int:
        return _FIRST_STATION + position

    def read_object(
        self, position: int, name: str, index: int, sub: int, room: int = _OBJECT_BYTES
    ) -> bytes:
        """Return a value of a device's object dictionary."""
        slave = self._devices[position]
        return self._transfer(
            position, name, index, lambda: bytes(slave.sdo_read(index, sub, room))
        )

    def write_object(self, position: int, name: str, index: int, sub: int, value: bytes) -> None:
        """Write a value of a device's object dictionary; ``name`` is for messages."""
        slave = self._devices[position]

        def write() -> bytes:
            slave.sdo_write(index, sub, value)
            return b""

        self._transfer(position, name, index, write)

    def _transfer(self, position: int, name: str, index: int, action: Callable[[], bytes]) -> bytes:
        return self._calls.call(position, name, index, lambda: _unless_refused(action, name, index))

    def read_register(self, position: int, name: str, address: int, length: int) -> bytes:
        """Return registers of a device's controller; ``name`` is for messages."""
        question = Datagram(Command.FPRD, self.station(position), address, bytes(length))
        return self._register(question, name)

    def write_register(self, position: int, name: str, address: int, value: bytes) -> None:
        """Write registers of a device's controller; ``name`` is for messages."""
        self._register(Datagram(Command.FPWR, self.station(position), address, value), name)

    def _register(self, question: Datagram, name: str) -> bytes:
        for _ in range(_TRIES):
            answers = self.port.query([question])
            if answers is not None and answers[0].working_counter == 1:
                return answers[0].data
        raise BusError(
            "bus.no_answer",
            f"Camera {name} gives an unexpected answer (register {question.register:#06x}).",
            "Check its cable; power-cycle the camera.",
        )

    def map(self, *, clocks: bool = True) -> None:
        """Lay out process data and, with `clocks`, measure distributed clock delays."""
        self._master.manual_state_change = 1
        try:
            with fuse(
                pysoem.settings.timeouts,
                self._own,
                stretched=self._time.stretched,
                ring=self.port.ring is not None,
            ):
                self._master.config_map()
        except pysoem.ConfigMapError as error:
            raise BusError(
                "bus.map",
                "The process data of the cameras could not be mapped.",
                "Power-cycle the cameras, then open the job again.",
            ) from error
        sizes = {(len(slave.input), len(slave.output)) for slave in self._devices}
        if sizes != {self._sizes}:
            raise BusError(
                "bus.map",
                f"The process data of the cameras could not be mapped completely: {sizes}.",
                "Check the cables of the cameras, then open the job again.",
            )
        if not self._master.config_dc() and clocks:
            raise BusError(
                "bus.clock",
                "The cameras have no distributed clock.",
                "Check that all devices on the bus are cameras of this kind.",
            )

    def request(self, state: int) -> None:
        self._master.state = state
        self._master.write_state()

    def steps_to(self, state: int) -> Iterator[None]:
        """Yield until all devices are in a state; raise BusError after the time limit.

        pysoem's own wait would hold the GIL.
        """
        deadline = time.monotonic() + self._time.patience * _STATE_TIMEOUT_S
        while self._master.read_state() != state:
            yield
            if time.monotonic() > deadline:
                raise BusError(
                    "bus.state",
                    self._stuck(state),
                    "Power-cycle the cameras; if that does not help, call service.",
                )
            time.sleep(_STATE_POLL_S)

    def first_cycle(self) -> None:
        """Exchange process data once, patiently; later cycles keep exact timeouts.

        pysoem relies on long waits in configuration; later its socket must not block.
        """
        service = ServiceChannel()
        self.port.collect(service)
        self._master.send_processdata()
        self._master.receive_processdata(10_000 * self._time.patience)
        self.port.tally.learn(self.port.collect(service))
        # Software cameras on a single core cannot answer while this process spins.
        set_blocking(self._own, blocking=self._time.stretched)

    def begin_cycles(self) -> None:
        """Observe timeouts exactly from now on: all devices are in operation."""
        set_blocking(self._own, blocking=False)

    def pump_clock(self) -> None:
        """Distribute the reference time once, ignoring answers."""
        self._master.send_processdata()
        self._master.receive_processdata(2000 * self._time.patience)

    def set_output(self, position: int, content: bytes) -> None:
        """Set the outputs of a device for the next cycle."""
        if len(content) != self._sizes[1]:
            raise BusError(
                "bus.output",
                f"Outputs of {len(content)} bytes do not fit.",
                "Report this as a program error.",
            )
        self._devices[position].output = content

    def inputs(self, positions: Sequence[int]) -> tuple[bytes, ...]:
        """Return the devices' inputs of the last cycle."""
        return tuple(self._devices[position].input for position in positions)

    def cycle(
        self, token: int, timeout_ns: int, service: ServiceChannel, jobs: Iterable[Job]
    ) -> Passage:
        """Exchange process data, followed directly by acyclic requests.

        Answers in several Ethernet frames are awaited on our own sockets, which see the same
        answers: pysoem would spin for the second and take the processor from other threads.
        ``token``: heartbeat in the outputs of this cycle.
        """
        port = self.port
        port.start_cycle(service, token)
        for own in self._own:
            drain(own)
        # Sent back to back, so that receivers wake up once.
        beside = service.compose(jobs)
        sent_ns = time.monotonic_ns()
        if self._master.send_processdata() <= 0:
            return Passage(0, False, False, sent_ns, sent_ns)
        port.send_service(beside)
        deadline_ns = sent_ns + timeout_ns
        if port.ring is None:
            whole, any_came, answered_ns = port.await_answers(service, deadline_ns)
            settle_us = _SETTLE_STRETCHED_US if self._time.stretched else _SETTLE_US
        else:
            # pysoem reassembles split answers and recirculates them. Frames 16 cycles old look
            # fresh to it; the cameras' counters reveal them.
            whole, any_came, answered_ns = port.await_copies(service, deadline_ns)
            settle_us = _SETTLE_RING_US if port.has_both_ends else _SETTLE_LINE_US
        # Also without an answer, because pysoem frees its buffers here.
        counter: int = self._master.receive_processdata(settle_us if whole else 0)
        # Our own sockets saw these answers: those missing in pysoem's count did arrive.
        untaken = whole and port.ring is None and counter < port.tally.working_counter
        whole = whole and not untaken
        return Passage(counter if whole else 0, whole, any_came, sent_ns, answered_ns, untaken)

    def close(self) -> None:
        """Leave the devices in INIT and release the interface; idempotent."""
        if self._port is not None:
            # Answers need not be awaited: every bring-up starts at INIT.
            if self._devices:
                content = INIT.to_bytes(2, "little")
                self._port.query([Datagram(Command.BWR, 0, _AL_CONTROL, content)])
            self._port.close()
            self._port = None
        for own in self._own:
            own.close()
        self._own = []
        self._devices = []
        # Also needed after a failed open: the socket stays open otherwise.
        with contextlib.suppress(pysoem.NetworkInterfaceNotOpenError):
            self._master.close()

    def identify(self, position: int) -> device.FoundDevice:
        """Return the identity of a device."""
        slave = self._devices[position]
        serial: int | None = None
        with contextlib.suppress(BusError):
            name = f"at position {position + 1}"
            content = self.read_object(position, name, device.IDENTITY, device.IDENTITY_SERIAL)
            if len(content) == _SERIAL_BYTES:
                serial = int.from_bytes(content, "little")
        alias = self.read_register(position, f"at position {position + 1}", _ALIAS_REGISTER, 2)
        return device.FoundDevice(
            slave.man, slave.id, slave.rev, serial, int.from_bytes(alias, "little"),
            stored_serial(self._exchange, position),
        )  # fmt: skip

    def _exchange(self, datagram: Datagram) -> Datagram:
        answers = self.port.query([datagram])
        if answers is None:
            raise BusError(
                "bus.no_answer",
                "A camera gives no answer while it is identified.",
                "Check its cable; power-cycle the camera.",
            )
        return answers[0]

    def _stuck(self, state: int) -> str:
        for position, slave in enumerate(self._devices, start=1):
            if slave.state != state:
                why = pysoem.al_status_code_to_string(slave.al_status)
                return (
                    f"The camera at position {position} of the bus does not reach the state "
                    f"{STATE_NAMES[state]} (AL status {slave.al_status:#06x}: {why})."
                )
        return f"The cameras do not reach the state {STATE_NAMES[state]}."


def _shorten_pysoem_timeouts(patience: int) -> None:
    """Limit single pysoem calls; these settings are per process."""
    pysoem.settings.timeouts.ret = patience * _RET_US
    pysoem.settings.timeouts.rx_mailbox = patience * _SDO_TIMEOUT_US
    pysoem.settings.timeouts.state = patience * _STATE_US


def al_text(code: int) -> str:
    """Return the meaning of an AL status code."""
    return str(pysoem.al_status_code_to_string(code)) if code else ""


def _unless_refused(action: Callable[[], bytes], name: str, index: int) -> bytes:
    try:
        return action()
    except pysoem.SdoError as error:
        raise BusError(
            "bus.refused",
            f"Camera {name} refuses object {index:#06x} (abort code {error.abort_code:#010x}: "
            f"{error.desc}).",
            "Install the camera firmware that matches this program.",
        ) from error
