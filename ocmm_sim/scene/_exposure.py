"""Compiled loops of a virtual sensor: light, pattern and noise to spots.

Every random number is a function of a key and its pixel number, so a pixel of a frame has the same
value in any window, line or image.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import centroid, compiled, search, windows
from ocmm_core.geometry import Float, Int

(
    SPOT_SIGMA, READ_NOISE, DARK_LEVEL, DARK_SPREAD, HOT_PART, HOT_ELECTRONS,
    RESPONSE_SPREAD, ELECTRONS_PER_COUNT, FULL_SCALE, BACKGROUND, SENSOR_WIDTH,
) = range(11)  # fmt: skip
N_PACKED = 11
"""Length of the packed sensor, see `sensor.Sensor.packed`; light in electrons."""

NORMAL_BITS = 14
"""The table of normal numbers has 2 to this power entries."""

_REACH = 6.0
"""Spot radius in sigmas; the light beyond is 2e-9 and ignored."""
_MASK = np.uint64((1 << NORMAL_BITS) - 1)
_STEP = np.uint64(0x9E3779B97F4A7C15)
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_S27, _S30, _S31, _S16, _S32, _S40 = (np.uint64(shift) for shift in (27, 30, 31, 16, 32, 40))
# Scales 24 bits to 0 to 1.
_UNIT24 = 1.0 / (1 << 24)


@compiled()
def mix(key: np.uint64, number: np.uint64) -> np.uint64:
    """Return 64 random bits for a number under a key (SplitMix64, Steele et al. 2014)."""
    z = key + number * _STEP
    z = (z ^ (z >> _S30)) * _FIRST
    z = (z ^ (z >> _S27)) * _SECOND
    return z ^ (z >> _S31)


@compiled()
def expose(
    left: int,
    top: int,
    step: int,
    columns: int,
    lights: Float,
    packed: Float,
    pattern_key: np.uint64,
    frame_key: np.uint64,
    quieter: float,
    normal: Float,
    signal: Float,
    out: NDArray[np.uint16],
) -> None:
    """Compute the counts of a window, or of some pixels of lines.

    ``out`` (rows, >= columns): its pixel (i, j) is the sensor's at row ``top + i`` and column
    ``left + step j``. ``lights`` (m, 3): centre (px) and electrons of each spot, NaN if absent.
    ``quieter`` scales the noise: one over the root of the number of averaged frames. ``normal``:
    table of normal numbers. ``signal`` (rows, >= columns): scratch space.
    """
    rows = out.shape[0]
    for i in range(rows):
        for j in range(columns):
            signal[i, j] = 0.0
    for k in range(len(lights)):
        # False for NaN: no light.
        if lights[k, 0] == lights[k, 0]:
            _add_light(left, top, step, columns, lights[k], packed[SPOT_SIGMA], signal)
    gain = 1.0 / packed[ELECTRONS_PER_COUNT]
    # Half a count: the integer conversion below truncates.
    level, full = packed[DARK_LEVEL] + 0.5, packed[FULL_SCALE]
    read2, background = packed[READ_NOISE] ** 2, packed[BACKGROUND]
    dark_spread, response_spread = packed[DARK_SPREAD], packed[RESPONSE_SPREAD]
    # The sum of two numbers of the table has variance 2 and twice the range.
    scale = quieter * math.sqrt(0.5)
    # Threshold for 24 random bits per pixel: this fraction of pixels is hot.
    hot = np.uint64(packed[HOT_PART] * (1 << 24))
    width, stride = np.uint64(packed[SENSOR_WIDTH]), np.uint64(step)
    dark = np.empty(columns)
    # Short loops without branches, so that the compiler vectorises them.
    for i in range(rows):
        start = np.uint64(top + i) * width + np.uint64(left)
        n_hot = 0
        for j in range(columns):
            # The lowest 14 bits draw the dark level, those from 16 on the response, the top 24
            # whether the pixel is hot: no bit serves twice.
            fixed = mix(pattern_key, start + stride * np.uint64(j))
            dark[j] = dark_spread * normal[np.int64(fixed & _MASK)]
            light = signal[i, j]
            # Background and light, electrons; only LED light has the uneven response.
            signal[i, j] = background + light * (
                1.0 + response_spread * normal[np.int64((fixed >> _S16) & _MASK)]
            )
            n_hot += 1 if (fixed >> _S40) < hot else 0
        if n_hot:
            for j in range(columns):
                number = start + stride * np.uint64(j)
                fixed = mix(pattern_key, number)
                if (fixed >> _S40) < hot:
                    # A second draw, because the first is below `hot` here. The half keeps the
                    # logarithm off zero.
                    chance = (float(mix(fixed, number) >> _S40) + 0.5) * _UNIT24
                    # Exponential, with the mean HOT_ELECTRONS.
                    dark[j] -= packed[HOT_ELECTRONS] * math.log(chance)
        for j in range(columns):
            noise = mix(frame_key, start + stride * np.uint64(j))
            # Lowest 14 bits, and 14 from bit 32 on.
            two = normal[np.int64(noise & _MASK)] + normal[np.int64((noise >> _S32) & _MASK)]
            light = signal[i, j]
            # Shot noise: variance equals the number of photons; normal instead of Poisson.
            electrons = light + dark[j] + scale * math.sqrt(read2 + light) * two
            out[i, j] = np.uint16(min(max(level + gain * electrons, 0.0), full))


@compiled()
def _add_light(
    left: int, top: int, step: int, columns: int, light: Float, sigma: float, signal: Float
) -> None:
    """Add a round Gaussian spot, integrated over each pixel."""
    rows = signal.shape[0]
    u, v, electrons = light[0], light[1], light[2]
    reach = _REACH * sigma
    j0 = max(math.ceil((u - reach - left) / step), 0)
    j1 = min(math.floor((u + reach - left) / step) + 1, columns)
    i0 = max(math.ceil(v - reach) - top, 0)
    i1 = min(math.floor(v + reach) - top + 1, rows)
    if j0 >= j1 or i0 >= i1:
        return
    scale = 1.0 / (sigma * math.sqrt(2.0))
    share = np.empty(j1 - j0)
    for j in range(j0, j1):
        x = left + step * j - u
        # A pixel is one px wide for any step; the integral of a Gaussian over it is half a
        # difference of error functions per axis, hence the 0.25 below.
        share[j - j0] = math.erf((x + 0.5) * scale) - math.erf((x - 0.5) * scale)
    # The lower edge of a row is the upper edge of the previous one.
    below = math.erf((top + i0 - 0.5 - v) * scale)
    for i in range(i0, i1):
        above = math.erf((top + i + 0.5 - v) * scale)
        row = 0.25 * electrons * (above - below)
        below = above
        for j in range(j0, j1):
            signal[i, j] += row * share[j - j0]


@compiled(centroid, search, windows)
def run(
    first: int,
    lights: Float,
    packed: Float,
    pattern_key: np.uint64,
    frame_stream: np.uint64,
    normal: Float,
    black: NDArray[np.uint16],
    slots: Float,
    cursor: Int,
    regions: Int,
    anywhere: bool,
    options: Float,
    height: int,
    valid: NDArray[np.uint64],
    saturated: NDArray[np.bool_],
    status: NDArray[np.uint8],
    uv: Float,
    variance: Float,
) -> None:
    """Expose consecutive frames in the camera's windows, and find its spots.

    ``lights`` (n, m, 3): of each frame. ``black``, and ``slots`` to ``options``: as in
    `camera.windows` and `camera.search`. ``valid`` (n,), ``saturated`` (n,), ``status`` (n, 8),
    ``uv`` and ``variance`` (n, 8, 2) are outputs, ``slots`` and ``cursor`` are updated.
    """
    n_slots, size = len(slots), int(options[centroid.WINDOW])
    step, n_lines = int(options[centroid.SEARCH_STEP]), int(options[centroid.SEARCH_LINES])
    width = int(packed[SENSOR_WIDTH])
    corners = np.empty((n_slots, 2), np.int64)
    pixels = np.empty((n_slots, size, size), np.uint16)
    room = np.empty((size, size))
    readings = np.empty((n_slots, centroid.N_READING))
    lines = np.empty((n_lines, 3), np.int64)
    samples = np.empty((n_lines, width), np.uint16)
    line_room = np.empty((1, width))
    for k in range(len(lights)):
        # Keyed by frame number: a stream read in other blocks, or again, has the same noise.
        key = mix(frame_stream, np.uint64(first + k))
        windows.predict_windows(slots, options, width, height, corners)
        for s in range(n_slots):
            if corners[s, 0] >= 0:
                expose(
                    corners[s, 0], corners[s, 1], 1, size, lights[k], packed, pattern_key, key,
                    1.0, normal, room, pixels[s],
                )  # fmt: skip
        windows.measure_windows(pixels, corners, black, slots, options, readings)
        count = search.plan(slots, regions, anywhere, options, cursor, lines)
        for i in range(count):
            expose(
                lines[i, 0], lines[i, 1], step, lines[i, 2], lights[k], packed, pattern_key, key,
                1.0, normal, line_room, samples[i : i + 1],
            )  # fmt: skip
        search.scan(samples, lines, count, black, slots, regions, anywhere, options)
        valid[k], saturated[k] = windows.report(readings, uv[k], variance[k], status[k])
