"""Intrinsics block stored inside a camera.

Little-endian: the four letters OCIN, version (UINT, 1), reserved (UINT, 0), serial number (UDINT),
date of the calibration in seconds since 1970 UTC (ULINT), width and height in px (UINT each), nine
numbers of 64 bits (pitch mm, focal mm, aspect, u0 px, v0 px, k1 mm^-2, k2 mm^-4, p1 mm^-1, p2
mm^-1) and the CRC-32 of all before it.
"""

from __future__ import annotations

import math
import struct
import zlib
from dataclasses import dataclass

from ocmm_core.camera import CameraModel
from ocmm_core.errors import BusError
from ocmm_core.geometry import RigidTransform

_HEAD = struct.Struct("<4sHHIQHH")
_NUMBERS = struct.Struct("<9d")
_CRC = struct.Struct("<I")
_MAGIC, _VERSION = b"OCIN", 1
BLOB_BYTES = _HEAD.size + _NUMBERS.size + _CRC.size


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """Lens and sensor parameters of a camera, without its pose; see `CameraModel`."""

    serial: int
    date_s: int
    """Calibration date, s since 1970 UTC."""
    width: int
    height: int
    pitch_mm: float
    focal: float
    aspect: float
    u0: float
    v0: float
    k1: float
    k2: float
    p1: float
    p2: float
    """`pitch_mm`, `focal`, `aspect`, `u0`, `v0`, `k1`, `k2`, `p1`, `p2`: as in `CameraModel`."""

    @classmethod
    def of(cls, camera: CameraModel, date_s: int) -> Intrinsics:
        """Return the intrinsics of `camera`, dated `date_s`."""
        return cls(
            camera.serial, date_s, camera.width, camera.height, camera.pitch_mm, camera.focal,
            camera.aspect, camera.u0, camera.v0, camera.k1, camera.k2, camera.p1, camera.p2,
        )  # fmt: skip

    @classmethod
    def decode(cls, content: bytes) -> Intrinsics:
        """Return the intrinsics; BusError ``bus.intrinsics`` if damaged or implausible."""
        if len(content) != BLOB_BYTES:
            raise _unfit(f"it has {len(content)} bytes instead of {BLOB_BYTES}")
        magic, version, reserved, serial, date_s, width, height = _HEAD.unpack_from(content)
        if (magic, version, reserved) != (_MAGIC, _VERSION, 0):
            raise _unfit("it is of an unknown kind or version")
        if _CRC.unpack(content[-_CRC.size :])[0] != zlib.crc32(content[: -_CRC.size]):
            raise _unfit("its checksum is wrong")
        found = cls(serial, date_s, width, height, *_NUMBERS.unpack_from(content, _HEAD.size))
        found._check()
        return found

    def encode(self) -> bytes:
        """Return the block; BusError ``bus.intrinsics`` for implausible values."""
        self._check()
        try:
            head = _HEAD.pack(
                _MAGIC, _VERSION, 0, self.serial, self.date_s, self.width, self.height
            )
        except struct.error as error:
            raise _unfit(f"a whole number is out of range ({error})") from error
        numbers = _NUMBERS.pack(
            self.pitch_mm, self.focal, self.aspect, self.u0, self.v0,
            self.k1, self.k2, self.p1, self.p2,
        )  # fmt: skip
        return head + numbers + _CRC.pack(zlib.crc32(head + numbers))

    def model(self) -> CameraModel:
        """Return a camera with these intrinsics at the origin of the world."""
        return CameraModel(
            "", self.serial, self.width, self.height, self.pitch_mm, self.focal, self.aspect,
            self.u0, self.v0, self.k1, self.k2, self.p1, self.p2, RigidTransform.identity(),
        )  # fmt: skip

    def _check(self) -> None:
        lens = (self.u0, self.v0, self.k1, self.k2, self.p1, self.p2)
        scales = (self.pitch_mm, self.focal, self.aspect)
        if not all(math.isfinite(value) for value in (*lens, *scales)):
            raise _unfit("a number is not finite")
        if min(scales) <= 0.0 or min(self.width, self.height) <= 0:
            raise _unfit("a length is not positive")


def _unfit(why: str) -> BusError:
    return BusError(
        "bus.intrinsics",
        f"The block of intrinsics cannot be used: {why}.",
        "Write the intrinsics to the camera again.",
    )
