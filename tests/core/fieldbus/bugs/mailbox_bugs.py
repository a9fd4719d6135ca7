"""Bugs of firmware: mailboxes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ocmm_sim.slave import Abort
from tests.core.fieldbus.bugs.bug_tools import abort_code, add, answers, late, live

# ruff: noqa: SLF001 - see bug_tools

add(
    "mailbox.segments",
    "the last byte of a long value is lost",
    lambda camera: _segment(camera, lambda part: part[:-1] if len(part) > 100 else part),
)
add("mailbox.broken", "the toggle bit is not looked at", lambda camera: _no_toggle(camera))
add(
    "mailbox.broken",
    "an abort is answered",
    answers(
        lambda camera, asked, found: (
            found if asked[8] != 0x80 else camera.coe.answer(asked[:8] + b"\xe0" + asked[9:])
        )
    ),
)
add(
    "mailbox.broken",
    "an unknown command is told as busy",
    lambda camera: abort_code(camera, Abort.COMMAND, Abort.BUSY),
)
add(
    "mailbox.bad",
    "a bad mailbox is not answered",
    answers(lambda _camera, _asked, found: None if found and found[5] & 15 == 0 else found),
)
add("mailbox.bad", "bad mailboxes are not counted", live(0xA000, 4, lambda _value: bytes(4)))
add(
    "mailbox.bad",
    "the error reply has no reason",
    answers(
        lambda _camera, _asked, found: (
            found[:8] + b"\x01\x00" if found and found[5] & 15 == 0 else found
        )
    ),
)
add(
    "mailbox.repeat",
    "nothing is sent again",
    lambda camera: setattr(camera.esc, "_sync_managers", lambda: None),
)
add(
    "mailbox.counter",
    "the mailbox counter stands still",
    answers(lambda _camera, _asked, found: found and found[:5] + bytes([0x13]) + found[6:]),
)
add(
    "mailbox.information",
    "an object is not in the list",
    lambda camera: camera.coe._objects.pop(0xA000),
)
add(
    "mailbox.information",
    "a record is described as a single value",
    lambda camera: camera.coe._objects.__setitem__(
        0x9010, replace(camera.coe._objects[0x9010], record=False)
    ),
)
add("mailbox.deadline", "some answers take 120 ms", lambda camera: late(0.12, _every(50))(camera))
add("mailbox.deadline", "some answers never come", lambda camera: late(10.0, _every(50))(camera))


def _every(count: int) -> Callable[[bytes], bool]:
    seen = [0]

    def when(_asked: bytes) -> bool:
        seen[0] += 1
        return seen[0] % count == 0

    return when


def _segment(camera: Any, change: Callable[[bytes], bytes]) -> None:
    before = camera.coe._store
    camera.coe._store = lambda index, sub, whole, value: before(index, sub, whole, change(value))


def _no_toggle(camera: Any) -> None:
    before = camera.coe._upload_segment

    def segment(upload: Any, command: int) -> Any:
        toggle = upload.toggle
        return before(upload, command & ~0x10 | toggle << 4)

    camera.coe._upload_segment = segment
