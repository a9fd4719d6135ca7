"""Conversion of a described camera's inputs to the layout of our own cameras.

Everything behind the bus expects one layout: spots in pixels, numbered by exposure, with counter,
time and checksum. Values that the camera sends are checked against the bus, missing ones derived
from the bus clock. So `judge` also refuses repeated, skipped or contradictory data of described
cameras. Such a camera has no buffer here: frames lost in a cycle are counted as lost.

Measurements use raw pixels and our own calibration. A camera that sends corrected millimetres has
computed x = g(xd) from the distorted point xd with its lens parameters. With the same parameters
the correction is inverted exactly, even if it was approximate.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import CameraModel, distort, distortion_jacobian, from_pixels, to_pixels
from ocmm_core.camera import ideal_from_pixels as _exactly
from ocmm_core.fieldbus.described._device_file import Clock, DeviceDescription, Role, Sends
from ocmm_core.fieldbus.described._process_image import ProcessImage
from ocmm_core.fieldbus.device import (
    COUNTER_MODULUS,
    DATA_CRC,
    DATA_CRC_AT,
    INPUT_DTYPE,
    N_SLOTS,
    NEWEST_LAYOUT,
    CameraStatus,
    Header,
    encode_frames,
)
from ocmm_core.geometry import Float

_STEPS = 3
"""Newton doubles the digits: from 2 % of distortion to 1e-12 of it in three steps."""


def corrected_from_pixels(camera: CameraModel, uv: Float, sends: Sends) -> Float:
    """Return corrected image points, mm, as sent for pixels (..., 2).

    The one-step form is that of the thesis, 2.4.1: the distortion of the *distorted* point is
    subtracted, ``x = xd - d(xd)``.
    """
    if sends is Sends.EXACT:
        return _exactly(camera, uv)
    distorted = from_pixels(camera, uv)
    return 2.0 * distorted - distort(camera, distorted)


def pixels_from_corrected(camera: CameraModel, corrected: Float, sends: Sends) -> Float:
    """Return the pixels (..., 2) of corrected image points (..., 2), mm.

    The one-step form ``2 xd - (xd + d(xd)) = x`` is solved by Newton's method; its derivative is
    ``2 I - J`` with `distortion_jacobian` J.
    """
    if sends is Sends.EXACT:
        return to_pixels(camera, distort(camera, corrected))
    distorted = np.array(corrected, dtype=np.float64)
    for _ in range(_STEPS):
        miss = corrected - (2.0 * distorted - distort(camera, distorted))
        slope = 2.0 * np.eye(2) - distortion_jacobian(camera, distorted)
        determinant = slope[..., 0, 0] * slope[..., 1, 1] - slope[..., 0, 1] * slope[..., 1, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            step_x = (slope[..., 1, 1] * miss[..., 0] - slope[..., 0, 1] * miss[..., 1]) / (
                determinant
            )
            step_y = (slope[..., 0, 0] * miss[..., 1] - slope[..., 1, 0] * miss[..., 0]) / (
                determinant
            )
        distorted = distorted + np.stack([step_x, step_y], axis=-1)
    return to_pixels(camera, distorted)


_SPOT_LIMIT_PX, _SPOT_LIMIT_MM = 8192.0, 100.0
"""Larger than any sensor."""
_REPEATS = 3
"""Without a counter, inputs are old after so many bit-identical cycles: noise changes them."""
_EDGE_NS = 5_000
"""Closer to the renewal of the inputs, the block read is ambiguous."""
_RUNNING = int(CameraStatus.OPERATIONAL | CameraStatus.SYNCHRONISED)
_OPERATIONAL = int(CameraStatus.OPERATIONAL)
_OVERRUN = int(CameraStatus.OVERRUN)
_WRONG = 1
"""Added to the exposure number if camera and clock disagree: `judge` refuses."""


class Timing(NamedTuple):
    """Exposure schedule."""

    start_ns: int
    period_ns: int
    config_crc: int


class InputTranslator:
    """Translator of one described camera, across bring-ups; `lens` if it sends corrected mm."""

    def __init__(
        self,
        device: DeviceDescription,
        image: ProcessImage,
        serial: int,
        lens: CameraModel | None,
        timing: Timing,
    ) -> None:
        self._device = device
        self._image = image
        self._lens = lens if device.is_corrected else None
        self._timing = timing
        self._serial = serial
        self._block: int | None = None
        self._told: int | None = None
        self._spots = b""
        self._repeats = 0
        self._cycle = 0

    @property
    def shares_clock(self) -> bool:
        """Return whether it exposes by the distributed clock."""
        return self._device.clock is Clock.DISTRIBUTED

    def translate(self, content: bytes, clock_ns: int, next_frame: int = 0) -> bytes:
        """Return inputs in our own layout; without spots if the camera shows none.

        ``next_frame``: the first frame still needed; those before this block are lost.
        """
        device, timing = self._device, self._timing
        cycle_ns = timing.period_ns * device.exposures
        since_ns = clock_ns - timing.start_ns - device.latency_ns
        block, into_ns = divmod(since_ns, cycle_ns)
        # Last complete block.
        block -= 1
        status, old, fits = _RUNNING, False, True
        if device.clock is Clock.DISTRIBUTED and not _EDGE_NS <= into_ns <= cycle_ns - _EDGE_NS:
            # Another read in this cycle may belong to the block before.
            status = _OPERATIONAL
        before = self._block
        first, count = max(0, block) * device.exposures, device.exposures
        if block < 0 or (before is not None and block <= before):
            count = 0
        elif first > next_frame:
            status |= _OVERRUN
        spots = self.spots(content)
        if count and status & _RUNNING == _RUNNING:
            old, fits = self._order(content, block, seen=bool(spots[0].any()))
            fits &= self._times_fit(content, first)
            self._block = block
        if not old:
            self._cycle = (self._cycle + 1) % NEWEST_LAYOUT.cycle_counters
        return self._packed(spots, first if fits else first + _WRONG, first, count, status)

    def _order(self, content: bytes, block: int, *, seen: bool) -> tuple[bool, bool]:
        """Return whether the inputs are repeated, and whether they fit the clock.

        Decided by the counter. Without one, bit-identical spots are old, whatever else may change.
        """
        image, exposures = self._image, self._device.exposures
        told = image.number(content, Role.COUNTER, 0)
        if told is None:
            before, self._spots = self._spots, image.spot_bytes(content)
            self._repeats = self._repeats + 1 if seen and before == self._spots else 0
            return self._repeats >= _REPEATS, True
        modulus, each = 1 << image.bits(Role.COUNTER), image.of_each_exposure(Role.COUNTER)
        last, self._told = self._told, told
        fits = not each or all(
            ((image.number(content, Role.COUNTER, k) or 0) - told - k) % modulus == 0
            for k in range(exposures)
        )
        if last is None or self._block is None:
            return False, fits
        passed = (block - self._block) * (exposures if each else 1)
        return told == last, fits and (told - last - passed) % modulus == 0

    def _times_fit(self, content: bytes, first: int) -> bool:
        timing, image = self._timing, self._image
        if not self._device.has(Role.TIME):
            return True
        modulus = 1 << image.bits(Role.TIME)
        for k in range(self._device.exposures if image.of_each_exposure(Role.TIME) else 1):
            told = image.number(content, Role.TIME, k) or 0
            apart = (told - timing.start_ns - (first + k) * timing.period_ns) % modulus
            if min(apart, modulus - apart) > max(1, self._device.doubt_ns):
                return False
        return True

    def _packed(
        self,
        spots: tuple[NDArray[np.uint16], NDArray[np.uint16], NDArray[np.float64]],
        counter: int,
        first: int,
        count: int,
        status: int,
    ) -> bytes:
        timing, image = self._timing, np.zeros((), INPUT_DTYPE)
        image["frames"][: self._device.exposures] = encode_frames(*spots)
        packed = bytearray(image.tobytes())
        head = NEWEST_LAYOUT.encode(
            Header(
                counter % COUNTER_MODULUS, timing.start_ns + first * timing.period_ns,
                timing.period_ns, count, self._cycle, status, timing.config_crc, 1,
            )
        )  # fmt: skip
        packed[: len(head)] = head
        DATA_CRC.pack_into(packed, DATA_CRC_AT, NEWEST_LAYOUT.crc(packed, self._serial))
        return bytes(packed)

    def spots(
        self, content: bytes
    ) -> tuple[NDArray[np.uint16], NDArray[np.uint16], NDArray[np.float64]]:
        """Return spot masks, flags and pixels of all exposures of an input.

        ``valid``, ``flags`` (n,): bit s: slot s; bit 0: button pressed; ``uv`` (n, 8, 2), px.
        """
        device = self._device
        count, slots = device.exposures, device.slots
        xy = np.stack([self._image.numbers(content, role) for role in (Role.X, Role.Y)], axis=-1)
        most = _SPOT_LIMIT_MM if device.is_corrected else _SPOT_LIMIT_PX
        seen: NDArray[np.bool_] = np.all(np.abs(xy) * device.step < most, axis=-1)
        if not device.has(Role.VALID) and not device.has(Role.INTENSITY):
            seen &= (xy != 0.0).any(axis=-1)
        if device.has(Role.INTENSITY):
            seen &= self._image.numbers(content, Role.INTENSITY) > 0.0
        flags = np.zeros(count, np.uint16)
        if each := self._image.is_of_slots(Role.VALID):
            seen &= self._image.numbers(content, Role.VALID) != 0.0
        for exposure in range(count):
            mask = self._image.number(content, Role.VALID, exposure)
            if mask is not None and not each:
                # numpy may be unable to shift a 64-bit number.
                mask &= (1 << slots) - 1
                seen[exposure] &= (mask >> np.arange(slots) & 1).astype(bool)
            flags[exposure] = bool(self._image.number(content, Role.BUTTON, exposure) or 0)
        values = np.where(seen[..., None], xy, 0.0) * device.step
        if self._lens is not None:
            values = pixels_from_corrected(self._lens, values, device.sends)
        # A wrong lens or nonsense leads far away.
        with np.errstate(invalid="ignore"):
            seen &= (np.abs(values) < _SPOT_LIMIT_PX).all(axis=-1)
        uv = np.full((count, N_SLOTS, 2), np.nan)
        uv[:, :slots][seen] = values[seen]
        valid = (seen << np.arange(slots)).sum(axis=1).astype(np.uint16)
        return valid, flags, uv
