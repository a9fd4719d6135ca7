"""The SII EEPROM image of the smart camera (ETG.2010), made from the device model."""

from __future__ import annotations

import struct

from ocmm_core.fieldbus.camera_slave import (
    DEVICE_NAME,
    INPUT_DTYPE,
    INPUT_PDOS,
    OUTPUT_DTYPE,
    OUTPUT_PDO,
    PRODUCT_CODE,
    REVISION,
    SM_INPUTS,
    SM_OUTPUTS,
    VENDOR_ID,
    Pdo,
)

MAILBOX_BYTES = 256
MAILBOX_OUT_START = 0x1000
MAILBOX_IN_START = MAILBOX_OUT_START + MAILBOX_BYTES
OUTPUT_START = 0x1400
INPUT_START = 0x1800
"""Three buffers of the inputs end at 0x21D8, inside the 8 KiB of an ET1100."""

_IMAGE_BYTES = 4096
_PROTOCOL_COE = 0x0004
_COE_DETAILS = 0x03
"""SDO and SDO information; neither assignment nor mapping can be changed."""
_CATEGORY_STRINGS, _CATEGORY_GENERAL, _CATEGORY_FMMU = 10, 30, 40
_CATEGORY_SYNC_MANAGERS, _CATEGORY_TX_PDO, _CATEGORY_RX_PDO = 41, 50, 51
_CATEGORY_CLOCK = 60

# Start, length, control, status, activate, type (1 to 4: mailbox out, in, outputs, inputs).
SYNC_MANAGERS = (
    (MAILBOX_OUT_START, MAILBOX_BYTES, 0x26, 0, 1, 1),
    (MAILBOX_IN_START, MAILBOX_BYTES, 0x22, 0, 1, 2),
    (OUTPUT_START, OUTPUT_DTYPE.itemsize, 0x64, 0, 1, 3),
    (INPUT_START, INPUT_DTYPE.itemsize, 0x20, 0, 1, 4),
)


def sii_image(serial: int, alias: int) -> bytes:
    """Return the content of the EEPROM.

    Parameters
    ----------
    serial
        Serial number of the camera.
    alias
        Station alias, 1 to 65535.
    """
    config = struct.pack("<HHHHHHH", 0x0005, 0, 0, 0, alias, 0, 0)
    head = bytearray(config + struct.pack("<H", _crc8(config)))
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
    head += struct.pack("<HH", _IMAGE_BYTES * 8 // 1024 - 1, 1)
    body = _category(_CATEGORY_STRINGS, _strings("OCMM", DEVICE_NAME))
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
    body += _category(_CATEGORY_CLOCK, struct.pack("<IIIhHH", 125_000, 875_000, 0, 0, 0, 0x0700))
    return (bytes(head) + body + b"\xff\xff").ljust(_IMAGE_BYTES, b"\xff")


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


def _crc8(content: bytes) -> int:
    crc = 0xFF
    for byte in content:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ 0x07 if crc & 0x80 else crc << 1) & 0xFF
    return crc
