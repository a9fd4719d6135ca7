"""Segment of slaves on one wire: processes EtherCAT datagrams (ETG.1000.4).

Every slave in turn processes every datagram and increments the working counter: by one for a read,
one for a write, and in a combined command two for the write.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

from ocmm_core.fieldbus.device import SM_INPUTS, SM_OUTPUTS
from ocmm_sim.slave._esc import Esc
from ocmm_sim.slave._registers import FMMU, N_FMMU, PORT_TIME

ETHERTYPE = 0x88A4
_ETHERNET_HEAD = 14
_DATAGRAM_HEAD = 10
_HEAD, _WORD = struct.Struct("<BBHHHH"), struct.Struct("<H")
_ETHERTYPE_BYTES = ETHERTYPE.to_bytes(2, "big")
_HOP_NS = 120
"""Delay of one slave on the wire."""


class DatagramCommand(IntEnum):
    """EtherCAT commands."""

    NOP = 0
    APRD = 1
    APWR = 2
    APRW = 3
    FPRD = 4
    FPWR = 5
    FPRW = 6
    BRD = 7
    BWR = 8
    BRW = 9
    LRD = 10
    LWR = 11
    LRW = 12
    ARMW = 13
    FRMW = 14


# Plain integers: enumeration lookups cost more than the datagram.
_BRD, _FPRD, _LRW = int(DatagramCommand.BRD), int(DatagramCommand.FPRD), int(DatagramCommand.LRW)
_READS = {DatagramCommand.APRD, DatagramCommand.FPRD, DatagramCommand.BRD, DatagramCommand.LRD}
_WRITES = {DatagramCommand.APWR, DatagramCommand.FPWR, DatagramCommand.BWR, DatagramCommand.LWR}
_LOGICAL = {DatagramCommand.LRD, DatagramCommand.LWR, DatagramCommand.LRW}
_POSITION = {DatagramCommand.APRD, DatagramCommand.APWR, DatagramCommand.APRW, DatagramCommand.ARMW}
_STATION = {DatagramCommand.FPRD, DatagramCommand.FPWR, DatagramCommand.FPRW, DatagramCommand.FRMW}
_BROADCAST = {DatagramCommand.BRD, DatagramCommand.BWR, DatagramCommand.BRW}


@dataclass(frozen=True, slots=True)
class _Copy:
    """Bytes of a logical datagram mapped by an FMMU; `sync_manager` 0: plain memory."""

    slave: Esc
    write: bool
    sync_manager: int
    at: int
    address: int
    length: int


class Segment:
    """Slaves of one wire in wire order."""

    def __init__(self, slaves: Sequence[Esc]) -> None:
        self.slaves = tuple(slaves)
        # Resolving FMMU mappings takes longer than copying; masters repeat the same logical
        # datagrams for hours.
        self._plans: dict[tuple[int, int, int], list[_Copy]] = {}
        for slave in self.slaves:
            slave.mapping_changed = self._plans.clear
            slave.set_ports(last=slave is self.slaves[-1])

    def process(self, frame: bytearray, now_ns: int) -> bool:
        """Process an Ethernet frame in place; return whether it was an EtherCAT frame."""
        if len(frame) < _ETHERNET_HEAD + 2 + _DATAGRAM_HEAD + 2:
            return False
        if frame[12:14] != _ETHERTYPE_BYTES:
            return False
        for slave in self.slaves:
            slave.now_ns = now_ns
        view = memoryview(frame)
        at = _ETHERNET_HEAD + 2
        while True:
            command, _index, low, high, flags, _event = _HEAD.unpack_from(frame, at)
            length = flags & 0x07FF
            start = at + _DATAGRAM_HEAD
            if start + length + 2 > len(frame):
                return False
            data = view[start : start + length]
            if command in _LOGICAL:
                count = self._logical(command, high << 16 | low, data)
            else:
                count, low = self._physical(command, low, high, data)
                _WORD.pack_into(frame, at + 2, low)
            if count:
                (before,) = _WORD.unpack_from(frame, start + length)
                _WORD.pack_into(frame, start + length, before + count & 0xFFFF)
            if not flags & 0x8000:
                break
            at = start + length + 2
            if at + _DATAGRAM_HEAD + 2 > len(frame):
                return False
        # Marks a frame that has passed a slave, in its source address.
        frame[6] |= 0x02
        return True

    def _logical(self, command: int, address: int, data: memoryview) -> int:
        key = (command, address, len(data))
        plan = self._plans.get(key)
        if plan is None:
            plan = self._plans[key] = self._plan(*key)
        weight = 2 if command == _LRW else 1
        written: set[int] = set()
        reading: set[int] = set()
        for copy in plan:
            slave = copy.slave
            if copy.sync_manager and not slave.exchange_allowed(copy.sync_manager):
                continue
            part = data[copy.at : copy.at + copy.length]
            if copy.write:
                slave.store_outputs(copy.address, part)
                written.add(id(slave))
            else:
                if copy.sync_manager:
                    slave.refresh_inputs()
                part[:] = slave.memory[copy.address : copy.address + copy.length]
                reading.add(id(slave))
        return weight * len(written) + len(reading)

    def _plan(self, command: int, address: int, length: int) -> list[_Copy]:
        plan = []
        for slave in self.slaves:
            for number in range(N_FMMU):
                copy = _mapped(slave, FMMU + 16 * number, address, length)
                if copy is not None and command != (
                    DatagramCommand.LRD if copy.write else DatagramCommand.LWR
                ):
                    plan.append(copy)
        return plan

    def _physical(
        self, command: int, target: int, register: int, data: memoryview
    ) -> tuple[int, int]:
        count = 0
        if command == _FPRD:
            for slave in self.slaves:
                if target == slave.station_address:
                    count += _read(slave, register, data)
            return count, target
        if command == _BRD:
            for slave in self.slaves:
                count += _read_or(slave, register, data)
            return count, target + len(self.slaves) & 0xFFFF
        for position, slave in enumerate(self.slaves):
            if command in _POSITION:
                addressed = target == 0
                target = target + 1 & 0xFFFF
            elif command in _STATION:
                addressed = target == slave.station_address
            elif command in _BROADCAST:
                addressed = True
                target = target + 1 & 0xFFFF
            else:
                return 0, target
            if command in (DatagramCommand.ARMW, DatagramCommand.FRMW):
                count += (
                    _read(slave, register, data) if addressed else _write(slave, register, data)
                )
            elif addressed:
                count += self._access(command, position, slave, register, data)
        return count, target

    def _access(
        self, command: int, position: int, slave: Esc, register: int, data: memoryview
    ) -> int:
        if register == PORT_TIME and command not in _READS:
            hops = len(self.slaves) - 1
            slave.latch_receive_times(
                slave.now_ns + position * _HOP_NS, slave.now_ns + (2 * hops - position) * _HOP_NS
            )
            return 1
        if command in _WRITES:
            return _write(slave, register, data)
        if command in _READS:
            return _read(slave, register, data)
        sent = bytes(data)
        count = (
            _read_or(slave, register, data)
            if command == DatagramCommand.BRW
            else _read(slave, register, data)
        )
        return count + (2 if slave.write(register, sent) else 0)


def _read(slave: Esc, register: int, data: memoryview) -> int:
    content = slave.read(register, len(data))
    if content is None or len(content) != len(data):
        return 0
    data[:] = content
    return 1


def _read_or(slave: Esc, register: int, data: memoryview) -> int:
    content = slave.read(register, len(data))
    if content is None or len(content) != len(data):
        return 0
    for at, byte in enumerate(content):
        data[at] |= byte
    return 1


def _write(slave: Esc, register: int, data: memoryview) -> int:
    return 1 if slave.write(register, data) else 0


def _mapped(slave: Esc, at: int, address: int, length: int) -> _Copy | None:
    logical, size, first_bit, last_bit, physical, bit, kind, active = struct.unpack_from(
        "<IHBBHBBB", slave.memory, at
    )
    # Only whole bytes are mapped; the camera has no bit variables.
    if not active & 1 or (first_bit, last_bit, bit) != (0, 7, 0) or kind not in (1, 2):
        return None
    low, high = max(logical, address), min(logical + size, address + length)
    if low >= high:
        return None
    start = physical + low - logical
    sync_manager = 0
    for number in (SM_OUTPUTS, SM_INPUTS):
        sm_start, sm_length = slave.sync_managers[number][:2]
        if sm_start <= start < sm_start + sm_length:
            sync_manager = number
    return _Copy(slave, kind == 2, sync_manager, low - address, start, high - low)
