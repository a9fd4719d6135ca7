"""Software EtherCAT slave controller (ETG.1000.4, ET1100): registers, EEPROM, clock, states."""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Sequence
from typing import Protocol

from ocmm_core.fieldbus import device
from ocmm_sim.slave import _registers as registers

_MIN_SYNC0_NS = 50_000
_SYNC_UNIT, _SYNC0_IS_OUTPUT = 0x04, 0x04
"""Bits of 0x0141 and 0x0151."""
_MAX_REPLIES = 4
_SM_FULL = 0x08
_EEPROM_64_BIT = 0x40
_MEMORY_BYTES = 0x10000
_OFFSET_AND_DELAY = struct.Struct("<qi")
"""The delay follows the offset."""


class Application(Protocol):
    """Application behind the controller."""

    def answer(self, mailbox: bytes) -> bytes | None:
        """Return the mailbox that answers `mailbox`."""
        ...

    def state_changed(self, state: int) -> None:
        """Handle the entered state."""
        ...

    def outputs_written(self) -> None:
        """Handle new outputs in the controller memory."""
        ...

    def refresh_inputs(self) -> None:
        """Write the newest inputs to the controller memory."""
        ...


class Esc:
    """One slave controller.

    ``clock_offset_ns``: of its free-running clock from the host's; ``sync_managers``: start,
    length, control, status, activation and type of each; the master may set no others.
    """

    def __init__(
        self,
        sii: bytes,
        clock_offset_ns: int,
        application: Application,
        sync_managers: Sequence[tuple[int, ...]] = device.SYNC_MANAGERS,
    ) -> None:
        self.sync_managers = tuple(sync_managers)
        self.memory = bytearray(_MEMORY_BYTES)
        self.now_ns = 0
        """Host arrival time of the current frame; set by the segment."""
        self.can_boot = False
        """Supports the state BOOT."""
        self.mapping_changed: Callable[[], object] = lambda: None
        """Called when logical addresses may map to other memory than before."""
        self.eeprom_written: Callable[[bytes], object] = lambda _content: None
        """Called with the whole EEPROM after a word of it was written."""
        self.spoil: Callable[[bytearray], object] | None = None
        """Fault: called with the memory after the application renewed its inputs."""
        self._sii = bytearray(sii)
        self.clock = registers.SlaveClock(clock_offset_ns)
        self._application = application
        self._replies: deque[bytes] = deque(maxlen=_MAX_REPLIES)
        self._last_reply = b""
        self._fed_ns = 0
        self._writable = bytearray(registers.RAM)
        for start, length in registers.WRITABLE:
            self._writable[start : start + length] = b"\x01" * length
        for number in range(len(device.SYNC_MANAGERS)):
            # Status and the slave's own control byte belong to the slave.
            self._writable[registers.SYNC_MANAGER + 8 * number + 5] = 0
            self._writable[registers.SYNC_MANAGER + 8 * number + 7] = 0
        head = struct.pack(
            "<BBHBBBBHH", 0x11, 0, 2, registers.N_FMMU, len(device.SYNC_MANAGERS), 8, 0x0F, 0x0C, 0
        )
        self.memory[: len(head)] = head
        self.memory[registers.STATION_ALIAS : registers.STATION_ALIAS + 2] = sii[8:10]
        # Loaded at power-on: PDI, pins, pulse length.
        self.memory[registers.PDI_CONTROL : registers.PDI_CONTROL + 2] = sii[0:2]
        self.memory[registers.PDI_CONFIGURATION : registers.PDI_CONFIGURATION + 2] = sii[2:4]
        self.memory[registers.SYNC_PULSE : registers.SYNC_PULSE + 2] = sii[4:6]
        self._set(registers.WATCHDOG_DIVIDER, "<H", 2498)
        self._set(0x0410, "<H", 1000)
        self._set(registers.WATCHDOG_SM_TIME, "<H", 1000)
        self._set(registers.WATCHDOG_STATUS, "<H", 1)
        self._set(registers.EEPROM_CONTROL, "<H", _EEPROM_64_BIT)
        self._set(registers.AL_STATUS, "<H", registers.INIT)

    @property
    def state(self) -> int:
        """Return the AL state without the error bit."""
        return self.memory[registers.AL_STATUS] & 0x0F

    @property
    def station_address(self) -> int:
        return (
            self.memory[registers.STATION_ADDRESS] | self.memory[registers.STATION_ADDRESS + 1] << 8
        )

    @property
    def system_time_ns(self) -> int:
        """Return the distributed-clock time."""
        offset: int
        delay: int
        offset, delay = _OFFSET_AND_DELAY.unpack_from(self.memory, registers.TIME_OFFSET)
        return self.clock.local_ns(self.now_ns) + offset + delay

    @property
    def is_synchronised(self) -> bool:
        """Return whether SYNC0 is on.

        Activation by a master is not sufficient: per EEPROM the unit must be enabled, the pin an
        output, and the pulse length nonzero.
        """
        return (
            self.memory[registers.SYNC_ACTIVATION] & 0x03 == 0x03
            and bool(self.memory[registers.PDI_CONTROL + 1] & _SYNC_UNIT)
            and bool(self.memory[registers.PDI_CONFIGURATION + 1] & _SYNC0_IS_OUTPUT)
            and self._get(registers.SYNC_PULSE, "<H") > 0
        )

    @property
    def sync0(self) -> tuple[int, int] | None:
        """Return start and period of SYNC0, ns of system time, or None while it is off."""
        if not self.is_synchronised:
            return None
        return int(self._get(registers.SYNC0_START, "<Q")), int(
            self._get(registers.SYNC0_CYCLE, "<I")
        )

    def set_ports(self, *, last: bool) -> None:
        """Set whether another slave follows on port 1."""
        linked, loops = (0x0010, 0x5600) if last else (0x0030, 0x5A00)
        self._set(registers.DL_STATUS, "<H", 0x0001 | linked | loops)

    def latch_receive_times(self, arrival_ns: int, return_ns: int) -> None:
        """Latch arrival on port 0 and return on port 1, host times."""
        arrival = self.clock.local_ns(arrival_ns)
        self._set(registers.PORT_TIME, "<I", arrival & 0xFFFFFFFF)
        self._set(registers.PORT_TIME + 4, "<I", self.clock.local_ns(return_ns) & 0xFFFFFFFF)
        self._set(registers.RECEIVE_TIME, "<Q", arrival)

    def read(self, address: int, length: int) -> bytes | None:
        """Return memory as read by the master, or None without answer."""
        end = address + length
        if address >= registers.RAM:
            return self._read_ram(address, end)
        if address < registers.SYSTEM_TIME + 8 and end > registers.SYSTEM_TIME:
            self._set(registers.SYSTEM_TIME, "<Q", self.system_time_ns & 0xFFFFFFFFFFFFFFFF)
        return bytes(self.memory[address:end])

    def write(self, address: int, data: bytes | bytearray | memoryview) -> bool:
        """Write as the master; return whether the slave accepted it."""
        end = address + len(data)
        if address >= registers.RAM:
            return self._write_ram(address, data)
        if end <= registers.SYSTEM_TIME + 8 and address >= registers.SYSTEM_TIME:
            # The reference time passes in every cycle and is not stored.
            if address == registers.SYSTEM_TIME and len(data) >= 4:
                self._compare_clock(bytes(data[:4]))
            return True
        for offset, byte in enumerate(data):
            if self._writable[address + offset]:
                self.memory[address + offset] = byte
        if address <= registers.AL_CONTROL < end:
            self._al_control()
        if address == registers.SYSTEM_TIME and len(data) >= 4:
            self._compare_clock(bytes(data[:4]))
        if address <= registers.SPEED_COUNTER < end:
            self._set(registers.TIME_DIFFERENCE, "<I", 0)
        if address <= registers.EEPROM_CONTROL + 1 and end > registers.EEPROM_CONTROL:
            self._eeprom()
        if address < registers.FMMU + 16 * registers.N_FMMU and end > registers.FMMU:
            self.mapping_changed()
        if (
            address < registers.SYNC_MANAGER + 8 * len(device.SYNC_MANAGERS)
            and end > registers.SYNC_MANAGER
        ):
            self._sync_managers()
        return True

    def exchange_allowed(self, sync_manager: int) -> bool:
        """Return whether process data of a sync manager is exchanged now."""
        memory = self.memory
        return memory[registers.AL_STATUS] & 0x0F >= registers.SAFEOP and bool(
            memory[registers.SYNC_MANAGER + 8 * sync_manager + 6] & 1
        )

    def store_outputs(self, address: int, data: memoryview) -> None:
        """Store outputs from a logical datagram; feeds the watchdog."""
        self.memory[address : address + len(data)] = data
        start, length = self._sm_range(device.SM_OUTPUTS)
        if address + len(data) == start + length:
            self._fed_ns = self.now_ns
            self._application.outputs_written()

    def refresh_inputs(self) -> None:
        self._application.refresh_inputs()
        if self.spoil is not None:
            self.spoil(self.memory)

    def poll(self, now_ns: int) -> None:
        """Fall back to SAFEOP if the outputs stay away longer than the watchdog time."""
        limit = (
            (self._get(registers.WATCHDOG_DIVIDER, "<H") + 2)
            * 40
            * self._get(registers.WATCHDOG_SM_TIME, "<H")
        )
        if self.state == registers.OP and limit and now_ns - self._fed_ns > limit:
            self._set(registers.WATCHDOG_STATUS, "<H", 0)
            self.memory[registers.WATCHDOG_COUNT] = min(
                255, self.memory[registers.WATCHDOG_COUNT] + 1
            )
            self.fall_back(registers.SAFEOP, registers.AL_WATCHDOG)

    def post(self, mailbox: bytes) -> bool:
        """Send an unsolicited mailbox; return whether there was room."""
        # One place is reserved for the answer to a request.
        if self.state < registers.PREOP or len(self._replies) >= _MAX_REPLIES - 1:
            return False
        self._replies.append(mailbox)
        self._load_reply()
        return True

    def fall_back(self, state: int, code: int) -> None:
        """Fall to a state by the slave's own decision, with an AL status code."""
        self._enter(state)
        self.memory[registers.AL_STATUS] = state | registers.ERROR
        self._set(registers.AL_STATUS_CODE, "<H", code)

    def _compare_clock(self, received: bytes) -> None:
        """Compare the system time with the passing reference time, and follow it."""
        difference = registers.time_difference(self.system_time_ns, received)
        self._set(registers.TIME_DIFFERENCE, "<I", registers.difference_register(difference))
        self.clock.follow(difference, self.now_ns)

    def _al_control(self) -> None:
        request = self.memory[registers.AL_CONTROL] & 0x0F
        acknowledged = bool(self.memory[registers.AL_CONTROL] & registers.ERROR)
        current = self.state
        if (
            self.memory[registers.AL_STATUS] & registers.ERROR
            and not acknowledged
            and request >= current
        ):
            return
        code = self._refusal(current, request)
        if code:
            self.memory[registers.AL_STATUS] = current | registers.ERROR
            self._set(registers.AL_STATUS_CODE, "<H", code)
            return
        self._set(registers.AL_STATUS_CODE, "<H", 0)
        self._enter(request)

    def _refusal(self, current: int, request: int) -> int:
        if request == registers.BOOT:
            if not self.can_boot:
                return registers.AL_NO_BOOT
            if current not in (registers.INIT, registers.BOOT):
                return registers.AL_INVALID_CHANGE
            fits = self._sm_fits(device.SM_MAILBOX_OUT) and self._sm_fits(device.SM_MAILBOX_IN)
            return 0 if fits else registers.AL_BOOT_MAILBOX
        if current == registers.BOOT and request != registers.INIT:
            return registers.AL_INVALID_CHANGE
        if request not in (registers.INIT, registers.PREOP, registers.SAFEOP, registers.OP):
            return registers.AL_UNKNOWN_STATE
        if request <= current:
            return 0
        if request != 2 * current:
            return registers.AL_INVALID_CHANGE
        if request == registers.PREOP:
            fits = self._sm_fits(device.SM_MAILBOX_OUT) and self._sm_fits(device.SM_MAILBOX_IN)
            return 0 if fits else registers.AL_MAILBOX
        if not self._sm_fits(device.SM_OUTPUTS):
            return registers.AL_OUTPUTS
        if not self._sm_fits(device.SM_INPUTS):
            return registers.AL_INPUTS
        sync0 = self.sync0
        return registers.AL_SYNC if sync0 is not None and sync0[1] < _MIN_SYNC0_NS else 0

    def _enter(self, state: int) -> None:
        if state == registers.INIT:
            self._replies.clear()
            self.memory[registers.SYNC_MANAGER + 8 * device.SM_MAILBOX_IN + 5] &= ~_SM_FULL
        if state == registers.OP:
            self._fed_ns = self.now_ns
            self._set(registers.WATCHDOG_STATUS, "<H", 1)
        self._set(registers.AL_STATUS, "<H", state)
        self._application.state_changed(state)

    def _eeprom(self) -> None:
        command = self._get(registers.EEPROM_CONTROL, "<H")
        at = 2 * self._get(registers.EEPROM_ADDRESS, "<I")
        error = 0
        if command & 0x0700 == 0x0100:
            content = bytes(self._sii[at : at + 8]).ljust(8, b"\xff")
            self.memory[registers.EEPROM_DATA : registers.EEPROM_DATA + 8] = content
        elif command & 0x0700 == 0x0200:
            if command & 1 and at + 2 <= len(self._sii):
                self._sii[at : at + 2] = self.memory[
                    registers.EEPROM_DATA : registers.EEPROM_DATA + 2
                ]
                self.eeprom_written(bytes(self._sii))
            else:
                error = 0x2000
        self._set(registers.EEPROM_CONTROL, "<H", _EEPROM_64_BIT | error)

    def _sync_managers(self) -> None:
        control = registers.SYNC_MANAGER + 8 * device.SM_MAILBOX_IN
        if not self._sm_active(device.SM_MAILBOX_IN):
            self.memory[control + 5] &= ~_SM_FULL
        # The repeat bit requests the last mailbox again after a lost return frame.
        if (self.memory[control + 6] ^ self.memory[control + 7]) & 0x02:
            self.memory[control + 7] ^= 0x02
            if self._last_reply:
                self._replies.appendleft(self._last_reply)
                self.memory[control + 5] &= ~_SM_FULL
                self._load_reply()
        self.mapping_changed()

    def _sm_range(self, number: int) -> tuple[int, int]:
        start, length = struct.unpack_from("<HH", self.memory, registers.SYNC_MANAGER + 8 * number)
        return start, length

    def _sm_active(self, number: int) -> bool:
        return bool(self.memory[registers.SYNC_MANAGER + 8 * number + 6] & 1)

    def _sm_fits(self, number: int) -> bool:
        return self._sm_active(number) and self._sm_range(number) == self.sync_managers[number][:2]

    def _read_ram(self, address: int, end: int) -> bytes | None:
        start, length = self._sm_range(device.SM_MAILBOX_IN)
        status = registers.SYNC_MANAGER + 8 * device.SM_MAILBOX_IN + 5
        if self._sm_active(device.SM_MAILBOX_IN) and start <= address < start + length:
            if address != start or not self.memory[status] & _SM_FULL:
                return None
            content = bytes(self.memory[address:end])
            if end >= start + length:
                self.memory[status] &= ~_SM_FULL
                self._load_reply()
            return content
        return bytes(self.memory[address:end])

    def _write_ram(self, address: int, data: bytes | bytearray | memoryview) -> bool:
        start, length = self._sm_range(device.SM_MAILBOX_OUT)
        if not self._sm_active(device.SM_MAILBOX_OUT) or not start <= address < start + length:
            return False
        if address != start or self.state < registers.PREOP:
            return False
        if len(data) >= length:
            reply = self._application.answer(bytes(data[:length]))
            if reply is not None:
                self._replies.append(reply)
                self._load_reply()
        return True

    def _load_reply(self) -> None:
        start, length = self._sm_range(device.SM_MAILBOX_IN)
        status = registers.SYNC_MANAGER + 8 * device.SM_MAILBOX_IN + 5
        if self._replies and not self.memory[status] & _SM_FULL:
            self._last_reply = self._replies.popleft()
            self.memory[start : start + length] = self._last_reply.ljust(length, b"\x00")[:length]
            self.memory[status] |= _SM_FULL

    def _set(self, address: int, layout: str, value: int) -> None:
        struct.pack_into(layout, self.memory, address, value)

    def _get(self, address: int, layout: str) -> int:
        value: int = struct.unpack_from(layout, self.memory, address)[0]
        return value
