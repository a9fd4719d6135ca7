"""The bus process's ear and mouth, over real pipes."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field

import pytest

from ocmm_core.acquisition.bus_process import read_first_line
from ocmm_core.acquisition.bus_process._commands import (
    MAX_REPLIES,
    MAX_REQUESTS,
    CommandPort,
    LineBuffer,
)
from ocmm_core.errors import InputError
from ocmm_core.fieldbus.objects import (
    MAX_LINE_BYTES,
    CancelRequest,
    EepromRequest,
    ObjectReply,
    ObjectRequest,
    decode_reply,
    decode_request,
    encode_line,
)
from tests.host import HANG_S

REQUEST = ObjectRequest(7, "left", 0x1018, 4)


@dataclass
class Ends:
    """The other ends of a port's pipes."""

    port: CommandPort
    write: int
    read: int
    ended: threading.Event
    lines: LineBuffer = field(default_factory=LineBuffer)
    waiting: list[bytes] = field(default_factory=list)

    def send(self, content: bytes) -> None:
        view = memoryview(content)
        while view:
            view = view[os.write(self.write, view) :]

    def reply(self) -> ObjectReply:
        while not self.waiting:
            self.waiting += self.lines.push(os.read(self.read, 65536))
        return decode_reply(self.waiting.pop(0))

    def take(self) -> ObjectRequest | EepromRequest:
        until = time.monotonic() + HANG_S
        while time.monotonic() < until:
            request = self.port.next_request()
            if request is not None:
                return request
            time.sleep(0.001)
        raise AssertionError("no request within")


@pytest.fixture
def ends() -> Iterator[Ends]:
    (in_read, in_write), (out_read, out_write) = os.pipe(), os.pipe()
    ended = threading.Event()
    port = CommandPort(in_read, out_write, ended.set)
    yield Ends(port, in_write, out_read, ended)
    port.close()
    for descriptor in (in_read, in_write, out_read, out_write):
        os.close(descriptor)


def test_messages_survive_their_line() -> None:
    for request in (
        REQUEST,
        ObjectRequest(8, "Kamera ä", 0x8010, 0, bytes(range(256)), 0),
        EepromRequest(9, "right", 8, 16),
        CancelRequest(7),
    ):
        line = encode_line(request)
        assert line.count(b"\n") == 1
        assert decode_request(line) == request
    reply = ObjectReply(7, 4, 4, True, b"\n\x00\xff", "bus.refused", "No.", "Do.")
    assert decode_reply(encode_line(reply)) == reply


@pytest.mark.parametrize(
    "line",
    [
        b"",
        b"{}",
        b"[1]",
        b"\xff\xfe",
        b'{"type":"object","number":0,"camera":"left","index":1,"sub":0}',
        b'{"type":"object","number":1,"camera":"left","index":65536,"sub":0}',
        b'{"type":"object","number":1,"camera":"left","index":1,"sub":-1}',
        b'{"type":"object","number":1,"camera":"left","index":1,"sub":0,"room":99999999}',
        b'{"type":"object","number":1,"camera":"left","index":1,"sub":0,"value":"%"}',
        b'{"type":"eeprom","number":1,"camera":"left","word":2047,"words":2}',
        b'{"type":"eeprom","number":1,"camera":"left","word":0,"words":0}',
        b'{"type":"other","number":1}',
    ],
)
def test_a_line_that_is_no_request_is_answered(ends: Ends, line: bytes) -> None:
    with pytest.raises(InputError):
        decode_request(line)
    ends.send(line + b"\n" + encode_line(REQUEST))
    if line:
        reply = ends.reply()
        assert (reply.number, reply.code, reply.finished) == (0, "bus.request", True)
    assert ends.take() == REQUEST
    assert ends.port.refused == bool(line)


def test_a_line_without_end_is_answered_and_left_out(ends: Ends) -> None:
    ends.send(b"x" * (MAX_LINE_BYTES + 1))
    assert ends.reply().what == "A request is too long."
    ends.send(b"x" * 1500 + b"\n" + encode_line(REQUEST))
    assert ends.take() == REQUEST


def test_a_request_may_come_in_pieces(ends: Ends) -> None:
    request = ObjectRequest(1, "left", 0x8010, 0, bytes(50_000))
    line = encode_line(request)
    for at in range(0, len(line), 7001):
        ends.send(line[at : at + 7001])
    assert ends.take() == request


def test_more_requests_than_have_room_are_answered_with_an_error(ends: Ends) -> None:
    for number in range(1, MAX_REQUESTS + 4):
        ends.send(encode_line(ObjectRequest(number, "left", 1, 0)))
    refused = [ends.reply() for _ in range(3)]
    assert [reply.number for reply in refused] == [MAX_REQUESTS + k for k in (1, 2, 3)]
    assert {reply.code for reply in refused} == {"bus.busy"}
    assert [ends.take().number for _ in range(MAX_REQUESTS)] == list(range(1, MAX_REQUESTS + 1))


def test_a_cancelled_request_is_not_given_out(ends: Ends) -> None:
    ends.send(encode_line(REQUEST) + encode_line(CancelRequest(7)))
    ends.send(encode_line(ObjectRequest(8, "left", 1, 0)))
    until = time.monotonic() + HANG_S
    while not ends.port.is_cancelled(7) and time.monotonic() < until:
        time.sleep(0.001)
    assert ends.take().number == 8


def test_answers_that_nobody_reads_never_stop_the_bus(ends: Ends) -> None:
    value = bytes(100_000)
    for number in range(1, MAX_REPLIES + 100):
        ends.port.reply(ObjectReply(number, number, number, finished=False))
        ends.port.reply(ObjectReply(number, finished=True, value=value))
    # One may be on its way into the pipe.
    assert ends.port.dropped >= 99 + MAX_REPLIES // 2
    got = [ends.reply() for _ in range(MAX_REPLIES)]
    finished = [reply for reply in got if reply.finished]
    assert all(reply.value == value for reply in finished)
    assert [reply.number for reply in finished] == sorted(reply.number for reply in finished)
    # Progress reports give way to final replies.
    assert len(finished) > MAX_REPLIES // 2


def test_the_end_of_the_input_is_told_once_and_answers_still_go_out(ends: Ends) -> None:
    line = encode_line(REQUEST)
    ends.send(line)
    os.dup2(os.open(os.devnull, os.O_WRONLY), ends.write)
    assert ends.ended.wait(HANG_S)
    assert ends.take() == REQUEST
    ends.port.reply(ObjectReply(7, finished=True, value=b"\x01"))
    assert ends.reply().value == b"\x01"


def test_the_last_answers_are_sent_on_close(ends: Ends) -> None:
    for number in range(1, 21):
        ends.port.reply(ObjectReply(number, finished=True, value=bytes(1000)))
    ends.port.close()
    assert [ends.reply().number for _ in range(20)] == list(range(1, 21))
    ends.port.reply(ObjectReply(21))
    assert ends.port.dropped == 1


def test_a_reader_that_is_gone_does_not_end_the_port(ends: Ends) -> None:
    spare, other = os.pipe()
    os.dup2(spare, ends.read)
    ends.port.reply(ObjectReply(1, finished=True))
    ends.send(encode_line(REQUEST))
    assert ends.take() == REQUEST
    os.close(spare)
    os.close(other)


def test_the_first_line_leaves_the_rest_alone() -> None:
    read, write = os.pipe()
    os.write(write, b'{"a": 1}\nrest')
    assert read_first_line(read) == b'{"a": 1}\n'
    assert os.read(read, 100) == b"rest"
    os.close(write)
    assert read_first_line(read) == b""
    os.close(read)
