"""Questions of the bus process's own between those of others: never lost, never mixed up."""

from __future__ import annotations

from collections import deque

import pytest

from ocmm_core.errors import OcmmError
from ocmm_core.fieldbus.objects import ObjectReply, ObjectRequest, Thermometer, decode_request
from ocmm_core.fieldbus.objects._objects import INTERVAL_NS, Request


class Queue:
    """Other clients' requests, and their answers."""

    def __init__(self, *requests: Request) -> None:
        self.requests = deque(requests)
        self.replies: list[ObjectReply] = []

    def next_request(self) -> Request | None:
        return self.requests.popleft() if self.requests else None

    def is_cancelled(self, number: int) -> bool:
        return number == 7

    def reply(self, reply: ObjectReply) -> None:
        self.replies.append(reply)


def warm(request: Request | None, tenths: int) -> ObjectReply:
    assert isinstance(request, ObjectRequest)
    return ObjectReply(
        request.number, finished=True, value=tenths.to_bytes(2, "little", signed=True)
    )


def test_cameras_are_asked_in_turn_and_those_of_others_first() -> None:
    now = [0]
    other = ObjectRequest(5, "left", 0x1018, 4)
    port = Queue(other)
    thermometer = Thermometer(port, ("left", "right"), lambda: now[0])
    assert thermometer.next_request() == other
    first = thermometer.next_request()
    assert isinstance(first, ObjectRequest)
    assert first.number < 0
    assert thermometer.next_request() is None
    thermometer.reply(warm(first, 314))
    now[0] += INTERVAL_NS
    second = thermometer.next_request()
    thermometer.reply(warm(second, -25))
    assert sorted(thermometer.celsius.items()) == [("left", -2.5), ("right", 31.4)]
    # Nobody else hears of it, and the answer of the other reaches him.
    assert port.replies == []
    thermometer.reply(ObjectReply(5, finished=True, value=b"\x01\x02"))
    assert [reply.number for reply in port.replies] == [5]
    assert thermometer.is_cancelled(7)
    assert not thermometer.is_cancelled(-1)


def test_a_camera_that_stops_answering_has_no_temperature_any_more() -> None:
    thermometer = Thermometer(None, ("left",), lambda: 0)
    question = thermometer.next_request()
    assert isinstance(question, ObjectRequest)
    thermometer.reply(warm(question, 300))
    assert thermometer.celsius == {"left": 30.0}
    thermometer.reply(ObjectReply(question.number, finished=True, code="bus.object_timeout"))
    assert thermometer.celsius == {}


def test_nobody_else_may_ask_in_our_name() -> None:
    with pytest.raises(OcmmError):
        decode_request(b'{"type":"object","number":-1,"camera":"left","index":1,"sub":0}')
