"""Bugs of firmware: clock."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ocmm_sim.slave import registers as reg
from tests.core.fieldbus.bugs.bug_tools import add, header, live

# ruff: noqa: SLF001 - see bug_tools

add(
    "clock.time",
    "clock a thousandth too fast",
    lambda camera: camera.esc.clock.set_rate(1_000_000, camera.esc.now_ns),
)
add("clock.time", "bus time of 32 bits", lambda camera: _short_time(camera))
add("clock.time", "the offset of the clock is not used", lambda camera: _no_offset(camera))
add("clock.difference", "the sign of the difference is turned", lambda camera: _turned(camera))
add(
    "clock.phase",
    "SYNC0's period is not looked at",
    lambda camera: _schedule(camera, lambda start, _period: (start, 125_000)),
)
add(
    "clock.phase",
    "exposures half a period behind SYNC0",
    header(lambda header: header._replace(start_ns=header.start_ns + header.period_ns // 2)),
)
add(
    "clock.late",
    "exposures begin when they like",
    lambda camera: _schedule(camera, lambda start, period: (start - 10 * period, period)),
)
add("clock.free", "free running is told as SYNC0", live(0x1C32, 1, lambda _value: b"\x02\x00"))
add(
    "clock.free",
    "own period is not used without SYNC0",
    lambda camera: _schedule(camera, lambda start, period: (start, 125_000)),
)
add("clock.restart", "exposures go on counting over a restart", lambda camera: _goes_on(camera))


def _short_time(camera: Any) -> None:
    before = camera.esc.read

    def read(address: int, length: int) -> Any:
        found = before(address, length)
        if address == reg.SYSTEM_TIME and found and length == 8:
            return found[:4] + bytes(4)
        return found

    camera.esc.read = read


def _no_offset(camera: Any) -> None:
    before = camera.esc.write

    def write(address: int, data: bytes) -> bool:
        return True if address == reg.TIME_OFFSET else before(address, data)

    camera.esc.write = write


def _turned(camera: Any) -> None:
    before = camera.esc.read

    def read(address: int, length: int) -> Any:
        found = before(address, length)
        if address == reg.TIME_DIFFERENCE and found:
            return found[:3] + bytes([found[3] ^ 0x80])
        return found

    camera.esc.read = read


def _schedule(camera: Any, change: Callable[[int, int], tuple[int, int]]) -> None:
    before = camera._schedule
    camera._schedule = lambda: change(*before())


def _goes_on(camera: Any) -> None:
    before, starts = camera.buffer.start, [0]

    def start(start_ns: int, period_ns: int) -> None:
        starts[0] += 1
        before(start_ns - 1000 * period_ns * (starts[0] - 1), period_ns)
        camera.buffer._tail = camera.buffer._generated = 1000 * (starts[0] - 1)

    camera.buffer.start = start
