"""Snapshot of a software camera (object 0x8030): captured and read in parts."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable

import numpy as np

from ocmm_core.errors import OcmmError
from ocmm_core.fieldbus.device import CHUNK_BYTES, SNAPSHOT, SnapshotCommand, Work
from ocmm_core.simulation.slave._pattern import SensorControl
from ocmm_core.simulation.slave._sdo_abort import Abort, AbortError
from ocmm_core.simulation.slave._sdo_values import Address

_LEFT, _TOP, _WIDTH, _HEIGHT, _COMMAND, _STATE, _PROGRESS, _TOTAL = range(1, 9)
_OFFSET, _CHUNK, _CRC, _PICTURE_WIDTH, _PICTURE_HEIGHT = range(9, 14)
_SLICE_PIXELS = 16384
"""Pixels per slice; limits the delay of answers to the master."""


class Snapshots:
    """The snapshot objects and their work."""

    def __init__(
        self,
        sensor: SensorControl,
        camera: int,
        size: tuple[int, int],
        failed: Callable[[OcmmError], object],
    ) -> None:
        self._sensor = sensor
        self._camera = camera
        self._size = size
        self._failed = failed
        self._state = Work.IDLE
        self._wanted = [0, 0, 0, 0]
        self._region = (0, 0, 0, 0)
        self._content = bytearray()
        self._crc = 0
        self._offset = 0

    def work(self) -> bool:
        """Capture the next slice; return whether there was one."""
        if self._state is not Work.BUSY:
            return False
        left, top, width, height = self._region
        done = len(self._content) // (2 * width)
        rows = min(max(1, _SLICE_PIXELS // width), height - done)
        try:
            pixels = self._sensor.image(self._camera, left, top + done, width, rows)
        except OcmmError as error:
            self._state = Work.FAILED
            self._failed(error)
            return True
        part = np.ascontiguousarray(pixels, "<u2").tobytes()
        self._content += part
        self._crc = zlib.crc32(part, self._crc)
        if done + rows == height:
            self._state = Work.DONE
        return True

    def live(self) -> dict[Address, Callable[[], bytes]]:
        """Return readers of the entries."""
        return {
            (SNAPSHOT, _STATE): lambda: bytes([self._state]),
            (SNAPSHOT, _PROGRESS): lambda: bytes([self._percent()]),
            (SNAPSHOT, _TOTAL): lambda: struct.pack("<I", self._total()),
            (SNAPSHOT, _CHUNK): self._chunk,
            (SNAPSHOT, _CRC): lambda: struct.pack("<I", self._crc),
            (SNAPSHOT, _PICTURE_WIDTH): lambda: struct.pack("<H", self._region[2]),
            (SNAPSHOT, _PICTURE_HEIGHT): lambda: struct.pack("<H", self._region[3]),
        }

    def written(self) -> dict[Address, Callable[[bytes], object]]:
        """Return the actions for written entries."""
        return {
            **{(SNAPSHOT, sub): self._setter(sub) for sub in (_LEFT, _TOP, _WIDTH, _HEIGHT)},
            (SNAPSHOT, _COMMAND): self._command,
            (SNAPSHOT, _OFFSET): self._set_offset,
        }

    def _setter(self, sub: int) -> Callable[[bytes], object]:
        def keep(value: bytes) -> None:
            self._wanted[sub - 1] = int.from_bytes(value, "little")

        return keep

    def _set_offset(self, value: bytes) -> None:
        self._offset = int.from_bytes(value, "little")

    def _command(self, value: bytes) -> None:
        if SnapshotCommand(value[0]) is SnapshotCommand.RELEASE:
            self._state = Work.IDLE
            self._content = bytearray()
            self._region, self._crc = (0, 0, 0, 0), 0
            return
        if self._state is Work.BUSY:
            raise AbortError(Abort.BUSY)
        left, top, width, height = self._wanted
        if not width or not height:
            left, top, (width, height) = 0, 0, self._size
        if left + width > self._size[0] or top + height > self._size[1]:
            raise AbortError(Abort.VALUE)
        self._region = (left, top, width, height)
        self._content = bytearray()
        self._crc = 0
        self._state = Work.BUSY

    def _total(self) -> int:
        return 2 * self._region[2] * self._region[3]

    def _percent(self) -> int:
        if self._state is Work.DONE:
            return 100
        return 100 * len(self._content) // max(1, self._total())

    def _chunk(self) -> bytes:
        if self._state is not Work.DONE or self._offset >= len(self._content):
            raise AbortError(Abort.NO_DATA)
        return bytes(self._content[self._offset : self._offset + CHUNK_BYTES])
