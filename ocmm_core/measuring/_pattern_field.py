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
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, Int
from ocmm_core.measuring._pattern_kernel import blocks, bumps_of, gather, spread
from ocmm_core.tracking import TipSensitivity

LARGEST_ERROR = 5e-4
"""Of the correlation of two spots, absolute, from pitch and reach."""

_PITCH = 1.0 / np.sqrt(2.0)
"""Of the grid, in correlation lengths."""


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
        first, heights, bumps = bumps_of(self.camera, self.place)
        found = spread(np.ascontiguousarray(gradients), first, heights, self.gain, bumps)
        return found.reshape(len(found), -1)

    def moved(self, gradients: Float) -> Float:
        """Return the covariances (k, N, 3) of all coordinates with values of these gradients."""
        first, heights, bumps = bumps_of(self.camera, self.place)
        # Most rows of an element are zero: a sphere has no direction.
        live = np.any(gradients, axis=(1, 2))
        found = np.zeros(gradients.shape)
        numbers = spread(gradients[live], first, heights, self.gain, bumps)
        found[live] = gather(numbers, first, heights, self.gain)
        return found

    def blocks(self) -> Float:
        """Return the covariance (N, 3, 3), mm^2, of each point."""
        return blocks(self.camera, self.place, self.gain)

    def drawing(self) -> tuple[int, Callable[[Float], Float]]:
        """Return the number f of bumps, and moves (m, N, 3), mm, by m sets of normal numbers.

        The function takes them as (m, 2, f), one per bump and axis.
        """
        first, heights, bumps = bumps_of(self.camera, self.place)
        return bumps, lambda normal: gather(normal, first, heights, self.gain)


def joined_fields(parts: Sequence[PatternField]) -> PatternField:
    """Return the fields of several, concatenated; at least one."""
    most = max(part.camera.shape[1] for part in parts)
    return PatternField(
        *map(np.concatenate, zip(*(_widened(part, most) for part in parts), strict=True))
    )


def _widened(field: PatternField, spots: int) -> tuple[Int, Float, Float]:
    """Return camera, place and gain of a field with so many spots a point."""
    seen = np.arange(spots) < field.camera.shape[1]
    if seen.all():
        return field.camera, field.place, field.gain
    # A missing spot takes the place of the first, with zero gain.
    chosen = np.where(seen, np.arange(spots), 0)
    gain = field.gain.take(chosen, axis=1) * seen[:, None, None]
    return field.camera.take(chosen, axis=1), field.place.take(chosen, axis=1), gain


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
