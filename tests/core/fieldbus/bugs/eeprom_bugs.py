"""Bugs of firmware: EEPROM."""

from __future__ import annotations

import struct
from typing import Any

from ocmm_sim.slave import registers as reg
from tests.core.fieldbus.bugs.bug_tools import add, bug, eeprom

# ruff: noqa: SLF001 - see bug_tools

add("eeprom.configuration", "check sum of the EEPROM is wrong", eeprom(14, b"\x00"))
add(
    "eeprom.configuration",
    "SYNC0 is an input (0500 0000)",
    eeprom(0, bytes.fromhex("05000000"), seal=True),
)
add(
    "eeprom.configuration",
    "station alias is not loaded",
    lambda camera: camera.esc.memory.__setitem__(slice(0x12, 0x14), b"\x00\x00"),
)
add("eeprom.configuration", "pulse has no length", eeprom(4, b"\x00\x00", seal=True))
add("eeprom.identity", "no serial number in the EEPROM", eeprom(28, bytes(4)))
add("eeprom.identity", "revision of the EEPROM is old", eeprom(24, bytes.fromhex("00000200")))
add("eeprom.identity", "vendor is another", eeprom(16, b"\x02"))
add("eeprom.mailboxes", "no mailboxes for BOOT", eeprom(40, bytes(8)))
add("eeprom.mailboxes", "FoE is not among the protocols", eeprom(56, b"\x04\x00"))
add("eeprom.mailboxes", "size of the EEPROM in bytes", eeprom(0x7C, b"\x00\x10"))


@bug("eeprom.categories", "ports stand two bytes early")
def _ports(camera: Any) -> None:
    at = camera.esc._sii.index(struct.pack("<HH", 30, 16)) + 4
    camera.esc._sii[at + 14 : at + 18] = b"\x11\x00\x00\x00"


@bug("eeprom.categories", "inputs are buffered as a mailbox")
def _manager(camera: Any) -> None:
    at = camera.esc._sii.index(struct.pack("<HH", 41, 16)) + 4
    camera.esc._sii[at + 3 * 8 + 4] = 0x22


@bug("eeprom.categories", "a PDO entry is a byte too short")
def _pdo_bits(camera: Any) -> None:
    at = camera.esc._sii.index(struct.pack("<HBB", 0x6000, 3, 0)[:3])
    camera.esc._sii[at + 5] = 24


@bug("eeprom.categories", "mailboxes are not told to be sent again")
def _flags(camera: Any) -> None:
    at = camera.esc._sii.index(struct.pack("<HH", 30, 16)) + 4
    camera.esc._sii[at + 11] = 0


@bug("eeprom.categories", "SYNC0 once a bus cycle")
def _factor(camera: Any) -> None:
    at = camera.esc._sii.index(struct.pack("<HH", 60, 24)) + 4
    camera.esc._sii[at + 16 : at + 18] = b"\x01\x00"


@bug("eeprom.categories", "a PDO entry has another type")
def _type(camera: Any) -> None:
    at = camera.esc._sii.index(struct.pack("<HBB", 0x6000, 3, 0)[:3])
    camera.esc._sii[at + 4] = 0x04


add(
    "eeprom.alias",
    "EEPROM cannot be written",
    lambda camera: setattr(camera.esc, "_sii", _Stubborn(camera.esc._sii)),
)


def _refuses_writing(camera: Any) -> None:
    before = camera.esc._eeprom

    def eeprom() -> None:
        writes = camera.esc._get(reg.EEPROM_CONTROL, "<H") & 0x0700 == 0x0200
        before()
        if writes:
            camera.esc._set(reg.EEPROM_CONTROL, "<H", 0x2040)

    camera.esc._eeprom = eeprom


add("eeprom.alias", "EEPROM refuses to be written", _refuses_writing)


class _Stubborn(bytearray):
    """Memory that keeps its content."""

    def __setitem__(self, _place: object, _value: object) -> None:
        """Keep nothing."""


add("controller.registers", "one FMMU only", lambda camera: camera.esc.memory.__setitem__(4, 1))
add("controller.registers", "memory of 4 kB", lambda camera: camera.esc.memory.__setitem__(6, 4))
add(
    "controller.registers",
    "clock of 32 bits",
    lambda camera: camera.esc.memory.__setitem__(8, 0x04),
)
add(
    "controller.registers",
    "watchdog of 10 ms at power-on",
    lambda camera: camera.esc._set(reg.WATCHDOG_SM_TIME, "<H", 100),
)
