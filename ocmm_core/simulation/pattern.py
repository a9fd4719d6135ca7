"""Where the frames of a software camera come from, and a test pattern that needs no physics."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ocmm_core.fieldbus.camera_slave import N_SLOTS

Frames = tuple[NDArray[np.uint16], NDArray[np.uint16], NDArray[np.float64]]


class CameraFrames(Protocol):
    """What the sensors see: a pure function of camera and exposure number."""

    def camera_frames(self, camera: int, first: int, count: int) -> Frames:
        """Return the frames ``first .. first + count - 1`` of one camera.

        Returns
        -------
        valid
            (count,) uint16: bit s says that slot s holds a spot.
        flags
            (count,) uint16: bits of `FrameFlag`.
        uv
            (count, 8, 2) float64, px: spots, NaN where not valid.
        """
        ...


class SensorControl(Protocol):
    """What the electronics of a camera can set and ask at its sensor."""

    def configure(
        self,
        camera: int,
        *,
        exposure_ns: int,
        threshold: int,
        strobe: int,
        windows: tuple[tuple[int, int, int, int], ...],
    ) -> None:
        """Set exposure time, threshold in grey levels, lit LEDs (bit mask, 0: all) and windows.

        A window is left, top, width and height, px; without any the camera chooses by itself.
        """
        ...

    def image(
        self, camera: int, left: int, top: int, width: int, height: int
    ) -> NDArray[np.uint16]:
        """Return a raw picture of a region (height, width)."""
        ...

    def black_image(self, camera: int, frames: int) -> NDArray[np.uint16]:
        """Return the mean of so many exposures of the whole sensor with the LEDs off."""
        ...

    def set_black_image(self, camera: int, image: NDArray[np.uint16] | None) -> None:
        """Subtract this picture from now on, or nothing."""
        ...

    def temperature_c(self, camera: int) -> float:
        """Return the temperature of the sensor."""
        ...


class TestPattern:
    """Spots on circles; a slot, the button and the positions all tell the exposure number.

    Every tenth of a second the button changes, and every 37th frame one slot is missing.
    """

    __test__ = False

    def camera_frames(self, camera: int, first: int, count: int) -> Frames:
        """Return the pattern; see `CameraFrames`."""
        counter = first + np.arange(count)
        valid = np.full(count, 0xFF, np.uint16)
        missing = counter % 37 == 0
        valid[missing] = 0xFF & ~(1 << counter[missing] // 37 % N_SLOTS)
        flags = (counter // 800 % 2).astype(np.uint16)
        phase = 1e-3 * counter[:, None] + np.arange(N_SLOTS) + camera
        uv = np.stack([1000.0 + 500.0 * np.cos(phase), 900.0 + 400.0 * np.sin(phase)], axis=2)
        uv[(valid[:, None] >> np.arange(N_SLOTS)) & 1 == 0] = np.nan
        return valid, flags, uv
