"""The fixed pattern of a sensor: how far spots are off at each place, the same in every frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.camera import SpotNoise
from ocmm_core.geometry import Float

_WAVES = 256
_NODES_PER_LENGTH = 5.0
"""Bilinear interpolation between nodes at a fifth of the length takes 1 % off the variance."""


@dataclass(frozen=True, slots=True)
class SpotPattern:
    """A smooth random field on the sensor, one for each image axis.

    Attributes
    ----------
    nodes
        (2, rows, columns), px: error in u and in v at the nodes.
    step_px
        Distance of the nodes; the first lies at pixel (0, 0).
    """

    nodes: Float
    step_px: float


def draw_pattern(
    noise: SpotNoise, width: int, height: int, rng: np.random.Generator
) -> SpotPattern:
    """Return a Gaussian field with the standard deviation and the correlation of ``noise``.

    The correlation at distance d is ``exp(-d^2 / (2 l^2))``. The field is a sum of cosine waves
    with normally distributed wave vectors (random Fourier features, Rahimi and Recht 2007); the
    addition theorem turns each wave into products of a row and a column.
    """
    step = noise.pattern_length_px / _NODES_PER_LENGTH
    u = step * np.arange(int(width / step) + 2)
    v = step * np.arange(int(height / step) + 2)
    nodes = np.empty((2, len(v), len(u)))
    for axis in range(2):
        wave = rng.standard_normal((2, _WAVES)) / noise.pattern_length_px
        phase = rng.uniform(0.0, 2.0 * np.pi, _WAVES)
        along_u = u[:, None] * wave[0] + phase
        along_v = v[:, None] * wave[1]
        nodes[axis] = np.cos(along_v) @ np.cos(along_u).T - np.sin(along_v) @ np.sin(along_u).T
    nodes *= noise.pattern_px * np.sqrt(2.0 / _WAVES)
    return SpotPattern(nodes, step)


def no_pattern(width: int, height: int) -> SpotPattern:
    """Return the pattern of a perfect sensor."""
    return SpotPattern(np.zeros((2, 2, 2)), float(max(width, height)))
