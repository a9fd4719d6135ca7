"""Non-volatile memory and errors of a software camera.

Memory: named blocks with checksums. Errors: register, diagnosis history and emergencies.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable
from pathlib import Path

from ocmm_core.documents import read_bytes, write_atomic
from ocmm_core.errors import StorageError
from ocmm_core.fieldbus.device import (
    DATA_BYTES,
    ERROR_REGISTER,
    HISTORY,
    HISTORY_FIRST,
    HISTORY_MESSAGES,
    DiagnosisMessage,
)
from ocmm_sim.slave._sdo_values import Abort, AbortError, Address

_CRC_BYTES = 4


class CameraStore:
    """Flash memory of one camera: a file per block in `folder`, or in memory if None.

    Pass the same object after a power cycle.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self._folder = folder
        self._blocks: dict[str, bytes] = {}

    def save(self, name: str, content: bytes) -> None:
        """Store `content` atomically; raise StorageError on failure."""
        block = zlib.crc32(content).to_bytes(_CRC_BYTES, "little") + content
        if self._folder is None:
            self._blocks[name] = block
            return
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            write_atomic(self._path(self._folder, name), block)
        except OSError as error:
            raise _unwritable(name, error) from error

    def load(self, name: str) -> bytes | None:
        """Return the content, or None; raise StorageError if damaged."""
        if self._folder is None:
            block = self._blocks.get(name)
        else:
            path = self._path(self._folder, name)
            block = read_bytes(path) if path.exists() else None
        if block is None:
            return None
        content = block[_CRC_BYTES:]
        if zlib.crc32(content).to_bytes(_CRC_BYTES, "little") != block[:_CRC_BYTES]:
            raise StorageError(
                "camera.stored",
                f"The {name} that the camera keeps is damaged.",
                "Write or measure it again.",
            )
        return content

    def forget(self, name: str) -> None:
        """Delete the content; raise StorageError on failure."""
        self._blocks.pop(name, None)
        if self._folder is None:
            return
        try:
            self._path(self._folder, name).unlink(missing_ok=True)
        except OSError as error:
            raise _unwritable(name, error) from error

    @staticmethod
    def _path(folder: Path, name: str) -> Path:
        return folder / f"{name.replace(' ', '_')}.bin"


def _unwritable(name: str, error: OSError) -> StorageError:
    return StorageError(
        "camera.stored",
        f"The camera cannot keep its {name} ({error.strerror}).",
        "Check the folder of the software camera.",
    )


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
