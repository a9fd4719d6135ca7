"""SDO transfers between the master's side and the software camera's server, mailbox by mailbox."""

from __future__ import annotations

import struct
from collections.abc import Callable

import pytest

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.device import DataType, DictionaryObject, ObjectEntry
from ocmm_core.fieldbus.objects._mailbox_line import parse_emergency
from ocmm_core.fieldbus.objects._sdo import (
    MAX_COUNTER,
    SdoRead,
    SdoTransfer,
    SdoWrite,
    mailbox_counter,
)
from ocmm_sim.slave import CoeServer

INDEX = 0x8010
ROOM = 1 << 16


def make_server(value: bytes, mailbox_bytes: int) -> CoeServer:
    entry = ObjectEntry("Value", DataType.OCTET_STRING, value, writable=True)
    return CoeServer({INDEX: DictionaryObject("Value", {0: entry}, False)}, mailbox_bytes, {})


def run(transfer: SdoTransfer, server: CoeServer, mailbox_bytes: int, limit: int = 10_000) -> int:
    """Carry mailboxes both ways until the end; return their number."""
    for number in range(1, limit):
        request = transfer.request((number - 1) % MAX_COUNTER + 1)
        assert len(request) == mailbox_bytes
        answer = server.answer(request)
        assert answer is not None
        transfer.answer(answer.ljust(mailbox_bytes, b"\x00"))
        if transfer.done:
            return number
    raise AssertionError("the transfer does not end")


@pytest.mark.parametrize("mailbox_bytes", [16, 24, 64, 256, 1024])
@pytest.mark.parametrize("size", [1, 2, 3, 4, 5, 7, 8, 13, 14, 240, 241, 247, 248, 1200, 40_000])
def test_every_size_travels_both_ways_unchanged(size: int, mailbox_bytes: int) -> None:
    content = bytes((7 * k + size) % 251 for k in range(size))
    server = make_server(bytes(size), mailbox_bytes)
    write = SdoWrite(INDEX, 0, content, mailbox_bytes=mailbox_bytes)
    run(write, server, mailbox_bytes)
    assert write.progress == (size, size)
    assert server.value(INDEX, 0) == content
    read = SdoRead(INDEX, 0, ROOM, mailbox_bytes=mailbox_bytes)
    run(read, server, mailbox_bytes)
    assert read.result == content
    assert read.progress == (size, size)


def test_a_transfer_of_many_mailboxes_tells_how_far_it_is() -> None:
    server = make_server(bytes(1200), 256)
    read = SdoRead(INDEX, 0, ROOM, mailbox_bytes=256)
    seen = [read.progress]
    while not read.done:
        answer = server.answer(read.request(1))
        assert answer is not None
        read.answer(answer)
        seen.append(read.progress)
    # 240 bytes in the first mailbox, then 247 in each.
    assert seen == [(0, 0), (240, 1200), (487, 1200), (734, 1200), (981, 1200), (1200, 1200)]


def test_a_request_stays_the_same_until_its_answer_came() -> None:
    write = SdoWrite(INDEX, 0, bytes(1200), mailbox_bytes=256)
    first = write.request(3)
    assert first == write.request(3)
    assert mailbox_counter(first) == 3
    answer = make_server(bytes(1200), 256).answer(first)
    assert answer is not None
    write.answer(answer)
    assert write.request(3) != first


def test_a_camera_that_refuses_is_named_with_its_reason() -> None:
    server = make_server(bytes(4), 256)
    for transfer, text in (
        (SdoRead(0x7777, 1, ROOM, mailbox_bytes=256), r"object does not exist \(0x06020000\)"),
        (SdoRead(INDEX, 9, ROOM, mailbox_bytes=256), "entry does not exist"),
        (SdoWrite(INDEX, 0, bytes(5), mailbox_bytes=256), "wrong length"),
    ):
        answer = server.answer(transfer.request(1))
        assert answer is not None
        with pytest.raises(BusError, match=text) as caught:
            transfer.answer(answer)
        assert caught.value.code == "bus.refused"


def coe(service: int, body: bytes) -> bytes:
    content = struct.pack("<H", service << 12) + body
    return struct.pack("<HHBB", len(content), 0, 0, 0x13) + content


def first_answer(size: int, part: bytes = b"") -> bytes:
    return coe(3, struct.pack("<BHBI", 0x41, INDEX, 0, size) + part)


def _segment(head: int, part: bytes) -> bytes:
    return coe(3, bytes([head]) + part)


BAD_READS: list[tuple[str, list[bytes]]] = [
    ("is about 0x8011:00", [coe(3, struct.pack("<BHBI", 0x43, 0x8011, 0, 1))]),
    ("is about 0x8010:01", [coe(3, struct.pack("<BHBI", 0x43, INDEX, 1, 1))]),
    ("is about 0x8010:07", [coe(3, struct.pack("<BHBI", 0x80, INDEX, 7, 0x06090011))]),
    ("is about 0x7777:00", [coe(2, struct.pack("<BHBI", 0x80, 0x7777, 0, 0x06020000))]),
    ("has 65537 bytes where 65536", [first_answer(ROOM + 1)]),
    ("has 4294967295 bytes", [first_answer(0xFFFFFFFF)]),
    ("longer than the 5 bytes", [first_answer(5, bytes(6))]),
    ("longer than the 20 bytes", [first_answer(20, bytes(10)), _segment(1, bytes(11))]),
    ("missing or came twice", [first_answer(20, bytes(10)), _segment(0x11, bytes(10))]),
    ("ends after 17 of 20", [first_answer(20, bytes(10)), _segment(1, bytes(7))]),
    ("continues after its end", [first_answer(20, bytes(10)), _segment(0, bytes(10))]),
    ("segment is empty", [first_answer(20, bytes(10)), _segment(0x0E, bytes(7))]),
    ("is not a segment", [first_answer(20, bytes(10)), _segment(0x41, bytes(10))]),
    ("comes after the end", [first_answer(1, b"x"), first_answer(1, b"x")]),
    ("starts nothing", [coe(3, struct.pack("<BHBI", 0x60, INDEX, 0, 0))]),
    ("is too short", [coe(3, b"\x43\x10")]),
    ("is empty", [coe(3, b"")]),
    ("another service", [coe(8, bytes(8))]),
    ("not a CANopen message", [b""]),
    ("not a CANopen message", [b"\xff" * 256]),
    ("not a CANopen message", [coe(3, bytes(8))[:-1]]),
    ("protocol not supported, 2", [struct.pack("<HHBBHH", 4, 0, 0, 0x10, 1, 2)]),
]


@pytest.mark.parametrize(("why", "answers"), BAD_READS)
def test_an_answer_that_does_not_fit_is_an_error(why: str, answers: list[bytes]) -> None:
    read = SdoRead(INDEX, 0, ROOM, mailbox_bytes=256)
    for answer in answers[:-1]:
        read.answer(answer)
    with pytest.raises(BusError, match=why) as caught:
        read.answer(answers[-1])
    assert caught.value.code == "bus.mailbox"


def test_a_confirmation_with_the_wrong_toggle_is_an_error() -> None:
    write = SdoWrite(INDEX, 0, bytes(1200), mailbox_bytes=256)
    write.answer(coe(3, struct.pack("<BHBI", 0x60, INDEX, 0, 0)))
    with pytest.raises(BusError, match="missing or came twice"):
        write.answer(_segment(0x30, bytes(7)))


def test_a_mailbox_without_room_for_an_object_is_refused() -> None:
    with pytest.raises(BusError, match="too small"):
        SdoRead(INDEX, 0, ROOM, mailbox_bytes=15)


def test_giving_up_ends_the_transfer_on_the_camera() -> None:
    server = make_server(bytes(1200), 256)
    read = SdoRead(INDEX, 0, ROOM, mailbox_bytes=256)
    answer = server.answer(read.request(1))
    assert answer is not None
    read.answer(answer)
    request: Callable[[int], bytes] = read.abandon
    server.answer(request(2))
    late = server.answer(read.request(3))
    assert late is not None
    with pytest.raises(BusError, match="unknown command"):
        read.answer(late)


def test_emergency_messages_are_told_from_answers() -> None:
    mailbox = coe(1, struct.pack("<HB5s", 0x4210, 0x09, b"\x2a\0\0\0\0"))
    emergency = parse_emergency(mailbox.ljust(256, b"\x00"))
    assert emergency is not None
    assert (emergency.code, emergency.register, emergency.data[0]) == (0x4210, 0x09, 0x2A)
    assert emergency.text == "device temperature"
    assert parse_emergency(coe(3, bytes(8))) is None
    assert parse_emergency(mailbox[:-1]) is None
    assert parse_emergency(b"") is None
