"""Segments of the operator's motion, one after the other, and the true course of each touch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.geometry import Float
from ocmm_sim.scene import _kernels as kernels

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
        segment = segment_of(self._time, duration_s, kind, self._place, place)
        segment[kernels.TOP] = top_z
        segment[kernels.SWAY0], segment[kernels.SWAY1] = self._sway, sway
        segment[kernels.W0 : kernels.W0 + 3] = self._attitude
        segment[kernels.W1 : kernels.W1 + 3] = attitude
        if normal is not None:
            segment[kernels.NORMAL : kernels.NORMAL + 3] = normal
        self.segments.append(segment)
        self._time += duration_s
        self._place, self._attitude, self._sway = place, attitude, sway


def segment_of(start_s: float, duration_s: float, kind: int, begin: Float, end: Float) -> Float:
    segment = np.zeros(kernels.N_COLUMNS)
    segment[kernels.T0], segment[kernels.T1] = start_s, start_s + duration_s
    segment[kernels.KIND] = kind
    segment[kernels.TOP] = np.nan
    segment[kernels.P0 : kernels.P0 + 3] = begin
    segment[kernels.P1 : kernels.P1 + 3] = end
    return segment
