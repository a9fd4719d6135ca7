"""Input layouts of a camera by its revision.

Since revision 3 the checksum starts with the camera's serial number, so that swapped inputs are
detected, and the input counter has 16 bits. Cameras of revision 2 are still read; these properties
remain unproven.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from typing import NamedTuple

from ocmm_core.fieldbus.device import _camera_slave as camera_slave

DATA_CRC = struct.Struct("<I")
DATA_CRC_AT = camera_slave.HEADER_STRUCT.size - DATA_CRC.size
"""Offset of the input's checksum."""
_NO_CRC = bytes(DATA_CRC.size)
_SERIAL = struct.Struct("<I")
_NO_INPUT = bytes(camera_slave.INPUT_DTYPE.itemsize)


class Header(NamedTuple):
    """Decoded header of one camera's process data; see `HEADER_PDO`."""

    counter: int
    start_ns: int
    period_ns: int
    frames_valid: int
    cycle_counter: int
    status: int
    config_crc: int
    boot_counter: int
    data_crc: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class InputLayout:
    """Input layout of one camera revision; all have the same size."""

    revision: int
    header_pdo: camera_slave.Pdo
    cycle_counters: int
    """Modulus of the input counter."""
    longest_advance: int
    """A larger advance of the input counter is a step back."""
    says_serial: bool

    @property
    def input_pdos(self) -> tuple[camera_slave.Pdo, ...]:
        return (self.header_pdo, *camera_slave.FRAME_PDOS)

    def decode(self, content: bytes) -> Header:
        found = camera_slave.HEADER_STRUCT.unpack_from(content)
        if self.says_serial:
            counter, start_ns, period_ns, valid, status, cycle, config, boot, crc = found
            return Header(counter, start_ns, period_ns, valid, cycle, status, config, boot, crc)
        return Header._make(found)

    def encode(self, header: Header) -> bytes:
        small, large = header.cycle_counter, header.status
        if self.says_serial:
            small, large = large, small
        return camera_slave.HEADER_STRUCT.pack(*header[:4], small, large, *header[6:])

    def crc_begin(self, serial: int) -> int:
        """Return the initial value of the checksum of a camera's input."""
        return zlib.crc32(_SERIAL.pack(serial)) if self.says_serial else 0

    def crc(self, content: bytes | bytearray | memoryview, serial: int) -> int:
        """Return the CRC-32 (ISO 3309) of a whole input; its own field counts as zero."""
        return _crc(content, self.crc_begin(serial))

    def mark(self, serial: int) -> int:
        """Return the `data_mark` of every valid input of a camera.

        A CRC is linear: another initial value changes it by the same bits for any content. So one
        comparison proves integrity and origin.
        """
        return _crc(_NO_INPUT, self.crc_begin(serial)) ^ _crc(_NO_INPUT, 0)


INPUT_LAYOUTS = {
    layout.revision: layout
    for layout in (
        InputLayout(
            camera_slave.REVISION, camera_slave.HEADER_PDO, 1 << 16, 1 << 15, says_serial=True
        ),
        InputLayout(0x00020000, camera_slave.FIRST_HEADER_PDO, 1 << 8, 200, says_serial=False),
    )
}
"""Supported layouts by revision, newest first."""
NEWEST_LAYOUT = INPUT_LAYOUTS[camera_slave.REVISION]
NO_MARK = -1
"""Mark of no valid input."""


def data_mark(content: bytes) -> int:
    """Return the checksum of a camera's whole input XOR the received one.

    `InputLayout.mark` of its camera for an undamaged input, `NO_MARK` for incomplete ones.
    """
    if len(content) != camera_slave.INPUT_DTYPE.itemsize:
        return NO_MARK
    found: int = DATA_CRC.unpack_from(content, DATA_CRC_AT)[0]
    return found ^ _crc(content, 0)


def _crc(content: bytes | bytearray | memoryview, begin: int) -> int:
    crc = zlib.crc32(_NO_CRC, zlib.crc32(content[:DATA_CRC_AT], begin))
    return zlib.crc32(content[DATA_CRC_AT + DATA_CRC.size :], crc)
