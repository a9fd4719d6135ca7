"""Is what a bus cycle brought fresh and whole? Pure functions of what came.

A full working counter proves nothing: cameras in SAFEOP and cameras whose program stands still
answer too. A cycle is accepted only when the working counter, the state, the cycle counter, the
frame counter, the configuration and the exposure times of every camera fit together; then frames
that are already known are left out, by their counter. Nothing doubtful is passed on, and because
it is not acknowledged either, the camera sends it again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from ocmm_core.fieldbus.camera_slave import (
    COUNTER_MODULUS,
    FRAMES_PER_CYCLE,
    CameraStatus,
    Header,
)

MAX_AHEAD_NS = 20_000_000
"""The answers of one cycle may be this much apart; an exposure time beyond that is not real."""
MAX_AGE_NS = 200_000_000
"""Older frames are not news; a camera's buffer holds less than this at 8 kHz."""


class Trouble(Enum):
    """Why a cycle brought nothing."""

    LOST = "lost"
    """No answer."""
    BAD = "bad"
    """An answer that must not be used."""


@dataclass(frozen=True, slots=True)
class Fault:
    """What was wrong with a cycle, in words for people."""

    trouble: Trouble
    reason: str


@dataclass(frozen=True, slots=True)
class Schedule:
    """When the cameras expose, and the configuration that they must show.

    Attributes
    ----------
    start_ns, period_ns
        Exposure k happens at ``start_ns + k * period_ns`` of the bus clock.
    config_crc
        Check sum of the configuration.
    """

    start_ns: int
    period_ns: int
    config_crc: int


@dataclass(frozen=True, slots=True)
class CameraRecord:
    """What is known about one camera from the cycles before.

    Attributes
    ----------
    name
        For messages.
    next_frame
        Exposure number of the first frame that is still wanted.
    cycle_counter, boot_counter
        As last accepted; None before the first answer.
    """

    name: str
    next_frame: int = 0
    cycle_counter: int | None = None
    boot_counter: int | None = None


@dataclass(frozen=True, slots=True)
class Answer:
    """What one bus cycle brought.

    Attributes
    ----------
    working_counter, expected_working_counter
        As counted by the wire and as it should be.
    operational
        All cameras are in OP, as far as the last look at their states tells.
    clock_ns
        Bus clock in this cycle.
    headers
        Of each camera, in the order of the rig; empty where there was no answer.
    """

    working_counter: int
    expected_working_counter: int
    operational: bool
    clock_ns: int
    headers: tuple[Header, ...]


def judge(answer: Answer, records: Sequence[CameraRecord], schedule: Schedule) -> Fault | None:
    """Return what is wrong with ``answer``, or None where it may be used."""
    if answer.working_counter <= 0:
        return Fault(Trouble.LOST, "No answer from the camera bus.")
    if answer.working_counter != answer.expected_working_counter:
        return _bad(
            f"Only part of the cameras took part in the cycle (working counter "
            f"{answer.working_counter} of {answer.expected_working_counter})."
        )
    if not answer.operational:
        return _bad("A camera has left operation.")
    for header, record in zip(answer.headers, records, strict=True):
        complaint = _complaint(header, record, schedule, answer.clock_ns)
        if complaint:
            return _bad(f"Camera '{record.name}' {complaint}.")
    return None


def first_frame(header: Header, schedule: Schedule) -> int:
    """Return the exposure number of the first frame of a header that `judge` accepted."""
    return (header.start_ns - schedule.start_ns) // schedule.period_ns


def advance(record: CameraRecord, header: Header, schedule: Schedule) -> CameraRecord:
    """Return the record after the frames of an accepted header were taken."""
    return CameraRecord(
        record.name,
        max(record.next_frame, first_frame(header, schedule) + header.frames_valid),
        header.cycle_counter,
        header.boot_counter,
    )


def _complaint(
    header: Header, record: CameraRecord, schedule: Schedule, clock_ns: int
) -> str | None:
    """Return what is wrong with one header, or None."""
    if not header.status & CameraStatus.OPERATIONAL:
        return "is not in operation"
    if not header.status & CameraStatus.SYNCHRONISED:
        return "is not synchronised to the bus clock"
    if record.boot_counter is not None and header.boot_counter != record.boot_counter:
        return "was restarted"
    if header.cycle_counter == record.cycle_counter:
        return "repeated old data (its cycle counter did not advance)"
    if header.config_crc != schedule.config_crc or header.period_ns != schedule.period_ns:
        return "has another configuration than was set"
    if header.frames_valid > FRAMES_PER_CYCLE:
        return f"claims {header.frames_valid} frames in one cycle"
    first, rest = divmod(header.start_ns - schedule.start_ns, schedule.period_ns)
    if rest or first < 0 or first % COUNTER_MODULUS != header.counter:
        return "sent a frame counter and an exposure time that do not fit together"
    if first > record.next_frame and not header.status & CameraStatus.OVERRUN:
        return "left out frames without saying so"
    end_ns = header.start_ns + header.frames_valid * schedule.period_ns
    if header.frames_valid and end_ns > clock_ns + MAX_AHEAD_NS:
        return "sent frames from the future"
    if clock_ns - end_ns > MAX_AGE_NS:
        return f"is {(clock_ns - end_ns) / 1e6:.0f} ms behind the bus clock"
    return None


def _bad(reason: str) -> Fault:
    return Fault(Trouble.BAD, reason)
