"""Freshness and integrity of a bus cycle: pure functions of its answers.

A full working counter proves nothing: cameras in SAFEOP or with hung firmware still answer. A cycle
is accepted only if working counter, state, cycle counter, frame counter, configuration and exposure
times of every camera agree; frames already received are skipped by their counter. Suspect data is
discarded and not acknowledged, so the camera sends it again.

Plausibility of frame contents: a checksum may cover nonsense.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import NamedTuple

import numpy as np

from ocmm_core.fieldbus import device
from ocmm_core.fieldbus.cycle._watch import CameraView, WatchView
from ocmm_core.fieldbus.report import Alarm

_SPOT_LIMIT = 8192 * device.SUBPIXELS
"""Larger than any sensor; wire units."""
_WITHOUT_COUNTER = (
    "Move the probe. If its spots move, the steps of the camera are coarser than its noise: let it "
    "send finer steps or a counter. If they do not, restart the camera."
)
_KNOWN_FRAME_FLAGS = 0x000F
_FRAME_WORDS = device.FRAME_DTYPE.itemsize // 4
_WRONG_MARKS = ~(_KNOWN_FRAME_FLAGS << 16 | (1 << device.N_SLOTS) - 1) & 0xFFFFFFFF


def _bits(words_of_frame: list[int]) -> int:
    """Return these bits of every frame of an input as one number."""
    header, frame = bytes(device.HEADER_STRUCT.size), np.array(words_of_frame, "<u4").tobytes()
    return int.from_bytes(header + device.FRAMES_PER_CYCLE * frame, "little")


_IN_MARKS = _bits([_WRONG_MARKS] + [0] * (_FRAME_WORDS - 1))
_IN_SPOTS = _bits([0] + [_SPOT_LIMIT | _SPOT_LIMIT << 1] * (_FRAME_WORDS - 1))


def is_sound(content: bytes) -> bool:
    """Return whether all numbers of a whole input are plausible, those behind the frames included.

    Fast, and exact up to spots at the limit; if False, `frames_complaint` decides.
    """
    bits = int.from_bytes(content, "little")
    # The highest bits of a small number are equal: differing neighbours are far outside.
    return not ((bits ^ bits >> 1) & _IN_SPOTS | bits & _IN_MARKS)


def frames_complaint(content: bytes, count: int) -> tuple[Alarm, str] | None:
    """Return what is implausible in the valid frames, or None."""
    if not count:
        return None
    words = np.frombuffer(
        content, "<i4", count=count * _FRAME_WORDS, offset=device.HEADER_STRUCT.size
    )
    frames = words.reshape(count, _FRAME_WORDS)
    # Two 16-bit numbers precede the spots.
    marks = int(np.bitwise_or.reduce(frames[:, 0]))
    if (marks & 0xFFFF) >> device.N_SLOTS:
        return Alarm.PAYLOAD, f"claims spots in more than {device.N_SLOTS} slots"
    if (marks >> 16 & 0xFFFF) & ~_KNOWN_FRAME_FLAGS:
        return Alarm.PAYLOAD, "sent frame flags that do not exist"
    spots = frames[:, 1:]
    if max(int(spots.max()), -int(spots.min())) > _SPOT_LIMIT:
        return Alarm.PAYLOAD, "sent spots far outside its sensor"
    return None


MAX_AHEAD_NS = 20_000_000
"""Maximum spread of the answers of one cycle; later exposure times are invalid."""
MAX_AGE_NS = 200_000_000
"""Maximum frame age; a camera buffers less at 8 kHz."""
CLOCK_LIMIT_NS = 20_000
"""With a larger clock offset a camera's exposure times are wrong."""
_SILENT_CYCLES = 3
# Plain integers: enumeration flags are slower.
_OPERATIONAL, _SYNCHRONISED = (
    int(device.CameraStatus.OPERATIONAL),
    int(device.CameraStatus.SYNCHRONISED),
)
_INIT, _PREOP, _SAFEOP, _OP = 1, 2, 4, 8
_AL_WATCHDOG = 0x001B
_AL_SYNC = {0x001A, 0x002C, 0x002D, *range(0x0030, 0x0038)}
"""ETG.1000.6, table 11: sync errors and distributed clock errors."""


class Trouble(Enum):
    """Reason for a cycle without data."""

    LOST = "lost"
    BAD = "bad"
    """An answer that must not be used."""


@dataclass(frozen=True, slots=True)
class CycleFault:
    trouble: Trouble
    alarm: Alarm
    reason: str
    camera: str = ""
    """Camera at fault; empty for the whole bus."""
    deep: bool = False
    """A camera lost its bring-up settings; waiting does not help."""
    remedy: str = ""
    """Other than that of the alarm, or empty."""


@dataclass(frozen=True, slots=True)
class Schedule:
    """Exposure schedule and expected configuration."""

    start_ns: int
    period_ns: int
    """`start_ns`, `period_ns`: exposure k is at ``start_ns + k * period_ns`` of the bus clock."""
    config_crc: int


class CameraPast(NamedTuple):
    """State of one camera from previous cycles."""

    name: str
    next_frame: int = 0
    cycle_counter: int | None = None
    boot_counter: int | None = None
    """`cycle_counter`, `boot_counter`: last accepted; None before the first answer."""
    layout: device.InputLayout = device.NEWEST_LAYOUT
    mark: int = 0
    """`layout`, `mark`: input layout, and the mark of a valid input (`InputLayout.mark`)."""
    counts: bool = True
    """The inputs have a counter; without one, identical spots are the only sign of old data."""


class CycleAnswer(NamedTuple):
    """Answers of one bus cycle."""

    whole: bool
    """All process data answers arrived in time."""
    working_counter: int
    expected_working_counter: int
    clock_ns: int
    clock_plausible: bool
    """`clock_ns`, `clock_plausible`: bus clock, and whether it agrees with earlier cycles."""
    view: WatchView
    inputs: tuple[bytes, ...]
    headers: tuple[device.Header, ...]
    """`inputs`, `headers`: per camera in rig order; empty without answer."""
    link: str = ""
    """Why no frame can pass the interface; empty if it can."""
    silent_cycles: int = 0
    """Consecutive cycles without any answer, including this one."""
    late: bool = False
    """Answers recently came too late."""
    untaken: bool = False
    """All answers arrived, but this computer did not receive all of them."""


def judge(
    answer: CycleAnswer, records: Sequence[CameraPast], schedule: Schedule
) -> CycleFault | None:
    """Return the fault of an answer, or None if it may be used."""
    names = [record.name for record in records]
    if not answer.whole:
        return _no_answer(answer, names)
    fault = _bus_fault(answer.view, names)
    if fault is not None:
        return fault
    if answer.working_counter != answer.expected_working_counter:
        return _not_all_took_part(answer, records)
    if answer.view.age:
        # A clock may have jumped since; the cameras resend these frames.
        return _bad(
            Alarm.LOST_ANSWERS,
            "Camera state unknown for 1 cycle."
            if answer.view.age == 1
            else f"Camera state unknown for {answer.view.age} cycles.",
        )
    if not answer.clock_plausible:
        return _bad(Alarm.CLOCK_JUMP, "The bus clock shows an impossible time.")
    for header, content, record in zip(answer.headers, answer.inputs, records, strict=True):
        mark = device.data_mark(content)
        if mark != record.mark:
            return _not_its_own(mark, record, records)
        complaint = _complaint(header, content, record, schedule, answer.clock_ns)
        if complaint is not None:
            alarm, words = complaint
            fault = _bad(alarm, f"Camera '{record.name}' {words}.", record.name)
            if alarm is Alarm.FROZEN and not record.counts:
                return replace(fault, remedy=_WITHOUT_COUNTER)
            return fault
    return None


def first_frame(header: device.Header, schedule: Schedule) -> int:
    """Return the number of the first frame of a header accepted by `judge`."""
    return (header.start_ns - schedule.start_ns) // schedule.period_ns


def advance(record: CameraPast, header: device.Header, first: int) -> CameraPast:
    """Return the record after accepting the frames of a header, from number `first` on."""
    return CameraPast(
        record.name,
        max(record.next_frame, first + header.frames_valid),
        header.cycle_counter,
        header.boot_counter,
        record.layout,
        record.mark,
        record.counts,
    )


def _not_all_took_part(answer: CycleAnswer, records: Sequence[CameraPast]) -> CycleFault:
    """Return the absent cameras by input counter, with the port at fault."""
    counted = f"working counter {answer.working_counter} of {answer.expected_working_counter}"
    names = [record.name for record in records]
    absent = [
        record.name
        for record, header in zip(records, answer.headers, strict=False)
        if header.cycle_counter == record.cycle_counter
    ]
    name, port = _port_words(answer.view, names)
    if len(absent) == 1:
        reason = f"Camera '{absent[0]}' did not take part in the cycle ({counted})."
        return _bad(Alarm.WORKING_COUNTER, f"{reason}{port}", absent[0])
    if absent:
        who = " and ".join(f"'{each}'" for each in absent)
        return _bad(
            Alarm.WORKING_COUNTER,
            f"Cameras {who} did not take part in the cycle ({counted}).{port}",
            name or absent[0],
        )
    if answer.headers:
        # Either outputs did not arrive, or the count is wrong.
        reason = f"The inputs of all cameras are new, but the count is wrong ({counted})."
        return _bad(Alarm.WORKING_COUNTER, f"{reason}{port}", name)
    return _bad(Alarm.WORKING_COUNTER, f"No camera took part in the cycle ({counted}).{port}", name)


def _port_words(view: WatchView, names: Sequence[str]) -> tuple[str, str]:
    """Return the camera and sentence of the latest port error; empty if none."""
    found = [
        (camera.trouble, name)
        for camera, name in zip(view.cameras, names, strict=False)
        if camera.trouble is not None
    ]
    if not found:
        return "", ""
    trouble, name = max(found, key=lambda each: each[0].broken + each[0].lost)
    return name, f" {trouble.message(name)}"


def _no_answer(answer: CycleAnswer, names: Sequence[str]) -> CycleFault:
    if answer.untaken:
        reason = "The computer was busy and did not take an answer of the cameras that had come."
        return CycleFault(Trouble.LOST, Alarm.HOST_BUSY, reason)
    if answer.link:
        return CycleFault(Trouble.LOST, Alarm.LINK_DOWN, f"The interface of the bus {answer.link}.")
    if answer.silent_cycles >= _SILENT_CYCLES:
        return CycleFault(Trouble.LOST, Alarm.SILENT, "No answer from the camera bus.")
    if answer.late:
        return CycleFault(Trouble.LOST, Alarm.LATE_ANSWERS, "The answer came too late.")
    name, port = _port_words(answer.view, names)
    reason = f"An answer of the camera bus was lost.{port}"
    return CycleFault(Trouble.LOST, Alarm.LOST_ANSWERS, reason, name)


def _bus_fault(view: WatchView, names: Sequence[str]) -> CycleFault | None:
    """Return the fault in the cameras' own states, or None."""
    for camera, name in zip(view.cameras, names, strict=True):
        if camera.answers > 1:
            return _bad(
                Alarm.DUPLICATE_ADDRESS, f"Two devices answer to the address of '{name}'.", name
            )
    for camera, name in zip(view.cameras, names, strict=True):
        if camera.answers:
            continue
        if view.devices < len(names):
            return _bad(Alarm.CAMERA_MISSING, f"Camera '{name}' does not answer.", name)
        return _bad(
            Alarm.RESTARTED, f"Camera '{name}' lost its address: it was restarted.", name, deep=True
        )
    if view.devices > len(names):
        return _bad(
            Alarm.CAMERAS,
            f"{view.devices} devices on the bus, but the rig has {len(names)} cameras.",
        )
    for camera, name in zip(view.cameras, names, strict=True):
        fault = _state_fault(camera, name)
        if fault is not None:
            return fault
    return None


def _state_fault(camera: CameraView, name: str) -> CycleFault | None:
    if camera.state == _INIT:
        return _bad(Alarm.RESTARTED, f"Camera '{name}' was restarted.", name, deep=True)
    if camera.state == _SAFEOP and camera.code == _AL_WATCHDOG:
        return _bad(Alarm.WATCHDOG, f"Camera '{name}' missed its outputs and left operation.", name)
    if camera.state and (camera.state != _OP or camera.error):
        alarm = Alarm.SYNC if camera.code in _AL_SYNC else Alarm.LEFT_OPERATION
        return _bad(
            alarm,
            f"Camera '{name}' left operation (AL state {camera.state}, "
            f"status code {camera.code:#06x}).",
            name,
            deep=camera.state != _SAFEOP and camera.state != _OP,
        )
    if camera.clock_offset_ns is not None and abs(camera.clock_offset_ns) > CLOCK_LIMIT_NS:
        # The camera buffers exposures made meanwhile and would send them later: only a bring-up
        # restarts all exposures.
        return _bad(
            Alarm.CLOCK_JUMP,
            f"The clock of camera '{name}' is {camera.clock_offset_ns} ns off the bus clock.",
            name,
        )
    return None


def _not_its_own(mark: int, record: CameraPast, records: Sequence[CameraPast]) -> CycleFault:
    """Return the fault of an input whose checksum is not its camera's."""
    other = next((one.name for one in records if one.mark == mark != 0), "")
    if other:
        return _bad(
            Alarm.EXCHANGED,
            f"The data of camera '{other}' came in the place of camera '{record.name}'.",
            record.name,
        )
    words = f"Camera '{record.name}' sent data that were corrupted in transit."
    return _bad(Alarm.PAYLOAD, words, record.name)


def _complaint(
    header: device.Header, content: bytes, record: CameraPast, schedule: Schedule, clock_ns: int
) -> tuple[Alarm, str] | None:
    """Return what is wrong with the data of one camera, or None."""
    if not header.status & _OPERATIONAL:
        return Alarm.LEFT_OPERATION, "is not in operation"
    if not header.status & _SYNCHRONISED:
        return Alarm.SYNC, "is not synchronised to the bus clock"
    if record.boot_counter is not None and header.boot_counter != record.boot_counter:
        return Alarm.RESTARTED, "was restarted"
    if record.cycle_counter is not None:
        advanced = (header.cycle_counter - record.cycle_counter) % record.layout.cycle_counters
        if advanced == 0 or advanced > record.layout.longest_advance:
            return Alarm.FROZEN, (
                "repeated old data (its cycle counter did not advance)"
                if record.counts
                else "repeated its spots to the last bit (its inputs have no counter)"
            )
    if header.period_ns != schedule.period_ns:
        return Alarm.FRAME_RATE, (
            f"makes a frame every {header.period_ns} ns instead of every {schedule.period_ns} ns"
        )
    if header.config_crc != schedule.config_crc:
        return Alarm.CONFIGURATION, "has a configuration other than the one set"
    if header.frames_valid > device.FRAMES_PER_CYCLE:
        return Alarm.PAYLOAD, f"claims {header.frames_valid} frames in one cycle"
    first, rest = divmod(header.start_ns - schedule.start_ns, schedule.period_ns)
    if rest or first < 0 or first % device.COUNTER_MODULUS != header.counter:
        return Alarm.PAYLOAD, "sent a frame counter and an exposure time that do not fit together"
    if first > record.next_frame and not header.status & device.CameraStatus.OVERRUN:
        return Alarm.GAP, "skipped frames without reporting it"
    end_ns = header.start_ns + header.frames_valid * schedule.period_ns
    if header.frames_valid and end_ns > clock_ns + MAX_AHEAD_NS:
        return Alarm.SYNC, "sent frames from the future"
    if clock_ns - end_ns > MAX_AGE_NS:
        return Alarm.FROZEN, f"is {(clock_ns - end_ns) / 1e6:.0f} ms behind the bus clock"
    return None if is_sound(content) else frames_complaint(content, header.frames_valid)


def _bad(alarm: Alarm, reason: str, camera: str = "", *, deep: bool = False) -> CycleFault:
    return CycleFault(Trouble.BAD, alarm, reason, camera, deep)
