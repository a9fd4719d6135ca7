"""Errors of a software camera: register, diagnosis history and emergencies."""

from __future__ import annotations

import struct
from collections.abc import Callable

from ocmm_core.fieldbus.device import (
    DATA_BYTES,
    ERROR_REGISTER,
    HISTORY,
    HISTORY_FIRST,
    HISTORY_MESSAGES,
    DiagnosisMessage,
)
from ocmm_sim.slave._sdo_abort import Abort, AbortError
from ocmm_sim.slave._sdo_values import Address

_NEWEST, _ACKNOWLEDGED, _AVAILABLE, _FLAGS = 2, 3, 4, 5
_SEND = 1


class Diagnosis:
    """Errors of the camera since power-on.

    ``clock`` returns bus time, ns; ``send`` gets code, error register and five bytes.
    """

    def __init__(self, clock: Callable[[], int], send: Callable[[int, int, bytes], object]) -> None:
        self._clock = clock
        self._send = send
        self.register = 0
        self.count = 0
        self._messages: dict[int, bytes] = {}
        self._newest = self._acknowledged = 0
        self._flags = _SEND

    @property
    def pending(self) -> bool:
        """Return whether the newest message is unacknowledged."""
        return self._newest != self._acknowledged

    def report(self, code: int, register: int, data: bytes) -> None:
        """Record an error, or with code 0 its end, and notify the master."""
        data = data[:DATA_BYTES].ljust(DATA_BYTES, b"\x00")
        self.register = register
        self.count += 1
        if self._newest:
            self._newest = HISTORY_FIRST + (self._newest - HISTORY_FIRST + 1) % HISTORY_MESSAGES
        else:
            self._newest = HISTORY_FIRST
        if self._newest == self._acknowledged:
            # The acknowledged message is overwritten.
            self._acknowledged = 0
        message = DiagnosisMessage(code, self._clock(), register, data)
        self._messages[self._newest] = message.encode()
        if self._flags & _SEND:
            self._send(code, register, data)

    def live(self) -> dict[Address, Callable[[], bytes]]:
        entries: dict[Address, Callable[[], bytes]] = {
            (ERROR_REGISTER, 0): lambda: bytes([self.register]),
            (HISTORY, _NEWEST): lambda: bytes([self._newest]),
            (HISTORY, _ACKNOWLEDGED): lambda: bytes([self._acknowledged]),
            (HISTORY, _AVAILABLE): lambda: bytes([self.pending]),
        }
        for place in range(HISTORY_FIRST, HISTORY_FIRST + HISTORY_MESSAGES):
            entries[HISTORY, place] = lambda place=place: self._messages.get(place, b"")  # type: ignore[misc]  # mypy cannot infer a lambda with bound defaults
        return entries

    def written(self) -> dict[Address, Callable[[bytes], object]]:
        return {(HISTORY, _ACKNOWLEDGED): self._acknowledge, (HISTORY, _FLAGS): self._set_flags}

    def _acknowledge(self, value: bytes) -> None:
        place = value[0]
        if place == 0:
            self._messages.clear()
            self._newest = self._acknowledged = 0
        elif place in self._messages:
            self._acknowledged = place
        else:
            raise AbortError(Abort.VALUE)

    def _set_flags(self, value: bytes) -> None:
        (self._flags,) = struct.unpack("<H", value)
