"""Word-by-word EEPROM reads through the service channel (ETG.1000.4, 6.4)."""

from __future__ import annotations

import struct
from collections.abc import Iterator

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.wire._datagrams import Command, Datagram
from ocmm_core.fieldbus.wire._service import Job

_OWNER, _CONTROL = 0x0500, 0x0502
_TO_MASTER, _TO_CAMERA = b"\x00", b"\x01"
_READ = 0x0100
_BUSY = 0x8000
_ERRORS = 0x7800
_EIGHT_BYTES = 0x0040
_REQUEST = struct.Struct("<HI")
_ANSWER = struct.Struct("<HI8s")


class EepromRead:
    """Read EEPROM words of one camera; a state machine without a clock."""

    def __init__(self, station: int, word: int, words: int) -> None:
        self._station = station
        self._word = word
        self._wanted = 2 * words
        self._value = bytearray()
        self._mine = self._asked = self._waiting = self._returned = False
        self._error: BusError | None = None

    @property
    def done(self) -> bool:
        """Return whether all words are read and EEPROM access is returned to the camera."""
        return self._returned

    @property
    def error(self) -> BusError | None:
        return self._error

    @property
    def result(self) -> bytes:
        return bytes(self._value[: self._wanted])

    @property
    def progress(self) -> tuple[int, int]:
        return len(self.result), self._wanted

    def jobs(self) -> Iterator[Job]:
        """Yield the request of this cycle, if due."""
        if self._waiting or self._returned or self._error is not None:
            return
        self._waiting = True
        if not self._mine:
            yield self._write(_OWNER, _TO_MASTER, "_mine")
        elif len(self._value) >= self._wanted:
            yield self._write(_OWNER, _TO_CAMERA, "_returned")
        elif not self._asked:
            place = self._word + len(self._value) // 2
            yield self._write(_CONTROL, _REQUEST.pack(_READ, place), "_asked")
        else:
            question = Datagram(Command.FPRD, self._station, _CONTROL, bytes(_ANSWER.size))
            yield Job(question, self._look)

    def _write(self, register: int, content: bytes, step: str) -> Job:
        def written(answer: Datagram | None) -> None:
            self._waiting = False
            if answer is not None and answer.working_counter == 1:
                setattr(self, step, True)

        return Job(Datagram(Command.FPWR, self._station, register, content), written)

    def _look(self, answer: Datagram | None) -> None:
        self._waiting = False
        if answer is None or answer.working_counter != 1:
            return
        status, place, data = _ANSWER.unpack(answer.data)
        if status & _BUSY:
            return
        if status & _ERRORS:
            self._error = BusError(
                "bus.eeprom",
                f"The EEPROM of the camera cannot be read at word {place} (status {status:#06x}).",
                "Repeat the request; if it happens again, have the camera repaired.",
            )
            return
        self._asked = False
        if place == self._word + len(self._value) // 2:
            self._value += data if status & _EIGHT_BYTES else data[:4]
