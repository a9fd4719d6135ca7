"""Two copies of each answer on a ring: put together, and what they say about the cables."""

from __future__ import annotations

import pytest

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.datagrams import Command, Datagram, decode_frame, encode_frame
from ocmm_core.fieldbus.ring_cable import RingCable, merge

STATUS = 0x0130


def count(answers: int, bits: int = 0) -> Datagram:
    return Datagram(Command.BRD, answers, STATUS, bytes((bits, 0)), answers)


def state(value: int, answers: int) -> Datagram:
    return Datagram(Command.FPRD, 0x1001, STATUS, bytes((value, 0)), answers)


def answer_of(ring: RingCable, near: list[Datagram], far: list[Datagram]) -> list[Datagram]:
    """Let one copy come in at each end and return what they make."""
    assert ring.take(0, encode_frame(0x80, near), 0x80) is None
    whole = ring.take(1, encode_frame(0x80, far), 0x80)
    assert whole is not None
    return list(decode_frame(whole)[1])


def test_on_a_whole_ring_the_copy_that_was_worked_on_counts() -> None:
    ring = RingCable()
    for _ in range(5):
        answer = answer_of(ring, [count(0), state(0, 0)], [count(2, 8), state(8, 1)])
        assert [one.working_counter for one in answer] == [2, 1]
        assert answer[1].data == b"\x08\x00"
    assert not ring.is_open


def test_on_an_open_ring_each_end_adds_its_cameras() -> None:
    ring = RingCable()
    opened = []
    for _ in range(4):
        answer = answer_of(ring, [count(1, 8), state(8, 1)], [count(1, 4), state(0, 0)])
        assert (answer[0].working_counter, answer[0].data) == (2, b"\x0c\x00")
        assert (answer[1].working_counter, answer[1].data) == (1, b"\x08\x00")
        opened.append(ring.is_open)
    assert opened == [False, False, True, True]
    answer_of(ring, [count(0)], [count(2)])
    assert not ring.is_open


def test_an_end_that_is_cut_off_leaves_one_copy() -> None:
    ring = RingCable()
    for _ in range(3):
        frame = encode_frame(0x81, [count(2)])
        assert ring.take(0, frame, 0x81) is None
        assert ring.settle() == [frame]
    assert ring.is_open
    assert ring.settle() == []


def test_an_old_copy_at_the_same_end_is_not_the_counterpart() -> None:
    ring = RingCable()
    assert ring.take(0, encode_frame(0x82, [count(1)]), 0x82) is None
    assert ring.take(0, encode_frame(0x82, [count(0)]), 0x82) is None
    assert ring.take(1, encode_frame(0x82, [count(2)]), 0x82) is not None


def test_frames_that_are_no_copies_of_each_other_are_refused() -> None:
    with pytest.raises(BusError, match="Two copies"):
        merge([count(1)], [state(8, 1)])


def test_a_damaged_copy_is_passed_on_for_the_channel_to_refuse() -> None:
    ring = RingCable()
    assert ring.take(1, encode_frame(0x83, [count(2)]), 0x83) is None
    damaged = encode_frame(0x83, [count(0)])[:20]
    assert ring.take(0, damaged, 0x83) == damaged
