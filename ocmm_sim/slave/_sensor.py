"""Sensor of a software camera whose provider has no pixels."""

from __future__ import annotations

from typing import TypeGuard

import numpy as np
from numpy.typing import NDArray

from ocmm_sim.slave._pattern import CameraFrames, SensorControl

SENSOR_PX = 2048
_METHODS = ("configure", "image", "black_image", "set_black_image", "temperature_c")
_DARK_LEVEL, _DARK_STEP = 120, 7
_PEAK, _SIGMA_PX = 9000.0, 1.2
_TEMPERATURE_C = 36.5


def sensor_of(provider: CameraFrames) -> SensorControl:
    """Return the provider's sensor, or a simple one that shows its first frame."""
    return provider if _is_sensor(provider) else SimpleSensor(provider)


def _is_sensor(provider: object) -> TypeGuard[SensorControl]:
    return all(callable(getattr(provider, name, None)) for name in _METHODS)


class SimpleSensor:
    """A fixed dark pattern; images add round spots at the provider's first positions."""

    def __init__(self, provider: CameraFrames) -> None:
        self._provider = provider

    def configure(
        self,
        camera: int,
        *,
        exposure_ns: int,
        threshold: int,
        strobe: int,
        windows: tuple[tuple[int, int, int, int], ...],
    ) -> None:
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
            down = np.exp(-0.5 * ((rows - v) / _SIGMA_PX) ** 2)
            grey += _PEAK * down[:, None] * across[None, :]
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
