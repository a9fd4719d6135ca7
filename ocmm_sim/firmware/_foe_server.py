"""FoE slave: receives firmware in packets (ETG.1000.6, 5.8)."""

from __future__ import annotations

import struct
from collections.abc import Callable

from ocmm_core.errors import InputError
from ocmm_sim.firmware._banks import FirmwareBanks

_MAILBOX_FOE = 4
_READ, _WRITE, _DATA, _ACK, _ERROR = 1, 2, 3, 4, 5
_HEAD = struct.Struct("<BBI")
_UNDEFINED, _NOT_FOUND, _DENIED, _FULL, _ILLEGAL, _PACKET = (
    0x8000, 0x8001, 0x8002, 0x8003, 0x8004, 0x8005,
)  # fmt: skip
_WRONG_FIRMWARE = 0x8009
"""File header is missing or wrong (ETG.1000.6, table 92)."""
FILE_NAME = b"firmware"


class FoeServer:
    """Receives firmware if `may_write` returns True (state BOOT)."""

    def __init__(
        self, banks: FirmwareBanks, mailbox_bytes: int, may_write: Callable[[], bool]
    ) -> None:
        self._banks = banks
        self._room = mailbox_bytes - 6 - _HEAD.size
        self._may_write = may_write
        self._expected = 0
        self._last = (0, b"")
        self._counter = 0

    def reset(self) -> None:
        """Abort the current transfer."""
        self._expected = 0

    def answer(self, body: bytes) -> bytes:
        """Return the mailbox that answers the content of one."""
        if len(body) < _HEAD.size:
            return self._error(_ILLEGAL, "too short")
        operation, _reserved, number = _HEAD.unpack_from(body)
        rest = body[_HEAD.size :]
        if operation == _WRITE:
            return self._begin(rest)
        if operation == _DATA:
            return self._data(number, rest)
        if operation == _READ:
            return self._error(_DENIED, "firmware is not given away")
        self._expected = 0
        return self._error(_ILLEGAL, "unexpected")

    def _begin(self, name: bytes) -> bytes:
        self._expected = 0
        if not self._may_write():
            return self._error(_ILLEGAL, "only in BOOT")
        if name.rstrip(b"\x00") != FILE_NAME:
            return self._error(_NOT_FOUND, "no such file")
        self._banks.begin()
        self._expected = 1
        self._last = (0, b"")
        return self._acknowledge(0)

    def _data(self, number: int, content: bytes) -> bytes:
        if number and (number, content) == self._last:
            # Our acknowledgement was lost.
            return self._acknowledge(number)
        if not self._expected:
            return self._error(_ILLEGAL, "no transfer")
        if number != self._expected:
            self._expected = 0
            return self._error(_PACKET, "packet number")
        if not self._banks.write(content):
            self._expected = 0
            return self._error(_FULL, "too large")
        self._expected += 1
        if len(content) < self._room:
            self._expected = 0
            try:
                self._banks.finish()
            except InputError as error:
                return self._error(_WRONG_FIRMWARE, error.what[:100])
        self._last = (number, content)
        return self._acknowledge(number)

    def _acknowledge(self, number: int) -> bytes:
        return self._mailbox(_HEAD.pack(_ACK, 0, number))

    def _error(self, code: int, text: str) -> bytes:
        words = text.encode("ascii", errors="replace")
        return self._mailbox(_HEAD.pack(_ERROR, 0, code) + words)

    def _mailbox(self, content: bytes) -> bytes:
        self._counter = self._counter % 7 + 1
        return struct.pack("<HHBB", len(content), 0, 0, self._counter << 4 | _MAILBOX_FOE) + content
