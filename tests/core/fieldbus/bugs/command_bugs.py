"""Bugs of firmware: commands."""

from __future__ import annotations

import struct
import zlib
from typing import Any

from ocmm_core.fieldbus.device import Intrinsics
from ocmm_sim.slave import Abort, AbortError
from tests.core.fieldbus.bugs.bug_tools import add, live

# ruff: noqa: SLF001 - see bug_tools

add("command.identify", "blinking does not end", live(0x8040, 2, lambda _value: b"\x05\x00"))
add(
    "command.identify",
    "what is left is in milliseconds",
    live(0x8040, 2, lambda value: struct.pack("<H", 1000 * value[0] & 0xFFFF)),
)
add(
    "command.intrinsics",
    "intrinsics of another camera are taken",
    lambda camera: setattr(camera.electronics, "_serial", 1000),
)
add("command.intrinsics", "damaged intrinsics are taken", lambda camera: _takes_damaged(camera))
add(
    "command.intrinsics",
    "SHA-256 is that of nothing",
    live(0x8010, 3, lambda value: bytes(len(value))),
)
add(
    "command.intrinsics",
    "CRC-32 begins with zero",
    live(0x8010, 4, lambda value: struct.pack("<I", struct.unpack("<I", value)[0] ^ 0xFFFFFFFF)),
)
add("command.intrinsics", "corrected without intrinsics", lambda camera: _mode(camera))
add(
    "command.black_image",
    "spots while the light is off",
    lambda camera: setattr(camera.buffer, "darken", lambda _now, _count: 50_000_000),
)
add("command.black_image", "a command while another one runs", lambda camera: _impatient(camera))
add(
    "command.black_image",
    "storing is not told",
    live(0x8020, 5, lambda value: bytes([value[0] & ~2])),
)
add(
    "command.black_image",
    "clearing leaves the stored image",
    lambda camera: setattr(camera.electronics._black, "_clear", lambda: None),
)
add(
    "command.snapshot",
    "CRC-32 of the first chunk only",
    live(0x8030, 0x0B, lambda value: struct.pack("<I", struct.unpack("<I", value)[0] ^ 1)),
)
add(
    "command.snapshot",
    "a region off the sensor is taken",
    lambda camera: setattr(camera.electronics._snapshots, "_size", (5000, 5000)),
)
add(
    "command.snapshot",
    "chunks without their offset",
    lambda camera: camera.coe._values._written.__setitem__((0x8030, 9), lambda _value: None),
)
add(
    "command.snapshot",
    "width and height exchanged",
    lambda camera: _exchanged(camera, (0x8030, 0x0C), (0x8030, 0x0D)),
)


def _takes_damaged(camera: Any) -> None:
    def keep(value: bytes) -> None:
        if value and len(value) == 100:
            sealed = value[:-4] + struct.pack("<I", zlib.crc32(value[:-4]))
            if Intrinsics.decode(sealed).serial != camera.electronics._serial:
                raise AbortError(Abort.VALUE)
        elif value:
            raise AbortError(Abort.VALUE)
        camera.electronics._intrinsics = value

    camera.coe._values._written[0x8010, 1] = keep


def _mode(camera: Any) -> None:
    camera.coe._values._written[0x8000, 4] = lambda _value: None


def _impatient(camera: Any) -> None:
    written = camera.coe._values._written
    before = written[0x8020, 1]

    def command(value: bytes) -> object:
        try:
            return before(value)
        except AbortError as abort:
            if abort.reason is Abort.BUSY:
                return None
            raise

    written[0x8020, 1] = command


def _exchanged(camera: Any, one: tuple[int, int], other: tuple[int, int]) -> None:
    live = camera.coe._values._live
    live[one], live[other] = live[other], live[one]
