"""Attitude of the probe in the operator's hand at a touch."""

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
