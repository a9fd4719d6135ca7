"""Frames of a software camera: providers, test patterns without physics, sensor, and buffer.

The sensor serves providers without pixels.
"""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import CameraModel, ideal_from_pixels
from ocmm_core.fieldbus import device

Frames = tuple[NDArray[np.uint16], NDArray[np.uint16], NDArray[np.float64]]


class CameraFrames(Protocol):
    """Sensor view: a pure function of camera and exposure number."""

    def camera_frames(self, camera: int, first: int, count: int) -> Frames:
        """Return the frames ``first .. first + count - 1`` of one camera.

        ``valid`` (count,) uint16: bit s: slot s holds a spot; ``flags`` (count,) uint16: bits of
        `FrameFlag`; ``uv`` (count, 8, 2), px: spots, NaN if invalid.
        """
        ...


@runtime_checkable
class SensorControl(Protocol):
    """Sensor functions available to a camera's electronics."""

    def configure(self, camera: int, config: device.CameraConfig) -> None:
        """Set exposure time, threshold (grey levels), LED mask and windows."""
        ...

    def image(
        self, camera: int, left: int, top: int, width: int, height: int
    ) -> NDArray[np.uint16]:
        """Return a raw image of a region (height, width)."""
        ...

    def black_image(self, camera: int, frames: int) -> NDArray[np.uint16]:
        """Return the mean of `frames` exposures of the whole sensor with the LEDs off."""
        ...

    def set_black_image(self, camera: int, image: NDArray[np.uint16] | None) -> None:
        """Subtract this image, or none, from now on."""
        ...

    def temperature_c(self, camera: int) -> float: ...


class TestPattern:
    """Spots on circles; slots, button and positions encode the exposure number.

    The button changes every tenth of a second, and every 37th frame lacks one slot.
    """

    __test__ = False

    def camera_frames(self, camera: int, first: int, count: int) -> Frames:
        """Return the pattern; see `CameraFrames`."""
        counter = first + np.arange(count)
        valid = np.full(count, 0xFF, np.uint16)
        missing = counter % 37 == 0
        valid[missing] = 0xFF & ~(1 << counter[missing] // 37 % device.N_SLOTS)
        flags = (counter // 800 % 2).astype(np.uint16)
        phase = 1e-3 * counter[:, None] + np.arange(device.N_SLOTS) + camera
        uv = np.stack([1000.0 + 500.0 * np.cos(phase), 900.0 + 400.0 * np.sin(phase)], axis=2)
        uv[(valid[:, None] >> np.arange(device.N_SLOTS)) & 1 == 0] = np.nan
        return valid, flags, uv


SENSOR_PX = 2048
_DARK_LEVEL, _DARK_STEP = 120, 7
_PEAK, _SIGMA_PX = 9000.0, 1.2
_TEMPERATURE_C = 36.5


def sensor_of(provider: CameraFrames) -> SensorControl:
    """Return the provider's sensor, or a simple one that shows its first frame."""
    return provider if isinstance(provider, SensorControl) else SimpleSensor(provider)


class SimpleSensor:
    """A fixed dark pattern; images add round spots at the provider's first positions."""

    def __init__(self, provider: CameraFrames) -> None:
        self._provider = provider

    def configure(self, camera: int, config: device.CameraConfig) -> None:
        """Do nothing: positions come from the provider, not from pixels."""

    def image(
        self, camera: int, left: int, top: int, width: int, height: int
    ) -> NDArray[np.uint16]:
        """Return a raw image of a region (height, width), grey levels."""
        rows, columns = np.arange(top, top + height), np.arange(left, left + width)
        grey = _dark(rows, columns).astype(np.float64)
        _valid, _flags, uv = self._provider.camera_frames(camera, 0, 1)
        for u, v in uv[0][np.isfinite(uv[0]).all(axis=1)]:
            across = np.exp(-0.5 * ((columns - u) / _SIGMA_PX) ** 2)
            grey += _PEAK * np.exp(-0.5 * ((rows - v) / _SIGMA_PX) ** 2)[:, None] * across[None, :]
        return np.round(grey).astype(np.uint16)

    def black_image(self, camera: int, frames: int) -> NDArray[np.uint16]:
        """Return the dark pattern of the whole sensor; averaging does not change it."""
        return _dark(np.arange(SENSOR_PX), np.arange(SENSOR_PX))

    def set_black_image(self, camera: int, image: NDArray[np.uint16] | None) -> None:
        """Do nothing: positions come from the provider, not from pixels."""

    def temperature_c(self, camera: int) -> float:
        """Return a camera-specific temperature."""
        return _TEMPERATURE_C + camera


def _dark(rows: NDArray[np.int_], columns: NDArray[np.int_]) -> NDArray[np.uint16]:
    pattern: NDArray[np.uint16] = (
        _DARK_LEVEL + (3 * rows[:, None] + 5 * columns[None, :]) % _DARK_STEP
    ).astype(np.uint16)
    return pattern


FIFO_FRAMES = 1024
"""128 ms at 8 kHz: a master that stalls for less than the watchdog's 100 ms loses nothing."""
CHUNK_FRAMES = 80

_AHEAD_FRAMES = 4 * CHUNK_FRAMES
_RING_FRAMES = 2048
OVERRUN_FLAG = 2
_FLAGS_AT = device.FRAME_DTYPE.fields["flags"][1] if device.FRAME_DTYPE.fields is not None else 0
_VALID_AT = device.FRAME_DTYPE.fields["valid"][1] if device.FRAME_DTYPE.fields is not None else 0
_NO_SPOT = b"\x00\x00"


class FrameBuffer:
    """Frame buffer of one camera.

    ``overruns`` counts events of frames ``lost`` in a full buffer, ``late`` frames not in time.
    """

    def __init__(self, provider: CameraFrames, camera: int) -> None:
        self._provider = provider
        self._camera = camera
        self._ring: NDArray[np.void] = np.zeros(_RING_FRAMES, device.FRAME_DTYPE)
        self._bytes = self._ring.view(np.uint8).data
        self.start_ns = 0
        self.period_ns = 0
        self.lost = self.overruns = self.late = 0
        self.lens: CameraModel | None = None
        """Corrects the spots, sent in mm; None sends them raw."""
        self.blind = False
        self._generated = self._tail = 0
        self._overrun_at = -1
        self._dark = range(0)

    @property
    def running(self) -> bool:
        return self.period_ns > 0

    def start(self, start_ns: int, period_ns: int) -> None:
        """Set exposure 0 to `start_ns` of the camera's clock."""
        self.start_ns, self.period_ns = start_ns, period_ns
        self.lost = 0
        self._generated = self._tail = 0
        self._overrun_at = -1
        self._dark = range(0)

    def resume(self, start_ns: int, period_ns: int, now_ns: int) -> None:
        """Follow another schedule from now on; its past exposures are lost."""
        self.start(start_ns, period_ns)
        first = max(0, self._newest(now_ns) + 1)
        self._generated = self._tail = self._overrun_at = first
        self.lost = first

    def look_again(self, now_ns: int) -> None:
        """Regenerate frames made ahead of their exposure, after a clock jump; for tests."""
        if self.running:
            self._generated = min(self._generated, max(self._tail, self._newest(now_ns) + 1))

    def darken(self, now_ns: int, count: int) -> int:
        """Make the next exposures without light; return their duration, ns."""
        if not self.running:
            return 0
        first = max(0, self._newest(now_ns) + 1)
        self._dark = range(first, first + count)
        return count * self.period_ns

    def is_dark(self, first: int, count: int) -> bool:
        """Return whether any of these frames is dark."""
        return self.blind or (first < self._dark.stop and self._dark.start < first + count)

    def stop(self) -> None:
        self.period_ns = 0

    def is_behind(self, now_ns: int) -> bool:
        """Return whether exposed frames are not generated yet."""
        return self.running and self._generated <= self._newest(now_ns)

    def generate(self, now_ns: int) -> bool:
        """Generate the next chunk of frames if due; return whether one was."""
        if not self.running or self._generated > self._newest(now_ns) + _AHEAD_FRAMES:
            return False
        first = self._generated
        valid, flags, uv = self._provider.camera_frames(self._camera, first, CHUNK_FRAMES)
        if self.lens is None:
            frames = device.encode_frames(valid, flags, uv)
        else:
            ideal = ideal_from_pixels(self.lens, uv)
            frames = device.encode_frames(valid, flags, ideal, device.CameraMode.CORRECTED)
        start = first % _RING_FRAMES
        whole = min(CHUNK_FRAMES, _RING_FRAMES - start)
        self._ring[start : start + whole] = frames[:whole]
        self._ring[: CHUNK_FRAMES - whole] = frames[whole:]
        self._generated += CHUNK_FRAMES
        return True

    def acknowledge(self, counter: int) -> None:
        """Release all frames up to this counter (32 bits, as on the wire)."""
        # The nearest frame with these 32 bits; a value far from the buffer is no acknowledgement.
        ahead = (counter + 1 - self._tail) % device.COUNTER_MODULUS
        if 0 < ahead <= device.FRAMES_PER_CYCLE:
            self._tail += ahead

    def pop(self, now_ns: int) -> tuple[int, int]:
        """Return the first frame to send and their number; drop frames without room."""
        exposed = self._newest(now_ns) + 1
        end = min(exposed, self._generated)
        if end < exposed:
            self.late += 1
        if end - self._tail > FIFO_FRAMES:
            self.overruns += 1
            self.lost += end - FIFO_FRAMES - self._tail
            self._tail = self._overrun_at = end - FIFO_FRAMES
        return self._tail, max(0, min(device.FRAMES_PER_CYCLE, end - self._tail))

    def follows_loss(self, frame: int) -> bool:
        """Return whether frames were dropped just before this one."""
        return frame == self._overrun_at

    def copy(self, first: int, count: int, target: bytearray, at: int) -> None:
        """Copy frames in wire format into `target`."""
        size = device.FRAME_DTYPE.itemsize
        start = first % _RING_FRAMES
        whole = min(count, _RING_FRAMES - start)
        target[at : at + whole * size] = self._bytes[start * size : (start + whole) * size]
        rest = count - whole
        target[at + whole * size : at + count * size] = self._bytes[: rest * size]
        if self.is_dark(first, count):
            for frame in range(first, first + count):
                if self.blind or frame in self._dark:
                    place = at + (frame - first) * size + _VALID_AT
                    target[place : place + len(_NO_SPOT)] = _NO_SPOT
        if count and self.follows_loss(first):
            target[at + _FLAGS_AT] |= OVERRUN_FLAG

    def _newest(self, now_ns: int) -> int:
        return (now_ns - self.start_ns) // self.period_ns - 1
