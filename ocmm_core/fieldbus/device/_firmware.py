"""Firmware file of a camera: target devices, content, and signature.

Letters ``OCFW``, version UINT 1, length of the version text UINT, product UDINT, lowest and highest
revision UDINT each, length of the content UDINT, SHA-256 of the content (32 bytes), the version in
ASCII, the content, and at the end the Ed25519 signature (64 bytes, RFC 8032) over all before it.
Cameras accept only files signed with their maker's key; the master checks the same before sending.
"""

from __future__ import annotations

import hashlib
import struct
from dataclasses import dataclass

from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey

from ocmm_core.errors import InputError
from ocmm_core.fieldbus.device._camera_slave import PRODUCT_CODE, REVISION

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
