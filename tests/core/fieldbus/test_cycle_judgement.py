"""`judge` accepts fresh and complete answers, and names all others."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from benchmarks.bus_identity import KINDS, try_cycles
from ocmm_core.acquisition.frames import FrameFlag
from ocmm_core.fieldbus.cycle import (
    CameraPast,
    CycleAnswer,
    CycleFault,
    Schedule,
    Trouble,
    advance,
    first_frame,
    judge,
)
from ocmm_core.fieldbus.cycle._health import frames_complaint, is_sound
from ocmm_core.fieldbus.cycle._watch import CameraView, PortTrouble, WatchView
from ocmm_core.fieldbus.device import (
    DATA_CRC_AT,
    FRAME_DTYPE,
    FRAMES_PER_CYCLE,
    HEADER_STRUCT,
    INPUT_DTYPE,
    INPUT_LAYOUTS,
    NEWEST_LAYOUT,
    SUBPIXELS,
    CameraConfig,
    CameraStatus,
    Header,
)
from ocmm_core.fieldbus.report import Alarm

PERIOD = 125_000
START = 700_000_000_000
CRC = CameraConfig().crc()
SCHEDULE = Schedule(START, PERIOD, CRC)
SERIALS = (1001, 1002)
LAYOUT = NEWEST_LAYOUT
RUNNING = CameraStatus.OPERATIONAL | CameraStatus.SYNCHRONISED
IN_OPERATION = CameraView(answers=1, state=8)


def header(first: int, count: int = 8, cycle: int = 5) -> Header:
    return Header(first % 2**32, START + first * PERIOD, PERIOD, count, cycle, RUNNING, CRC, 1)


def content(item: Header, serial: int, **first_frame_fields: int) -> bytes:
    """Return the whole input of a camera, with a check sum that fits."""
    frames = np.zeros(FRAMES_PER_CYCLE, FRAME_DTYPE)
    frames["valid"], frames["xy"] = 0xFF, 900 << 16
    for name, value in first_frame_fields.items():
        frames[name][0] = value
    whole = bytearray((LAYOUT.encode(item) + frames.tobytes()).ljust(INPUT_DTYPE.itemsize))
    struct.pack_into("<I", whole, DATA_CRC_AT, LAYOUT.crc(whole, serial))
    return bytes(whole)


def answer(*headers: Header, clock: int | None = None) -> CycleAnswer:
    ends = [item.start_ns + item.frames_valid * PERIOD for item in headers]
    return CycleAnswer(
        whole=True,
        working_counter=6,
        expected_working_counter=6,
        clock_ns=max(ends, default=0) if clock is None else clock,
        clock_plausible=True,
        view=WatchView(0, 2, (IN_OPERATION, IN_OPERATION)),
        inputs=tuple(content(*each) for each in zip(headers, SERIALS, strict=False)),
        headers=headers,
    )


def seen(
    given: CycleAnswer, *, devices: int = 2, age: int = 0, **right: int | bool | PortTrouble
) -> CycleAnswer:
    """Return the answer with another view of the right camera."""
    view = WatchView(age, devices, (IN_OPERATION, IN_OPERATION._replace(**right)))  # type: ignore[arg-type]  # the fields are ints and bools
    return given._replace(view=view)


def records(next_frame: int) -> list[CameraPast]:
    return [
        CameraPast(name, next_frame, 4, 1, mark=LAYOUT.mark(serial))
        for name, serial in zip(("left", "right"), SERIALS, strict=True)
    ]


def test_a_healthy_cycle_is_accepted_and_moves_the_record_on() -> None:
    given = answer(header(100), header(100))
    assert judge(given, records(100), SCHEDULE) is None
    assert advance(records(100)[0], given.headers[0], 100) == records(108)[0]._replace(
        cycle_counter=5
    )


def test_an_answer_that_came_and_was_not_taken_is_the_computers_and_no_cameras() -> None:
    given = answer(header(100), header(100))._replace(
        whole=False, working_counter=0, untaken=True, late=True
    )
    fault = judge(given, records(100), SCHEDULE)
    assert fault is not None
    assert (fault.trouble, fault.alarm, fault.camera) == (Trouble.LOST, Alarm.HOST_BUSY, "")
    assert "busy" in fault.reason


def test_frames_sent_again_are_accepted_and_do_not_move_it_back() -> None:
    again = header(90)
    assert judge(answer(again, header(100)), records(100), SCHEDULE) is None
    assert advance(records(100)[0], again, 90).next_frame == 100


def test_the_counter_may_wrap_at_32_bits() -> None:
    first = 2**32 + 17
    assert judge(answer(header(first), header(first)), records(first), SCHEDULE) is None
    assert first_frame(header(first), SCHEDULE) == first


def test_before_the_first_exposure_there_is_nothing_wrong() -> None:
    waiting = header(0, count=0)
    assert judge(answer(waiting, waiting, clock=START - 50_000_000), records(0), SCHEDULE) is None


def test_frames_dropped_by_a_full_buffer_are_accepted_when_the_camera_says_so() -> None:
    gap = header(300)._replace(status=RUNNING | CameraStatus.OVERRUN)
    assert judge(answer(gap, header(100), clock=gap.start_ns), records(100), SCHEDULE) is None


def test_no_answer_is_lost_and_the_reason_is_told_apart() -> None:
    nothing = answer()._replace(whole=False, inputs=(), headers=())
    for change, alarm in (
        ({}, Alarm.LOST_ANSWERS),
        ({"late": True}, Alarm.LATE_ANSWERS),
        ({"silent_cycles": 3}, Alarm.SILENT),
        ({"silent_cycles": 3, "link": "has no link"}, Alarm.LINK_DOWN),
    ):
        fault = judge(nothing._replace(**change), records(0), SCHEDULE)
        assert fault is not None
        assert (fault.trouble, fault.alarm) == (Trouble.LOST, alarm)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"status": RUNNING & ~CameraStatus.OPERATIONAL}, "left_operation: not in operation"),
        ({"status": RUNNING & ~CameraStatus.SYNCHRONISED}, "sync: not synchronised"),
        ({"boot_counter": 2}, "restarted: was restarted"),
        ({"cycle_counter": 4}, "frozen: repeated old data"),
        ({"cycle_counter": 3}, "frozen: repeated old data"),
        ({"config_crc": CRC ^ 1}, "configuration: a configuration other"),
        ({"period_ns": 250_000}, "frame_rate: every 250000 ns"),
        ({"frames_valid": 13}, "payload: 13 frames"),
        ({"counter": 101}, "payload: do not fit together"),
        ({"start_ns": START + 100 * PERIOD + 1}, "payload: do not fit together"),
        ({"start_ns": START - PERIOD, "counter": 2**32 - 1}, "payload: do not fit together"),
        ({"start_ns": START + 300 * PERIOD, "counter": 300}, "gap: skipped frames"),
    ],
)
def test_one_wrong_field_spoils_the_whole_cycle(change: dict[str, int], words: str) -> None:
    given = answer(header(100), header(100)._replace(**change))
    code, words = words.split(": ")
    fault = judge(given, records(100), SCHEDULE)
    assert fault is not None
    assert fault.trouble is Trouble.BAD
    assert fault.alarm == f"bus.{code}"
    assert fault.camera == "right"
    assert "'right'" in fault.reason
    assert words in fault.reason


def test_every_single_flipped_bit_is_found() -> None:
    good = answer(header(100), header(100))
    whole = good.inputs[1]
    rng = np.random.default_rng(1)
    for bit in rng.choice(8 * len(whole), 300, replace=False):
        damaged = bytearray(whole)
        damaged[bit // 8] ^= 1 << bit % 8
        headers = (good.headers[0], LAYOUT.decode(bytes(damaged)))
        given = good._replace(inputs=(good.inputs[0], bytes(damaged)), headers=headers)
        fault = judge(given, records(100), SCHEDULE)
        assert fault is not None
        assert (fault.alarm, fault.camera) == (Alarm.PAYLOAD, "right")


@pytest.mark.parametrize(
    "fields", [{"valid": 0x1FF}, {"flags": 0x8000}, {"xy": 9000 << 16}, {"xy": -(2**31)}]
)
def test_frames_that_cannot_be_are_refused_although_the_check_sum_fits(
    fields: dict[str, int],
) -> None:
    good = answer(header(100), header(100))
    given = good._replace(inputs=(good.inputs[0], content(header(100), SERIALS[1], **fields)))
    fault = judge(given, records(100), SCHEDULE)
    assert fault is not None
    assert fault.alarm is Alarm.PAYLOAD


def test_the_fast_check_passes_nothing_that_the_exact_one_refuses() -> None:
    """4,000 inputs with one word at an edge or random; only a spot at the limit needs both."""
    rng = np.random.default_rng(2)
    plain = content(header(100), SERIALS[0])
    limit = 8192 * SUBPIXELS
    edges = [
        limit,
        limit + 1,
        limit - 1,
        -limit,
        -limit - 1,
        2**31 - 1,
        -(2**31),
        0,
        0x1FF,
        0xF00FF,
    ]
    refused = 0
    for _ in range(4000):
        image = bytearray(plain)
        frame = int(rng.integers(FRAMES_PER_CYCLE))
        at = HEADER_STRUCT.size + frame * FRAME_DTYPE.itemsize + 4 * int(rng.integers(17))
        word = int(rng.choice(edges) if rng.random() < 0.8 else rng.integers(-(2**31), 2**31))
        struct.pack_into("<i", image, at, word)
        right = frames_complaint(bytes(image), FRAMES_PER_CYCLE) is None
        assert is_sound(bytes(image)) == (right and word != limit)
        refused += not right
    # Some of the edges are no spots of any sensor, and most are no marks of a frame.
    assert 1600 < refused < 2800


def test_the_input_of_another_camera_is_refused_and_both_are_named() -> None:
    good = answer(header(100), header(100))
    for inputs, place, owner in (
        (good.inputs[::-1], "left", "right"),
        ((good.inputs[0], good.inputs[0]), "right", "left"),
        ((good.inputs[1], good.inputs[1]), "left", "right"),
    ):
        fault = judge(good._replace(inputs=inputs), records(100), SCHEDULE)
        assert fault is not None
        assert (fault.alarm, fault.camera) == (Alarm.EXCHANGED, place)
        assert f"'{owner}' came in the place of camera '{place}'" in fault.reason


def test_nothing_swapped_copied_old_or_flipped_passes() -> None:
    found = try_cycles(5000, seed=20261125)
    assert set(found.tried) == set(KINDS)
    assert not any(found.passed.values()), found.passed


def test_cameras_of_the_first_revision_are_still_read() -> None:
    first = INPUT_LAYOUTS[0x00020000]
    items = (header(100), header(100))
    inputs = []
    for item in items:
        plain = content(item, SERIALS[0])
        image = bytearray(first.encode(item) + plain[HEADER_STRUCT.size :])
        struct.pack_into("<I", image, DATA_CRC_AT, first.crc(image, 0))
        inputs.append(bytes(image))
    given = answer(*items)._replace(inputs=tuple(inputs))
    assert tuple(map(first.decode, inputs)) == tuple(
        item._replace(data_crc=first.decode(image).data_crc)
        for item, image in zip(items, inputs, strict=True)
    )
    old = [record._replace(layout=first, mark=first.mark(1)) for record in records(100)]
    assert judge(given, old, SCHEDULE) is None
    # Their data are not accepted as those of a camera that sends its serial number.
    fault = judge(given, records(100), SCHEDULE)
    assert fault is not None
    assert fault.alarm is Alarm.PAYLOAD


def test_nonsense_behind_the_valid_frames_is_nobodys_fault() -> None:
    image = bytearray(content(header(100), SERIALS[1]))
    struct.pack_into("<i", image, len(image) - 4, 2**31 - 1)
    struct.pack_into("<I", image, DATA_CRC_AT, LAYOUT.crc(image, SERIALS[1]))
    given = answer(header(100), header(100))
    given = given._replace(inputs=(given.inputs[0], bytes(image)))
    assert not is_sound(given.inputs[1])
    assert judge(given, records(100), SCHEDULE) is None


def test_every_flag_of_a_frame_may_be_set() -> None:
    good = answer(header(100), header(100))
    flags = sum(int(flag) for flag in FrameFlag)
    given = good._replace(inputs=(good.inputs[0], content(header(100), SERIALS[1], flags=flags)))
    assert judge(given, records(100), SCHEDULE) is None


@pytest.mark.parametrize(
    ("change", "alarm", "camera", "deep"),
    [
        ({"answers": 2}, Alarm.DUPLICATE_ADDRESS, "right", False),
        ({"answers": 0, "devices": 1}, Alarm.CAMERA_MISSING, "right", False),
        ({"answers": 0, "devices": 2}, Alarm.RESTARTED, "right", True),
        ({"devices": 3}, Alarm.CAMERAS, "", False),
        ({"state": 1}, Alarm.RESTARTED, "right", True),
        ({"state": 2}, Alarm.LEFT_OPERATION, "right", True),
        ({"state": 4, "error": True, "code": 0x1B}, Alarm.WATCHDOG, "right", False),
        ({"state": 4, "error": True, "code": 0x1A}, Alarm.SYNC, "right", False),
        ({"state": 4, "error": True, "code": 0x2C}, Alarm.SYNC, "right", False),
        ({"state": 4}, Alarm.LEFT_OPERATION, "right", False),
        ({"state": 8, "error": True, "code": 0x11}, Alarm.LEFT_OPERATION, "right", False),
        ({"clock_offset_ns": -30_000}, Alarm.CLOCK_JUMP, "right", False),
        ({"age": 1}, Alarm.LOST_ANSWERS, "", False),
    ],
)
def test_a_full_working_counter_does_not_hide_what_the_cameras_say(
    change: dict[str, int | bool], alarm: Alarm, camera: str, deep: bool
) -> None:
    given = seen(answer(header(100), header(100)), **change)
    fault = judge(given, records(100), SCHEDULE)
    assert fault is not None
    assert (fault.trouble, fault.alarm, fault.camera) == (Trouble.BAD, alarm, camera)
    assert fault.deep is deep


def test_a_short_working_counter_names_the_camera_that_did_not_take_part() -> None:
    stale = header(100)._replace(cycle_counter=4)
    short = answer(header(100), stale)._replace(working_counter=3)
    fault = judge(short, records(100), SCHEDULE)
    assert fault is not None
    assert (fault.alarm, fault.camera) == (Alarm.WORKING_COUNTER, "right")
    assert fault.reason == (
        "Camera 'right' did not take part in the cycle (working counter 3 of 6)."
    )
    # The port that counts broken frames locates the fault.
    port = seen(short, trouble=PortTrouble(0, broken=7, lost=1))
    fault = judge(port, records(100), SCHEDULE)
    assert fault is not None
    assert fault.reason.endswith(
        "Camera 'right' counts 7 broken frames and 1 lost link at its port IN (0)."
    )
    fault = judge(seen(short, answers=0, devices=1), records(100), SCHEDULE)
    assert fault is not None
    assert (fault.alarm, fault.camera) == (Alarm.CAMERA_MISSING, "right")


def test_a_wrong_count_with_new_inputs_of_all_blames_no_camera() -> None:
    for count in (3, 9):
        given = answer(header(100), header(100))._replace(working_counter=count)
        fault = judge(given, records(100), SCHEDULE)
        assert fault is not None
        assert (fault.alarm, fault.camera) == (Alarm.WORKING_COUNTER, "")
        assert f"(working counter {count} of 6)" in fault.reason
    nobody = answer()._replace(working_counter=0)
    fault = judge(nobody, records(100), SCHEDULE)
    assert fault is not None
    assert "No camera took part" in fault.reason


def test_a_lost_answer_names_the_port_where_frames_break() -> None:
    lost = seen(answer(header(100), header(100)), trouble=PortTrouble(1, broken=2, lost=0))
    fault = judge(lost._replace(whole=False), records(100), SCHEDULE)
    assert fault is not None
    assert (fault.alarm, fault.camera) == (Alarm.LOST_ANSWERS, "right")
    assert "2 broken frames at its port OUT (1)" in fault.reason


def test_a_clock_that_cannot_be_spoils_the_cycle() -> None:
    given = answer(header(100), header(100))._replace(clock_plausible=False)
    assert judge(given, records(100), SCHEDULE) == CycleFault(
        Trouble.BAD, Alarm.CLOCK_JUMP, "The bus clock shows an impossible time."
    )


@pytest.mark.parametrize(
    ("clock_ns", "words"), [(-30_000_000, "future"), (300_000_000, "behind the bus clock")]
)
def test_exposure_times_far_from_the_clock_are_not_believed(clock_ns: int, words: str) -> None:
    end = START + 1008 * PERIOD
    given = answer(header(1000), header(1000), clock=end + clock_ns)
    fault = judge(given, records(1000), SCHEDULE)
    assert fault is not None
    assert words in fault.reason
