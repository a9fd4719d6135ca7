"""Bugs of firmware: objects."""

from __future__ import annotations

from typing import Any

from ocmm_sim.slave import Abort, AbortError
from tests.core.fieldbus.bugs.bug_tools import abort_code, aborting, add, bug, entry, header

# ruff: noqa: SLF001 - see bug_tools

add("object.read", "an entry is missing", lambda camera: camera.coe._objects[0x8030].entries.pop(9))
add("object.read", "an entry has four bytes instead of two", entry(0x9000, 8, value=bytes(4)))
add("object.read", "a fixed number is another", entry(0x9000, 6, value=b"\x10\x27\x00\x00"))
add(
    "object.read",
    "a mapping names another entry",
    entry(0x1A00, 3, value=bytes.fromhex("20040060")),
)
add("object.read", "the number of entries is wrong", entry(0x8001, 0, value=b"\x1f"))
add(
    "object.identity",
    "serial number of the objects is another",
    entry(0x1018, 4, value=b"\x07\x00\x00\x00"),
)
add("object.identity", "two versions of the firmware", entry(0x9010, 1, value=b"2.9.9"))
add("object.read_only", "the width of the sensor can be written", entry(0x9000, 2, writable=True))
add(
    "object.read_only",
    "read only is told as unknown",
    lambda camera: abort_code(camera, Abort.READ_ONLY, Abort.NO_OBJECT),
)
add(
    "object.absent",
    "what is not there has another code",
    lambda camera: abort_code(camera, Abort.NO_OBJECT, Abort.NO_ENTRY),
)
add("object.limits", "too high is taken", entry(0x8000, 3, high=None))
add("object.limits", "too low is taken", entry(0x8000, 1, low=None))
add("object.limits", "the limit itself is refused", entry(0x8040, 1, high=599))
add(
    "object.limits",
    "too high and too low are the same",
    aborting(lambda why: Abort.VALUE if why in (Abort.TOO_HIGH, Abort.TOO_LOW) else why),
)
add("object.limits", "a value is taken and not kept", lambda camera: _forgets(camera, (0x8001, 7)))
add("object.lengths", "a note is longer than it may be", entry(0x8010, 5, max_bytes=1300))
add(
    "object.lengths",
    "a wrong length is a wrong value",
    lambda camera: abort_code(camera, Abort.LENGTH, Abort.VALUE),
)
add("object.preop", "exposure can be written in operation", entry(0x8000, 2, preop_only=False))
add("object.preop", "windows can be written in operation", entry(0x8001, 9, preop_only=False))
add(
    "object.config_crc",
    "check sum of the configuration at power-on stays",
    lambda camera: _frozen_crc(camera),
)


def _forgets(camera: Any, place: tuple[int, int]) -> None:
    before = camera.coe._values.write

    def write(index: int, sub: int, value: bytes) -> None:
        kept = camera.coe._values._values[index, sub]
        before(index, sub, value)
        if (index, sub) == place:
            camera.coe._values._values[index, sub] = kept

    camera.coe._values.write = write


def _frozen_crc(camera: Any) -> None:
    crc = camera._crc
    header(lambda header: header._replace(config_crc=crc))(camera)


@bug("object.complete", "a mixed record travels as a whole")
def _any_record(camera: Any) -> None:
    before = camera.coe._values.read_all

    def read_all(index: int, first: int) -> Any:
        try:
            return before(index, first)
        except AbortError:
            return bytes(8)

    camera.coe._values.read_all = read_all


@bug("object.complete", "a record is kept up to its first bad value")
def _half_record(camera: Any) -> None:
    values = camera.coe._values

    def write_all(index: int, first: int, content: bytes) -> None:
        at = 0
        for sub in values._together(index, first):
            size = values._entry(index, sub).room if sub else 2
            if sub:
                values.write(index, sub, content[at : at + size])
            at += size
        if at != len(content):
            raise AbortError(Abort.LENGTH)

    values.write_all = write_all
