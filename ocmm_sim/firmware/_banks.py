"""Two firmware banks, one always running, safe against power loss.

A page is erased and written in pieces; a power loss leaves a piece half written. New firmware is
written to the idle bank; only when it is complete and its signature valid, a one-piece record with
its own checksum selects it. It then runs on trial until a master brings it to PREOP; otherwise the
next start reverts.
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

    @property
    def on_trial(self) -> bool:
        """Return whether the running firmware is unconfirmed."""
        return bool(self._newest()[2])

    def confirm(self) -> None:
        """Keep the running firmware, as a master has brought it to PREOP."""
        number, bank, trial, _starts = self._newest()
        if trial and bank == self._running:
            self._note(number + 1, bank, 0, 0)

    def begin(self) -> None:
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
        image = bytes(self._banks[other][: self._at])
        found = Firmware.read(image, MAKER)
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
        found = [each for each in map(_unsealed, self._records) if each is not None]
        return max(found)

    def _note(self, number: int, bank: int, trial: int, starts: int) -> None:
        """Overwrite the older record; the other stays valid until complete."""
        known = [_unsealed(each) for each in self._records]
        older = min(range(2), key=lambda place: known[place] or (-1, 0, 0, 0))
        record = self._records[older]
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
