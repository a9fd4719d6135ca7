"""Packed pixel formats, against their definition bit by bit."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_genicam import unpack
from ocmm_genicam._client import FORMATS

_WIDTH, _HEIGHT = 8, 6


def _sent(name: str, bits: int, counts: np.ndarray) -> bytes:
    """Return an image as a camera sends it, written from the definition with Python integers."""
    pixels = [int(one) for one in counts.ravel()]
    if name.endswith("p"):
        stream = sum(one << (bits * i) for i, one in enumerate(pixels))
        return stream.to_bytes(len(pixels) * bits // 8, "little")
    if name.endswith("Packed"):
        low = bits - 8
        pairs = zip(pixels[::2], pixels[1::2], strict=True)
        mask = (1 << low) - 1
        return b"".join(bytes([a >> low, (a & mask) | (b & mask) << 4, b >> low]) for a, b in pairs)
    return b"".join(one.to_bytes(1 if bits == 8 else 2, "little") for one in pixels)


@pytest.mark.parametrize("pixels", FORMATS, ids=lambda one: one.name)
def test_every_format_gives_the_counts_that_were_sent(pixels) -> None:  # type: ignore[no-untyped-def] # a private type
    bits = int("".join(filter(str.isdigit, pixels.name)))
    counts = np.random.default_rng(1).integers(0, 1 << bits, (_HEIGHT, _WIDTH))
    content = np.frombuffer(_sent(pixels.name, bits, counts), np.uint8)
    assert len(content) == pixels.bytes_of(_WIDTH, _HEIGHT)
    # Buffers may be longer than the image.
    padded = np.concatenate([content, np.full(5, 255, np.uint8)])
    assert np.array_equal(unpack(pixels, padded, _WIDTH, _HEIGHT), counts)


def test_an_overexposed_pixel_is_one_in_every_format() -> None:
    for pixels in FORMATS:
        bits = int("".join(filter(str.isdigit, pixels.name)))
        # The highest count of a converter of 10 bits in the high bits of 16.
        highest = 0xFFC0 if bits == 16 else (1 << bits) - 1
        assert highest >= pixels.spot_options().full_scale
