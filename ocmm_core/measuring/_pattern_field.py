"""The field of the sensors' patterns as features: shared by near spots only.

The position-dependent part of the spot error is a Gaussian field: two spots of one camera at
distance d correlate by exp(-d^2 / (2 l^2)). A sum of bumps on a grid, each with an independent
standard normal number, is such a field, because

    sum_g phi(x - g) phi(y - g) = exp(-|x - y|^2 / (2 l^2)) sum_g exp(-2 |(x + y) / 2 - g|^2 / l^2)

with phi(x) = exp(-|x|^2 / l^2), and the last sum hardly depends on the midpoint. By Poisson's
summation it varies along each axis by 2 exp(-pi^2 l^2 / (2 h^2)) of its mean at a grid pitch h:
exp(-pi^2) for h = l / sqrt(2), 1.0e-4. Bumps further than `_REACH` pitches from a spot are omitted,
and the rest is scaled so that the variance of a spot is exact; the remaining error of the
correlation of two spots is below `LARGEST_ERROR`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking import TipSensitivity

LARGEST_ERROR = 5e-4
"""Of the correlation of two spots, absolute, from pitch and reach."""

_PITCH = 1.0 / np.sqrt(2.0)
"""Of the grid, in correlation lengths."""

_REACH = 4
"""Pitches to either side of a spot: further bumps are below exp(-8) of the nearest."""


@dataclass(frozen=True, slots=True)
class PatternField:
    """Derivatives of N points by the fields of all sensors; at most S spots each."""

    camera: Int
    """(N, S) int64: of each spot."""
    place: Float
    """(N, S, 2): of each spot on its sensor, in pitches of the grid."""
    gain: Float
    """(N, S, 2, 3), mm: derivative of the point by a spot error along u and v of one standard
    deviation of the pattern; zero for missing spots."""

    def kept(self, places: Int) -> PatternField:
        return PatternField(self.camera[places], self.place[places], self.gain[places])

    def answers(self, gradients: Float) -> Float:
        """Return derivatives (k, f) by the relevant bumps, of values with gradients (k, N, 3)."""
        by_spots = np.einsum("kni,nsai->kans", gradients, self.gain, optimize=True)
        count, bumps = len(gradients), self.bumps()
        found: Float = by_spots.reshape(2 * count, -1) @ bumps
        return found.reshape(count, -1)

    def moved(self, gradients: Float) -> Float:
        """Return the covariances (k, N, 3) of all coordinates with values of these gradients."""
        by_spots = np.einsum("kni,nsai->kans", gradients, self.gain, optimize=True)
        bumps = self.bumps()
        flat = by_spots.reshape(2 * len(gradients), -1)
        shared = (bumps @ (flat @ bumps).T).T.reshape(by_spots.shape)
        found: Float = np.einsum("kans,nsai->kni", shared, self.gain, optimize=True)
        return found

    def blocks(self) -> Float:
        """Return the covariance (N, 3, 3), mm^2, of each point."""
        apart = np.sum((self.place[:, :, None] - self.place[:, None]) ** 2, axis=3)
        # Correlation of the bumps, exp(-d^2 / (2 l^2)), in pitches of the grid.
        alike = np.exp(-0.5 * _PITCH**2 * apart)
        alike *= self.camera[:, :, None] == self.camera[:, None]
        found: Float = np.einsum("nsai,nst,ntaj->nij", self.gain, alike, self.gain, optimize=True)
        return found

    def drawn(self, normal: Float, bumps: csr_array) -> Float:
        """Return moves (m, N, 3), mm, for independent numbers (m, 2, f), one per bump and axis."""
        shape = (len(normal), 2, *self.camera.shape)
        at_spots = (bumps @ normal.reshape(-1, normal.shape[2]).T).T.reshape(shape)
        found: Float = np.einsum("mans,nsai->mni", at_spots, self.gain, optimize=True)
        return found

    def bumps(self) -> csr_array:
        """Return heights of bumps at spots, sparse (N S, f), without empty ones, on either axis."""
        first = np.floor(self.place).astype(np.int32) - np.int32(_REACH - 1)
        steps = np.arange(2 * _REACH, dtype=np.int32)
        away = self.place[..., None] - first[..., None] - steps
        # The bump phi in units of the grid: l^2 = 1 / _PITCH^2.
        heights = np.exp(-(_PITCH**2) * away**2)
        heights /= np.sqrt(np.sum(heights**2, axis=-1))[..., None]
        first -= first.min(axis=(0, 1))
        width = int(first[..., 1].max()) + 2 * _REACH
        area = width * (int(first[..., 0].max()) + 2 * _REACH)
        rows = (
            self.camera.astype(np.int32)[..., None] * area + (first[..., 0, None] + steps) * width
        )
        cells = (rows[..., :, None] + (first[..., 1, None] + steps)[..., None, :]).ravel()
        taken = np.zeros(area * (int(self.camera.max()) + 1), dtype=bool)
        taken[cells] = True
        number = np.cumsum(taken, dtype=np.int32) - np.int32(1)
        values = heights[..., 0, :, None] * heights[..., 1, None, :]
        ends = np.arange(self.camera.size + 1, dtype=np.int32) * np.int32(len(steps) ** 2)
        shape = (self.camera.size, int(number[-1]) + 1)
        return csr_array((values.ravel(), number[cells], ends), shape=shape)


def joined_fields(parts: Sequence[PatternField]) -> PatternField:
    """Return the fields of several, concatenated; at least one."""
    most = max(part.camera.shape[1] for part in parts)
    # A missing spot takes the place of the first, with zero gain.
    chosen = [
        np.where(np.arange(most) < part.camera.shape[1], np.arange(most), 0) for part in parts
    ]
    seen = [np.arange(most) < part.camera.shape[1] for part in parts]
    return PatternField(
        np.concatenate([p.camera[:, c] for p, c in zip(parts, chosen, strict=True)]),
        np.concatenate([p.place[:, c] for p, c in zip(parts, chosen, strict=True)]),
        np.concatenate(
            [p.gain[:, c] * s[:, None, None] for p, c, s in zip(parts, chosen, seen, strict=True)]
        ),
    )


def pattern_field(sensitivities: Sequence[TipSensitivity], rig: Rig) -> PatternField:
    """Return the field of at least one point; missing spots have zero gain."""
    most = max(len(item.camera) for item in sensitivities)
    n, noise = len(sensitivities), rig.noise
    camera = np.zeros((n, most), dtype=np.int64)
    place, gain = np.zeros((n, most, 2)), np.zeros((n, most, 2, 3))
    for index, item in enumerate(sensitivities):
        seen = len(item.camera)
        camera[index, :seen] = item.camera
        place[index, :seen] = item.uv
        # A missing spot takes the place of another, so it adds no bumps.
        place[index, seen:], camera[index, seen:] = item.uv[0], item.camera[0]
        gain[index, :seen] = item.by_spots.transpose(1, 2, 0)
    if rig.noise_ratios:
        gain *= np.array(rig.noise_ratios)[camera][:, :, None, None]
    return PatternField(camera, place / (_PITCH * noise.pattern_length_px), noise.pattern_px * gain)
