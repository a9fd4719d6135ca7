"""The camera's objects through its mailboxes: every byte passes the slave controller's memory."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.device import (
    CALIBRATION,
    CONFIGURATION,
    COUNTERS,
    HISTORY,
    INPUT_SYNC,
    NEWEST_LAYOUT,
    SNAPSHOT,
    SYNC_MISSED,
    SYNC_MODE,
    ErrorCode,
    ErrorRegister,
    configuration_values,
    object_dictionary,
)
from ocmm_core.fieldbus.device import _camera_slave as model
from ocmm_core.fieldbus.objects._mailbox_line import parse_emergency
from ocmm_sim.slave import CameraStore
from ocmm_sim.slave import registers as reg
from tests.core.fieldbus.direct_camera import SERIAL, STEP_NS, DirectCamera

NO_DATA = {(SNAPSHOT, 10)}
"""Entries that hold nothing before something was done."""

CONFIG = model.CameraConfig(
    frame_period_ns=250_000,
    exposure_ns=30_000,
    threshold=300,
    strobe=0x0F,
    windows=((10, 20, 30, 40), (50, 60, 70, 80)),
)


def sdo(host: DirectCamera, body: bytes) -> bytes:
    """Send an SDO request; return the SDO that comes back."""
    content = struct.pack("<H", 2 << 12) + body
    answer = host.exchange(struct.pack("<HHBB", len(content), 0, 0, 0x13) + content)
    assert answer is not None
    length = int.from_bytes(answer[:2], "little")
    return answer[8 : 6 + length]


def abort_code(answer: bytes) -> int:
    assert answer[0] == 0x80
    return int.from_bytes(answer[4:8], "little")


def test_every_entry_can_be_read_and_has_the_size_of_the_table() -> None:
    host = DirectCamera()
    count = 0
    for index, item in object_dictionary(SERIAL).items():
        for sub, entry in item.entries.items():
            count += 1
            if (index, sub) in NO_DATA:
                with pytest.raises(BusError, match="08000024"):
                    host.read(index, sub)
                continue
            value = host.read(index, sub)
            if entry.is_number:
                assert len(value) == len(entry.value), (hex(index), sub)
            else:
                assert len(value) <= entry.room, (hex(index), sub)
            if not entry.live:
                assert value == entry.value, (hex(index), sub)
    assert count > 400


def test_live_entries_have_something_behind_them() -> None:
    """A live entry without a provider would show its placeholder for ever."""
    host = DirectCamera()
    values = host.camera.coe._values  # noqa: SLF001  # the test is about the stored values
    for index, item in object_dictionary(SERIAL).items():
        for sub, entry in item.entries.items():
            served = (index, sub) in values._live  # noqa: SLF001  # as above
            assert served == entry.live, (hex(index), sub)


def test_every_writable_entry_takes_what_it_holds_and_others_refuse() -> None:
    host = DirectCamera()
    for index, item in object_dictionary(SERIAL).items():
        for sub, entry in item.entries.items():
            if entry.writable:
                continue
            with pytest.raises(BusError, match="06010002"):
                host.write(index, sub, entry.value or b"\x00")
    for index, sub, value in configuration_values(CONFIG):
        host.write(index, sub, value)
        assert host.read(index, sub) == value


@pytest.mark.parametrize(
    ("index", "sub", "value", "code"),
    [
        (0x5555, 0, b"\x00", "06020000"),
        (CONFIGURATION, 9, b"\x00", "06090011"),
        (CONFIGURATION, 1, b"\x00", "06070010"),
        (CONFIGURATION, 1, bytes(9), "06070010"),
        (CONFIGURATION, 1, struct.pack("<I", 49_999), "06090032"),
        (CONFIGURATION, 1, struct.pack("<I", 1_000_000_001), "06090031"),
        (CONFIGURATION, 4, b"\x02", "06090031"),
        # Corrected image points need intrinsics.
        (CONFIGURATION, 4, b"\x01", "08000024"),
        (CALIBRATION, 1, b"nonsense", "06090030"),
        (CALIBRATION, 1, bytes(101), "06070010"),
        (CALIBRATION, 5, bytes(1201), "06070010"),
        (HISTORY, 3, b"\x07", "06090030"),
        (0x8020, 1, b"\x02", "08000024"),
        (0x8020, 1, b"\x03", "08000024"),
        (0x8020, 1, b"\x05", "06090031"),
    ],
)
def test_refusals_say_why(index: int, sub: int, value: bytes, code: str) -> None:
    with pytest.raises(BusError, match=f"0x{code}"):
        DirectCamera().write(index, sub, value)


def test_the_configuration_cannot_change_while_frames_are_made() -> None:
    host = DirectCamera(state=reg.SAFEOP)
    for index, sub, value in configuration_values(CONFIG):
        with pytest.raises(BusError, match="0x08000022"):
            host.write(index, sub, value)
    host.go(reg.PREOP)
    for index, sub, value in configuration_values(CONFIG):
        host.write(index, sub, value)
    host.go(reg.OP)
    assert NEWEST_LAYOUT.decode(host.cycle()).config_crc == CONFIG.crc()


def test_a_configuration_that_contradicts_itself_does_not_start() -> None:
    host = DirectCamera()
    host.write(CONFIGURATION, 2, struct.pack("<I", 500_000))
    host.go(reg.SAFEOP)
    assert host.status == (reg.PREOP | reg.ERROR, 0x0026)
    host.write(CONFIGURATION, 2, struct.pack("<I", 50_000))
    host.go(reg.SAFEOP)
    assert host.status == (reg.SAFEOP, 0)


def test_records_travel_as_a_whole() -> None:
    host = DirectCamera()
    answer = sdo(host, struct.pack("<BHBI", 0x50, 0x1018, 0, 0))
    command, index, sub, size = struct.unpack_from("<BHBI", answer)
    assert (command, index, sub, size) == (0x51, 0x1018, 0, 18)
    identity = (model.VENDOR_ID, model.PRODUCT_CODE, model.REVISION, SERIAL)
    assert struct.unpack("<HIIII", answer[8:]) == (4, *identity)
    assert sdo(host, struct.pack("<BHBI", 0x50, 0x1018, 1, 0))[8:] == answer[10:]
    # Neither single values nor records with octets or bits, nor in the middle.
    for index, sub in ((0x1000, 0), (HISTORY, 0), (INPUT_SYNC, 0)):
        body = struct.pack("<BHBI", 0x50, index, sub, 0)
        assert abort_code(sdo(host, body)) == 0x06010004
    assert abort_code(sdo(host, struct.pack("<BHBI", 0x50, 0x1018, 2, 0))) == 0x06090011


def test_a_record_is_written_wholly_or_not_at_all() -> None:
    host = DirectCamera()
    before = [host.read(CONFIGURATION, sub) for sub in range(1, 6)]

    def write(content: bytes) -> bytes:
        return sdo(host, struct.pack("<BHBI", 0x31, CONFIGURATION, 0, len(content)) + content)

    wrong = struct.pack("<HIIHBH", 5, 250_000, 30_000, 300, 7, 1)
    assert abort_code(write(wrong)) == 0x06090031
    assert abort_code(write(wrong[:-1])) == 0x06070010
    assert abort_code(write(b"\x04" + wrong[1:])) == 0x06010003
    assert [host.read(CONFIGURATION, sub) for sub in range(1, 6)] == before
    assert write(struct.pack("<HIIHBH", 5, 250_000, 30_000, 300, 0, 1))[0] == 0x70
    assert host.read(CONFIGURATION, 3) == struct.pack("<H", 300)


def test_segments_out_of_turn_end_the_transfer() -> None:
    host = DirectCamera()
    start = struct.pack("<BHBI", 0x21, CALIBRATION, 5, 600)
    for first, then, code in (
        (start, b"\x10" + bytes(247), 0x05030000),
        (start, b"\x01" + bytes(10), 0x06070010),
        (start, b"\x60" + bytes(7), 0x05040001),
        (start, b"\xe0" + bytes(7), 0x05040001),
    ):
        assert sdo(host, first)[0] == 0x60
        assert abort_code(sdo(host, then)) == code
        # It is over: the next segment belongs to nothing.
        assert abort_code(sdo(host, b"\x00" + bytes(7))) == 0x05040001
    assert host.read(CALIBRATION, 5) == b""
    host.write(CALIBRATION, 5, bytes(range(200)) * 6)
    read = struct.pack("<BHBI", 0x40, CALIBRATION, 5, 0)
    assert sdo(host, read)[0] == 0x41
    assert abort_code(sdo(host, b"\x70" + bytes(7))) == 0x05030000
    assert sdo(host, read)[0] == 0x41
    # An abort is not answered.
    content = struct.pack("<H", 2 << 12) + struct.pack("<BHBI", 0x80, CALIBRATION, 5, 0)
    assert host.exchange(struct.pack("<HHBB", len(content), 0, 0, 0x13) + content) is None
    assert abort_code(sdo(host, b"\x60" + bytes(7))) == 0x05040001


@pytest.mark.parametrize(
    ("mailbox", "detail"),
    [
        (struct.pack("<HHBB", 10, 0, 0, 0x12) + bytes(10), 2),
        (struct.pack("<HHBB", 2000, 0, 0, 0x13) + bytes(10), 8),
        (struct.pack("<HHBB", 1, 0, 0, 0x13) + bytes(10), 6),
        (struct.pack("<HHBBHB", 3, 0, 0, 0x13, 2 << 12, 0x40), 6),
        (struct.pack("<HHBBH", 10, 0, 0, 0x13, 9 << 12) + bytes(8), 4),
        (struct.pack("<HHBBH", 10, 0, 0, 0x13, 1 << 12) + bytes(8), 4),
    ],
)
def test_mailboxes_that_mean_nothing_get_an_error_reply(mailbox: bytes, detail: int) -> None:
    host = DirectCamera()
    answer = host.exchange(mailbox)
    assert answer is not None
    length, _address, _channel, kind, command, found = struct.unpack_from("<HHBBHH", answer)
    assert (length, kind & 0x0F, command, found) == (4, 0, 1, detail)
    assert host.read(COUNTERS, 4) == struct.pack("<I", 1)


def test_random_mailboxes_never_break_the_camera() -> None:
    generator = np.random.default_rng(7)
    host = DirectCamera()
    indices = list(object_dictionary(SERIAL))
    for _ in range(3000):
        content = generator.integers(0, 256, generator.integers(0, 80), dtype=np.uint8).tobytes()
        body = struct.pack("<H", int(generator.choice([2, 8])) << 12) + content
        head = struct.pack("<HHBB", len(body), 0, 0, 0x13)
        if generator.random() < 0.7 and len(content) > 4:
            index = int(generator.choice(indices))
            body = body[:3] + struct.pack("<H", index) + body[5:]
        host.exchange(head + body)
    assert host.read(0x1008, 0) == model.DEVICE_NAME.encode()


def test_information_describes_every_entry() -> None:
    host = DirectCamera()

    def ask(operation: int, content: bytes) -> bytes:
        body = struct.pack("<HBBH", 8 << 12, operation, 0, 0) + content
        answer = host.exchange(struct.pack("<HHBB", len(body), 0, 0, 0x13) + body)
        assert answer is not None
        return answer[8 : 6 + int.from_bytes(answer[:2], "little")]

    objects = object_dictionary(SERIAL)
    listed = ask(1, b"\x01\x00")
    assert listed[0] == 2
    assert struct.unpack(f"<{len(objects)}H", listed[6:]) == tuple(objects)
    counts = struct.unpack("<5H", ask(1, b"\x00\x00")[6:])
    assert counts == (len(objects), 1, len(model.INPUT_PDOS), 0, 2)
    for index, item in objects.items():
        described = ask(3, struct.pack("<H", index))
        assert described[0] == 4
        assert described[10:].decode() == item.name
        for sub, entry in item.entries.items():
            described = ask(5, struct.pack("<HBB", index, sub, 0))
            found = struct.unpack_from("<HBBHHH", described, 4)
            assert found[:2] == (index, sub)
            assert found[3:5] == (entry.kind, entry.bits)
            assert bool(found[5] & 0x38) == entry.writable
            assert described[14:].decode() == entry.name
    # A gap in a record is described as nothing; beyond its end is an error.
    gap = struct.pack("<HBBHHH", INPUT_SYNC, 9, 0, 0, 0, 0)
    assert ask(5, struct.pack("<HBB", INPUT_SYNC, 9, 0))[4:] == gap
    assert ask(5, struct.pack("<HBB", INPUT_SYNC, 0x21, 0))[:1] == b"\x07"
    assert ask(3, b"\x55\x55")[:1] == b"\x07"
    assert ask(9, bytes(4))[:1] == b"\x07"


def test_process_data_can_be_read_as_objects() -> None:
    host = DirectCamera(state=reg.OP)
    content = host.cycle()
    host.camera.frozen = True
    header = NEWEST_LAYOUT.decode(content)
    for entry in model.HEADER_PDO.entries:
        value = int.from_bytes(host.read(entry.index, entry.sub), "little")
        assert value == getattr(header, entry.name)
    frames = np.frombuffer(content, model.INPUT_DTYPE)[0]["frames"]
    last = model.FRAME_PDOS[-1].entries[-1]
    found = int.from_bytes(host.read(last.index, last.sub), "little", signed=True)
    assert found == frames[-1]["xy"][-1, 1]


def test_a_watchdog_trip_is_told_remembered_and_taken_back() -> None:
    host = DirectCamera(state=reg.OP)
    host.cycle()
    host.esc.poll(host.esc.now_ns + 150_000_000)
    assert host.status == (reg.SAFEOP | reg.ERROR, reg.AL_WATCHDOG)
    host.receive()
    (emergency,) = [parse_emergency(content) for content in host.emergencies]
    assert emergency is not None
    assert emergency.code == ErrorCode.WATCHDOG
    assert emergency.register == ErrorRegister.GENERIC | ErrorRegister.COMMUNICATION
    assert host.read(0x1001, 0) == bytes([0x11])
    assert host.read(COUNTERS, 2) == struct.pack("<I", 1)
    status = NEWEST_LAYOUT.decode(host.cycle()).status
    assert status & model.CameraStatus.DIAGNOSIS
    host.go(reg.OP)
    host.receive()
    assert [content[8:10] for content in host.emergencies] == [b"\x30\x81", b"\x00\x00"]
    assert host.read(0x1001, 0) == b"\x00"


def test_emergencies_can_be_turned_off_and_never_push_answers_out() -> None:
    host = DirectCamera()
    for code in range(0xFF00, 0xFF20):
        host.camera.emergency(code, 0x81, b"12345")
    # The queue kept the first ones, one of them in the mailbox itself; an answer still gets in.
    assert host.read(COUNTERS, 6) == struct.pack("<I", 32)
    found = [int.from_bytes(content[8:10], "little") for content in host.emergencies]
    assert found == list(range(0xFF00, 0xFF00 + len(found)))
    assert len(found) >= 4
    host.write(HISTORY, 5, struct.pack("<H", 0))
    count = len(host.emergencies)
    host.camera.emergency(0xFFFF, 0x81, b"")
    assert host.receive() is None
    assert len(host.emergencies) == count


def test_heat_and_a_dead_sensor_are_emergencies_with_an_end() -> None:
    host = DirectCamera(state=reg.OP)
    electronics = host.camera.electronics
    seconds = 1_100_000_000 // STEP_NS
    electronics.warmer_c = 40.0
    for _ in range(seconds):
        host.cycle()
    electronics.warmer_c = 0.0
    electronics.sensor_fails = True
    for _ in range(seconds):
        content = host.cycle()
    frames = np.frombuffer(content, model.INPUT_DTYPE)[0]
    assert frames["header"]["frames_valid"] > 0
    assert not frames["frames"]["valid"][: frames["header"]["frames_valid"]].any()
    electronics.sensor_fails = False
    for _ in range(seconds):
        content = host.cycle(1, NEWEST_LAYOUT.decode(content).counter)
    host.receive()
    codes = [parse_emergency(content) for content in host.emergencies]
    assert [code.code for code in codes if code is not None] == [
        ErrorCode.OVER_TEMPERATURE, ErrorCode.RESET, ErrorCode.SENSOR, ErrorCode.RESET,
    ]  # fmt: skip


def test_missed_cycles_are_counted_by_the_camera() -> None:
    host = DirectCamera()
    start = host.esc.system_time_ns + 10_000_000
    host.esc.write(reg.SYNC0_START, struct.pack("<Q", start))
    host.esc.write(reg.SYNC0_CYCLE, struct.pack("<II", 125_000, 875_000))
    host.esc.write(reg.SYNC_ACTIVATION, b"\x07")
    host.go(reg.OP)
    for _ in range(5):
        host.cycle()
    assert host.read(INPUT_SYNC, SYNC_MODE) == b"\x02\x00"
    missed = int.from_bytes(host.read(INPUT_SYNC, SYNC_MISSED), "little")
    host.work(6)
    host.cycle()
    now = int.from_bytes(host.read(INPUT_SYNC, SYNC_MISSED), "little")
    # Reading also took steps of time.
    assert now - missed >= 6


def test_a_mailbox_that_hangs_says_nothing_until_it_is_cured() -> None:
    host = DirectCamera()
    host.camera.mailbox_hangs = True
    with pytest.raises(AssertionError):
        host.read(0x1000, 0)
    host.camera.mailbox_hangs = False
    assert host.read(0x1000, 0) == struct.pack("<I", 0x1389)


def test_another_frame_rate_shows_and_ends_on_the_old_schedule() -> None:
    host = DirectCamera()
    start = host.esc.system_time_ns + 1_000_000
    host.esc.write(reg.SYNC0_START, struct.pack("<Q", start))
    host.esc.write(reg.SYNC0_CYCLE, struct.pack("<II", 125_000, 875_000))
    host.esc.write(reg.SYNC_ACTIVATION, b"\x07")
    host.go(reg.OP)
    for _ in range(20):
        host.cycle()
    host.camera.period_override = 200_000
    assert NEWEST_LAYOUT.decode(host.cycle()).period_ns == 200_000
    host.camera.period_override = 0
    host.cycle()
    header = NEWEST_LAYOUT.decode(host.cycle())
    assert header.period_ns == 125_000
    assert header.frames_valid > 0
    assert header.start_ns == start + header.counter * 125_000
    assert header.status & model.CameraStatus.OVERRUN


def test_damaged_memory_is_told_and_not_used() -> None:
    store = CameraStore()
    store.save("intrinsics", b"not intrinsics")
    host = DirectCamera(store=store)
    assert host.read(CALIBRATION, 1) == b""
    history = host.read(HISTORY, 6)
    assert struct.unpack_from("<HH", history) == (0xE800, ErrorCode.STORED_DATA)
