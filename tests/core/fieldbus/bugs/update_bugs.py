"""Bugs of firmware: firmware."""

from __future__ import annotations

from typing import Any

from ocmm_core.fieldbus.device import Firmware
from tests.core.fieldbus.bugs.bug_tools import add, answers, late, replaced

# ruff: noqa: SLF001 - see bug_tools

add(
    "firmware.refusals",
    "firmware is taken outside of BOOT",
    replaced("foe._may_write", lambda: True),
)
add("firmware.refusals", "any name of a file will do", lambda camera: _any_name(camera))
add("firmware.refusals", "packets in any order", lambda camera: _any_order(camera))
add("firmware.refusals", "a packet that comes again is refused", lambda camera: _no_echo(camera))
add(
    "firmware.refusals",
    "reading has the code of a missing file",
    answers(
        lambda _camera, asked, found: (
            found and found[:8] + b"\x01\x80" + found[10:]
            if asked[5] & 15 == 4 and asked[6] == 1
            else found
        )
    ),
)
add("firmware.wrong", "the signature is not looked at", lambda camera: _unsigned(camera))
add(
    "firmware.wrong",
    "wrong firmware is told as too large",
    answers(lambda _camera, _asked, found: found and found.replace(b"\x09\x80", b"\x03\x80", 1)),
)
add(
    "firmware.interrupted",
    "an update goes on after INIT",
    lambda camera: setattr(camera.foe, "reset", lambda: None),
)
add("firmware.interrupted", "an update cannot begin anew", lambda camera: _once(camera))
add("firmware.update", "no way back from a trial", lambda camera: _confirmed_at_once(camera))
add("firmware.update", "new firmware is never kept", replaced("_banks.confirm", lambda: None))
add(
    "firmware.update",
    "new firmware needs a loss of power",
    lambda camera: setattr(camera, "_start_firmware", lambda: None),
)
add(
    "firmware.wrong",
    "a packet takes 3 s",
    lambda camera: late(3.0, lambda asked: asked[5] & 15 == 4 and asked[6] == 3)(camera),
)


def _any_name(camera: Any) -> None:
    before = camera.foe._start
    camera.foe._start = lambda _name: before(b"firmware")


def _any_order(camera: Any) -> None:
    before = camera.foe._data

    def data(number: int, content: bytes) -> Any:
        if camera.foe._expected:
            camera.foe._expected = number
        return before(number, content)

    camera.foe._data = data


def _no_echo(camera: Any) -> None:
    before = camera.foe._data

    def data(number: int, content: bytes) -> Any:
        camera.foe._last = (0, b"")
        return before(number, content)

    camera.foe._data = data


def _unsigned(camera: Any) -> None:
    banks = camera._banks

    def finish() -> Firmware:
        image = bytes(banks._banks[1 - banks._running][: banks._at])
        found = Firmware.read(image)
        found.check_for()
        return found

    banks.finish = finish


def _once(camera: Any) -> None:
    before = camera.foe._start

    def begin(name: bytes) -> Any:
        if camera.foe._expected > 1:
            return camera.foe._error(0x8004, "busy")
        return before(name)

    camera.foe._start = begin


def _confirmed_at_once(camera: Any) -> None:
    before = camera._start_firmware

    def start() -> None:
        before()
        camera._banks.confirm()

    camera._start_firmware = start
