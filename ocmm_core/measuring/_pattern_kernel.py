"""Compiled sums over the bumps of `_pattern_field`, without forming their heights at all spots.

A spot meets 8 bumps an axis, and its height over one is the product of two heights along the axes:
16 numbers instead of 64. Bumps are numbered row by row of a sensor, from the first to the last one
that a spot of the field meets.
"""

from __future__ import annotations

import math

import numpy as np

from ocmm_core.geometry import Float, Int
from ocmm_core.instructions import njit

REACH = 4
"""Pitches to either side of a spot: further bumps are below exp(-8) of the nearest."""

_MET = 2 * REACH
# Heights exp(-d^2 / 2) of bumps at whole distances, in pitches.
_WHOLE = np.exp(-0.5 * np.arange(1 - REACH, REACH + 1) ** 2)


@njit(cache=True)
def bumps_of(camera: Int, place: Float) -> tuple[Int, Float, int]:
    """Return the bumps that spots (N, S) meet.

    Number of the first one of each row, (N, S, 8); heights along both axes, (N, S, 2, 8), with a
    sum of squares of one; number of all bumps.
    """
    count, spots = camera.shape
    first, heights = np.empty((count, spots, _MET), np.int64), np.empty((count, spots, 2, _MET))
    top, left = math.floor(place[:, :, 0].min()), math.floor(place[:, :, 1].min())
    rows = math.floor(place[:, :, 0].max()) - top + _MET
    ends = np.zeros((camera.max() + 1, rows, 2), dtype=np.int64)
    ends[:, :, 0] = np.iinfo(np.int64).max
    for n in range(count):
        for s in range(spots):
            column = math.floor(place[n, s, 1]) - left
            for i in range(_MET):
                end = ends[camera[n, s], math.floor(place[n, s, 0]) - top + i]
                end[0], end[1] = min(end[0], column), max(end[1], column + _MET)
    bumps = 0
    for c in range(len(ends)):
        for i in range(rows):
            if ends[c, i, 1] > 0:
                # From here on the number of the bump at column 0.
                width = ends[c, i, 1] - ends[c, i, 0]
                ends[c, i, 0] = bumps - ends[c, i, 0]
                bumps += width
    for n in range(count):
        for s in range(spots):
            row, column = math.floor(place[n, s, 0]) - top, math.floor(place[n, s, 1]) - left
            for i in range(_MET):
                first[n, s, i] = ends[camera[n, s], row + i, 0] + column
            for a in range(2):
                # exp(-(d - j)^2 / 2) without the factor exp(-d^2 / 2), which the norm cancels.
                step = math.exp(place[n, s, a] - math.floor(place[n, s, a]))
                power, squares = 1.0 / step ** (REACH - 1), 0.0
                for j in range(_MET):
                    heights[n, s, a, j] = power * _WHOLE[j]
                    squares += heights[n, s, a, j] ** 2
                    power *= step
                for j in range(_MET):
                    heights[n, s, a, j] *= 1.0 / math.sqrt(squares)
    return first, heights, bumps


@njit(cache=True)
def gather(numbers: Float, first: Int, heights: Float, gain: Float) -> Float:
    """Return moves (k, N, 3), mm, of points by numbers (k, 2, f), one per bump and axis."""
    count, spots = first.shape[:2]
    moves = np.zeros((len(numbers), count, 3))
    for n in range(count):
        for s in range(spots):
            down, h = heights[n, s]
            for k in range(len(numbers)):
                for a in range(2):
                    row = numbers[k, a]
                    # One sum a column: compiled to additions of four at once.
                    r0 = r1 = r2 = r3 = r4 = r5 = r6 = r7 = 0.0
                    for i in range(_MET):
                        # Unsigned, because signed indices are checked for the end of the row.
                        m, height = np.uint64(first[n, s, i]), down[i]
                        r0 += height * row[m]
                        r1 += height * row[m + np.uint64(1)]
                        r2 += height * row[m + np.uint64(2)]
                        r3 += height * row[m + np.uint64(3)]
                        r4 += height * row[m + np.uint64(4)]
                        r5 += height * row[m + np.uint64(5)]
                        r6 += height * row[m + np.uint64(6)]
                        r7 += height * row[m + np.uint64(7)]
                    total = r0 * h[0] + r1 * h[1] + r2 * h[2] + r3 * h[3]
                    total += r4 * h[4] + r5 * h[5] + r6 * h[6] + r7 * h[7]
                    for axis in range(3):
                        moves[k, n, axis] += gain[n, s, a, axis] * total
    return moves


@njit(cache=True)
def spread(gradients: Float, first: Int, heights: Float, gain: Float, bumps: int) -> Float:
    """Return derivatives (k, 2, f) by bumps and axes of values with gradients (k, N, 3)."""
    count, spots = first.shape[:2]
    found = np.zeros((len(gradients), 2, bumps))
    for n in range(count):
        for s in range(spots):
            down, along = heights[n, s]
            for k in range(len(gradients)):
                for a in range(2):
                    value = 0.0
                    for axis in range(3):
                        value += gradients[k, n, axis] * gain[n, s, a, axis]
                    for i in range(_MET if value != 0.0 else 0):
                        met = found[k, a, first[n, s, i] : first[n, s, i] + _MET]
                        height = value * down[i]
                        for j in range(_MET):
                            met[j] += height * along[j]
    return found


@njit(cache=True)
def blocks(camera: Int, place: Float, gain: Float) -> Float:
    """Return the covariance (N, 3, 3), mm^2, of each point."""
    count, spots = camera.shape
    found = np.zeros((count, 3, 3))
    for n in range(count):
        for s in range(spots):
            for t in range(spots):
                if camera[n, s] == camera[n, t]:
                    down, along = place[n, s, 0] - place[n, t, 0], place[n, s, 1] - place[n, t, 1]
                    # Correlation of the bumps, exp(-d^2 / (2 l^2)), in pitches of l / sqrt(2).
                    alike = math.exp(-0.25 * (down**2 + along**2))
                    for a in range(2):
                        for i in range(3):
                            for j in range(3):
                                found[n, i, j] += alike * gain[n, s, a, i] * gain[n, t, a, j]
    return found
