"""The field of the sensors' patterns as features: shared by near spots only.

The position-dependent part of the spot error is a Gaussian field: two spots of one camera at
distance d correlate by exp(-d^2 / (2 l^2)). A sum of bumps on a grid, each with an independent
standard normal number, is such a field, because

    sum_g phi(x - g) phi(y - g) = exp(-|x - y|^2 / (2 l^2)) sum_g exp(-2 |(x + y) / 2 - g|^2 / l^2)

with phi(x) = exp(-|x|^2 / l^2), and the last sum hardly depends on the midpoint. By Poisson's
summation it varies along each axis by 2 exp(-pi^2 l^2 / (2 h^2)) of its mean at a grid pitch h:
exp(-pi^2) for h = l / sqrt(2), 1.0e-4. Bumps further than `REACH` pitches from a spot are omitted,
and the rest is scaled so that the variance of a spot is exact; the remaining error of the
correlation of two spots is below `LARGEST_ERROR`.

Compiled sums form no heights of all spots: a spot meets 8 bumps an axis, and its height over one is
the product of two heights along the axes, 16 numbers instead of 64. Bumps are numbered row by row
of a sensor, from the first to the last one that a spot of the field meets.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ocmm_core.camera import Rig
from ocmm_core.cpu_features import njit
from ocmm_core.geometry import Float, Int
from ocmm_core.measuring._rows import Rows
from ocmm_core.tracking import TipSensitivity

LARGEST_ERROR = 5e-4
"""Of the correlation of two spots, absolute, from pitch and reach."""

_PITCH = 1.0 / np.sqrt(2.0)
"""Of the grid, in correlation lengths."""


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
    # First and last column, by the first row of the spots, and then by all rows that they meet.
    own = np.zeros((camera.max() + 1, rows, 2), dtype=np.int64)
    own[:, :, 0] = np.iinfo(np.int64).max
    for n in range(count):
        for s in range(spots):
            row, column = math.floor(place[n, s, 0]) - top, math.floor(place[n, s, 1]) - left
            end = own[camera[n, s], row]
            end[0], end[1] = min(end[0], column), max(end[1], column + _MET)
    starts, bumps = np.zeros((len(own), rows), dtype=np.int64), 0
    for c in range(len(own)):
        for i in range(rows):
            near = own[c, max(i - _MET + 1, 0) : i + 1]
            if near[:, 1].max() > 0:
                # The number of the bump at column 0.
                starts[c, i] = bumps - near[:, 0].min()
                bumps += near[:, 1].max() - near[:, 0].min()
    for n in range(count):
        for s in range(spots):
            row, column = math.floor(place[n, s, 0]) - top, math.floor(place[n, s, 1]) - left
            for i in range(_MET):
                first[n, s, i] = starts[camera[n, s], row + i] + column
            for a in range(2):
                # exp(-(d - j)^2 / 2) without the factor exp(-d^2 / 2), which the norm cancels.
                step = math.exp(place[n, s, a] - math.floor(place[n, s, a]))
                power, squares = 1.0 / step ** (REACH - 1), 0.0
                for j in range(_MET):
                    heights[n, s, a, j] = power * _WHOLE[j]
                    squares += heights[n, s, a, j] ** 2
                    power *= step
                norm = 1.0 / math.sqrt(squares)
                for j in range(_MET):
                    heights[n, s, a, j] *= norm
    return first, heights, bumps


@njit(cache=True)
def gather(numbers: Float, first: Int, heights: Float, gain: Float) -> Float:
    """Return moves (k, N, 3), mm, of points by numbers (f, 2 k) of the bumps, see `spread`."""
    count, spots = first.shape[:2]
    # Unsigned, because signed indices are checked for the end of the row.
    wide, flat = np.uint64(numbers.shape[1]), numbers.reshape(-1)
    moves, patch = np.zeros((numbers.shape[1] // 2, count, 3)), np.empty(_MET * numbers.shape[1])
    starts = np.empty(_MET, dtype=np.uint64)
    for n in range(count):
        for s in range(spots):
            down, along = heights[n, s]
            patch[:] = 0.0
            for i in range(_MET):
                starts[i] = wide * np.uint64(first[n, s, i])
            # Four rows of bumps at once: a sum is stored and loaded less often.
            for i in range(0, _MET, 4):
                d0, d1, d2, d3 = down[i], down[i + 1], down[i + 2], down[i + 3]
                at0, at1, at2, at3 = starts[i], starts[i + 1], starts[i + 2], starts[i + 3]
                for c in range(np.uint64(_MET) * wide):
                    upper = d0 * flat[at0 + c] + d1 * flat[at1 + c]
                    patch[c] += upper + d2 * flat[at2 + c] + d3 * flat[at3 + c]
            for a in range(2):
                for k in range(len(moves)):
                    total, at = 0.0, np.uint64(a * len(moves) + k)
                    for j in range(_MET):
                        total += along[j] * patch[np.uint64(j) * wide + at]
                    for axis in range(3):
                        moves[k, n, axis] += gain[n, s, a, axis] * total
    return moves


@njit(cache=True)
def spread(gradients: Float, first: Int, heights: Float, gain: Float, bumps: int) -> Float:
    """Return derivatives (f, 2 k) by the bumps, first of all along u, of values by (k, N, 3).

    Those by one bump are next to each other: a spot adds one run to a row of bumps.
    """
    count, spots = first.shape[:2]
    wide = 2 * len(gradients)
    found, patch, values = np.zeros(bumps * wide), np.empty(_MET * wide), np.empty(wide)
    for n in range(count):
        for s in range(spots):
            live = 0
            for a in range(2):
                for k in range(len(gradients)):
                    value = 0.0
                    for axis in range(3):
                        value += gradients[k, n, axis] * gain[n, s, a, axis]
                    values[a * len(gradients) + k] = value
                    live += value != 0.0
            down, along = heights[n, s]
            if _MET * live < wide:
                # As for deviations by their own points.
                for c in range(wide):
                    if values[c] != 0.0:
                        for i in range(_MET):
                            for j in range(_MET):
                                at = (first[n, s, i] + j) * wide + c
                                found[at] += down[i] * along[j] * values[c]
                continue
            for j in range(_MET):
                for c in range(wide):
                    patch[j * wide + c] = along[j] * values[c]
            for i in range(_MET):
                start, height = np.uint64(wide * first[n, s, i]), down[i]
                for c in range(np.uint64(_MET * wide)):
                    found[start + c] += height * patch[c]
    return found.reshape(bumps, wide)


@njit(cache=True)
def blocks(camera: Int, place: Float, gain: Float) -> Float:
    """Return the covariance (N, 3, 3), mm^2, of each point."""
    count, spots = camera.shape
    found = np.zeros((count, 3, 3))
    for n in range(count):
        for s in range(spots):
            for t in range(s + 1):
                if camera[n, s] == camera[n, t]:
                    down, along = place[n, s, 0] - place[n, t, 0], place[n, s, 1] - place[n, t, 1]
                    # Correlation of the bumps, exp(-d^2 / (2 l^2)), in pitches of l / sqrt(2).
                    alike = math.exp(-0.25 * (down**2 + along**2)) * (0.5 if s == t else 1.0)
                    for a in range(2):
                        for i in range(3):
                            for j in range(3):
                                both = gain[n, s, a, i] * gain[n, t, a, j]
                                found[n, i, j] += alike * (
                                    both + gain[n, s, a, j] * gain[n, t, a, i]
                                )
    return found


@dataclass(frozen=True, slots=True, eq=False)
class PatternField:
    """Derivatives of N points by the fields of all sensors; at most S spots each."""

    camera: Int
    """(N, S) int64: of each spot."""
    place: Float
    """(N, S, 2): of each spot on its sensor, in pitches of the grid."""
    gain: Float
    """(N, S, 2, 3), mm: derivative of the point by a spot error along u and v of one standard
    deviation of the pattern; zero for missing spots."""

    own: Float
    """(N, 3, 3), mm^2: covariance of each point."""

    @classmethod
    def of(cls, camera: Int, place: Float, gain: Float) -> PatternField:
        """Return the field with the covariances of its points."""
        return cls(camera, place, gain, blocks(camera, place, gain))

    def kept(self, places: Int) -> PatternField:
        return PatternField(
            self.camera[places], self.place[places], self.gain[places], self.own[places]
        )

    def answers(self, rows: Rows) -> Float:
        """Return derivatives (k, 2 f) by the relevant bumps, of values by these points."""
        return _spread(self, rows).reshape(-1, len(rows)).T

    def moved(self, rows: Rows) -> Float:
        """Return the covariances (k, N, 3) of all coordinates with values by these points."""
        return gather(_spread(self, rows), *_bumps(self)[:3])

    def drawing(self) -> tuple[int, Callable[[Float], Float]]:
        """Return the number f of bumps, and moves (m, N, 3), mm, by m sets of normal numbers.

        The function takes them as (m, 2, f), one per bump and axis.
        """
        first, heights, gain, bumps = _bumps(self)

        def drawn(normal: Float) -> Float:
            numbers = np.ascontiguousarray(normal.transpose(2, 1, 0)).reshape(bumps, -1)
            return gather(numbers, first, heights, gain)

        return bumps, drawn


@lru_cache(maxsize=2)
def _bumps(field: PatternField) -> tuple[Int, Float, Float, int]:
    """Return `bumps_of` a field, and its gain: after a point several sums over it are needed."""
    first, heights, bumps = bumps_of(field.camera, field.place)
    return first, heights, field.gain, bumps


@lru_cache(maxsize=1)
def _spread(field: PatternField, rows: Rows) -> Float:
    """Return `spread` of rows by all points of a field: once for their variance and `moved`."""
    return spread(np.ascontiguousarray(rows.by_points), *_bumps(field))


def joined_fields(parts: Sequence[PatternField]) -> PatternField:
    """Return the fields of several, concatenated; at least one."""
    most = max(part.camera.shape[1] for part in parts)
    return PatternField(
        *map(np.concatenate, zip(*(_widened(part, most) for part in parts), strict=True))
    )


def _widened(field: PatternField, spots: int) -> tuple[Int, Float, Float, Float]:
    """Return the arrays of a field with this number of spots a point."""
    seen = np.arange(spots) < field.camera.shape[1]
    if seen.all():
        return field.camera, field.place, field.gain, field.own
    # A missing spot takes the place of the first, with zero gain.
    chosen = np.where(seen, np.arange(spots), 0)
    gain = field.gain.take(chosen, axis=1) * seen[:, None, None]
    return field.camera.take(chosen, axis=1), field.place.take(chosen, axis=1), gain, field.own


def pattern_field(sensitivities: Sequence[TipSensitivity], rig: Rig) -> PatternField:
    """Return the field of at least one point; missing spots have zero gain."""
    counts = np.array([len(item.camera) for item in sensitivities])
    spots = np.arange(counts.max())
    seen = spots < counts[:, None]
    # A missing spot takes the place of the first, so it adds no bumps.
    chosen = (np.cumsum(counts) - counts)[:, None] + np.where(seen, spots, 0)
    camera = np.concatenate([item.camera for item in sensitivities], dtype=np.int64)[chosen]
    place = np.concatenate([item.uv for item in sensitivities])[chosen]
    by_spots = np.concatenate([item.by_spots for item in sensitivities], axis=1)
    gain = np.ascontiguousarray(by_spots.transpose(1, 2, 0))[chosen]
    gain *= rig.noise.pattern_px * seen[:, :, None, None]
    if rig.noise_ratios:
        gain *= np.array(rig.noise_ratios)[camera][:, :, None, None]
    return PatternField.of(camera, place / (_PITCH * rig.noise.pattern_length_px), gain)
