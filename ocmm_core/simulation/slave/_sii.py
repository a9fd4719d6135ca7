"""The SII EEPROM image of the smart camera (ETG.2010), made from the device model."""

from __future__ import annotations

import struct

from ocmm_core.fieldbus.device import (
    DC_ACTIVATE,
    DEVICE_NAME,
    INPUT_PDOS,
    MAILBOX_BYTES,
    MAILBOX_IN_START,
    MAILBOX_OUT_START,
    OUTPUT_PDO,
    PRODUCT_CODE,
    REVISION,
    SII_BYTES,
    SII_CONFIGURATION,
    SM_INPUTS,
    SM_OUTPUTS,
    SYNC0_NS,
    SYNC1_NS,
    VENDOR_ID,
    VENDOR_NAME,
    Pdo,
)
from ocmm_core.fieldbus.device import INPUT_START as INPUT_START
from ocmm_core.fieldbus.device import SYNC_MANAGERS as SYNC_MANAGERS

_PROTOCOL_COE = 0x0004
_COE_DETAILS = 0x23
"""SDO, SDO information and complete access; neither assignment nor mapping can be changed."""
_CATEGORY_STRINGS, _CATEGORY_GENERAL, _CATEGORY_FMMU = 10, 30, 40
_CATEGORY_SYNC_MANAGERS, _CATEGORY_TX_PDO, _CATEGORY_RX_PDO = 41, 50, 51
_CATEGORY_CLOCK = 60


def sii_image(serial: int, alias: int) -> bytes:
    """Return the content of the EEPROM.

    Parameters
    ----------
    serial
        Serial number of the camera.
    alias
        Station alias, 1 to 65535.
    """
    head = bytearray(SII_CONFIGURATION)
    struct.pack_into("<H", head, 8, alias)
    head += struct.pack("<H", _crc8(head))
    head += struct.pack("<IIII", VENDOR_ID, PRODUCT_CODE, REVISION, serial)
    head += bytes(8 + 8)
    head += struct.pack(
        "<HHHHH",
        MAILBOX_OUT_START,
        MAILBOX_BYTES,
        MAILBOX_IN_START,
        MAILBOX_BYTES,
        _PROTOCOL_COE,
    )
    head = head.ljust(0x7C, b"\x00")
    head += struct.pack("<HH", SII_BYTES * 8 // 1024 - 1, 1)
    body = _category(_CATEGORY_STRINGS, _strings(VENDOR_NAME, DEVICE_NAME))
    body += _category(
        _CATEGORY_GENERAL,
        bytes([1, 0, 1, 2, 0, _COE_DETAILS]).ljust(14, b"\x00") + bytes([0x11, 0x00]) + bytes(16),
    )
    body += _category(_CATEGORY_FMMU, bytes([1, 2]))
    body += _category(
        _CATEGORY_SYNC_MANAGERS, b"".join(struct.pack("<HHBBBB", *sm) for sm in SYNC_MANAGERS)
    )
    body += b"".join(_pdo(_CATEGORY_TX_PDO, pdo, SM_INPUTS) for pdo in INPUT_PDOS)
    body += _pdo(_CATEGORY_RX_PDO, OUTPUT_PDO, SM_OUTPUTS)
    clock = struct.pack("<IIIhHH", SYNC0_NS, SYNC1_NS, 0, 0, 0, DC_ACTIVATE)
    body += _category(_CATEGORY_CLOCK, clock)
    return (bytes(head) + body + b"\xff\xff").ljust(SII_BYTES, b"\xff")


def _category(kind: int, content: bytes) -> bytes:
    content += bytes(len(content) % 2)
    return struct.pack("<HH", kind, len(content) // 2) + content


def _strings(*texts: str) -> bytes:
    content = bytes([len(texts)])
    for text in texts:
        content += bytes([len(text)]) + text.encode("ascii")
    return content


def _pdo(category: int, pdo: Pdo, sync_manager: int) -> bytes:
    content = struct.pack("<HBBBBH", pdo.index, len(pdo.entries), sync_manager, 0, 0, 0x0010)
    for entry in pdo.entries:
        content += struct.pack(
            "<HBBBBH", entry.index, entry.sub, 0, entry.kind & 0xFF, entry.bits, 0
        )
    return _category(category, content)


def _crc8(content: bytes | bytearray) -> int:
    crc = 0xFF
    for byte in content:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ 0x07 if crc & 0x80 else crc << 1) & 0xFF
    return crc
