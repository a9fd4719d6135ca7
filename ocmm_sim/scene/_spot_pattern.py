"""Fixed pattern of a sensor: position-dependent spot errors, equal in all frames."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.camera import SpotNoise
from ocmm_core.geometry import Float

_WAVES = 256
_FEW = 32
_NODES_PER_LENGTH = 5.0
"""Bilinear interpolation between nodes at a fifth of the length takes 1 % off the variance."""


@dataclass(frozen=True, slots=True)
class SpotPattern:
    """A smooth random field on the sensor, one per image axis."""

    nodes: Float
    """(2, rows, columns), px: error in u and in v at the nodes."""
    step_px: float
    """Distance of the nodes; the first lies at pixel (0, 0)."""


def draw_pattern(
    noise: SpotNoise, width: int, height: int, rng: np.random.Generator
) -> SpotPattern:
    """Return a Gaussian field with standard deviation and correlation of `noise`.

    The correlation at distance d is ``exp(-d^2 / (2 l^2))``. The field is a sum of cosine waves
    with normally distributed wave vectors (random Fourier features, Rahimi and Recht 2007); the
    addition theorem turns each wave into products of a row and a column.
    """
    step = noise.pattern_length_px / _NODES_PER_LENGTH
    columns, rows = int(width / step) + 2, int(height / step) + 2
    nodes = np.empty((2, rows, columns))
    for axis in range(2):
        wave = rng.standard_normal((2, _WAVES)) / noise.pattern_length_px
        phase = rng.uniform(0.0, 2.0 * np.pi, _WAVES)
        cos_u, sin_u = _waves(columns, step * wave[0], phase)
        cos_v, sin_v = _waves(rows, step * wave[1], np.zeros(_WAVES))
        nodes[axis] = cos_v @ cos_u.T - sin_v @ sin_u.T
    nodes *= noise.pattern_px * np.sqrt(2.0 / _WAVES)
    return SpotPattern(nodes, step)


def _waves(count: int, turn: Float, phase: Float) -> tuple[Float, Float]:
    """Return cosine and sine (count, w) of ``n turn + phase``, both (w,), rad.

    Addition theorem on every `_FEW`-th value and the first ones: these dominate the cost.
    """
    far = _FEW * np.arange(-(-count // _FEW))[:, None, None] * turn + phase
    near = np.arange(_FEW)[:, None] * turn
    cos_far, sin_far, cos_near, sin_near = np.cos(far), np.sin(far), np.cos(near), np.sin(near)
    cosine = (cos_far * cos_near - sin_far * sin_near).reshape(-1, len(turn))[:count]
    sine = (sin_far * cos_near + cos_far * sin_near).reshape(-1, len(turn))[:count]
    return cosine, sine


def no_pattern(width: int, height: int) -> SpotPattern:
    """Return the pattern of a perfect sensor."""
    return SpotPattern(np.zeros((2, 2, 2)), float(max(width, height)))
