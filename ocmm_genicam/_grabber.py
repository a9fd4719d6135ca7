"""One camera: set up, then a thread that takes its buffers, checks them, and finds the spots.

Layouts of the Pixel Format Naming Convention and of GigE Vision: ``p`` is a little-endian stream of
bits; ``Packed`` holds the high bits of two pixels in bytes 0 and 2, the low bits of both in byte 1.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocmm_core.acquisition.frames import FrameFlag
from ocmm_core.camera import USUAL_SLOTS, SpotFinder, SpotOptions, compiled
from ocmm_core.errors import AcquisitionError
from ocmm_core.failure import REOPEN, contained
from ocmm_core.geometry import Float
from ocmm_genicam._client import COMPLETE, Camera, Image
from ocmm_genicam._timing import CameraClock, ClockState

_TAKE_S = 0.05
_CLOCK_S = 1.0
_STOP_S = 0.9
_QUEUE = 256
_WRAP = 0xFFFF
_STEP_SHARE = 4
"""An exposure off the number of periods by a period over this one is a step of the clock."""
_LINES = "LineStatusAll"
_EXPOSURES = ("ExposureTime", "ExposureTimeAbs")


@dataclass(frozen=True, slots=True)
class Expected:
    """A camera as the rig knows it."""

    name: str
    width: int
    height: int
    period_ns: int
    button_line: int = -1
    """Input line that the button of the probe is wired to; negative: none."""
    n_slots: int = USUAL_SLOTS


@dataclass(slots=True)
class BufferAccount:
    """Every exposure of a camera: ``exposures == delivered + lost``."""

    exposures: int = 0
    delivered: int = 0
    lost: int = 0
    """Never arrived, incomplete, refused, or overwritten before they were joined."""
    incomplete: int = 0
    refused: int = 0
    overrun: int = 0
    """`incomplete`, `refused`, `overrun`: buffers, as parts of `lost`; refused ones were old."""


@dataclass(frozen=True, slots=True)
class Spots:
    """Spots of one exposure."""

    time_ns: int
    flags: int
    valid: int
    uv: Float
    """(S, 2), px."""
    exposure: int
    """Number of the exposure of its camera: 1, 2, 3 ..."""
    heard_s: float
    """Time of its arrival, on the monotonic clock of this computer."""


def set_up(camera: Camera, expected: Expected) -> PixelFormat:
    """Set format, region and rate by SFNC names, and read them back; AcquisitionError."""
    serial = camera.serial
    offered = camera.entries("PixelFormat")
    pixels = next((one for one in FORMATS if one.name in offered), None)
    if pixels is None:
        raise AcquisitionError(
            "genicam.format",
            f"Camera {serial} has no pixel format that OCMM reads; it has {', '.join(offered)}.",
            f"Use a monochrome camera with one of {', '.join(one.name for one in FORMATS)}.",
        )
    camera.set_text("PixelFormat", pixels.name)
    for offset in ("OffsetX", "OffsetY"):
        if camera.has(offset):
            camera.set_integer(offset, 0)
    size = (camera.integer("WidthMax"), camera.integer("HeightMax"))
    if size != (expected.width, expected.height):
        raise AcquisitionError(
            "genicam.size",
            f"Camera {serial} has {size[0]} x {size[1]} px, but camera '{expected.name}' of the "
            f"rig has {expected.width} x {expected.height} px.",
            "Use the camera that the rig was made for, without binning, or correct the rig.",
        )
    camera.set_integer("Width", expected.width)
    camera.set_integer("Height", expected.height)
    triggered = camera.has("TriggerMode") and camera.text("TriggerMode") == "On"
    if not triggered:
        if camera.has("AcquisitionFrameRateEnable"):
            camera.switch("AcquisitionFrameRateEnable", on=True)
        rate = 1e9 / expected.period_ns
        camera.set_number("AcquisitionFrameRate", rate)
        real = camera.number("AcquisitionFrameRate")
        if abs(real - rate) > 0.01 * rate:
            raise AcquisitionError(
                "genicam.rate",
                f"Camera {serial} takes {real:.4g} frames a second, but the rig states {rate:.4g}.",
                f"Set a shorter exposure, or {real:.4g} as 'frame_rate_hz' of the rig.",
            )
    return pixels


def exposure_us(camera: Camera) -> float:
    """Return the exposure time that is set in a camera, microseconds; NaN without one."""
    name = next((one for one in _EXPOSURES if camera.has(one)), None)
    return camera.number(name) if name is not None else float("nan")


class Grabber:
    """Takes the buffers of one camera in a thread of its own.

    `clock` is read once a second in the same thread: a camera has one owner; None: exposure times
    are not proven. `wake` is called after each new frame and at the end.
    """

    def __init__(
        self,
        camera: Camera,
        clock: CameraClock | None,
        pixels: PixelFormat,
        expected: Expected,
        wake: Callable[[], None],
    ) -> None:
        self.camera, self.account = camera, BufferAccount()
        self.frames: deque[Spots] = deque()
        """For the reader, who removes them from the left."""
        self.kept: deque[tuple[int, NDArray[np.uint16]]] = deque()
        """Time and counts (height, width) of images kept by `keep`."""
        self._keeps = 0
        self.clock_state: ClockState | None = None
        self.failure: Exception | None = None
        self.heard_s = time.monotonic()
        """Time of the last complete image, on the monotonic clock."""
        self._clock, self._pixels, self._expected, self._wake = clock, pixels, expected, wake
        options = pixels.spot_options().at_period(expected.period_ns, expected.width)
        self._finder = SpotFinder(
            expected.width, expected.height, options, n_slots=expected.n_slots
        )
        # The first call may compile, which takes longer than a camera may be silent.
        dark = np.zeros(pixels.bytes_of(expected.width, expected.height), np.uint8)
        self._finder.find(unpack(pixels, dark, expected.width, expected.height))
        self._last: tuple[int, int] | None = None
        self._stop = threading.Event()
        # A daemon: the library may wait for a camera that is gone.
        self._thread = threading.Thread(
            target=self._run, name=f"ocmm-genicam-{camera.serial}", daemon=True
        )

    def start(self) -> None:
        self.heard_s = time.monotonic()
        self._thread.start()

    def keep(self, count: int) -> None:
        """Keep the next ``count`` images, and forget those before."""
        self._keeps = 0
        self.kept.clear()
        self._keeps = count

    @property
    def full_scale(self) -> int:
        """Return the counts from which pixels are overexposed."""
        return self._pixels.full_scale

    def close(self) -> None:
        """Stop the thread and release the camera, unless it no longer answers.

        Releasing would wait 15 s for its answers; it releases itself when its heartbeat ends.
        """
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join(_STOP_S)
        if not self._thread.is_alive() and time.monotonic() - self.heard_s < _STOP_S:
            self.camera.close()

    def _run(self) -> None:
        try:
            self.camera.start()
            due = time.monotonic() + _CLOCK_S
            while not self._stop.is_set():
                image = self.camera.next_image(_TAKE_S)
                if image is not None:
                    self.process(image)
                if self._clock is not None and time.monotonic() > due:
                    self.clock_state = self._clock.state()
                    due = time.monotonic() + _CLOCK_S
        except Exception as error:
            self.failure = contained(error, f"Camera {self.camera.serial}", remedy=REOPEN)
        self._wake()

    def process(self, image: Image) -> None:
        """Check a buffer, and find its spots; AcquisitionError for a camera that has changed."""
        account, expected = self.account, self._expected
        size = self._pixels.bytes_of(expected.width, expected.height)
        told = (image.pixel_format, image.width, image.height)
        set_ = (self._pixels.code, expected.width, expected.height)
        if image.status != COMPLETE or (told == set_ and len(image.data) < size):
            # Its number and time are of another frame: the next complete one tells how many.
            account.incomplete += 1
            return
        if told != set_:
            raise AcquisitionError(
                "genicam.image",
                f"Camera {self.camera.serial} sends {image.width} x {image.height} px in format "
                f"{image.pixel_format:#010x}, but was set to {expected.width} x {expected.height} "
                f"px in {self._pixels.name}.",
                "Close other programs that change the camera, then open the job again.",
            )
        gap = self._exposures_since(image)
        if gap is None:
            account.refused += 1
            return
        self._last = (image.number, image.time_ns)
        self.heard_s = time.monotonic()
        account.exposures += gap
        account.delivered += 1
        account.lost += gap - 1
        counts = unpack(self._pixels, image.data, image.width, image.height)
        if self._keeps > 0:
            self._keeps -= 1
            self.kept.append((image.time_ns, counts.copy()))
        block = self._finder.find(counts)
        flags = int(FrameFlag.SATURATED) if block.saturated[0] else 0
        # Read with each image: some frames late at most, and the ball rests for many.
        if expected.button_line >= 0 and (self.camera.integer(_LINES) >> expected.button_line & 1):
            flags |= FrameFlag.BUTTON
        if len(self.frames) >= _QUEUE:
            account.overrun += 1
            account.delivered -= 1
            account.lost += 1
        else:
            valid = int(np.uint64(block.valid[0]))
            self.frames.append(
                Spots(image.time_ns, flags, valid, block.uv[0], account.exposures, self.heard_s)
            )
        self._wake()

    def _exposures_since(self, image: Image) -> int | None:
        """Return the exposures since the last complete image, this one included; None if old.

        AcquisitionError: number and time of the image contradict each other.
        """
        if self._last is None:
            return 1
        number, time_ns = self._last
        passed_ns = image.time_ns - time_ns
        gap = image.number - number
        if gap == 0:
            return None
        if gap < 0:
            gap += _WRAP
        period_ns = self._expected.period_ns
        if passed_ns > 0 and abs(passed_ns - gap * period_ns) <= period_ns // _STEP_SHARE:
            return gap
        if -_QUEUE < image.number - number < 0 and passed_ns <= 0:
            return None
        raise AcquisitionError(
            "genicam.clock_step",
            f"Camera {self.camera.serial}: {gap} exposures after the last one its clock has "
            f"advanced by {passed_ns * 1e-6:.3f} ms instead of {gap * period_ns * 1e-6:.3f} ms.",
            "The clock was set, the camera restarted, or its trigger is not the rate of the rig: "
            "check PTP, trigger and 'frame_rate_hz', then open the job again.",
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
    return data.view("<u2").reshape(height, width)


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
