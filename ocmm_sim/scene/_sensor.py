"""Virtual image sensor: pixel counts under LED light.

With the defaults a spot scatters by 0.030 px as in the rig documents for one exposure: at the
camera's default exposure of 20 us an LED gives 8400 electrons in a spot of 1 px (sigma), on 40
electrons of read noise. This is the sensor of the thesis (2.1: 66 dB, so 40 of 80,000 electrons),
with an amplifier that lets the 14 bits count single electrons, so that the default threshold of 200
counts is five times the read noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_sim.scene import _exposure as exposure

_PATTERN, _FRAME, _BLACK = range(3)
_COMA_PART = 0.2


@dataclass(frozen=True, slots=True)
class SensorOptions:
    """Properties of sensor and light."""

    spot_sigma_px: float = 1.0
    """Sigma of the round Gaussian spot of lens and LED."""
    coma_px: float = 0.0
    """Outward shift of a fifth of the light at the sensor's corner, in proportion elsewhere."""
    led_electrons_per_us: float = 420.0
    background_electrons_per_us: float = 1.0
    """Ambient light per pixel."""
    read_noise_electrons: float = 40.0
    """Standard deviation of a dark pixel."""
    dark_level_counts: float = 500.0
    dark_spread_electrons: float = 60.0
    """Standard deviation of the dark signal between pixels."""
    hot_part: float = 1e-4
    hot_electrons: float = 2000.0
    """`hot_part`, `hot_electrons`: fraction and mean excess signal (exponential) of hot pixels."""
    response_spread: float = 0.01
    """Relative standard deviation of the response to light between pixels."""
    electrons_per_count: float = 1.0
    bits: int = 14
    temperature_c: float = 35.0
    factory_black: bool = True
    """The camera starts with a factory black image, as the thesis' in flash memory."""

    def __post_init__(self) -> None:
        """Raise InputError for values out of range."""
        for name, low, high in (
            ("spot_sigma_px", 0.3, 5.0),
            ("coma_px", -5.0, 5.0),
            ("led_electrons_per_us", 0.0, 1e9),
            ("background_electrons_per_us", 0.0, 1e9),
            ("read_noise_electrons", 0.0, 1e6),
            ("dark_level_counts", 0.0, 65535.0),
            ("dark_spread_electrons", 0.0, 1e6),
            ("hot_part", 0.0, 1.0),
            ("hot_electrons", 0.0, 1e6),
            ("response_spread", 0.0, 0.2),
            ("electrons_per_count", 1e-3, 1e6),
            ("bits", 8, 16),
        ):
            value = getattr(self, name)
            if not low <= value <= high:
                raise InputError(
                    "simulation.sensor",
                    f"Field '{name}' of the virtual sensor is {value}, "
                    f"but must be {low:g} to {high:g}.",
                    "Correct that field.",
                )

    @property
    def full_scale(self) -> int:
        """Return the highest count of the converter."""
        return (1 << self.bits) - 1


def normal_table() -> Float:
    """Return normal numbers (2^14,) at evenly spaced probabilities, of variance one."""
    count = 1 << exposure.NORMAL_BITS
    quantile = NormalDist().inv_cdf
    table = np.array([quantile((k + 0.5) / count) for k in range(count)])
    return table / float(table.std())


class Sensor:
    """Sensor of one camera; all results are functions of their arguments.

    ``pattern_key``, ``frame_stream``: keys of the fixed pattern and of frame noise, see `exposure`.
    """

    def __init__(
        self, seed: int, camera: int, width: int, height: int, options: SensorOptions, normal: Float
    ) -> None:
        self.width, self.height = width, height
        self.options = options
        self.normal = normal
        self.pattern_key, self.frame_stream, self._black_stream = (
            np.random.SeedSequence([seed, camera, stream]).generate_state(1, np.uint64)[0]
            for stream in (_PATTERN, _FRAME, _BLACK)
        )

    def packed(self, exposure_ns: int) -> Float:
        """Return sensor and exposure for the compiled loop, (N_PACKED,)."""
        o = self.options
        background = o.background_electrons_per_us * 1e-3 * exposure_ns
        return np.array(
            [
                o.spot_sigma_px, o.read_noise_electrons, o.dark_level_counts,
                o.dark_spread_electrons, o.hot_part, o.hot_electrons, o.response_spread,
                o.electrons_per_count, o.full_scale, background, self.width,
            ],
            dtype=np.float64,
        )  # fmt: skip

    def lights(self, uv: Float, lit: NDArray[np.bool_], exposure_ns: int) -> Float:
        """Return LED light at `uv` (..., L, 2), px, as (..., m, 3): centre, electrons.

        ``lit`` (L,): LEDs lit by the strobe; the others, and those at NaN, give no light.
        """
        o = self.options
        light = np.full((*uv.shape[:-1], 3), o.led_electrons_per_us * 1e-3 * exposure_ns)
        light[..., :2] = np.where(lit[:, None], uv, np.nan)
        if o.coma_px == 0.0:
            return light
        outer = light.copy()
        light[..., 2] *= 1.0 - _COMA_PART
        outer[..., 2] *= _COMA_PART
        middle = 0.5 * np.array([self.width - 1, self.height - 1])
        outer[..., :2] += o.coma_px * (outer[..., :2] - middle) / np.hypot(*middle)
        return np.concatenate([light, outer], axis=-2)

    def picture(
        self,
        frame: int,
        lights: Float,
        exposure_ns: int,
        left: int,
        top: int,
        width: int,
        height: int,
    ) -> NDArray[np.uint16]:
        """Return a region of a frame (height, width), counts; ``lights`` (m, 3)."""
        key = exposure.mix(self.frame_stream, np.uint64(frame))
        return self._expose(key, lights, exposure_ns, 1.0, left, top, width, height)

    def black_image(self, frames: int, exposure_ns: int) -> NDArray[np.uint16]:
        """Return the mean (height, width), counts, of `frames` frames without LEDs.

        Noise is independent between frames, so its mean is drawn at once.
        """
        if frames < 1:
            raise InputError(
                "simulation.black_image",
                f"The black image is set to the mean of {frames} frames.",
                "Give one frame at least.",
            )
        key = exposure.mix(self._black_stream, np.uint64(frames))
        return self._expose(
            key, np.zeros((0, 3)), exposure_ns, frames**-0.5, 0, 0, self.width, self.height
        )

    def _expose(
        self,
        key: np.uint64,
        lights: Float,
        exposure_ns: int,
        quieter: float,
        left: int,
        top: int,
        width: int,
        height: int,
    ) -> NDArray[np.uint16]:
        out = np.empty((height, width), np.uint16)
        exposure.expose(
            left, top, 1, width, lights, self.packed(exposure_ns), self.pattern_key,
            np.uint64(key), quieter, self.normal, np.empty((height, width)), out,
        )  # fmt: skip
        return out
