"""Attitude of the probe in the operator's hand, and a steady hand with its ball on a surface.

The tip of a free instrument trembles by 0.038 mm RMS in space (Singh and Riviere, IEEE EMBS/BMES
2002, eye surgeons at work), at 8 to 12 Hz (Lakie et al., J. Physiol. 593 (2015) 4411), and wanders
by 0.049 mm RMS in all, mostly below 2 Hz (Riviere, Rader and Khosla, IEEE EMBS 1997, eye surgeons
holding still). Here this is the grip, 150 mm from a ball of 6 mm that rests on a surface. The
surface holds the ball; turned by the grip it rolls by its radius, 3/150 of that motion. The stylus
also bends under the trembling force, so the tremor is assumed four times greater.
"""

from __future__ import annotations

import numpy as np

from ocmm_core.geometry import Float, rotation_from_vector

_MAX_TILT = np.radians(38.0)
_MAX_BACKWARD = np.radians(26.0)
"""Leaning back turns the LEDs up and away from the cameras."""
_LEAN_GAIN = 0.32
"""Fraction of the outward normal's angle from the vertical that the handle follows."""


def attitude_at(normal_world: Float, lean: Float, yaw: float, *, bore: bool) -> Float:
    """Return the attitude of the probe as a rotation vector (3,), rad.

    The handle leans towards the outward normal, so that the stylus stays clear of the material,
    within the limit at which the LEDs turn away from the cameras; in a bore it stays near the axis.
    """
    if not bore:
        level = float(np.hypot(normal_world[0], normal_world[1]))
        angle = float(np.arctan2(level, normal_world[2]))
        if level > 1e-9:
            lean = lean + _LEAN_GAIN * angle * normal_world[:2] / level
    lean = np.array([lean[0], min(lean[1], _MAX_BACKWARD)])
    lean *= min(1.0, _MAX_TILT / max(float(np.linalg.norm(lean)), 1e-9))
    rotation = rotation_from_vector(np.array([-lean[1], lean[0], 0.0])) @ rotation_from_vector(
        np.array([0.0, 0.0, yaw])
    )
    return rotation_vector(rotation)


def rotation_vector(rotation: Float) -> Float:
    """Return the rotation vector (3,), rad, of a rotation (3, 3) below half a turn."""
    axis = 0.5 * np.array(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    sine = float(np.linalg.norm(axis))
    angle = float(np.arctan2(sine, 0.5 * (np.trace(rotation) - 1.0)))
    vector: Float = axis * (angle / sine if sine > 1e-12 else 1.0)
    return vector


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
