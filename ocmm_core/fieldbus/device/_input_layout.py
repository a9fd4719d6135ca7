"""Layouts of a camera's input, by the revision of the camera: where the header says what.

Since revision 3 the check sum begins with the serial number of the camera, so that an input which
reaches the place of another one is not taken for that camera's, and the counter of inputs has 16
bits. Cameras of revision 2 are still read; what they cannot prove stays unproven.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from typing import NamedTuple

from ocmm_core.fieldbus.device._camera_slave import (
    FIRST_HEADER_PDO,
    FRAME_PDOS,
    HEADER_PDO,
    HEADER_STRUCT,
    INPUT_DTYPE,
    REVISION,
    Pdo,
)

DATA_CRC = struct.Struct("<I")
DATA_CRC_AT = HEADER_STRUCT.size - DATA_CRC.size
"""Where the check sum of the input stands in it."""
_NO_CRC = bytes(DATA_CRC.size)
_SERIAL = struct.Struct("<I")
_NO_INPUT = bytes(INPUT_DTYPE.itemsize)


class Header(NamedTuple):
    """The header of one camera's process data, decoded; see `HEADER_PDO`."""

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
    """How cameras of one revision lay out their input; its size is the same in all."""

    revision: int
    header_pdo: Pdo
    """What stands in front of the frames."""
    cycle_counters: int
    """The counter of inputs begins again after so many."""
    longest_advance: int
    """Where the counter of inputs seems to have gone on by more, it has gone back."""
    says_serial: bool
    """The check sum begins with the serial number."""

    @property
    def input_pdos(self) -> tuple[Pdo, ...]:
        """Return what the input is made of."""
        return (self.header_pdo, *FRAME_PDOS)

    def decode(self, content: bytes) -> Header:
        """Return the header at the start of a camera's input."""
        found = HEADER_STRUCT.unpack_from(content)
        if self.says_serial:
            counter, start_ns, period_ns, valid, status, cycle, config, boot, crc = found
            return Header(counter, start_ns, period_ns, valid, cycle, status, config, boot, crc)
        return Header._make(found)

    def encode(self, header: Header) -> bytes:
        """Return a header as the camera sends it."""
        small, large = header.cycle_counter, header.status
        if self.says_serial:
            small, large = large, small
        return HEADER_STRUCT.pack(*header[:4], small, large, *header[6:])

    def crc_begin(self, serial: int) -> int:
        """Return what the check sum of a camera's input begins with."""
        return zlib.crc32(_SERIAL.pack(serial)) if self.says_serial else 0

    def crc(self, content: bytes | bytearray | memoryview, serial: int) -> int:
        """Return the check sum (CRC-32 of ISO 3309) of a camera's whole input.

        The field that holds it counts as zero.
        """
        return _crc(content, self.crc_begin(serial))

    def mark(self, serial: int) -> int:
        """Return the `data_mark` that every sound input of a camera has.

        A check sum is linear: with another beginning it differs by the same bits, whatever the
        content is. So one look tells that an input is sound, and whose it is.
        """
        return _crc(_NO_INPUT, self.crc_begin(serial)) ^ _crc(_NO_INPUT, 0)


INPUT_LAYOUTS = {
    layout.revision: layout
    for layout in (
        InputLayout(REVISION, HEADER_PDO, 1 << 16, 1 << 15, says_serial=True),
        InputLayout(0x00020000, FIRST_HEADER_PDO, 1 << 8, 200, says_serial=False),
    )
}
"""Those that are read, by revision; the newest first."""
NEWEST_LAYOUT = INPUT_LAYOUTS[REVISION]
NO_MARK = -1
"""No sound input has it."""


def data_mark(content: bytes) -> int:
    """Return the check sum of a camera's whole input less the one that it brought.

    It is `InputLayout.mark` of its camera where the input arrived as the camera sent it, and
    `NO_MARK` where it is no whole input.
    """
    if len(content) != INPUT_DTYPE.itemsize:
        return NO_MARK
    found: int = DATA_CRC.unpack_from(content, DATA_CRC_AT)[0]
    return found ^ _crc(content, 0)


def _crc(content: bytes | bytearray | memoryview, begin: int) -> int:
    crc = zlib.crc32(_NO_CRC, zlib.crc32(content[:DATA_CRC_AT], begin))
    return zlib.crc32(content[DATA_CRC_AT + DATA_CRC.size :], crc)
