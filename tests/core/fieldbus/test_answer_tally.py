"""Answers to the process data: fresh, late, doubled and foreign ones are distinguished."""

from __future__ import annotations

import struct

from ocmm_core.fieldbus.device import OUTPUT_STRUCT
from ocmm_core.fieldbus.wire._tally import N_INDICES, AnswerTally


def answer(index: int, token: int, *, first: bool = True, count: int = 0) -> bytes:
    """Return an answer whose first datagram brings back outputs (or inputs of a camera)."""
    data = OUTPUT_STRUCT.pack(1, 0, 77, token) if first else b"\xaa" * OUTPUT_STRUCT.size
    head = struct.pack("<BBHHHH", 12, index, 0, 0, len(data), 0)
    return b"\xff" * 12 + b"\x88\xa4" + bytes(2) + head + data + struct.pack("<H", count)


def cycle(tally: AnswerTally, token: int, start: int) -> None:
    tally.expect(token)
    assert tally.receive(answer(start % N_INDICES, token))
    assert tally.receive(answer((start + 1) % N_INDICES, token, first=False))
    assert tally.missing == 0


def learnt() -> AnswerTally:
    tally = AnswerTally()
    tally.learn([answer(3, 0), answer(4, 0, first=False)])
    return tally


def test_every_answer_is_expected_in_turn_around_all_indices() -> None:
    tally = learnt()
    for number in range(40):
        cycle(tally, number + 1, 5 + 2 * number)
    assert (tally.frames, tally.stray, tally.late) == (2, 0, 0)


def test_indices_that_were_used_for_something_else_are_followed() -> None:
    tally = learnt()
    cycle(tally, 1, 9)
    cycle(tally, 2, 11)
    assert tally.stray == 0


def test_doubled_answers_do_not_stand_for_missing_ones() -> None:
    tally = learnt()
    tally.expect(1)
    assert tally.receive(answer(5, 1))
    assert not tally.receive(answer(5, 1))
    assert tally.missing == 1
    assert (tally.stray, tally.late) == (1, 0)


def test_an_answer_of_the_cycle_before_is_late_and_not_taken() -> None:
    tally = learnt()
    tally.expect(1)
    tally.expect(2)
    assert not tally.receive(answer(5, 1))
    assert not tally.receive(answer(6, 1, first=False))
    assert tally.missing == 2
    assert (tally.stray, tally.late) == (2, 2)
    assert tally.receive(answer(7, 2))


def test_an_answer_sixteen_frames_late_has_the_right_index_and_is_not_taken() -> None:
    tally = learnt()
    for number in range(1, 9):
        tally.expect(number)
    tally.expect(9)
    assert not tally.receive(answer(5, 1))
    assert tally.missing == 2
    assert tally.receive(answer(5, 9))


def test_answers_of_one_cycle_may_come_in_another_order() -> None:
    tally = learnt()
    tally.expect(1)
    assert tally.receive(answer(6, 1, first=False))
    assert tally.receive(answer(5, 1))
    assert tally.missing == 0
    assert tally.stray == 1


def test_the_counts_of_what_came_add_up_and_begin_anew() -> None:
    tally = learnt()
    tally.expect(1)
    assert tally.receive(answer(5, 1, count=5))
    assert tally.working_counter == 5
    # Nobody waits for it, and it counts nothing.
    assert not tally.receive(answer(5, 1, count=5))
    assert tally.receive(answer(6, 1, first=False, count=1))
    assert tally.working_counter == 6
    tally.expect(2)
    assert tally.working_counter == 0
