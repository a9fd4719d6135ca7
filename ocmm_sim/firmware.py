"""Firmware of a software camera: two memory banks and their FoE server.

In: packets of FoE in the state BOOT. Out: the running bank, also after a power loss at any moment.

A page is erased and written in pieces; a power loss leaves a piece half written. New firmware
arrives in packets (ETG.1000.6, 5.8) and is written to the idle bank; only when it is complete and
its signature valid, a one-piece record with its own checksum selects it. It then runs on trial
until a master brings it to PREOP; otherwise the next start reverts.

It must not import other parts of the camera.
"""

from __future__ import annotations

import hashlib
import struct
import zlib
from collections.abc import Callable

from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

from ocmm_core.errors import InputError
from ocmm_core.fieldbus.device import PRODUCT_CODE, REVISION, Firmware

_PIECE = 256
_BANK_BYTES = 1 << 20
_RECORD = struct.Struct("<IBBB")
"""Record number, running bank, on trial, number of trial starts."""
_CRC = struct.Struct("<I")
_TRIALS = 1


class PowerLossError(Exception):
    """Power was lost during a memory write."""


def maker_key() -> Ed25519PrivateKey:
    """Return the key of the maker of software cameras; public, so it proves nothing."""
    return Ed25519PrivateKey.from_private_bytes(hashlib.sha256(b"OCMM software camera").digest())


MAKER = maker_key().public_key()
FACTORY = Firmware("3.0.0", PRODUCT_CODE, (REVISION, REVISION), b"factory" * 64).signed(maker_key())


class FirmwareBanks:
    """Persistent firmware memory of one camera.

    ``written`` is called before each piece; raise `PowerLossError` there to simulate a power loss.
    """

    def __init__(self, written: Callable[[], object] = lambda: None) -> None:
        self.written = written
        self._banks = [bytearray(b"\xff" * _BANK_BYTES) for _ in range(2)]
        self._records = [bytearray(_RECORD.size + _CRC.size) for _ in range(2)]
        self._banks[0][: len(FACTORY)] = FACTORY
        self._records[0][:] = _sealed(1, 0, 0, 0)
        self._sizes = [len(FACTORY), 0]
        self._running = 0
        self._at = 0
        self.version = ""
        """Version of the running firmware; set by `start`."""
        self.start()

    def start(self) -> None:
        """Start the camera: choose the bank, and revert one that failed on trial."""
        number, bank, trial, starts = self._newest()
        if trial and (starts >= _TRIALS or self._firmware(bank) is None):
            bank, trial = 1 - bank, 0
            self._note(number + 1, bank, 0, 0)
        elif trial:
            self._note(number + 1, bank, 1, starts + 1)
        found = self._firmware(bank)
        if found is None:
            # The bank was whole when selected; memory may have decayed since.
            bank = 1 - bank
            found = self._firmware(bank)
        if found is None:
            raise InputError(
                "firmware.dead", "Neither bank holds firmware.", "Have the camera repaired."
            )
        self._running = bank
        self.version = found.version

    def confirm(self) -> None:
        """Keep the running firmware, as a master has brought it to PREOP."""
        number, bank, trial, _starts = self._newest()
        if trial and bank == self._running:
            self._note(number + 1, bank, 0, 0)

    def start_writing(self) -> None:
        """Start writing new firmware into the idle bank."""
        self._at = 0
        bank = self._banks[1 - self._running]
        for at in range(0, _BANK_BYTES, _BANK_BYTES // 16):
            self._spoil(bank, at, _PIECE)
            bank[at : at + _BANK_BYTES // 16] = b"\xff" * (_BANK_BYTES // 16)

    def write(self, content: bytes) -> bool:
        """Write the next bytes; return whether there was room."""
        bank = self._banks[1 - self._running]
        if self._at + len(content) > _BANK_BYTES:
            return False
        for at in range(0, len(content), _PIECE):
            piece = content[at : at + _PIECE]
            self._spoil(bank, self._at, len(piece))
            bank[self._at : self._at + len(piece)] = piece
            self._at += len(piece)
        return True

    def finish(self) -> Firmware:
        """Check the written firmware and select it for a trial; raise InputError if unfit."""
        other = 1 - self._running
        found = Firmware.read(bytes(self._banks[other][: self._at]), MAKER)
        found.check_for()
        self._sizes[other] = self._at
        self._note(self._newest()[0] + 1, other, 1, 0)
        return found

    def _firmware(self, bank: int) -> Firmware | None:
        """Return the firmware of a bank, or None unless whole and signed."""
        try:
            return Firmware.read(bytes(self._banks[bank][: self._sizes[bank]]), MAKER)
        except InputError:
            return None

    def _newest(self) -> tuple[int, int, int, int]:
        return max(filter(None, map(_unsealed, self._records)))

    def _note(self, number: int, bank: int, trial: int, starts: int) -> None:
        """Overwrite the older record; the other stays valid until complete."""
        known = [_unsealed(each) for each in self._records]
        record = self._records[min(range(2), key=lambda place: known[place] or (-1, 0, 0, 0))]
        self._spoil(record, 0, len(record))
        record[:] = _sealed(number, bank, trial, starts)

    def _spoil(self, memory: bytearray, at: int, size: int) -> None:
        """Simulate a power loss: half of the piece is undefined."""
        try:
            self.written()
        except PowerLossError:
            half = max(1, size // 2)
            memory[at : at + half] = b"\xa5" * half
            raise


def _sealed(number: int, bank: int, trial: int, starts: int) -> bytes:
    content = _RECORD.pack(number, bank, trial, starts)
    return content + _CRC.pack(zlib.crc32(content))


def _unsealed(record: bytearray) -> tuple[int, int, int, int] | None:
    content = bytes(record[: _RECORD.size])
    if _CRC.pack(zlib.crc32(content)) != bytes(record[_RECORD.size :]) or not any(record):
        return None
    number, bank, trial, starts = _RECORD.unpack(content)
    return number, bank, trial, starts


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
            return self._start(rest)
        if operation == _DATA:
            return self._data(number, rest)
        if operation == _READ:
            return self._error(_DENIED, "firmware is not given away")
        self._expected = 0
        return self._error(_ILLEGAL, "unexpected")

    def _start(self, name: bytes) -> bytes:
        self._expected = 0
        if not self._may_write():
            return self._error(_ILLEGAL, "only in BOOT")
        if name.rstrip(b"\x00") != FILE_NAME:
            return self._error(_NOT_FOUND, "no such file")
        self._banks.start_writing()
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
