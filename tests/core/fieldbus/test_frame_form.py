"""A frame of a fixed form is built and read in one pass, with the results of full parsing."""

from __future__ import annotations

import numpy as np

from ocmm_core.fieldbus.wire import (
    Command,
    Datagram,
    Job,
    ServiceChannel,
    decode_frame,
    encode_frame,
)
from ocmm_core.fieldbus.wire._datagrams import FrameForm


def _mixed(rng: np.random.Generator) -> list[Datagram]:
    return [
        Datagram(
            int(rng.choice([Command.BRD, Command.FPRD, Command.FPWR, Command.FRMW])),
            int(rng.integers(1 << 16)),
            int(rng.integers(1 << 16)),
            rng.bytes(int(rng.integers(1, 40))),
            int(rng.integers(4)),
        )
        for _ in range(int(rng.integers(1, 7)))
    ]


def test_a_frame_in_a_known_form_is_the_same_frame() -> None:
    rng = np.random.default_rng(5)
    for _ in range(200):
        datagrams = _mixed(rng)
        form = FrameForm(datagrams)
        for index in (0x80, 0xFF):
            frame = encode_frame(index, datagrams)
            assert form.encode(index) == frame
            assert form.answers(frame) == list(decode_frame(frame)[1])


def test_a_known_form_takes_nothing_that_would_not_be_taken_apart_the_same() -> None:
    rng = np.random.default_rng(6)
    for _ in range(40):
        datagrams = _mixed(rng)
        form, frame = FrameForm(datagrams), encode_frame(0x80, datagrams)
        assert form.answers(frame[: 16 + 10]) is None
        for bit in rng.choice(8 * len(frame), 100):
            damaged = bytearray(frame)
            damaged[bit // 8] ^= 1 << bit % 8
            answers = form.answers(bytes(damaged))
            if answers is None:
                continue
            assert answers == list(decode_frame(bytes(damaged))[1])
            asked = [(item.command, item.register, len(item.data)) for item in datagrams]
            assert [(item.command, item.register, len(item.data)) for item in answers] == asked


def test_an_answer_with_a_flag_that_the_question_had_not_is_taken() -> None:
    channel = ServiceChannel()
    seen: list[Datagram | None] = []
    question = Job(Datagram(Command.BRD, 0, 0x0130, bytes(2)), seen.append)
    frame = channel.compose([question, question])
    assert frame is not None
    # The slave's circulating bit is next to the length.
    marked = bytearray(frame)
    marked[16 + 7] |= 0x40
    assert channel.receive(bytes(marked))
    assert [answer is not None for answer in seen] == [True, True]


def test_questions_in_many_forms_each_get_their_own_answer() -> None:
    channel = ServiceChannel()
    lasting = [Datagram(Command.BRD, 0, 0x0130 + turn, bytes(2)) for turn in range(3)]
    for turn in range(200):
        told: list[Datagram | None] = []
        # One that lasts, and one that exists for this question alone.
        once = Datagram(Command.FPRD, turn, 0x1000, bytes(1 + turn % 50))
        asked = [lasting[turn % 3], once]
        frame = channel.compose([Job(datagram, told.append) for datagram in asked])
        assert frame is not None
        assert list(decode_frame(frame)[1]) == asked
        assert channel.receive(frame)
        assert told == asked
