"""The EtherCAT master: brings the cameras to operation and exchanges process data with them.

This is the only module that imports pysoem, and it fences in what pysoem does not check (the
reasons were measured): the interface name, the size of the process image, the length of outputs,
the socket that a failed open leaves behind, and a wait for an answer that lasts 8 ms whatever
was asked. One thread owns the bus from open to close.
"""

from __future__ import annotations

import contextlib
import os
import select
import socket
import stat
import struct
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pysoem

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.camera_objects import CONFIGURATION, IDENTITY, IDENTITY_SERIAL
from ocmm_core.fieldbus.camera_slave import (
    COUNTER_MODULUS,
    INPUT_DTYPE,
    OUTPUT_STRUCT,
    CameraConfig,
    Control,
    Header,
)
from ocmm_core.fieldbus.health import Answer, Schedule
from ocmm_core.fieldbus.identity import CameraIdentity, FoundDevice, assign
from ocmm_core.fieldbus.interface import check_interface
from ocmm_core.fieldbus.mapping import check_mapping, check_room

_STATE_TIMEOUT_S = 3.0
_STATE_POLL_S = 0.002
_STATE_CHECK_CYCLES = 16
_SDO_TIMEOUT_US = 300_000
_CLOCK_LIMIT_NS = 1000
_CLOCK_READINGS = 20
_CLOCK_TIMEOUT_S = 3.0
_LEAD_NS = 60_000_000
"""From programming the first exposure until it happens; the states change in this time."""
_CYCLE_S = 0.001

_ALIAS_REGISTER = 0x0012
_TIME_REGISTER = 0x0910
_TIME_DIFFERENCE_REGISTER = 0x092C
_SYNC_UNIT_REGISTER = 0x0980
_SYNC_ACTIVATION_REGISTER = 0x0981
_SYNC0_START_REGISTER = 0x0990
_SYNC_CYCLES_REGISTER = 0x09A0
_SYNC_BOTH = 0x07

_CALL_ERRORS = (
    pysoem.WkcError,
    pysoem.MailboxError,
    pysoem.PacketError,
    pysoem.SdoError,
    AssertionError,  # pysoem asserts on its shared error list instead of raising
)


@dataclass(frozen=True, slots=True)
class BusSettings:
    """Which cameras are expected where, and how fast they run.

    Attributes
    ----------
    interface
        Network interface of the bus.
    cameras
        Cameras of the rig, in its order.
    frame_period_ns, cycle_period_ns
        Between two exposures, and between two bus cycles.
    force
        Use the interface although the computer uses it for its network.
    """

    interface: str
    cameras: tuple[CameraIdentity, ...]
    frame_period_ns: int
    cycle_period_ns: int
    force: bool = False


@dataclass(frozen=True, slots=True)
class Exchange:
    """What one cycle brought: the answer to be judged and the raw inputs, in rig order."""

    answer: Answer
    inputs: tuple[bytes, ...]


class CameraBus:
    """The bus with its cameras.

    Parameters
    ----------
    settings
        What to open and what to find there.
    """

    def __init__(self, settings: BusSettings) -> None:
        self._settings = settings
        self._master: Any = None
        self._cameras: list[Any] = []
        self._socket: socket.socket | None = None
        self._cycles = 0
        self._operational = False
        self._schedule: Schedule | None = None

    @property
    def schedule(self) -> Schedule:
        """Return when the cameras expose; known once the bus is open."""
        if self._schedule is None:
            raise BusError("bus.closed", "The camera bus is not open.", "Open it first.")
        return self._schedule

    def open(self) -> None:
        """Find, check, configure and synchronise the cameras and bring them to operation.

        Raises
        ------
        BusError
            With the camera, the state or the object at fault, and what to do.
        """
        check_interface(self._settings.interface, force=self._settings.force)
        try:
            self._connect()
            devices = self._scan()
            order = assign([self._identify(device) for device in devices], self._settings.cameras)
            self._cameras = [devices[place] for place in order]
            crc = self._configure()
            self._map()
            self._schedule = Schedule(
                self._start_clocks(), self._settings.frame_period_ns, crc
            )
            self._to_operation()
        except BaseException:
            self.close()
            raise

    def exchange(self, next_frames: Sequence[int], timeout_ns: int) -> Exchange:
        """Send outputs, wait for the answer and return it unjudged.

        Parameters
        ----------
        next_frames
            For each camera, the exposure number of the first frame that is still wanted; all
            before it are acknowledged.
        timeout_ns
            How long to wait for the answer.

        Raises
        ------
        BusError
            A camera has left the state in which its identity is certain.
        """
        self._cycles += 1
        for camera, frame in zip(self._cameras, next_frames, strict=True):
            camera.output = OUTPUT_STRUCT.pack(
                Control.STREAM, 0, (frame - 1) % COUNTER_MODULUS, self._cycles % COUNTER_MODULUS
            )
        working_counter = self._cycle(timeout_ns)
        headers: tuple[Header, ...] = ()
        inputs: tuple[bytes, ...] = ()
        if working_counter > 0:
            inputs = tuple(camera.input for camera in self._cameras)
            headers = tuple(Header.decode(content) for content in inputs)
            if self._cycles % _STATE_CHECK_CYCLES == 0 or not self._operational:
                self._watch_states()
        return Exchange(
            Answer(
                working_counter,
                self._master.expected_wkc,
                self._operational,
                self._master.dc_time,
                headers,
            ),
            inputs,
        )

    def close(self) -> None:
        """Leave the cameras in INIT and give the interface back; may be called twice."""
        master, self._master = self._master, None
        self._cameras = []
        self._operational = False
        if self._socket is not None:
            self._socket.close()
            self._socket = None
        if master is None:
            return
        with contextlib.suppress(pysoem.NetworkInterfaceNotOpenError):
            master.state = pysoem.INIT_STATE
            master.write_state()
        # Needed after a failed open as well: the socket stays open otherwise.
        master.close()

    def _connect(self) -> None:
        before = _packet_sockets()
        master = pysoem.Master()
        master.always_release_gil = True
        master.sdo_read_timeout = master.sdo_write_timeout = _SDO_TIMEOUT_US
        self._master = master
        try:
            master.open(self._settings.interface)
        except ConnectionError as error:
            raise BusError(
                "bus.unusable",
                f"Interface '{self._settings.interface}' cannot be opened for EtherCAT.",
                "Check the adapter, its driver and that no other master uses it.",
            ) from error
        opened = _packet_sockets() - before
        if len(opened) != 1:
            raise BusError(
                "bus.socket",
                "The socket of the EtherCAT master was not found.",
                "Install the version of pysoem that this program names.",
            )
        self._socket = socket.socket(fileno=os.dup(opened.pop()))

    def _scan(self) -> list[Any]:
        if self._master.config_init(False, release_gil=True) <= 0:
            raise BusError(
                "bus.no_cameras",
                f"No camera answers on interface '{self._settings.interface}'.",
                "Check the cable and that the cameras are switched on.",
            )
        devices = list(self._master.slaves)
        check_room(len(devices))
        self._reach(pysoem.PREOP_STATE, "PREOP")
        return devices

    def _identify(self, device: Any) -> FoundDevice:  # noqa: ANN401 - pysoem has no types
        serial: int | None = None
        with contextlib.suppress(*_CALL_ERRORS):
            serial = struct.unpack("<I", device.sdo_read(IDENTITY, IDENTITY_SERIAL))[0]
        alias = int.from_bytes(self._register(device, _ALIAS_REGISTER, 2), "little")
        return FoundDevice(device.man, device.id, device.rev, serial, alias)

    def _configure(self) -> int:
        """Check the mapping, set object 0x8000, read it back; return the check sum to expect."""
        config = CameraConfig(frame_period_ns=self._settings.frame_period_ns)
        values = (
            (1, struct.pack("<I", config.frame_period_ns)),
            (2, struct.pack("<I", config.exposure_ns)),
            (3, struct.pack("<H", config.threshold)),
        )
        for camera, identity in zip(self._cameras, self._settings.cameras, strict=True):
            name = identity.name

            def read(index: int, sub: int, camera: Any = camera, name: str = name) -> bytes:  # noqa: ANN401 - pysoem has no types
                return _call(
                    lambda: bytes(camera.sdo_read(index, sub)), name, f"object {index:#06x}"
                )

            check_mapping(name, read)
            for sub, value in values:

                def write(camera: Any = camera, sub: int = sub, value: bytes = value) -> bytes:  # noqa: ANN401 - pysoem has no types
                    camera.sdo_write(CONFIGURATION, sub, value)
                    return bytes(camera.sdo_read(CONFIGURATION, sub))

                if _call(write, name, "its configuration") != value:
                    raise BusError(
                        "bus.configuration",
                        f"Camera '{name}' did not keep its configuration.",
                        "Switch the camera off and on and start again.",
                    )
        return config.crc()

    def _map(self) -> None:
        self._master.manual_state_change = 1
        try:
            self._master.config_map()
        except pysoem.ConfigMapError as error:
            raise BusError(
                "bus.map",
                "The process data of the cameras could not be mapped.",
                "Switch the cameras off and on and start again.",
            ) from error
        sizes = {(len(camera.input), len(camera.output)) for camera in self._cameras}
        if sizes != {(INPUT_DTYPE.itemsize, OUTPUT_STRUCT.size)}:
            raise BusError(
                "bus.map",
                f"The process data of the cameras have other sizes than expected: {sizes}.",
                "Install the firmware of the camera that belongs to this program.",
            )

    def _start_clocks(self) -> int:
        """Synchronise the clocks, program the same first exposure everywhere; return its time."""
        if not self._master.config_dc():
            raise BusError(
                "bus.clock",
                "The cameras have no distributed clock.",
                "Check that all devices on the bus are cameras of this kind.",
            )
        self._settle_clocks()
        period, cycle = self._settings.frame_period_ns, self._settings.cycle_period_ns
        now = struct.unpack("<Q", self._register(self._cameras[0], _TIME_REGISTER, 8))[0]
        start: int = (now + _LEAD_NS) // cycle * cycle
        for camera, identity in zip(self._cameras, self._settings.cameras, strict=True):
            for register, content in (
                (_SYNC_ACTIVATION_REGISTER, b"\x00"),
                (_SYNC_UNIT_REGISTER, b"\x00"),
                (_SYNC0_START_REGISTER, struct.pack("<Q", start)),
                (_SYNC_CYCLES_REGISTER, struct.pack("<II", period, cycle - period)),
                (_SYNC_ACTIVATION_REGISTER, bytes([_SYNC_BOTH])),
            ):
                self._set_register(camera, register, content)
            programmed = self._register(camera, _SYNC0_START_REGISTER, 8)
            if programmed != struct.pack("<Q", start):
                raise BusError(
                    "bus.clock",
                    f"Camera '{identity.name}' did not take the time of the first exposure.",
                    "Switch the camera off and on and start again.",
                )
        return start

    def _settle_clocks(self) -> None:
        """Pass the reference time on until every camera's clock follows it."""
        deadline = time.monotonic() + _CLOCK_TIMEOUT_S
        calm = 0
        while calm < _CLOCK_READINGS:
            self._master.send_processdata()
            self._master.receive_processdata(2000)
            worst_ns, worst = 0, ""
            for camera, identity in zip(self._cameras, self._settings.cameras, strict=True):
                raw = struct.unpack("<I", self._register(camera, _TIME_DIFFERENCE_REGISTER, 4))[0]
                difference = raw & 0x7FFFFFFF
                if difference > worst_ns:
                    worst_ns, worst = difference, identity.name
            calm = calm + 1 if worst_ns < _CLOCK_LIMIT_NS else 0
            if time.monotonic() > deadline:
                raise BusError(
                    "bus.clock",
                    f"The clock of camera '{worst}' does not follow the bus ({worst_ns} ns off).",
                    "Check cables and devices between the cameras; use no ordinary switch.",
                )
            time.sleep(_CYCLE_S)

    def _to_operation(self) -> None:
        self._request(pysoem.SAFEOP_STATE)
        self._reach(pysoem.SAFEOP_STATE, "SAFEOP")
        if self._socket is not None:
            # Only now: while it configures, pysoem relies on waiting longer than it says.
            self._socket.setblocking(False)
        for camera in self._cameras:
            camera.output = OUTPUT_STRUCT.pack(0, 0, 0, 0)
        self._cycle(2_000_000)
        self._request(pysoem.OP_STATE)
        self._reach(pysoem.OP_STATE, "OP", lambda: self._cycle(2_000_000))
        self._operational = True

    def _request(self, state: int) -> None:
        self._master.state = state
        self._master.write_state()

    def _reach(
        self, state: int, name: str, meanwhile: Callable[[], object] = lambda: None
    ) -> None:
        """Wait until all devices are in ``state``; pysoem's own wait would hold the GIL."""
        deadline = time.monotonic() + _STATE_TIMEOUT_S
        while self._master.read_state() != state:
            meanwhile()
            if time.monotonic() > deadline:
                raise BusError("bus.state", self._stuck(state, name), "Switch the cameras off "
                               "and on; if that does not help, the sentence above is for service.")
            time.sleep(_STATE_POLL_S)

    def _stuck(self, state: int, name: str) -> str:
        for position, device in enumerate(self._master.slaves, start=1):
            if device.state != state:
                why = pysoem.al_status_code_to_string(device.al_status)
                return (
                    f"The camera at position {position} of the bus does not reach the state "
                    f"{name} (state {device.state:#04x}, {device.al_status:#06x}: {why})."
                )
        return f"The cameras do not reach the state {name}."

    def _cycle(self, timeout_ns: int) -> int:
        """Send and receive process data once; return the working counter, or less than 1."""
        deadline = time.monotonic_ns() + timeout_ns
        if self._master.send_processdata() <= 0 or self._socket is None:
            return 0
        ready, _, _ = select.select([self._socket], [], [], timeout_ns * 1e-9)
        rest_us = (deadline - time.monotonic_ns()) // 1000
        # Also after a timeout, because pysoem frees its buffers here.
        counter: int = self._master.receive_processdata(max(1, rest_us) if ready else 0)
        return counter

    def _watch_states(self) -> None:
        """Look at the states and bring cameras that only fell back to SAFEOP into OP again."""
        state = self._master.read_state()
        self._operational = state == pysoem.OP_STATE
        if self._operational:
            return
        for camera, identity in zip(self._cameras, self._settings.cameras, strict=True):
            base = camera.state & 0x0F
            if base in (pysoem.INIT_STATE, pysoem.PREOP_STATE):
                raise BusError(
                    "bus.restarted",
                    f"Camera '{identity.name}' was restarted while it was measuring.",
                    "Start the acquisition again, so that all cameras are checked anew.",
                )
            if base == pysoem.SAFEOP_STATE:
                camera.state = (
                    pysoem.SAFEOP_STATE + pysoem.STATE_ACK
                    if camera.state & pysoem.STATE_ERROR
                    else pysoem.OP_STATE
                )
                camera.write_state()

    def _register(self, device: Any, address: int, length: int) -> bytes:  # noqa: ANN401 - pysoem has no types
        return _call(
            lambda: bytes(device._fprd(address, length)),  # noqa: SLF001 - pysoem has no other register access
            "on the bus",
            f"register {address:#06x}",
        )

    def _set_register(self, device: Any, address: int, content: bytes) -> None:  # noqa: ANN401 - pysoem has no types
        def write() -> bytes:
            device._fpwr(address, content)  # noqa: SLF001 - pysoem has no other register access
            return b""

        _call(write, "on the bus", f"register {address:#06x}")


def _call(action: Callable[[], bytes], name: str, what: str) -> bytes:
    """Try twice what a lost frame may have spoiled; then say which camera did not answer."""
    try:
        return action()
    except _CALL_ERRORS:
        try:
            return action()
        except _CALL_ERRORS as error:
            raise BusError(
                "bus.no_answer",
                f"The camera {name} does not answer as it should ({what}: {error}).",
                "Check its cable; switch the camera off and on.",
            ) from error


def _packet_sockets() -> set[int]:
    """Return the descriptors of this process that are raw Ethernet sockets."""
    found = set()
    for entry in Path("/proc/self/fd").iterdir():
        descriptor = int(entry.name)
        try:
            if not stat.S_ISSOCK(os.fstat(descriptor).st_mode):
                continue
            with socket.socket(fileno=os.dup(descriptor)) as duplicate:
                if duplicate.family == socket.AF_PACKET:
                    found.add(descriptor)
        except OSError:
            # The descriptor of the listing itself is closed by now.
            continue
    return found
