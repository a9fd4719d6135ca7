"""Pictures of spots for the tests of the camera, made without the virtual sensor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from ocmm_core.geometry import Float

DARK_LEVEL = 500.0
READ_NOISE = 40.0
LIGHT = 8400.0
"""Electrons of an LED at the camera's default exposure; one electron is one count."""


def spot(
    u: float,
    v: float,
    shape: tuple[int, int],
    light: float = LIGHT,
    sigma: tuple[float, float] = (1.0, 1.0),
) -> Float:
    """Return the mean counts of one spot (rows, columns), integrated over the pixels."""
    rows, columns = shape
    across = np.diff(ndtr((np.arange(columns + 1) - 0.5 - u) / sigma[0]))
    down = np.diff(ndtr((np.arange(rows + 1) - 0.5 - v) / sigma[1]))
    return np.asarray(light * np.outer(down, across))


def picture(light: Float, rng: np.random.Generator) -> NDArray[np.uint16]:
    """Return the counts of a picture with read and shot noise, clipped at 14 bits."""
    scatter = np.sqrt(READ_NOISE**2 + light) * rng.standard_normal(light.shape)
    return np.clip(np.round(DARK_LEVEL + light + scatter), 0, 16383).astype(np.uint16)
