"""Binary blocks inside a camera: its firmware file and its intrinsics.

Firmware: letters ``OCFW``, version UINT 1, length of the version text UINT, product UDINT, lowest
and highest revision UDINT each, length of the content UDINT, SHA-256 of the content (32 bytes), the
version in ASCII, the content, and at the end the Ed25519 signature (64 bytes, RFC 8032) over all
before it. Cameras accept only files signed with their maker's key; the master checks the same
before sending.

Intrinsics, little-endian: the four letters OCIN, version (UINT, 1), reserved (UINT, 0), serial
number (UDINT), date of the calibration in seconds since 1970 UTC (ULINT), width and height in px
(UINT each), nine numbers of 64 bits (pitch mm, focal mm, aspect, u0 px, v0 px, k1 mm^-2, k2 mm^-4,
p1 mm^-1, p2 mm^-1) and the CRC-32 of all before it.
"""

from __future__ import annotations

import hashlib
import math
import struct
import zlib
from dataclasses import dataclass

from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey

from ocmm_core.camera import CameraModel
from ocmm_core.errors import BusError, InputError
from ocmm_core.fieldbus.device._camera_slave import PRODUCT_CODE, REVISION
from ocmm_core.geometry import RigidTransform

_HEAD = struct.Struct("<4sHHIIII32s")
_MAGIC, _VERSION = b"OCFW", 1
_SIGNATURE_BYTES = 64
MOST_FIRMWARE_BYTES = 16 << 20
_LONGEST_VERSION = 60


@dataclass(frozen=True, slots=True)
class Firmware:
    """Signed firmware."""

    version: str
    product: int
    revisions: tuple[int, int]
    """`product`, `revisions`: target devices; lowest and highest revision."""
    content: bytes

    def signed(self, key: Ed25519PrivateKey) -> bytes:
        """Return the file, signed with the maker's key."""
        text = self.version.encode("ascii")
        head = _HEAD.pack(
            _MAGIC, _VERSION, len(text), self.product, *self.revisions, len(self.content),
            hashlib.sha256(self.content).digest(),
        )  # fmt: skip
        whole = head + text + self.content
        return whole + key.sign(whole)

    @classmethod
    def read(cls, image: bytes, maker: Ed25519PublicKey | None = None) -> Firmware:
        """Return the firmware of a file, or InputError; `maker` None verifies checksums only."""
        if len(image) < _HEAD.size + _SIGNATURE_BYTES or len(image) > MOST_FIRMWARE_BYTES:
            raise _unfit(f"it has {len(image)} bytes")
        magic, version, text_bytes, product, low, high, size, sha256 = _HEAD.unpack_from(image)
        if (magic, version) != (_MAGIC, _VERSION):
            raise _unfit("it is of an unknown kind or version")
        begin = _HEAD.size + text_bytes
        content = image[begin : begin + size]
        if len(image) != begin + size + _SIGNATURE_BYTES:
            raise _unfit("it is cut off, or something is appended")
        if hashlib.sha256(content).digest() != sha256:
            raise _unfit("its checksum is wrong")
        try:
            text = image[_HEAD.size : begin].decode("ascii")
            if maker is not None:
                maker.verify(image[-_SIGNATURE_BYTES:], image[:-_SIGNATURE_BYTES])
        except UnicodeDecodeError as error:
            raise _unfit("its version is no text") from error
        except InvalidSignature as error:
            raise _unfit("the maker of the camera did not sign it") from error
        if not (0 < len(text) <= _LONGEST_VERSION and text.isprintable()):
            # It is displayed, and compared with the version the camera reports.
            raise _unfit("its version is no text")
        return cls(text, product, (low, high), content)

    def check_for(self, product: int = PRODUCT_CODE, revision: int = REVISION) -> None:
        """Raise InputError if it is for other devices."""
        low, high = self.revisions
        if self.product != product or not low <= revision <= high:
            raise InputError(
                "firmware.device",
                f"The firmware {self.version} is for product {self.product:#010x}, revision "
                f"{low:#010x} to {high:#010x}; the camera is {product:#010x}, {revision:#010x}.",
                "Give the firmware of this camera.",
            )


def _unfit(why: str) -> InputError:
    return InputError(
        "firmware.file",
        f"The firmware file cannot be used: {why}.",
        "Get the file from the maker of the camera again.",
    )


_INTRINSICS_HEAD = struct.Struct("<4sHHIQHH")
_NUMBERS = struct.Struct("<9d")
_CRC = struct.Struct("<I")
_INTRINSICS_MAGIC, _INTRINSICS_VERSION = b"OCIN", 1
BLOB_BYTES = _INTRINSICS_HEAD.size + _NUMBERS.size + _CRC.size


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
    def from_camera(cls, camera: CameraModel, date_s: int) -> Intrinsics:
        """Return the intrinsics of `camera`, dated `date_s`."""
        return cls(
            camera.serial, date_s, camera.width, camera.height, camera.pitch_mm, camera.focal,
            camera.aspect, camera.u0, camera.v0, camera.k1, camera.k2, camera.p1, camera.p2,
        )  # fmt: skip

    @classmethod
    def decode(cls, content: bytes) -> Intrinsics:
        """Return the intrinsics; BusError ``bus.intrinsics`` if damaged or implausible."""
        if len(content) != BLOB_BYTES:
            raise _unfit_intrinsics(f"it has {len(content)} bytes instead of {BLOB_BYTES}")
        magic, version, reserved, serial, date_s, width, height = _INTRINSICS_HEAD.unpack_from(
            content
        )
        if (magic, version, reserved) != (_INTRINSICS_MAGIC, _INTRINSICS_VERSION, 0):
            raise _unfit_intrinsics("it is of an unknown kind or version")
        if _CRC.unpack(content[-_CRC.size :])[0] != zlib.crc32(content[: -_CRC.size]):
            raise _unfit_intrinsics("its checksum is wrong")
        found = cls(
            serial, date_s, width, height, *_NUMBERS.unpack_from(content, _INTRINSICS_HEAD.size)
        )
        found._check()
        return found

    def encode(self) -> bytes:
        """Return the block; BusError ``bus.intrinsics`` for implausible values."""
        self._check()
        try:
            head = _INTRINSICS_HEAD.pack(
                _INTRINSICS_MAGIC,
                _INTRINSICS_VERSION,
                0,
                self.serial,
                self.date_s,
                self.width,
                self.height,
            )
        except struct.error as error:
            raise _unfit_intrinsics(f"a whole number is out of range ({error})") from error
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
            raise _unfit_intrinsics("a number is not finite")
        if min(scales) <= 0.0 or min(self.width, self.height) <= 0:
            raise _unfit_intrinsics("a length is not positive")


def _unfit_intrinsics(why: str) -> BusError:
    return BusError(
        "bus.intrinsics",
        f"The block of intrinsics cannot be used: {why}.",
        "Write the intrinsics to the camera again.",
    )
