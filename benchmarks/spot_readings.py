"""Reading of a single window of a camera image, for benchmarks and tests."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import NO_BLACK, SpotOptions, SpotStatus, centroid
from ocmm_core.geometry import Float


@dataclass(frozen=True, slots=True)
class SpotReading:
    """Reading of one window alone."""

    status: SpotStatus
    uv: Float
    """(2,), px of the sensor: also for refused spots, NaN in the dark."""
    variance: Float
    """(2,), px^2: due to read noise, photons, converter, and residual pixel differences."""
    flux: float
    peak: float
    background: float
    """`flux`, `peak`, `background`: weighted light, brightest pixel above background, counts."""
    pixels: int
    elongation: float
    """Ratio of the axes."""


def measure_window(
    pixels: NDArray[np.uint16],
    left: int,
    top: int,
    options: SpotOptions,
    black: NDArray[np.uint16] = NO_BLACK,
) -> SpotReading:
    """Return the reading of ``pixels`` (h, w) from (left, top), less ``black`` (whole sensor)."""
    reading = np.empty(centroid.N_READING)
    centroid.measure(
        np.ascontiguousarray(pixels, np.uint16),
        left,
        top,
        black,
        options.packed(),
        np.empty(pixels.shape),
        np.empty(pixels.shape, np.uint8),
        np.empty(pixels.size, np.int64),
        reading,
    )
    return SpotReading(
        status=SpotStatus(int(reading[centroid.STATUS])),
        uv=reading[[centroid.U, centroid.V]],
        variance=reading[[centroid.VAR_U, centroid.VAR_V]],
        flux=float(reading[centroid.FLUX]),
        peak=float(reading[centroid.PEAK]),
        background=float(reading[centroid.BACKGROUND]),
        pixels=int(reading[centroid.PIXELS]),
        elongation=float(reading[centroid.ELONGATION]),
    )
