"""Pictures of 16 bits as files: PNG and PGM."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ocmm_core.errors import InputError

_PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
_GREYSCALE, _BITS = 0, 16


def encode_png(picture: NDArray[np.uint16]) -> bytes:
    """Return a picture (height, width) as 16 bit greyscale PNG, not scaled."""
    height, width = picture.shape
    head = struct.pack(">IIBBBBB", width, height, _BITS, _GREYSCALE, 0, 0, 0)
    rows = np.zeros((height, 1 + 2 * width), np.uint8)
    # Each row starts with its filter, 0: none.
    rows[:, 1:] = picture.astype(">u2").view(np.uint8).reshape(height, 2 * width)
    content = _chunk(b"IHDR", head) + _chunk(b"IDAT", zlib.compress(rows.tobytes(), 6))
    return _PNG_MAGIC + content + _chunk(b"IEND", b"")


def encode_pgm(picture: NDArray[np.uint16]) -> bytes:
    """Return a picture (height, width) as binary 16 bit PGM, not scaled."""
    height, width = picture.shape
    return f"P5\n{width} {height}\n65535\n".encode("ascii") + picture.astype(">u2").tobytes()


def encoder_for(path: Path) -> Callable[[NDArray[np.uint16]], bytes]:
    """Return the encoder for a file name's suffix; InputError if unknown."""
    encoders = {".png": encode_png, ".pgm": encode_pgm}
    encoder = encoders.get(path.suffix.lower())
    if encoder is None:
        raise InputError(
            "picture.kind",
            f"{path}: not a picture file name.",
            "Give a file that ends with .png or .pgm.",
        )
    return encoder


def _chunk(kind: bytes, content: bytes) -> bytes:
    check = zlib.crc32(kind + content)
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", check)
