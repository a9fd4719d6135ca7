"""A frame on a ring: its exit shows whether the ring is whole, and whether it is finished."""

from __future__ import annotations

from ocmm_core.fieldbus.wire import Command, Datagram, encode_frame
from ocmm_core.fieldbus.wire._port import RingCable

STATUS = 0x0130
FIRST, SECOND = 0, 1


def frame(answers: int) -> bytes:
    return encode_frame(0x80, [Datagram(Command.BRD, answers, STATUS, bytes(2), answers)])


def passes(ring: RingCable, end: int, answers: int = 2, *, other_has_link: bool = True) -> bool:
    """Let a frame that went in at the first end come out at ``end``."""
    ring.sent(0x80, FIRST)
    return ring.is_whole(0x80, end, frame(answers), other_has_link=other_has_link)


def test_a_frame_says_from_whom_it_is_and_how_long_it_is() -> None:
    """To all, from an address of our own in which a slave sets a bit, of EtherCAT's kind."""
    sent = frame(1)
    assert sent[:6] == b"\xff" * 6
    assert sent[6:12] == b"\0OCMM\x01"
    assert not sent[6] & 0x02
    assert sent[12:14] == b"\x88\xa4"
    # Head of 10 bytes, data, and a counter of two; kind 1 above eleven bits of length.
    assert int.from_bytes(sent[14:16], "little") == (1 << 12) + 10 + 2 + 2


def test_on_a_whole_ring_the_answer_comes_out_at_the_other_end() -> None:
    ring = RingCable()
    for _ in range(5):
        assert passes(ring, SECOND)
    assert not ring.is_open
    assert ring.reached is None


def test_what_comes_back_goes_in_at_the_other_end_and_is_the_answer_then() -> None:
    ring = RingCable()
    opened = []
    for _ in range(4):
        assert not passes(ring, FIRST, answers=1)
        assert ring.is_whole(0x80, SECOND, frame(2), other_has_link=True)
        opened.append(ring.is_open)
    assert opened == [False, False, True, True]
    assert ring.reached == 1
    assert passes(ring, SECOND)
    assert not ring.is_open
    assert ring.reached is None


def test_an_end_without_link_leaves_a_line_on_which_all_are_reached() -> None:
    ring = RingCable()
    for _ in range(3):
        assert passes(ring, FIRST, other_has_link=False)
    assert ring.is_open
    assert ring.reached is None


def test_a_frame_that_nobody_sent_says_nothing_about_the_ring() -> None:
    ring = RingCable()
    for _ in range(5):
        assert ring.is_whole(0x99, FIRST, frame(2), other_has_link=True)
    assert not ring.is_open


def test_a_damaged_frame_that_came_back_does_not_say_how_far_it_came() -> None:
    ring = RingCable()
    ring.sent(0x80, FIRST)
    assert not ring.is_whole(0x80, FIRST, frame(1)[:20], other_has_link=True)
    assert ring.reached is None


def test_the_last_64_frames_are_known_and_the_one_before_them_is_not() -> None:
    ring = RingCable()
    for index in range(65):
        ring.sent(index, FIRST)
    came_back = [not ring.is_whole(i, FIRST, frame(1), other_has_link=True) for i in range(65)]
    assert came_back == [False] + [True] * 64
