"""The proxy treats frames by its rules, and its log is exact."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from benchmarks.faulty_line import FrameKind, LineDirection, LineRule, LineTricks, Trick, kind_of
from ocmm_core.fieldbus.device import OUTPUT_STRUCT
from ocmm_core.fieldbus.wire import Command, Datagram, decode_frame, encode_frame


def process_frame(heartbeat: int, counter: int = 0) -> bytes:
    data = OUTPUT_STRUCT.pack(1, 0, 7, heartbeat) + bytes(88)
    return encode_frame(heartbeat % 16, [Datagram(Command.LRW, 0, 0, data, counter)])


def service_frame() -> bytes:
    return encode_frame(0x81, [Datagram(Command.BRD, 0, 0x0130, bytes(2))])


def travel(tricks: LineTricks, heartbeats: Sequence[int]) -> list[int]:
    """Send requests, bring their answers back and return the order in which they arrive."""
    arrived = []
    for heartbeat in heartbeats:
        for _delay, frame in tricks.treat(process_frame(heartbeat), LineDirection.REQUEST):
            arrived += [
                OUTPUT_STRUCT.unpack_from(answer, 26)[3]
                for _, answer in tricks.treat(frame, LineDirection.ANSWER)
            ]
    return arrived


def test_kinds_of_frames_are_told_apart() -> None:
    assert kind_of(process_frame(1)) is FrameKind.PROCESS
    assert kind_of(service_frame()) is FrameKind.SERVICE
    other = encode_frame(3, [Datagram(Command.FPRD, 0x1001, 0x0130, bytes(2))])
    assert kind_of(other) is FrameKind.OTHER


def test_without_rules_everything_passes_and_is_counted() -> None:
    tricks = LineTricks(0)
    assert travel(tricks, range(50)) == list(range(50))
    log = tricks.log(new=True)
    assert log.seen == {"request process": 50, "answer process": 50}
    assert (log.done, log.touched, log.heartbeats) == ({}, [], (0, 49))
    assert tricks.log(new=False).seen == {}


def test_exactly_the_named_answers_are_dropped_and_written_down() -> None:
    tricks = LineTricks(0)
    tricks.set_rules((LineRule(do=Trick.DROP, only=(3, 5)),))
    assert travel(tricks, range(100, 110)) == [100, 101, 102, 104, 106, 107, 108, 109]
    log = tricks.log(new=False)
    assert log.done == {"answer process drop": 2}
    assert [touched.heartbeat for touched in log.touched] == [103, 105]


def test_a_share_is_drawn_the_same_for_the_same_seed() -> None:
    arrived = []
    for seed in (1, 1, 2):
        tricks = LineTricks(seed)
        tricks.set_rules((LineRule(do=Trick.DROP, share=0.05),))
        arrived.append(travel(tricks, range(2000)))
    assert arrived[0] == arrived[1] != arrived[2]
    # Binomial, 100 +- 9.7: five standard deviations.
    assert abs(2000 - len(arrived[0]) - 100) < 49


def test_frames_are_duplicated_held_and_replayed() -> None:
    tricks = LineTricks(0)
    tricks.set_rules((LineRule(do=Trick.DUPLICATE, only=(1,)),))
    assert travel(tricks, range(3)) == [0, 1, 1, 2]
    tricks.set_rules((LineRule(do=Trick.HOLD, only=(1,)),))
    assert travel(tricks, range(4)) == [0, 2, 1, 3]
    tricks.set_rules((LineRule(do=Trick.HOLD, value=2, only=(1,)),))
    assert travel(tricks, range(5)) == [0, 2, 3, 1, 4]
    tricks.set_rules((LineRule(do=Trick.REPLAY, only=(2,)),))
    assert travel(tricks, range(4)) == [0, 1, 1, 3]


def test_a_delay_is_passed_on_with_the_frame() -> None:
    tricks = LineTricks(0)
    tricks.set_rules((LineRule(do=Trick.DELAY, value=1500),))
    assert tricks.treat(process_frame(1), LineDirection.ANSWER) == [(1_500_000, process_frame(1))]


@pytest.mark.parametrize("value", [1, -1, 65535])
def test_only_the_working_counter_is_changed(value: int) -> None:
    tricks = LineTricks(0)
    tricks.set_rules((LineRule(do=Trick.COUNTER, value=value),))
    ((_, changed),) = tricks.treat(process_frame(1, counter=6), LineDirection.ANSWER)
    (datagram,) = decode_frame(changed)[1]
    assert datagram.working_counter == (6 + value) % 65536
    assert datagram.data == decode_frame(process_frame(1, counter=6))[1][0].data


@pytest.mark.parametrize("trick", [Trick.FLIP, Trick.FLIP_DATA])
def test_one_bit_is_flipped_where_it_was_asked_for(trick: Trick) -> None:
    tricks = LineTricks(3)
    tricks.set_rules((LineRule(do=trick, value=1),))
    for heartbeat in range(200):
        frame = process_frame(heartbeat)
        ((_, changed),) = tricks.treat(frame, LineDirection.ANSWER)
        at = [place for place in range(len(frame)) if frame[place] != changed[place]]
        assert len(at) == 1
        assert (frame[at[0]] ^ changed[at[0]]).bit_count() == 1
        assert at[0] >= (26 if trick is Trick.FLIP_DATA else 14)
        assert at[0] < (126 if trick is Trick.FLIP_DATA else len(frame))


def test_rules_leave_other_kinds_and_the_other_way_alone() -> None:
    tricks = LineTricks(0)
    tricks.set_rules((LineRule(do=Trick.DROP, kinds=(FrameKind.SERVICE,)),))
    assert travel(tricks, range(10)) == list(range(10))
    assert tricks.treat(service_frame(), LineDirection.REQUEST) == [(0, service_frame())]
    assert tricks.treat(service_frame(), LineDirection.ANSWER) == []
