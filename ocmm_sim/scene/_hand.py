"""The operator's hand: attitude of the probe, and segments of its motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.geometry import Float, rotation_from_vector
from ocmm_sim.scene import _kernels as kernels

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


_APPROACH_S, _RETRACT_S = 0.25, 0.18
_SPEED_MM_S = 220.0
_TRAVEL_MIN_S, _TRAVEL_MAX_S = 0.35, 1.6
_PRESS_S = 0.1


@dataclass(frozen=True, slots=True)
class ScriptedTouch:
    """True course of one touch."""

    feature: str
    contact_s: float
    settled_s: float
    retract_s: float
    """`contact_s`, `settled_s`, `retract_s`: first contact, start and end of the ball's rest."""
    surface_world: Float
    """(3,), mm: the point that is touched."""
    normal_world: Float
    """(3,), unit: from the material towards the ball."""
    tip_world: Float
    """(3,), mm: ball centre at rest."""


class ScriptWriter:
    """Append segments from a place (3,), mm, on; touches dwell for ``dwell_s``."""

    def __init__(
        self, place: Float, start_s: float, dwell_s: float, attitude: Float | None = None
    ) -> None:
        self.segments: list[Float] = []
        self.touches: list[ScriptedTouch] = []
        self._time = start_s
        self._place = place
        self._attitude = np.zeros(3) if attitude is None else attitude
        self._sway = 0.0
        self._dwell_s = dwell_s

    def follow(self, last: Float) -> None:
        """Start from the end of a segment."""
        self._place, self._sway = last[kernels.P1 : kernels.P1 + 3], float(last[kernels.SWAY1])
        self._attitude = last[kernels.W1 : kernels.W1 + 3]

    def rest(self, duration_s: float) -> None:
        self._append(duration_s, kernels.REST, self._place, self._attitude, self._sway)

    def travel(self, place: Float, attitude: Float, top_z: float, sway: float) -> None:
        way = float(np.linalg.norm(place - self._place))
        if np.isfinite(top_z):
            way += abs(top_z - self._place[2]) + abs(top_z - place[2])
        duration = float(np.clip(0.2 + way / _SPEED_MM_S, _TRAVEL_MIN_S, _TRAVEL_MAX_S))
        self._append(duration, kernels.MOVE, place, attitude, sway, top_z)

    def touch(self, feature: str, surface: Float, normal: Float, tip: Float) -> None:
        self._append(_APPROACH_S, kernels.MOVE, tip, self._attitude, 0.0)
        contact = self._time
        self._append(self._dwell_s, kernels.TOUCH, tip, self._attitude, 0.0, normal=normal)
        self.touches.append(
            ScriptedTouch(
                feature, contact, contact + kernels.SETTLE_S, self._time, surface, normal, tip
            )
        )

    def slide(
        self, feature: str, tips: Float, normal: Float, radius: float, seconds: Float
    ) -> None:
        """Press, slide along ball centres (n, 3), mm, and rest; ``normal`` is that at the start."""
        self._append(_APPROACH_S, kernels.MOVE, tips[0], self._attitude, 0.0)
        contact = self._time
        self.rest(_PRESS_S)
        settled = self._time
        for tip, duration in zip(tips, seconds, strict=True):
            self._append(float(duration), kernels.SLIDE, tip, self._attitude, 0.0)
        end = self._time
        self.rest(_PRESS_S)
        self.touches.append(
            ScriptedTouch(
                feature, contact, settled, end, tips[0] - radius * normal, normal, tips[0]
            )
        )

    def retract(self, place: Float) -> None:
        self._append(_RETRACT_S, kernels.MOVE, place, self._attitude, 1.0)

    def _append(
        self,
        duration_s: float,
        kind: int,
        place: Float,
        attitude: Float,
        sway: float,
        top_z: float = np.nan,
        normal: Float | None = None,
    ) -> None:
        segment = segment_of(
            self._time, duration_s, kind, self._place, place, self._attitude, attitude
        )
        segment[kernels.TOP] = top_z
        segment[kernels.SWAY0], segment[kernels.SWAY1] = self._sway, sway
        if normal is not None:
            segment[kernels.NORMAL : kernels.NORMAL + 3] = normal
        self.segments.append(segment)
        self._time += duration_s
        self._place, self._attitude, self._sway = place, attitude, sway


def segment_of(
    start_s: float, duration_s: float, kind: int, begin: Float, end: Float, w0: Float, w1: Float
) -> Float:
    """Return a segment between places (3,), mm, and rotation vectors (3,), rad."""
    segment = np.zeros(kernels.N_COLUMNS)
    segment[kernels.T0], segment[kernels.T1] = start_s, start_s + duration_s
    segment[kernels.KIND], segment[kernels.TOP] = kind, np.nan
    segment[kernels.P0 : kernels.P0 + 3], segment[kernels.P1 : kernels.P1 + 3] = begin, end
    segment[kernels.W0 : kernels.W0 + 3], segment[kernels.W1 : kernels.W1 + 3] = w0, w1
    return segment
