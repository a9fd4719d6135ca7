"""Bugs of firmware: process data."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable
from typing import Any

from ocmm_core.fieldbus.device import HEADER_STRUCT
from ocmm_sim.slave import registers as reg
from tests.core.fieldbus.bugs.bug_tools import add, crc, frames, header, live

# ruff: noqa: SLF001 - see bug_tools

add(
    "frames.inputs",
    "check sum without the serial number",
    crc(lambda content, _begin: zlib.crc32(content)),
)
add(
    "frames.inputs",
    "check sum of the header alone",
    crc(lambda content, begin: zlib.crc32(content[: HEADER_STRUCT.size], begin)),
)
add(
    "frames.inputs",
    "check sum with the serial number at the end",
    crc(lambda content, _begin: zlib.crc32(struct.pack("<I", 1001), zlib.crc32(content))),
)
add(
    "frames.inputs",
    "cycle counter of 8 bits",
    header(lambda header: header._replace(cycle_counter=header.cycle_counter & 0xFF)),
)
add(
    "frames.inputs",
    "cycle counter goes on by two",
    header(lambda header: header._replace(cycle_counter=2 * header.cycle_counter & 0xFFFF)),
)
add(
    "frames.inputs",
    "boot counter is never counted",
    header(lambda header: header._replace(boot_counter=0)),
)
add(
    "frames.inputs",
    "time of the end of the exposure",
    header(lambda header: header._replace(start_ns=header.start_ns + header.period_ns)),
)
add(
    "frames.inputs",
    "exposures are counted from 1",
    header(lambda header: header._replace(counter=header.counter + 1)),
)
add(
    "frames.inputs",
    "period is a nanosecond off",
    header(lambda header: header._replace(period_ns=max(0, header.period_ns - 1))),
)
add(
    "frames.inputs",
    "thirteen frames are announced",
    header(lambda header: header._replace(frames_valid=13 if header.frames_valid else 0)),
)
add(
    "frames.inputs",
    "the clock signal is not told",
    header(lambda header: header._replace(status=header.status & ~2)),
)
add(
    "frames.inputs",
    "a reserved flag is set",
    frames(lambda frames: frames.__setitem__(2, frames[2] | 0x40)),
)
add(
    "frames.inputs",
    "a ninth slot is valid",
    frames(lambda frames: frames.__setitem__(1, frames[1] | 0x01)),
)
add(
    "frames.inputs",
    "old layout: cycle counter and status exchanged",
    header(
        lambda header: header._replace(
            status=header.cycle_counter & 0xFF, cycle_counter=header.status
        )
    ),
)
add(
    "frames.exchange",
    "operation is told in SAFEOP",
    header(lambda header: header._replace(status=header.status | 1)),
)
add("frames.exchange", "outputs are not taken in SAFEOP", lambda camera: _deaf_in_safeop(camera))
add(
    "frames.exchange",
    "inputs already in PREOP",
    lambda camera: setattr(camera.esc, "exchange_allowed", lambda _sync_manager: True),
)
add("frames.order", "frames come before they are over", lambda camera: _shifted(camera, 1))
add("frames.order", "frames come two periods late", lambda camera: _shifted(camera, -2))
add(
    "frames.order",
    "the first frame of a block is the last of the one before",
    lambda camera: _acknowledging(camera, lambda counter: counter - 1),
)
add("frames.go_back", "an acknowledgement needs no control bit", lambda camera: _no_control(camera))
add("frames.go_back", "what is far ahead can be acknowledged", lambda camera: _any_ack(camera))
add("frames.go_back", "frames are sent once", lambda camera: _sent_once(camera))
add(
    "frames.go_back",
    "frames change when they come again",
    frames(
        lambda frames: frames.__setitem__(4, (frames[4] + 1) & 0xFF) if _every_other() else None
    ),
)
add("frames.go_back", "a part cannot be acknowledged", lambda camera: _whole_blocks(camera))
add("frames.overrun", "the buffer holds half", lambda camera: _small_buffer(camera))
add(
    "frames.overrun",
    "a loss is not told in the status",
    header(lambda header: header._replace(status=header.status & ~4)),
)
add(
    "frames.overrun",
    "the frame behind a gap is not marked",
    frames(lambda frames: frames.__setitem__(2, frames[2] & ~2)),
)
add("frames.overrun", "lost frames are not counted", live(0xA000, 1, lambda _value: bytes(4)))
add("frames.overrun", "overruns are not counted", live(0xA000, 3, lambda _value: bytes(4)))
add("frames.objects", "objects of the outputs show zero", live(0x7000, 3, lambda _value: bytes(4)))
add(
    "frames.objects",
    "objects of the header show another period",
    live(0x6000, 3, lambda _value: b"\x01\x00\x00\x00"),
)
add(
    "frames.sensor",
    "spots in millimetres instead of pixels",
    frames(lambda frames: frames.__setitem__(slice(4, 8), struct.pack("<i", -40 << 16))),
)
_turn = [0]


def _every_other() -> bool:
    _turn[0] += 1
    return _turn[0] % 2 == 0


def _deaf_in_safeop(camera: Any) -> None:
    before = camera.esc.exchange_allowed
    camera.esc.exchange_allowed = lambda manager: (
        before(manager) and (manager != 2 or camera.esc.state == reg.OP)
    )


def _shifted(camera: Any, periods: int) -> None:
    before = camera.buffer._newest
    camera.buffer._newest = lambda now_ns: max(-1, before(now_ns) + periods)


def _acknowledging(camera: Any, change: Callable[[int], int]) -> None:
    before = camera.buffer.acknowledge
    camera.buffer.acknowledge = lambda counter: before(change(counter))


def _no_control(camera: Any) -> None:
    before = camera.outputs_written

    def written() -> None:
        camera.esc.memory[0x1400] |= 1
        before()

    camera.outputs_written = written


def _any_ack(camera: Any) -> None:
    def acknowledge(counter: int) -> None:
        camera.buffer._tail = max(camera.buffer._tail, counter + 1)

    camera.buffer.acknowledge = acknowledge


def _sent_once(camera: Any) -> None:
    before = camera.buffer.pop

    def take(now_ns: int) -> tuple[int, int]:
        first, count = before(now_ns)
        camera.buffer._tail += count
        return first, count

    camera.buffer.pop = take


def _whole_blocks(camera: Any) -> None:
    before, last = camera.buffer.pop, [0]

    def take(now_ns: int) -> tuple[int, int]:
        first, count = before(now_ns)
        last[0] = first + count
        return first, count

    def acknowledge(counter: int) -> None:
        if counter + 1 <= last[0] <= counter + 12:
            camera.buffer._tail = max(camera.buffer._tail, last[0])

    camera.buffer.pop = take
    camera.buffer.acknowledge = acknowledge


def _small_buffer(camera: Any) -> None:
    before = camera.buffer.pop

    def take(now_ns: int) -> tuple[int, int]:
        first, count = before(now_ns)
        end = camera.buffer._newest(now_ns) + 1
        if end - first > 512:
            camera.buffer.lost += end - 512 - first
            camera.buffer.overruns += 1
            camera.buffer._tail = camera.buffer._overrun_at = end - 512
            first, count = before(now_ns)
        return first, count

    camera.buffer.pop = take
