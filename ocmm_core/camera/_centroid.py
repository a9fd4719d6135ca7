"""Compiled measurement of one window: test for a single LED, and its centroid.

1. Subtract the black image, signed: noise about zero stays about zero. Then subtract the level of
   the window's border, which removes light that is not in the black image.
2. Connected pixels above the threshold are a blob. The main blob gives the first centroid, weighted
   by the height above the threshold; a second one of LED size makes the window crowded.
3. Two Newton steps to the centroid under a Gaussian weight that is centred on the result
   (the windowed centroid of SExtractor, Bertin, 2.x manual, chapter on windowed positions).

Step 3 removes the effect of the threshold. A thresholded centroid jumps whenever a pixel enters:
for the light of the virtual LEDs by up to 0.03 px, as much as the noise, and fixed to the sensor
position, so that averaging does not help. With the smooth weight the same spots show less than
0.001 px, and their scatter is within 5 % of the Cramér-Rao bound (``benchmarks/centroids.py``).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera._compiled import compiled
from ocmm_core.geometry import Float, Int

GOOD, FREE, DARK, EDGE, CROWDED, SATURATED, SMALL, LARGE, ELONGATED, DIM = range(10)
SHARED, JUMPED, UNCONFIRMED = 10, 11, 12
"""Values of `spots.SpotStatus`."""

(
    THRESHOLD, READ_NOISE, DARK_SPREAD, BLACK_FRAMES, RESPONSE_SPREAD,
    ELECTRONS_PER_COUNT, FULL_SCALE, WEIGHT_SIGMA,
    MIN_PIXELS, MAX_PIXELS, MAX_ELONGATION, MAX_SIGMA,
    WINDOW, SEPARATION, FLUX_LOW, FLUX_HIGH, CONFIRM, HOLD, SEARCH_STEP, SEARCH_LINES,
) = range(20)  # fmt: skip
N_OPTIONS = 20
"""Indices of the packed options, see `spots.SpotOptions.packed`."""

STATUS, U, V, VAR_U, VAR_V, FLUX, PEAK, PIXELS, ELONGATION, BACKGROUND = range(10)
N_READING = 10
"""Columns of a reading: positions in px of the sensor, variances in px^2, light in counts."""

_REACH = 4.0
"""Half width of the weighted neighbourhood in weight sigmas; beyond it the weight is below 4e-4."""
# Newton doubles the digits with each step; the thresholded centroid is within some hundredths of a
# pixel, so that two steps are far below the noise.
_STEPS = 2
# The first mean includes the spots, the second excludes pixels above it, the third repeats that
# about a level without them.
_LEVEL_ROUNDS = 3
_ELONGATION_NOISE = 5.0
"""A round spot with its brightest pixel k noise deviations high appears elongated by more than 5 /
k in less than one of a thousand frames from k = 9 on, of ten thousand from 14 on.
"""


@compiled()
def measure(
    pixels: NDArray[np.uint16],
    left: int,
    top: int,
    black: NDArray[np.uint16],
    options: Float,
    light: Float,
    mark: NDArray[np.uint8],
    stack: Int,
    reading: Float,
) -> None:
    """Write the reading of one window.

    ``pixels`` (h, w): raw counts of the window whose first pixel is (left, top). ``black`` is the
    image of the whole sensor, or empty. ``light`` (h, w), ``mark`` (h, w) and ``stack`` (h w) are
    work arrays; ``reading`` (N_READING,) is the output.
    """
    height, width = pixels.shape
    has_black = black.size > 0
    for i in range(height):
        for j in range(width):
            mark[i, j] = 0
            light[i, j] = float(pixels[i, j])
    if has_black:
        for i in range(height):
            for j in range(width):
                light[i, j] -= float(black[top + i, left + j])
    # All pixels of the rim, corners once.
    border = np.empty(2 * (height + width) - 4)
    _border(light, border)
    threshold = options[THRESHOLD]
    background = level_of(border, threshold)
    brightest = -np.inf
    for i in range(height):
        for j in range(width):
            # From here on light is in counts above the background, and may be negative: clipping
            # noise at zero would raise the level and pull the centroid to the middle of the window.
            light[i, j] -= background
            brightest = max(brightest, light[i, j])
    for k in range(N_READING):
        reading[k] = np.nan
    reading[BACKGROUND] = background
    reading[PEAK] = brightest
    reading[PIXELS] = 0.0
    # By default five times the read noise: dark pixels pass it at most once in a minute.
    if brightest <= threshold:
        reading[STATUS] = DARK
        return

    count, spots = _main_blob(light, threshold, int(options[MIN_PIXELS]), mark, stack)
    touches, clipped = False, False
    total = x = y = xx = xy = yy = peak = 0.0
    for k in range(count):
        i, j = stack[k] // width, stack[k] % width
        # Part of the light is beyond the window, so the centroid would be biased inwards.
        touches |= i == 0 or j == 0 or i == height - 1 or j == width - 1
        # Raw counts: an overexposed pixel is at the end of the converter, before subtraction.
        clipped |= pixels[i, j] >= options[FULL_SCALE]
        peak = max(peak, light[i, j])
        # Height above the threshold, not above the background: a pixel then enters the blob with
        # zero weight, without a jump of the sums.
        w = light[i, j] - threshold
        total += w
        x += w * j
        y += w * i
        xx += w * j * j
        xy += w * j * i
        yy += w * i * i
    x /= total
    y /= total
    reading[PEAK], reading[PIXELS] = peak, count
    # Second central moments, px^2: E[x^2] - E[x]^2.
    reading[ELONGATION] = _axis_ratio(xx / total - x * x, xy / total - x * y, yy / total - y * y)
    reading[U], reading[V] = left + x, top + y
    # Variance of a dark pixel, counts^2. Rounding to a whole count has the variance 1/12.
    noise = options[READ_NOISE] ** 2 + 1.0 / 12.0
    # The mean of n frames adds 1/n of the same noise to every pixel; without a black image the
    # fixed differences between pixels count as noise.
    noise += noise / options[BLACK_FRAMES] if has_black else options[DARK_SPREAD] ** 2
    located = _refine(light, x, y, left, top, noise, options, reading)

    sigma = np.sqrt(max(reading[VAR_U], reading[VAR_V]))
    # Height of the brightest pixel in noise deviations. Photons: n electrons scatter by their root,
    # so that counts have the variance counts / (electrons per count).
    contrast = peak / np.sqrt(noise + peak / options[ELECTRONS_PER_COUNT])
    longest = options[MAX_ELONGATION] + _ELONGATION_NOISE / contrast

    # Report the cause: a cut or overexposed spot also has a wrong size.
    if touches:
        reading[STATUS] = EDGE
    elif spots > 1:
        reading[STATUS] = CROWDED
    elif clipped:
        reading[STATUS] = SATURATED
    elif count < options[MIN_PIXELS]:
        reading[STATUS] = SMALL
    elif count > options[MAX_PIXELS]:
        reading[STATUS] = LARGE
    elif not located or reading[ELONGATION] > longest:
        reading[STATUS] = ELONGATED
    elif sigma > options[MAX_SIGMA]:
        reading[STATUS] = DIM
    else:
        reading[STATUS] = GOOD


@compiled()
def _refine(
    light: Float,
    x: float,
    y: float,
    left: int,
    top: int,
    noise: float,
    options: Float,
    reading: Float,
) -> bool:
    """Write position, variance and light under the Gaussian weight; False without a peak.

    The position solves F(x) = sum W(x_i - x) (x_i - x) p_i = 0, with the Newton step ``m / (1 - q /
    s^2)`` with the first and second weighted moments m and q about the present position. A change
    of one pixel by dp moves the root by ``W (x_i - x) dp / (P (1 - q / s^2))`` with P the weighted
    light; the variance is the sum of these squares with the variance of each pixel: read noise and
    one twelfth of a count squared for the converter, the same in the black image, photons, and the
    spread of the response.
    """
    height, width = light.shape
    s = options[WEIGHT_SIGMA]
    # W(d) = exp(-d^2 / (2 s^2)); s is best near 1.3 times the spot's own sigma.
    scale = -0.5 / (s * s)
    # Pixels on either side of the nearest one.
    reach = int(_REACH * s + 0.5)
    slope_x = slope_y = total = 0.0
    weight_x = np.empty(2 * reach + 1)
    weight_y = np.empty(2 * reach + 1)
    start_x, start_y = x, y
    # The last round only sums at the final position, for the derivative and the light.
    for step in range(_STEPS + 1):
        # int(x + 0.5) is the nearest pixel; both ends are kept within the window.
        j0, i0 = max(int(x + 0.5) - reach, 0), max(int(y + 0.5) - reach, 0)
        j1, i1 = min(int(x + 0.5) + reach + 1, width), min(int(y + 0.5) + reach + 1, height)
        for j in range(j0, j1):
            weight_x[j - j0] = np.exp(scale * (j - x) ** 2)
        for i in range(i0, i1):
            weight_y[i - i0] = np.exp(scale * (i - y) ** 2)
        total = mx = my = qx = qy = 0.0
        for i in range(i0, i1):
            row = row_x = row_xx = 0.0
            for j in range(j0, j1):
                # The weight is separable in x and y: two short tables of exponentials suffice.
                w = weight_x[j - j0] * light[i, j]
                d = j - x
                row += w
                row_x += w * d
                row_xx += w * d * d
            w, d = weight_y[i - i0], i - y
            total += w * row
            mx += w * row_x
            qx += w * row_xx
            my += w * d * row
            qy += w * d * d * row
        # P (1 - q / s^2) of the text above with q not yet divided by P: minus the derivative of F.
        # It is s^2 / (s^2 + spot^2) of P for a round spot, and zero or less without a peak.
        slope_x, slope_y = total - qx / (s * s), total - qy / (s * s)
        if not (slope_x > 0.0 and slope_y > 0.0):
            return False
        if step == _STEPS:
            break
        # x - F / F' with F' = -slope: a plus.
        x += mx / slope_x
        y += my / slope_y
        # A step of more than the weight's width: not one round spot.
        if not (abs(x - start_x) <= s and abs(y - start_y) <= s):
            return False
    # A relative response difference r between pixels adds (r counts)^2.
    photons, uneven = 1.0 / options[ELECTRONS_PER_COUNT], options[RESPONSE_SPREAD] ** 2
    var_x = var_y = 0.0
    for i in range(i0, i1):
        for j in range(j0, j1):
            w = weight_x[j - j0] * weight_y[i - i0]
            # Noise below zero has no photons.
            counts = max(light[i, j], 0.0)
            v = noise + counts * (photons + uneven * counts)
            # Each pixel moves the root by W d / slope; independent pixels add by squares.
            var_x += v * (w * (j - x)) ** 2
            var_y += v * (w * (i - y)) ** 2
    reading[U], reading[V] = left + x, top + y
    reading[VAR_U], reading[VAR_V] = var_x / slope_x**2, var_y / slope_y**2
    reading[FLUX] = total
    return True


# Sums in any order, which the compiler vectorises: eight times faster.
@compiled(reorder=True)
def level_of(light: Float, threshold: float) -> float:
    """Return the mean of ``light`` (n,) without the spots in it.

    Pixels more than the threshold above the last mean are excluded next time; without any, this is
    the plain mean, which has the least noise.
    """
    level = np.inf
    for _ in range(_LEVEL_ROUNDS):
        limit = level + threshold
        total = n = 0.0
        for k in range(len(light)):
            below = 1.0 if light[k] < limit else 0.0
            total += below * light[k]
            n += below
        level = total / max(n, 1.0)
    return level


@compiled()
def _border(light: Float, border: Float) -> None:
    height, width = light.shape
    # First and last row whole, then left and right column without the corners.
    border[:width], border[width : 2 * width] = light[0], light[height - 1]
    n = 2 * width
    for i in range(1, height - 1):
        border[n], border[n + 1] = light[i, 0], light[i, width - 1]
        n += 2


@compiled()
def _fill(
    light: Float, threshold: float, i: int, j: int, mark: NDArray[np.uint8], stack: Int
) -> int:
    """Mark the blob about a pixel, write its pixels to ``stack`` and return their number."""
    height, width = light.shape
    mark[i, j] = 1
    stack[0] = i * width + j
    count, done = 1, 0
    while done < count:
        ci, cj = stack[done] // width, stack[done] % width
        done += 1
        # Eight neighbours: pixels that touch at a corner are connected.
        for ni in range(max(ci - 1, 0), min(ci + 2, height)):
            for nj in range(max(cj - 1, 0), min(cj + 2, width)):
                if mark[ni, nj] == 0 and light[ni, nj] > threshold:
                    mark[ni, nj] = 1
                    stack[count] = ni * width + nj
                    count += 1
    return count


@compiled()
def _main_blob(
    light: Float, threshold: float, least: int, mark: NDArray[np.uint8], stack: Int
) -> tuple[int, int]:
    """Write pixels of the brightest large blob to ``stack``; return pixel and blob counts."""
    height, width = light.shape
    main_i = main_j = count = blobs = spots = 0
    most, main_large = -1.0, False
    for i in range(height):
        for j in range(width):
            if light[i, j] <= threshold or mark[i, j] != 0:
                continue
            count = _fill(light, threshold, i, j, mark, stack)
            total = 0.0
            for k in range(count):
                total += light[stack[k] // width, stack[k] % width]
            large = count >= least
            blobs += 1
            spots += 1 if large else 0
            # LED size has priority over brightness; otherwise the one with more light wins.
            if (large and not main_large) or (large == main_large and total > most):
                main_i, main_j, most, main_large = i, j, total, large
    # The stack holds the last blob; refill the main one.
    if blobs > 1:
        mark[:] = 0
        count = _fill(light, threshold, main_i, main_j, mark, stack)
    return count, spots


@compiled()
def _axis_ratio(xx: float, xy: float, yy: float) -> float:
    """Return the ratio of the axes of the ellipse of inertia; 1 is round."""
    # A row of single pixels has no width; a pixel itself has a variance of 1/12.
    xx, yy = xx + 1.0 / 12.0, yy + 1.0 / 12.0
    # Eigenvalues of a symmetric 2x2 matrix: mean plus and minus half.
    mean, half = 0.5 * (xx + yy), np.sqrt(0.25 * (xx - yy) ** 2 + xy * xy)
    return float(np.sqrt((mean + half) / max(mean - half, 1.0 / 12.0)))
