"""SII EEPROM image of the smart camera (ETG.2010), made from the device model."""

from __future__ import annotations

import struct

from ocmm_core.fieldbus import device
from ocmm_core.fieldbus.device import INPUT_START as INPUT_START
from ocmm_core.fieldbus.device import SYNC_MANAGERS as SYNC_MANAGERS
from ocmm_sim.slave import _esi as esi

_PROTOCOLS = 0x000C
"""CoE, and FoE for firmware."""
_COE_DETAILS = 0x23
"""SDO, SDO information and complete access; assignment and mapping are fixed."""
_CATEGORY_STRINGS, _CATEGORY_GENERAL, _CATEGORY_FMMU = 10, 30, 40
_CATEGORY_SYNC_MANAGERS, _CATEGORY_TX_PDO, _CATEGORY_RX_PDO = 41, 50, 51
_CATEGORY_CLOCK = 60
_MANDATORY, _FIXED = 0x0001, 0x0010
"""PDO flags: mapped by every master, with fixed content."""


def sii_image(serial: int, alias: int, layout: device.InputLayout = device.NEWEST_LAYOUT) -> bytes:
    """Return the content of the EEPROM; `layout` defines the revision."""
    head = bytearray(esi.SII_CONFIGURATION)
    struct.pack_into("<H", head, 8, alias)
    head += struct.pack("<H", checksum_of_configuration(head))
    head += struct.pack("<IIII", device.VENDOR_ID, device.PRODUCT_CODE, layout.revision, serial)
    head += bytes(8)
    # In BOOT the mailbox addresses are fixed.
    head += struct.pack(
        "<HHHH",
        device.MAILBOX_OUT_START,
        device.MAILBOX_BYTES,
        device.MAILBOX_IN_START,
        device.MAILBOX_BYTES,
    )
    head += struct.pack(
        "<HHHHH",
        device.MAILBOX_OUT_START,
        device.MAILBOX_BYTES,
        device.MAILBOX_IN_START,
        device.MAILBOX_BYTES,
        _PROTOCOLS,
    )
    head = head.ljust(0x7C, b"\x00")
    head += struct.pack("<HH", esi.SII_BYTES * 8 // 1024 - 1, 1)
    strings = _Strings()
    body = sii_category(_CATEGORY_GENERAL, _general(strings))
    body += sii_category(_CATEGORY_FMMU, bytes([1, 2]))
    body += sii_category(
        _CATEGORY_SYNC_MANAGERS, b"".join(struct.pack("<HHBBBB", *sm) for sm in SYNC_MANAGERS)
    )
    body += b"".join(
        _pdo(_CATEGORY_TX_PDO, pdo, device.SM_INPUTS, strings) for pdo in layout.input_pdos
    )
    body += _pdo(_CATEGORY_RX_PDO, device.OUTPUT_PDO, device.SM_OUTPUTS, strings)
    body += sii_category(
        _CATEGORY_CLOCK, b"".join(_clock(mode, strings) for mode in esi.CLOCK_MODES)
    )
    # Strings come first, but are complete only now.
    body = sii_category(_CATEGORY_STRINGS, strings.content) + body
    return (bytes(head) + body + b"\xff\xff").ljust(esi.SII_BYTES, b"\xff")


class _Strings:
    """Unique texts of an image, referenced by number from 1."""

    def __init__(self) -> None:
        self._texts: list[str] = []

    def number(self, text: str) -> int:
        """Return the number of a text; 0 for an empty text."""
        if not text:
            return 0
        if text not in self._texts:
            self._texts.append(text)
        return self._texts.index(text) + 1

    @property
    def content(self) -> bytes:
        """Return the category: count, then each text with its length."""
        encoded = [text.encode("ascii") for text in self._texts]
        return bytes([len(encoded)]) + b"".join(bytes([len(text)]) + text for text in encoded)


def _general(strings: _Strings) -> bytes:
    """Return the category General (ETG.2010, table 7), 32 bytes."""
    group, name = strings.number(esi.DEVICE_GROUP), strings.number(device.DEVICE_NAME)
    # Group, picture, order number, name, a reserved byte, details of CoE.
    head = struct.pack("<BBBBBB", group, 0, name, name, 0, _COE_DETAILS)
    # FoE; no EoE, three reserved, flags, no current on the E-bus (int16).
    head += struct.pack("<B4xBh", 1, esi.MAILBOX_REPEATS, 0)
    # Group again, a reserved byte, then at byte 16 the ports, a nibble each.
    head += struct.pack("<BBH", group, 0, esi.PHYSICAL_PORTS)
    return head.ljust(32, b"\x00")


def _clock(mode: esi.ClockMode, strings: _Strings) -> bytes:
    """Return one mode of the distributed clock (ETG.2010, table 13), 24 bytes."""
    return struct.pack(
        "<IIIhHhBB4x",
        0, 0, 0, mode.sync1_factor, mode.activate, mode.sync0_factor,
        strings.number(mode.name), strings.number(mode.text),
    )  # fmt: skip


def sii_category(kind: int, content: bytes) -> bytes:
    content += bytes(len(content) % 2)
    return struct.pack("<HH", kind, len(content) // 2) + content


def _pdo(category: int, pdo: device.Pdo, sync_manager: int, strings: _Strings) -> bytes:
    name = strings.number(pdo.name)
    content = struct.pack(
        "<HBBBBH", pdo.index, len(pdo.entries), sync_manager, 0, name, _MANDATORY | _FIXED
    )
    for entry in pdo.entries:
        content += struct.pack(
            "<HBBBBH",
            entry.index, entry.sub, strings.number(entry.name), entry.kind & 0xFF, entry.bits, 0,
        )  # fmt: skip
    return sii_category(category, content)


def checksum_of_configuration(content: bytes | bytearray) -> int:
    """Return the CRC-8 of the first 14 bytes (ETG.2010, table 2), start 0xFF."""
    crc = 0xFF
    for byte in content:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ 0x07 if crc & 0x80 else crc << 1) & 0xFF
    return crc
