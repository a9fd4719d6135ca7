"""A GenICam camera and its client library (`AravisCameras`); pixel formats and their unpacking.

Layouts of the Pixel Format Naming Convention and of GigE Vision: ``p`` is a little-endian stream of
bits; ``Packed`` holds the high bits of two pixels in bytes 0 and 2, the low bits of both in byte 1.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import SpotOptions, compiled
from ocmm_core.errors import AcquisitionError

COMPLETE = 0
"""Status of a buffer with all its packets; others carry a stale number and old pixels."""


@dataclass(frozen=True, slots=True)
class Image:
    """One buffer; `data` is valid until the next `Camera.next_image`."""

    status: int
    number: int
    """Block id of the transport; 16 bits wide in most cameras, and never 0."""
    time_ns: int
    """Time of the exposure on the clock of the camera; 0: unknown."""
    pixel_format: int
    """Code of the Pixel Format Naming Convention."""
    width: int
    height: int
    data: NDArray[np.uint8]
    left: int = 0
    top: int = 0
    """`left`, `top`: place of its first pixel on the sensor."""


class Camera(Protocol):
    """One camera that this program controls; for one thread."""

    @property
    def serial(self) -> str: ...
    @property
    def model(self) -> str:
        """Return maker and model."""

    def has(self, feature: str) -> bool: ...
    def text(self, feature: str) -> str:
        """Return the value of a feature of any kind; switches are ``true`` or ``false``."""

    def number(self, feature: str) -> float: ...
    def integer(self, feature: str) -> int: ...
    def set_text(self, feature: str, value: str) -> None:
        """Set a feature of any kind."""

    def set_number(self, feature: str, value: float) -> None: ...
    def set_integer(self, feature: str, value: int) -> None: ...
    def steps(self, feature: str) -> tuple[int, int]:
        """Return the least value of a whole number that can be set now, and its increment."""

    def execute(self, feature: str) -> None: ...
    def entries(self, feature: str) -> tuple[str, ...]:
        """Return the values of an enumeration that can be set now."""

    def address(self) -> str:
        """Return the IPv4 address; empty if unknown."""

    def tick_frequency(self) -> int:
        """Return the ticks of the time stamps in a second; 0: stamps are those of this computer."""

    def start(self) -> None:
        """Allocate buffers and start the acquisition."""

    def next_image(self, timeout_s: float) -> Image | None:
        """Return the next buffer, or None."""

    def close(self) -> None:
        """Stop and release the camera; idempotent."""


class Cameras(Protocol):
    """Finds cameras and takes control of them."""

    def found(self) -> dict[str, str]:
        """Return maker and model of each camera, by serial number."""

    def open(self, serial: str) -> Camera:
        """Take control of a camera; AcquisitionError if absent or controlled by others."""


def is_refused(serial: str, text: str) -> AcquisitionError:
    """Return the error of a camera that refuses a command."""
    return AcquisitionError(
        "genicam.camera",
        f"Camera {serial}: {text}.",
        "Check cable, power and network of the camera, then open the job again.",
    )


def is_absent(serial: str, found: Mapping[str, str]) -> AcquisitionError:
    """Return the error of a camera that is not among those ``found``: model by serial number."""
    others = ", ".join(f"{one} ({model})" for one, model in found.items())
    return AcquisitionError(
        "genicam.absent",
        f"Camera {serial} was not found. Cameras found: {others or 'none'}.",
        "Check its power and cable, that its address is in the network of this computer, and that "
        "no firewall blocks UDP port 3956; with a GenTL producer, that its viewer shows the "
        "camera.",
    )


def is_controlled(serial: str) -> AcquisitionError:
    """Return the error of a camera that another program uses."""
    return AcquisitionError(
        "genicam.controlled",
        f"Camera {serial} is controlled by another program.",
        "Close that program. After a crash a camera stays reserved for some seconds: wait, then "
        "open the job again.",
    )


_SMALLEST_SIGNAL = 1.0 / 64.0
_NOISE = 1.0 / 1000.0
_WELL_ELECTRONS = 10_000.0
"""Stated for the sensors of such cameras: 2 to 10 electrons of noise, a well of 10,000. They decide
only which spots are refused; U has the noise of the rig, checked in each job."""


@dataclass(frozen=True, slots=True)
class PixelFormat:
    name: str
    code: int
    full_scale: int
    """Counts from here on are overexposed."""
    bits: int
    """Bits of a packed pixel; 0: whole bytes."""
    split: bool = False
    """Low bits of two pixels share a byte (``Packed``)."""

    def bytes_of(self, width: int, height: int) -> int:
        """Return the size of an image."""
        return width * height * (self.code >> 16 & 0xFF) // 8

    def spot_options(self) -> SpotOptions:
        """Return the options of the spot finder for this number of counts."""
        scale = float(self.full_scale)
        return SpotOptions(
            threshold=scale * _SMALLEST_SIGNAL,
            read_noise=scale * _NOISE,
            dark_spread=scale * _NOISE,
            electrons_per_count=_WELL_ELECTRONS / scale,
            full_scale=scale,
        )


FORMATS = (
    PixelFormat("Mono12p", 0x010C_0047, 4095, 12),
    PixelFormat("Mono12Packed", 0x010C_0006, 4095, 12, split=True),
    PixelFormat("Mono12", 0x0110_0005, 4095, 0),
    PixelFormat("Mono10p", 0x010A_0046, 1023, 10),
    PixelFormat("Mono10Packed", 0x010C_0004, 1023, 10, split=True),
    PixelFormat("Mono10", 0x0110_0003, 1023, 0),
    # Most fill the high bits of a 10- or 12-bit converter: its end is below 65535.
    PixelFormat("Mono16", 0x0110_0007, 65472, 0),
    PixelFormat("Mono8", 0x0108_0001, 255, 0),
)
"""The best one first: many levels, few bytes."""


def unpack(
    pixels: PixelFormat, data: NDArray[np.uint8], width: int, height: int
) -> NDArray[np.uint16]:
    """Return the counts (height, width) of an image; a view of ``data`` if nothing is packed."""
    data = data[: pixels.bytes_of(width, height)]
    if pixels.bits:
        out = np.empty(width * height, np.uint16)
        unpack_bits(data, pixels.bits, pixels.split, out)
        return out.reshape(height, width)
    if pixels.code >> 16 & 0xFF == 8:
        return data.astype(np.uint16).reshape(height, width)
    counts = data.view("<u2").reshape(height, width)
    # Memory of some producers is read-only, which the finder is not compiled for.
    return counts if counts.flags.writeable else counts.copy()


def scaled(counts: NDArray[np.uint16], full_scale: int) -> NDArray[np.uint16]:
    """Return counts with a full scale of 65535."""
    found = np.minimum(counts.astype(np.uint32) * 65535 // full_scale, 65535)
    return found.astype(np.uint16)


@compiled()
def unpack_bits(data: NDArray[np.uint8], bits: int, split: bool, out: NDArray[np.uint16]) -> None:
    """Write the counts of an even number of packed pixels (n,); n a multiple of 4 for 10p."""
    if split:
        low = bits - 8
        mask = (1 << low) - 1
        for k in range(len(out) // 2):
            shared = int(data[3 * k + 1])
            out[2 * k] = (int(data[3 * k]) << low) | (shared & mask)
            out[2 * k + 1] = (int(data[3 * k + 2]) << low) | (shared >> 4 & mask)
        return
    if bits == 12:
        for k in range(len(out) // 2):
            a, b, e = int(data[3 * k]), int(data[3 * k + 1]), int(data[3 * k + 2])
            out[2 * k] = a | (b & 15) << 8
            out[2 * k + 1] = b >> 4 | e << 4
        return
    for k in range(len(out) // 4):
        word = 0
        for i in range(5):
            word |= int(data[5 * k + i]) << (8 * i)
        for i in range(4):
            out[4 * k + i] = word >> (10 * i) & 1023
