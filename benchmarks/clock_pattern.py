"""Camera view that encodes the exposure time in the spots, to detect old and mixed frames."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocmm_core.fieldbus import device
from ocmm_sim.bus import Unit
from ocmm_sim.slave import Esc, FrameBuffer, Frames, SoftwareCamera

_DIGIT = 1 << 10
"""Values of one digit; a digit is a whole number of pixels from `_ZERO_PX`."""
_ZERO_PX = 100.0
CLOCK_MODULUS_US = _DIGIT**4


class ClockPattern:
    """Spots that encode their exposure time, to detect old and mixed frames.

    Slots 0 and 1 hold the exposure time on the bus clock as computed by the camera, slots 2 and 3
    the true host time, both in microseconds, slot 4 the camera number and boot counter; the rest,
    and the button, follow from the exposure time. See `read_clock`.
    """

    def __init__(self) -> None:
        self._watched: dict[int, tuple[Esc, FrameBuffer, int]] = {}

    def watch(self, camera: int, clock: Esc, schedule: FrameBuffer, boots: int) -> None:
        """Set the time sources of a camera."""
        self._watched[camera] = (clock, schedule, boots)

    def camera_frames(self, camera: int, first: int, count: int) -> Frames:
        """Return the pattern; see `CameraFrames`."""
        bus_ns = np.zeros(count, np.int64)
        ahead_ns = boots = 0
        if camera in self._watched:
            clock, schedule, boots = self._watched[camera]
            bus_ns = schedule.start_ns + (first + np.arange(count)) * schedule.period_ns
            ahead_ns = clock.system_time_ns - clock.now_ns
        bus_us = bus_ns // 1000 % CLOCK_MODULUS_US
        host_us = (bus_ns - ahead_ns) // 1000 % CLOCK_MODULUS_US
        uv = np.empty((count, device.N_SLOTS, 2))
        for slot, value in ((0, bus_us), (2, host_us)):
            for digit in range(4):
                uv[:, slot + digit // 2, digit % 2] = value // _DIGIT**digit % _DIGIT
        uv[:, 4] = camera, boots % _DIGIT
        uv[:, 5:] = _follow_up(bus_us)
        flags = (bus_us // 100_000 % 2).astype(np.uint16)
        return np.full(count, 0xFF, np.uint16), flags, _ZERO_PX + uv


@dataclass(frozen=True, slots=True)
class ClockReading:
    """Decoded frames of one camera that shows a `ClockPattern`."""

    bus_us: NDArray[np.int64]
    host_us: NDArray[np.int64]
    """`bus_us`, `host_us`: (n,): exposure times, modulo `CLOCK_MODULUS_US`."""
    camera: NDArray[np.int64]
    boots: NDArray[np.int64]
    intact: NDArray[np.bool_]
    """(n,): the frame is consistent."""


def read_clock(
    valid: NDArray[np.uint16] | NDArray[np.uint64], uv: NDArray[np.float64]
) -> ClockReading:
    """Decode a `ClockPattern` from `valid` (n,) and `uv` (n, 8, 2) of one camera."""
    digits = np.nan_to_num(uv - _ZERO_PX, nan=-1.0)
    whole = digits.astype(np.int64)
    weights = _DIGIT ** np.arange(4)
    bus_us = whole[:, 0:2].reshape(-1, 4) @ weights
    intact = np.all(whole[:, 5:] == _follow_up(bus_us), axis=(1, 2)) & np.all(
        (digits == whole) & (whole >= 0) & (whole < _DIGIT), axis=(1, 2)
    )
    return ClockReading(
        bus_us=bus_us,
        host_us=whole[:, 2:4].reshape(-1, 4) @ weights,
        camera=whole[:, 4, 0],
        boots=whole[:, 4, 1],
        intact=intact & (valid == 0xFF),
    )


def _follow_up(bus_us: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return whole numbers (n, 3, 2) below `_DIGIT` derived from the time."""
    factors = np.array([[7, 11], [13, 17], [19, 23]])
    # A prime keeps the six numbers distinct; any wrong bit of the time changes most of them.
    follow_up: NDArray[np.int64] = bus_us[:, None, None] * factors % 1021
    return follow_up


class ClockUnit(Unit):
    """A camera position whose camera sets the time sources of a `ClockPattern`."""

    def switch_on(self, clock_ns: int) -> SoftwareCamera:
        """Restart the camera, with its clock advanced by `clock_ns`."""
        camera = super().switch_on(clock_ns)
        if isinstance(self.provider, ClockPattern):
            self.provider.watch(self.sees, camera.esc, camera.buffer, self.boots)
        return camera
