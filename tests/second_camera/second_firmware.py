"""Firmware files as the page describes them, two banks, and FoE (ETG.1000.6, 5.8)."""

from __future__ import annotations

import hashlib
import struct

from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

KEY = Ed25519PrivateKey.from_private_bytes(hashlib.sha256(b"the second camera").digest())
"""Key of the maker of second cameras."""
_HEAD = struct.Struct("<4sHHIIII32s")
_WHOLE_PACKET = 244
_LARGEST = 1 << 20


def signed(version: str, content: bytes, product: int, revision: int) -> bytes:
    """Return a firmware file."""
    text = version.encode("ascii")
    head = _HEAD.pack(b"OCFW", 1, len(text), product, revision, revision, len(content),
                      hashlib.sha256(content).digest())  # fmt: skip
    return head + text + content + KEY.sign(head + text + content)


class Banks:
    """Two banks: which runs, whether on trial, and FoE that writes the other one."""

    def __init__(self, product: int, revision: int) -> None:
        self._product, self._revision = product, revision
        self.versions = ["1.0.0", ""]
        self.running = 0
        self._next: int | None = None
        self._trial = False
        self._expected = 0
        self._content = b""
        self._last: tuple[int, bytes] = (0, b"")

    @property
    def version(self) -> str:
        return self.versions[self.running]

    def start(self) -> None:
        """Restart: with the written firmware, or back from an unconfirmed trial."""
        if self._next is not None:
            self.running, self._next, self._trial = self._next, None, True
        elif self._trial:
            self.running, self._trial = 1 - self.running, False

    def confirm(self) -> None:
        self._trial = False

    def forget(self) -> None:
        self._expected = 0

    def answer(self, body: bytes, in_boot: bool) -> bytes:
        operation, number = struct.unpack_from("<BxI", body)
        rest = body[6:]
        if operation == 2:
            self._expected = 0
            if not in_boot:
                return _error(0x8004)
            if rest.rstrip(b"\x00") != b"firmware":
                return _error(0x8001)
            self._expected, self._content, self._last = 1, b"", (0, b"")
            return _acknowledge(0)
        if operation == 1:
            return _error(0x8002)
        if operation != 3:
            return _error(0x8004)
        if number and (number, rest) == self._last:
            return _acknowledge(number)
        if not self._expected:
            return _error(0x8004)
        if number != self._expected:
            self._expected = 0
            return _error(0x8005)
        self._content += rest
        if len(self._content) > _LARGEST:
            self._expected = 0
            return _error(0x8003)
        self._expected, self._last = number + 1, (number, rest)
        if len(rest) < _WHOLE_PACKET:
            self._expected = 0
            version = self._version_of(self._content)
            if version is None:
                return _error(0x8009)
            self._next = 1 - self.running
            self.versions[self._next] = version
        return _acknowledge(number)

    def _version_of(self, image: bytes) -> str | None:
        """Return the version of a file that is for this camera and signed, or None."""
        if len(image) < _HEAD.size + 64:
            return None
        magic, form, text, product, low, high, size, digest = _HEAD.unpack_from(image)
        content = image[_HEAD.size + text : -64]
        if (magic, form, product) != (b"OCFW", 1, self._product) or len(content) != size:
            return None
        if not low <= self._revision <= high or hashlib.sha256(content).digest() != digest:
            return None
        try:
            KEY.public_key().verify(image[-64:], image[:-64])
        except InvalidSignature:
            return None
        return image[_HEAD.size : _HEAD.size + text].decode("ascii")


def _acknowledge(number: int) -> bytes:
    return struct.pack("<BBI", 4, 0, number)


def _error(code: int) -> bytes:
    return struct.pack("<BBI", 5, 0, code)
