"""Sensor, memory and errors of a software camera with their objects."""

from __future__ import annotations

import hashlib
import struct
import zlib
from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from ocmm_core.camera import CameraModel
from ocmm_core.errors import BusError, OcmmError, StorageError
from ocmm_core.fieldbus import device
from ocmm_sim.slave._frames import SENSOR_PX, CameraFrames, SensorControl, sensor_of
from ocmm_sim.slave._sdo_values import Abort, AbortError, Address
from ocmm_sim.slave._store import BlackImages, CameraStore, Diagnosis

_LEFT, _TOP, _REGION_WIDTH, _REGION_HEIGHT, _COMMAND, _STATE, _PROGRESS, _TOTAL = range(1, 9)
_OFFSET, _CHUNK, _CHUNK_CRC, _PICTURE_WIDTH, _PICTURE_HEIGHT = range(9, 14)
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
        self._state = device.Work.IDLE
        self._wanted = [0, 0, 0, 0]
        self._region = (0, 0, 0, 0)
        self._content = bytearray()
        self._crc = 0
        self._offset = 0

    def work(self) -> bool:
        """Capture the next slice; return whether there was one."""
        if self._state is not device.Work.BUSY:
            return False
        left, top, width, height = self._region
        done = len(self._content) // (2 * width)
        rows = min(max(1, _SLICE_PIXELS // width), height - done)
        try:
            pixels = self._sensor.image(self._camera, left, top + done, width, rows)
        except OcmmError as error:
            self._state = device.Work.FAILED
            self._failed(error)
            return True
        part = np.ascontiguousarray(pixels, "<u2").tobytes()
        self._content += part
        self._crc = zlib.crc32(part, self._crc)
        if done + rows == height:
            self._state = device.Work.DONE
        return True

    def live(self) -> dict[Address, Callable[[], bytes]]:
        return {
            (device.SNAPSHOT, _STATE): lambda: bytes([self._state]),
            (device.SNAPSHOT, _PROGRESS): lambda: bytes([self._percent()]),
            (device.SNAPSHOT, _TOTAL): lambda: struct.pack("<I", self._total()),
            (device.SNAPSHOT, _CHUNK): self._chunk,
            (device.SNAPSHOT, _CHUNK_CRC): lambda: struct.pack("<I", self._crc),
            (device.SNAPSHOT, _PICTURE_WIDTH): lambda: struct.pack("<H", self._region[2]),
            (device.SNAPSHOT, _PICTURE_HEIGHT): lambda: struct.pack("<H", self._region[3]),
        }

    def written(self) -> dict[Address, Callable[[bytes], object]]:
        return {
            **{
                (device.SNAPSHOT, sub): partial(self._want, sub)
                for sub in (_LEFT, _TOP, _REGION_WIDTH, _REGION_HEIGHT)
            },
            (device.SNAPSHOT, _COMMAND): self._command,
            (device.SNAPSHOT, _OFFSET): self._set_offset,
        }

    def _want(self, sub: int, value: bytes) -> None:
        self._wanted[sub - 1] = int.from_bytes(value, "little")

    def _set_offset(self, value: bytes) -> None:
        self._offset = int.from_bytes(value, "little")

    def _command(self, value: bytes) -> None:
        if device.SnapshotCommand(value[0]) is device.SnapshotCommand.RELEASE:
            self._state = device.Work.IDLE
            self._content = bytearray()
            self._region, self._crc = (0, 0, 0, 0), 0
            return
        if self._state is device.Work.BUSY:
            raise AbortError(Abort.BUSY)
        left, top, width, height = self._wanted
        if not width or not height:
            left, top, (width, height) = 0, 0, self._size
        if left + width > self._size[0] or top + height > self._size[1]:
            raise AbortError(Abort.VALUE)
        self._region = (left, top, width, height)
        self._content = bytearray()
        self._crc = 0
        self._state = device.Work.BUSY

    def _total(self) -> int:
        return 2 * self._region[2] * self._region[3]

    def _percent(self) -> int:
        if self._state is device.Work.DONE:
            return 100
        return 100 * len(self._content) // max(1, self._total())

    def _chunk(self) -> bytes:
        if self._state is not device.Work.DONE or self._offset >= len(self._content):
            raise AbortError(Abort.NO_DATA)
        return bytes(self._content[self._offset : self._offset + device.CHUNK_BYTES])


_INTRINSICS_NAME, _NOTE_NAME, _HOURS_NAME = "intrinsics", "note", "hours"
_HOT_C, _COOL_C = 70.0, 65.0
_CHECK_NS = 1_000_000_000
_HOUR_NS = 3600 * 1_000_000_000
_BLOB, _LENGTH, _SHA, _CRC, _NOTE = range(1, 6)
_MODE = 4
_WIDTH, _HEIGHT, _TEMPERATURE, _HOURS = range(2, 6)


class Electronics:
    """Application behind one camera's objects; ``sensor``: serial number and size, px (0x9000)."""

    def __init__(
        self,
        camera: int,
        serial: int,
        provider: CameraFrames,
        store: CameraStore,
        diagnosis: Diagnosis,
        darken: Callable[[int], int],
        sensor: tuple[int, int, int] = (0, SENSOR_PX, SENSOR_PX),
    ) -> None:
        self._told_sensor = sensor
        self.warmer_c = 0.0
        """Fault: excess temperature of the sensor."""
        self.sensor_fails = False
        """Fault: the sensor fails; no spot is valid."""
        self._camera = camera
        self._serial = serial
        self._store = store
        self._diagnosis = diagnosis
        self._sensor = sensor_of(provider)
        self._black = BlackImages(self._sensor, camera, store, darken, self._failed)
        self._snapshots = Snapshots(self._sensor, camera, (SENSOR_PX, SENSOR_PX), self._failed)
        self._hot = self._failing = False
        self._now_ns = self._blinks_until_ns = 0
        self._checked_ns: int | None = None
        self._powered_ns = 0
        self._intrinsics = self._stored(_INTRINSICS_NAME)
        self._note = self._stored(_NOTE_NAME)
        self._hours = int.from_bytes(self._stored(_HOURS_NAME), "little")
        self._saved_hours = self._hours
        try:
            if self._intrinsics:
                device.Intrinsics.decode(self._intrinsics)
        except BusError as error:
            self._intrinsics = b""
            self._failed(error)
        self._black.switch_on()

    @property
    def lens(self) -> CameraModel | None:
        """Return the correction model, or None without stored intrinsics."""
        return device.Intrinsics.decode(self._intrinsics).model() if self._intrinsics else None

    @property
    def sensor_px(self) -> tuple[int, int]:
        """Return sensor width and height from the objects, px."""
        return self._told_sensor[1], self._told_sensor[2]

    def configure(self, config: device.CameraConfig) -> None:
        self._sensor.configure(self._camera, config)

    def work(self, now_ns: int) -> bool:
        """Advance lengthy work; return whether work was done."""
        self._now_ns = now_ns
        if self._checked_ns is None or now_ns - self._checked_ns >= _CHECK_NS:
            self._powered_ns += 0 if self._checked_ns is None else now_ns - self._checked_ns
            self._checked_ns = now_ns
            self._check()
        return self._black.work(now_ns) or self._snapshots.work()

    def live(self) -> dict[Address, Callable[[], bytes]]:
        return {
            **self._diagnosis.live(),
            (device.IDENTIFY, 2): lambda: struct.pack(
                "<H", max(0, -(-(self._blinks_until_ns - self._now_ns) // 1_000_000_000))
            ),
            **self._black.live(),
            **self._snapshots.live(),
            (device.CALIBRATION, _BLOB): lambda: self._intrinsics,
            (device.CALIBRATION, _LENGTH): lambda: struct.pack("<I", len(self._intrinsics)),
            (device.CALIBRATION, _SHA): lambda: (
                hashlib.sha256(self._intrinsics).digest() if self._intrinsics else b""
            ),
            (device.CALIBRATION, _CRC): lambda: struct.pack("<I", zlib.crc32(self._intrinsics)),
            (device.CALIBRATION, _NOTE): lambda: self._note,
            (device.INFORMATION, _WIDTH): lambda: struct.pack("<H", self._told_sensor[1]),
            (device.INFORMATION, _HEIGHT): lambda: struct.pack("<H", self._told_sensor[2]),
            (device.INFORMATION, _TEMPERATURE): lambda: struct.pack(
                "<h", round(10 * self._celsius())
            ),
            (device.INFORMATION, _HOURS): lambda: struct.pack("<I", self._operating_hours()),
        }

    def written(self) -> Mapping[Address, Callable[[bytes], object]]:
        return {
            **self._diagnosis.written(),
            (device.IDENTIFY, 1): self._blink,
            **self._black.written(),
            **self._snapshots.written(),
            (device.CONFIGURATION, _MODE): self._check_mode,
            (device.CALIBRATION, _BLOB): self._keep_intrinsics,
            (device.CALIBRATION, _NOTE): self._keep_note,
        }

    def _blink(self, value: bytes) -> None:
        self._blinks_until_ns = self._now_ns + int.from_bytes(value, "little") * 1_000_000_000

    def _check_mode(self, value: bytes) -> None:
        if value[0] == device.CameraMode.CORRECTED and not self._intrinsics:
            raise AbortError(Abort.NO_DATA)

    def _keep_intrinsics(self, value: bytes) -> None:
        if value:
            try:
                found = device.Intrinsics.decode(value)
            except BusError as error:
                raise AbortError(Abort.VALUE) from error
            if found.serial != self._serial:
                raise AbortError(Abort.VALUE)
        self._save(_INTRINSICS_NAME, value)
        self._intrinsics = value

    def _keep_note(self, value: bytes) -> None:
        self._save(_NOTE_NAME, value)
        self._note = value

    def _save(self, name: str, value: bytes) -> None:
        try:
            self._store.save(name, value)
        except StorageError as error:
            self._failed(error)
            raise AbortError(Abort.NOT_STORED) from error

    def _stored(self, name: str) -> bytes:
        try:
            return self._store.load(name) or b""
        except OcmmError as error:
            self._failed(error)
            return b""

    def _celsius(self) -> float:
        try:
            return self._sensor.temperature_c(self._camera) + self.warmer_c
        except OcmmError as error:
            raise AbortError(Abort.HARDWARE) from error

    def _operating_hours(self) -> int:
        return self._hours + self._powered_ns // _HOUR_NS

    def _check(self) -> None:
        """Check hours, temperature and sensor, once a second."""
        hours = self._operating_hours()
        if hours != self._saved_hours:
            self._saved_hours = hours
            try:
                self._store.save(_HOURS_NAME, struct.pack("<I", hours))
            except StorageError as error:
                self._failed(error)
        failing = self.sensor_fails
        try:
            celsius = self._celsius()
        except AbortError:
            failing, celsius = True, 0.0
        hot = celsius > (_COOL_C if self._hot else _HOT_C)
        if hot != self._hot:
            self._hot = hot
            code = device.ErrorCode.OVER_TEMPERATURE if hot else device.ErrorCode.RESET
            self._report(code, struct.pack("<h", round(10 * celsius)))
        if failing != self._failing:
            self._failing = failing
            self._report(device.ErrorCode.SENSOR if failing else device.ErrorCode.RESET)

    def _failed(self, error: OcmmError) -> None:
        stored = isinstance(error, StorageError) or error.code == "bus.intrinsics"
        self._report(device.ErrorCode.STORED_DATA if stored else device.ErrorCode.SENSOR)

    def _report(self, code: device.ErrorCode, data: bytes = b"") -> None:
        register = device.ErrorRegister(0)
        if self._hot:
            register |= device.ErrorRegister.TEMPERATURE
        if self._failing:
            register |= device.ErrorRegister.PROFILE
        if code or register:
            register |= device.ErrorRegister.GENERIC
        self._diagnosis.report(code, register, data)
