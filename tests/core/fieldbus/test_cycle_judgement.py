"""`judge` accepts what is fresh and whole, and names everything else."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ocmm_core.fieldbus.camera_slave import CameraConfig, CameraStatus, Header
from ocmm_core.fieldbus.health import (
    Answer,
    CameraRecord,
    Fault,
    Schedule,
    Trouble,
    advance,
    first_frame,
    judge,
)

PERIOD = 125_000
START = 700_000_000_000
CRC = CameraConfig().crc()
SCHEDULE = Schedule(START, PERIOD, CRC)
RUNNING = CameraStatus.OPERATIONAL | CameraStatus.SYNCHRONISED


def header(first: int, count: int = 8, cycle: int = 5) -> Header:
    return Header(first % 2**32, START + first * PERIOD, PERIOD, count, cycle, RUNNING, CRC, 1)


def answer(*headers: Header, clock: int | None = None) -> Answer:
    ends = [item.start_ns + item.frames_valid * PERIOD for item in headers]
    return Answer(6, 6, True, max(ends) if clock is None else clock, headers)


def records(next_frame: int) -> list[CameraRecord]:
    return [CameraRecord(name, next_frame, 4, 1) for name in ("left", "right")]


def test_a_healthy_cycle_is_accepted_and_moves_the_record_on() -> None:
    given = answer(header(100), header(100))
    assert judge(given, records(100), SCHEDULE) is None
    assert advance(records(100)[0], given.headers[0], SCHEDULE) == CameraRecord("left", 108, 5, 1)


def test_frames_sent_again_are_accepted_and_do_not_move_it_back() -> None:
    again = header(90)
    assert judge(answer(again, header(100)), records(100), SCHEDULE) is None
    assert advance(records(100)[0], again, SCHEDULE).next_frame == 100


def test_the_counter_may_wrap_at_32_bits() -> None:
    first = 2**32 + 17
    assert judge(answer(header(first), header(first)), records(first), SCHEDULE) is None
    assert first_frame(header(first), SCHEDULE) == first


def test_before_the_first_exposure_there_is_nothing_wrong() -> None:
    waiting = header(0, count=0)
    assert judge(answer(waiting, waiting, clock=START - 50_000_000), records(0), SCHEDULE) is None


def test_frames_dropped_by_a_full_buffer_are_accepted_when_the_camera_says_so() -> None:
    gap = replace(header(300), status=RUNNING | CameraStatus.OVERRUN)
    assert judge(answer(gap, header(100), clock=gap.start_ns), records(100), SCHEDULE) is None


def test_no_answer_is_lost() -> None:
    assert judge(Answer(0, 6, True, 0, ()), records(0), SCHEDULE) == Fault(
        Trouble.LOST, "No answer from the camera bus."
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"status": RUNNING & ~CameraStatus.OPERATIONAL}, "not in operation"),
        ({"status": RUNNING & ~CameraStatus.SYNCHRONISED}, "not synchronised"),
        ({"boot_counter": 2}, "was restarted"),
        ({"cycle_counter": 4}, "repeated old data"),
        ({"config_crc": CRC ^ 1}, "another configuration"),
        ({"period_ns": 250_000}, "another configuration"),
        ({"frames_valid": 13}, "13 frames"),
        ({"counter": 101}, "do not fit together"),
        ({"start_ns": START + 100 * PERIOD + 1}, "do not fit together"),
        ({"start_ns": START - PERIOD, "counter": 2**32 - 1}, "do not fit together"),
        ({"start_ns": START + 300 * PERIOD, "counter": 300}, "left out frames"),
    ],
)
def test_one_wrong_field_spoils_the_whole_cycle(change: dict[str, int], words: str) -> None:
    given = answer(header(100), replace(header(100), **change))
    fault = judge(given, records(100), SCHEDULE)
    assert fault is not None
    assert fault.trouble is Trouble.BAD
    assert "'right'" in fault.reason
    assert words in fault.reason


def test_a_short_working_counter_or_a_lost_state_spoils_the_cycle() -> None:
    good = answer(header(100), header(100))
    short = judge(replace(good, working_counter=3), records(100), SCHEDULE)
    assert short is not None
    assert "3 of 6" in short.reason
    fallen = judge(replace(good, operational=False), records(100), SCHEDULE)
    assert fallen is not None
    assert fallen.trouble is Trouble.BAD


@pytest.mark.parametrize(
    ("clock_ns", "words"),
    [(-30_000_000, "future"), (300_000_000, "behind the bus clock")],
)
def test_exposure_times_far_from_the_clock_are_not_believed(clock_ns: int, words: str) -> None:
    end = START + 1008 * PERIOD
    given = answer(header(1000), header(1000), clock=end + clock_ns)
    fault = judge(given, records(1000), SCHEDULE)
    assert fault is not None
    assert words in fault.reason
