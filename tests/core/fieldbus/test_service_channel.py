"""The service channel parallel to the cycle: states, mailboxes and EEPROM, on a lossy wire."""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
import pytest

from ocmm_core.fieldbus.cycle._watch import StateWatch
from ocmm_core.fieldbus.device import SYNC_MANAGERS
from ocmm_core.fieldbus.objects import (
    EepromRequest,
    MailboxAreas,
    ObjectReply,
    ObjectRequest,
    ObjectService,
)
from ocmm_core.fieldbus.objects._objects import Request
from ocmm_core.fieldbus.report import Alarm
from ocmm_core.fieldbus.wire import Command, Datagram, Job, ServiceChannel, frame_index
from ocmm_core.fieldbus.wire._service import FIRST_INDEX
from ocmm_sim.slave import Segment, SoftwareCamera, TestPattern, sii_image
from ocmm_sim.slave import registers as reg

NAMES = ("left", "right")
STATIONS = (0x1001, 0x1002)
CYCLE_NS = 1_000_000
IDENTITY, INTRINSICS, NOTE = 0x1018, 0x8010, 5
NOTE_TEXT = bytes(65 + n % 26 for n in range(1200))


@dataclass
class Desk:
    """A requester that keeps the answers."""

    requests: deque[Request] = field(default_factory=deque)
    replies: list[ObjectReply] = field(default_factory=list)
    cancelled: set[int] = field(default_factory=set)

    def next_request(self) -> Request | None:
        return self.requests.popleft() if self.requests else None

    def is_cancelled(self, number: int) -> bool:
        return number in self.cancelled

    def reply(self, reply: ObjectReply) -> None:
        self.replies.append(reply)

    def last(self, number: int) -> ObjectReply | None:
        done = [reply for reply in self.replies if reply.number == number and reply.finished]
        assert len(done) <= 1
        return done[0] if done else None


class Line:
    """Two cameras in PREOP and the master's service channel, with selectable losses."""

    def __init__(self, lose: Callable[[int], bool] = lambda _frame: False) -> None:
        pattern = TestPattern()
        self.cameras = [SoftwareCamera(n, 1001 + n, n + 1, pattern) for n in range(2)]
        self.segment = Segment([camera.esc for camera in self.cameras])
        self.desk = Desk()
        self.channel = ServiceChannel()
        self.watch = StateWatch(STATIONS)
        self.objects = ObjectService(self.desk, NAMES)
        self.cycle = 0
        self.lost = 0
        self._lose = lose
        self.delayed: deque[bytes] = deque()
        for number, camera in enumerate(self.cameras):
            camera.esc.write(reg.STATION_ADDRESS, struct.pack("<H", STATIONS[number]))
            for sync_manager in range(2):
                start, length, control, _, active, _ = SYNC_MANAGERS[sync_manager]
                content = struct.pack("<HHBBBB", start, length, control, 0, active, 0)
                camera.esc.write(reg.SYNC_MANAGER + 8 * sync_manager, content)
            camera.esc.write(reg.AL_CONTROL, struct.pack("<H", reg.PREOP))
            assert camera.esc.state == reg.PREOP
        areas = MailboxAreas.decode(bytes(self.cameras[0].esc.memory[0x0800:0x0810]))
        self.objects.attach({name: (STATIONS[n], areas) for n, name in enumerate(NAMES)})

    def run(self, cycles: int) -> None:
        for _ in range(cycles):
            self.cycle += 1
            self.objects.work(self.cycle * CYCLE_NS)
            sent = self.channel.compose(self._jobs())
            if sent is None:
                continue
            assert len(sent) <= 1514
            frame = bytearray(sent)
            # Lost on the way there, or on the way back: the cameras worked on it or not.
            if self._lose(2 * self.cycle):
                self.lost += 1
                continue
            for camera in self.cameras:
                camera.generate(self.cycle * CYCLE_NS)
            assert self.segment.process(frame, self.cycle * CYCLE_NS)
            if self._lose(2 * self.cycle + 1):
                self.lost += 1
                continue
            assert self.channel.receive(bytes(frame))

    def ask(self, request: Request, cycles: int = 3000) -> ObjectReply:
        self.desk.requests.append(request)
        for _ in range(cycles):
            self.run(1)
            reply = self.desk.last(request.number)
            if reply is not None:
                return reply
        raise AssertionError(f"no answer within {cycles} cycles")

    def _jobs(self) -> Iterator[Job]:
        yield from self.watch.jobs()
        yield from self.objects.jobs()


def random_loss(share: float, seed: int) -> Callable[[int], bool]:
    rng = np.random.default_rng(seed)
    return lambda _frame: bool(rng.random() < share)


def test_states_are_known_in_the_same_cycle() -> None:
    line = Line()
    line.run(1)
    view = line.watch.view
    assert (view.age, view.devices) == (0, 2)
    assert [camera.state for camera in view.cameras] == [reg.PREOP, reg.PREOP]
    line.cameras[1].esc.fall_back(reg.INIT, 0x1B)
    line.run(1)
    right = line.watch.view.cameras[1]
    assert (right.state, right.error, right.code) == (reg.INIT, True, 0x1B)


def test_a_lost_address_and_a_doubled_one_are_seen() -> None:
    line = Line()
    line.cameras[1].esc.write(reg.STATION_ADDRESS, bytes(2))
    line.run(1)
    assert [camera.answers for camera in line.watch.view.cameras] == [1, 0]
    assert line.watch.view.devices == 2
    line.cameras[1].esc.write(reg.STATION_ADDRESS, struct.pack("<H", STATIONS[0]))
    line.run(1)
    assert [camera.answers for camera in line.watch.view.cameras] == [2, 0]


def test_what_was_known_grows_old_without_answers() -> None:
    line = Line(lambda frame: frame > 20)
    line.run(30)
    assert line.watch.view.age == 21


def test_objects_are_read_and_written() -> None:
    line = Line()
    reply = line.ask(ObjectRequest(1, "right", IDENTITY, 4))
    assert reply.value == struct.pack("<I", 1002)
    # One cycle to write the request and have it answered, one to notice.
    assert line.cycle <= 3
    refused = line.ask(ObjectRequest(2, "left", IDENTITY, 4, value=bytes(4)))
    assert refused.code == Alarm.OBJECT_REFUSED
    assert "0x06010002" in refused.what
    unknown = line.ask(ObjectRequest(3, "third", IDENTITY, 4))
    assert "'third'" in unknown.what
    assert (line.objects.done, line.objects.failed) == (1, 2)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_long_objects_survive_a_wire_that_loses_every_tenth_frame(seed: int) -> None:
    line = Line(random_loss(0.1, seed))
    written = line.ask(ObjectRequest(1, "left", INTRINSICS, NOTE, value=NOTE_TEXT))
    assert written.code == ""
    read = line.ask(ObjectRequest(2, "left", INTRINSICS, NOTE))
    assert (read.code, read.value) == ("", NOTE_TEXT)
    assert line.lost > 0


def test_a_camera_that_hangs_fails_its_own_requests_only() -> None:
    line = Line()
    line.cameras[0].mailbox_hangs = True
    for number in range(1, 4):
        line.desk.requests.append(ObjectRequest(number, "left", IDENTITY, 4))
    begin = line.cycle
    reply = line.ask(ObjectRequest(9, "right", IDENTITY, 4))
    assert reply.value == struct.pack("<I", 1002)
    assert line.cycle - begin <= 3
    line.run(501)
    first = line.desk.last(1)
    assert first is not None
    assert first.code == Alarm.OBJECT_TIMEOUT
    assert "'left'" in first.what
    line.run(1010)
    assert line.desk.last(3) is not None
    line.run(5)
    assert line.watch.view.cameras[0].state == reg.PREOP


def test_a_cancelled_request_makes_room() -> None:
    line = Line()
    line.cameras[0].mailbox_hangs = True
    line.desk.requests.append(ObjectRequest(1, "left", IDENTITY, 4))
    line.run(5)
    line.desk.cancelled.add(1)
    line.run(2)
    line.cameras[0].mailbox_hangs = False
    assert line.ask(ObjectRequest(2, "left", IDENTITY, 4)).value == struct.pack("<I", 1001)
    assert line.desk.last(1) is None


def test_emergencies_come_without_being_asked_for_and_disturb_no_transfer() -> None:
    line = Line()
    line.cameras[1].emergency(0x4210, 0x09, b"\x01\x02\x03\x04\x05")
    line.run(20)
    assert [(camera, item.code) for camera, item in line.objects.emergencies] == [("right", 0x4210)]
    line.ask(ObjectRequest(2, "right", INTRINSICS, NOTE, value=NOTE_TEXT))
    line.desk.requests.append(ObjectRequest(1, "right", INTRINSICS, NOTE))
    line.run(2)
    line.cameras[1].emergency(0x4210, 0x09, b"\x01\x02\x03\x04\x05")
    line.run(30)
    reply = line.desk.last(1)
    assert reply is not None
    assert (reply.code, reply.value) == ("", NOTE_TEXT)
    assert len(line.objects.emergencies) == 2


@pytest.mark.parametrize("loss", [0.0, 0.1])
def test_the_eeprom_is_read(loss: float) -> None:
    line = Line(random_loss(loss, 4))
    reply = line.ask(EepromRequest(1, "right", 4, 61))
    assert reply.value == sii_image(1002, 2)[8 : 8 + 122]


def test_a_new_bring_up_begins_what_was_under_way_anew() -> None:
    line = Line()
    line.ask(ObjectRequest(2, "left", INTRINSICS, NOTE, value=NOTE_TEXT))
    line.desk.requests.append(ObjectRequest(1, "left", INTRINSICS, NOTE))
    line.run(2)
    areas = MailboxAreas.decode(bytes(line.cameras[0].esc.memory[0x0800:0x0810]))
    line.channel.abandon()
    line.objects.attach({name: (STATIONS[n], areas) for n, name in enumerate(NAMES)})
    line.run(40)
    reply = line.desk.last(1)
    assert reply is not None
    assert reply.code == ""


def _question(seen: list[Datagram | None], size: int = 2) -> Job:
    return Job(Datagram(Command.BRD, 0, 0x0130, bytes(size)), seen.append)


def test_answers_twice_late_or_of_others_are_counted_and_left_alone() -> None:
    channel = ServiceChannel()
    seen: list[Datagram | None] = []
    frames = []
    for _ in range(3):
        frame = channel.compose([_question(seen)])
        assert frame is not None
        index = frame_index(frame)
        assert index is not None
        assert index >= FIRST_INDEX
        frames.append(frame)
    # Out of order, but in time.
    assert channel.receive(frames[2])
    assert channel.receive(frames[0])
    assert not channel.receive(frames[0])
    foreign = bytearray(frames[1])
    foreign[16] = Command.BWR
    assert not channel.receive(bytes(foreign))
    assert not channel.receive(frames[1][:26])
    assert channel.stray == 3
    for _ in range(7):
        channel.compose([])
    assert seen[2:] == [None]
    assert not channel.receive(frames[1])
    assert (channel.answered, channel.given_up, channel.stray) == (2, 1, 4)


def test_what_does_not_fit_is_put_off_and_never_waits() -> None:
    channel = ServiceChannel()
    seen: list[Datagram | None] = []
    frame = channel.compose([_question(seen, 600), _question(seen, 1000), _question(seen, 100)])
    assert frame is not None
    assert [len(answer.data) for answer in seen if answer is not None] == [1000]
    assert channel.receive(frame)
    assert len(seen) == 3
