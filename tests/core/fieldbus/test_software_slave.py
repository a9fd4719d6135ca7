"""The software slave without a network: datagrams are handed to the segment directly."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from ocmm_core.fieldbus.device import COUNTER_MODULUS, FRAME_DTYPE, SYNC_MANAGERS
from ocmm_sim.slave import (
    FIFO_FRAMES,
    DatagramCommand,
    FrameBuffer,
    Segment,
    SoftwareCamera,
    TestPattern,
)
from ocmm_sim.slave import registers as reg

PERIOD = 125_000


def make_segment() -> Segment:
    pattern = TestPattern()
    return Segment([SoftwareCamera(n, 1001 + n, n + 1, pattern).esc for n in range(3)])


def send(
    segment: Segment, command: DatagramCommand, target: int, register: int, data: bytes
) -> tuple[bytes, int, int]:
    """Send one datagram; return data, working counter and target as they come back."""
    datagram = struct.pack("<BBHHHH", command, 1, target, register, len(data), 0) + data + b"\0\0"
    frame = bytearray(b"\xff" * 12 + b"\x88\xa4" + struct.pack("<H", len(datagram) | 0x1000))
    frame += datagram
    assert segment.process(frame, 1_000_000_000)
    start = 14 + 2 + 10
    (counter,) = struct.unpack_from("<H", frame, start + len(data))
    (returned,) = struct.unpack_from("<H", frame, 18)
    return bytes(frame[start : start + len(data)]), counter, returned


def state(segment: Segment, position: int) -> tuple[int, int]:
    slave = segment.slaves[position]
    code = int.from_bytes(slave.read(reg.AL_STATUS_CODE, 2) or b"", "little")
    return int.from_bytes(slave.read(reg.AL_STATUS, 2) or b"", "little"), code


def test_working_counters_of_every_kind_of_address() -> None:
    segment = make_segment()
    assert send(segment, DatagramCommand.BRD, 0, reg.AL_STATUS, bytes(2)) == (b"\x01\x00", 3, 3)
    for position in range(3):
        address = struct.pack("<H", 0x1001 + position)
        target = -position & 0xFFFF
        assert send(segment, DatagramCommand.APWR, target, reg.STATION_ADDRESS, address)[1] == 1
    assert send(segment, DatagramCommand.FPRD, 0x1002, reg.STATION_ALIAS, bytes(2))[:2] == (
        b"\2\0",
        1,
    )
    assert send(segment, DatagramCommand.FPRD, 0x1009, reg.STATION_ALIAS, bytes(2))[1] == 0
    assert send(segment, DatagramCommand.FPRW, 0x1002, 0x0200, b"\5\0")[1] == 3
    assert send(segment, DatagramCommand.BRW, 0, 0x0200, b"\0\0")[1] == 9
    assert send(segment, DatagramCommand.NOP, 0, 0, bytes(4))[1] == 0
    # The addressed slave is read, all others are written to.
    assert send(segment, DatagramCommand.FRMW, 0x1001, reg.SYSTEM_TIME, bytes(8))[1] == 3


def test_what_is_no_ethercat_frame_is_left_alone() -> None:
    segment = make_segment()
    assert not segment.process(bytearray(60), 0)
    assert not segment.process(bytearray(b"\xff" * 12 + b"\x88\xa4" + b"\x01"), 0)
    # A length that reaches beyond the frame.
    long = bytearray(b"\xff" * 12 + b"\x88\xa4" + b"\x10\x10" + bytes(40))
    struct.pack_into("<H", long, 14 + 2 + 6, 0x07FF)
    assert not segment.process(long, 0)


@pytest.mark.parametrize(
    ("request_", "code"),
    [
        (reg.OP, reg.AL_INVALID_CHANGE),
        (reg.SAFEOP, reg.AL_INVALID_CHANGE),
        (reg.BOOT, reg.AL_BOOT_MAILBOX),
        (7, reg.AL_UNKNOWN_STATE),
        (reg.PREOP, reg.AL_MAILBOX),
    ],
)
def test_wrong_state_requests_are_refused_until_acknowledged(request_: int, code: int) -> None:
    segment = make_segment()
    send(segment, DatagramCommand.APWR, 0, reg.AL_CONTROL, struct.pack("<H", request_))
    assert state(segment, 0) == (reg.INIT | reg.ERROR, code)
    send(segment, DatagramCommand.APWR, 0, reg.AL_CONTROL, struct.pack("<H", reg.INIT | reg.ERROR))
    assert state(segment, 0) == (reg.INIT, 0)


def test_the_way_to_operation_and_back_by_the_watchdog() -> None:
    segment = make_segment()
    for number, manager in enumerate(SYNC_MANAGERS):
        settings = struct.pack("<HHBBBB", *manager[:5], 0)
        send(segment, DatagramCommand.APWR, 0, reg.SYNC_MANAGER + 8 * number, settings)
    for wanted in (reg.PREOP, reg.SAFEOP, reg.OP):
        send(segment, DatagramCommand.APWR, 0, reg.AL_CONTROL, struct.pack("<H", wanted))
        assert state(segment, 0) == (wanted, 0)
    slave = segment.slaves[0]
    slave.poll(1_000_000_000 + 90_000_000)
    assert state(segment, 0) == (reg.OP, 0)
    slave.poll(1_000_000_000 + 110_000_000)
    assert state(segment, 0) == (reg.SAFEOP | reg.ERROR, reg.AL_WATCHDOG)


def test_clocks_of_all_slaves_agree_after_the_offsets_are_set() -> None:
    segment = make_segment()
    send(segment, DatagramCommand.BWR, 0, reg.PORT_TIME, bytes(4))
    for position in range(3):
        target = -position & 0xFFFF
        received = int.from_bytes(
            send(segment, DatagramCommand.APRD, target, reg.RECEIVE_TIME, bytes(8))[0], "little"
        )
        offset = struct.pack("<q", 5_000_000_000 - received)
        send(segment, DatagramCommand.APWR, target, reg.TIME_OFFSET, offset)
        send(
            segment, DatagramCommand.APWR, target, reg.TIME_DELAY, struct.pack("<i", 120 * position)
        )
    assert {slave.system_time_ns for slave in segment.slaves} == {5_000_000_000}


def test_the_buffer_sends_again_until_it_is_acknowledged() -> None:
    buffer = FrameBuffer(TestPattern(), 0)
    buffer.start(0, PERIOD)
    while buffer.generate(0):
        pass
    assert buffer.pop(0) == (0, 0)
    assert buffer.pop(9 * PERIOD) == (0, 9)
    assert buffer.pop(30 * PERIOD) == (0, 12)
    buffer.acknowledge(COUNTER_MODULUS - 1)
    assert buffer.pop(30 * PERIOD) == (0, 12)
    buffer.acknowledge(8)
    assert buffer.pop(30 * PERIOD) == (9, 12)
    # Acknowledging an unsent or an old item changes nothing.
    buffer.acknowledge(3)
    buffer.acknowledge(500)
    assert buffer.pop(30 * PERIOD) == (9, 12)
    assert buffer.lost == 0


def test_a_full_buffer_drops_the_oldest_and_marks_the_place() -> None:
    buffer = FrameBuffer(TestPattern(), 0)
    buffer.start(0, PERIOD)
    now = (FIFO_FRAMES + 100) * PERIOD
    while buffer.generate(now):
        pass
    assert buffer.pop(now) == (100, 12)
    assert buffer.lost == 100
    memory = bytearray(12 * FRAME_DTYPE.itemsize)
    buffer.copy(100, 12, memory, 0)
    flags = np.frombuffer(memory, FRAME_DTYPE)["flags"]
    np.testing.assert_array_equal(flags & 2, [2] + [0] * 11)
