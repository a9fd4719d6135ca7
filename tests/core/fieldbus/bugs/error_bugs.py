"""Bugs of firmware: watchdog and errors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ocmm_sim.slave import AbortError
from ocmm_sim.slave import registers as reg
from tests.core.fieldbus.bugs.bug_tools import add, header, live, replaced

# ruff: noqa: SLF001 - see bug_tools

add("watchdog.time", "no watchdog", lambda camera: setattr(camera.esc, "poll", lambda _now: None))
add("watchdog.time", "the watchdog barks at half its time", lambda camera: _bite(camera, 2))
add(
    "watchdog.time",
    "the time of the watchdog cannot be set",
    lambda camera: _deaf(camera, reg.WATCHDOG_SM_TIME),
)
add(
    "watchdog.time",
    "the watchdog does not count",
    lambda camera: _after_fall(
        camera, lambda: camera.esc.memory.__setitem__(reg.WATCHDOG_COUNT, 0)
    ),
)
add(
    "watchdog.time",
    "the watchdog has the code of missing outputs",
    lambda camera: _after_fall(camera, lambda: camera.esc._set(reg.AL_STATUS_CODE, "<H", 0x1D)),
)
add(
    "watchdog.time",
    "the watchdog leads to PREOP",
    lambda camera: _after_fall(camera, lambda: camera.esc.fall_back(reg.PREOP, reg.AL_WATCHDOG)),
)
add(
    "watchdog.frames",
    "exposures end with the outputs",
    lambda camera: _after_fall(camera, camera.buffer.stop),
)
add(
    "watchdog.frames",
    "frames are dropped with the outputs",
    lambda camera: _after_fall(camera, lambda: _drop(camera)),
)
add("errors.told", "no emergency", replaced("_diagnosis._send", lambda *_: None))
add("errors.told", "the end of an error is not told", lambda camera: _never_over(camera))
add("errors.told", "the error register stays empty", live(0x1001, 0, lambda _value: b"\x00"))
add("errors.told", "watchdog events are not counted", live(0xA000, 2, lambda _value: bytes(4)))
add("errors.told", "emergencies are not counted", live(0xA000, 6, lambda _value: bytes(4)))
add(
    "errors.told",
    "messages have no time",
    live(0x10F3, 6, lambda value: value[:8] + bytes(8) + value[16:]),
)
add(
    "errors.told",
    "messages have other flags",
    live(0x10F3, 6, lambda value: value[:4] + b"\x02\x00" + value[6:]),
)
add("errors.told", "new messages are not told", live(0x10F3, 4, lambda _value: b"\x00"))
add("errors.told", "any message can be acknowledged", lambda camera: _any_message(camera))
add(
    "errors.told",
    "status bit 4 is never set",
    header(lambda header: header._replace(status=header.status & ~16)),
)
add(
    "errors.history",
    "the newest message stays at the last place",
    live(0x10F3, 2, lambda value: bytes([max(value[0], 21)])),
)
add(
    "errors.history",
    "emergencies cannot be switched off",
    lambda camera: camera.coe._values._written.__setitem__((0x10F3, 5), lambda _value: None),
)


def _bite(camera: Any, share: int) -> None:
    before = camera.esc.poll
    camera.esc.poll = lambda now_ns: before(
        camera.esc._fed_ns + share * (now_ns - camera.esc._fed_ns)
    )


def _deaf(camera: Any, register: int) -> None:
    camera.esc._writable[register : register + 2] = bytes(2)


def _after_fall(camera: Any, then: Callable[[], object]) -> None:
    before = camera.esc.poll

    def poll(now_ns: int) -> None:
        state = camera.esc.state
        before(now_ns)
        if state == reg.OP and camera.esc.state != reg.OP:
            then()

    camera.esc.poll = poll


def _drop(camera: Any) -> None:
    camera.buffer._tail += 50


def _never_over(camera: Any) -> None:
    before = camera._diagnosis.report

    def report(code: int, register: int, data: bytes = b"") -> None:
        if code:
            before(code, register, data)

    camera._diagnosis.report = report


def _any_message(camera: Any) -> None:
    written = camera.coe._values._written
    before = written[0x10F3, 3]

    def acknowledge(value: bytes) -> object:
        try:
            return before(value)
        except AbortError:
            return None

    written[0x10F3, 3] = acknowledge
