"""Steadiness of an operator's hand that holds a probe at a surface.

The tip of a free instrument trembles by 0.038 mm RMS in space (Singh and Riviere, IEEE EMBS/BMES
2002, eye surgeons at work), at 8 to 12 Hz (Lakie et al., J. Physiol. 593 (2015) 4411), and wanders
by 0.049 mm RMS in all, mostly below 2 Hz (Riviere, Rader and Khosla, IEEE EMBS 1997, eye surgeons
holding still). Here this is the grip, 150 mm from a ball of 6 mm that rests on a surface. The
surface holds the ball; turned by the grip it rolls by its radius, 3/150 of that motion. The stylus
also bends under the trembling force, so the tremor is assumed four times greater.
"""

from __future__ import annotations

import numpy as np

from ocmm_core.geometry import Float

TREMOR_HZ, WANDER_HZ = (8.0, 12.0), (0.3, 2.0)
TREMOR_MM, WANDER_MM = 0.002, 0.0006
"""Standard deviations of the ball along each axis."""

TREMOR_RAD, WANDER_RAD = 1.5e-4, 1.9e-4
"""Standard deviations of the probe about each axis."""

_WAVES = 4


def steady_hand(times_s: Float, rng: np.random.Generator) -> tuple[Float, Float]:
    """Return ball displacements (n, 3), mm, and probe rotation vectors (n, 3), rad.

    Sums of sines at the times (n,), s; zero mean over all hands.
    """
    tremor, wander = _swing(times_s, TREMOR_HZ, rng), _swing(times_s, WANDER_HZ, rng)
    turn, roll = _swing(times_s, TREMOR_HZ, rng), _swing(times_s, WANDER_HZ, rng)
    return TREMOR_MM * tremor + WANDER_MM * wander, TREMOR_RAD * turn + WANDER_RAD * roll


def _swing(times_s: Float, band_hz: tuple[float, float], rng: np.random.Generator) -> Float:
    """Return sums of waves (n, 3) with a standard deviation of 1."""
    frequency = rng.uniform(*band_hz, (_WAVES, 3))
    phase = rng.uniform(0.0, 2.0 * np.pi, (_WAVES, 3))
    waves = np.sin(2.0 * np.pi * frequency * times_s[:, None, None] + phase)
    swing: Float = np.sqrt(2.0 / _WAVES) * waves.sum(axis=1)
    return swing
