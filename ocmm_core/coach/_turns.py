"""The possible turns of the probe about the resting ball, and their names."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from ocmm_core.coach._stance import Stance
from ocmm_core.geometry import Float, rotation_from_vector

STEPS_DEG = (10, 15, 20, 30, 45)
"""A hand is no finer than the first, and seldom exceeds the last at once."""


class Way(Enum):
    """Direction of a turn for the inspector: of the LEDs or the top of the probe."""

    TURN_LEFT = "turn_left"
    TURN_RIGHT = "turn_right"
    LEAN_LEFT = "lean_left"
    LEAN_RIGHT = "lean_right"
    TILT_TOWARDS = "tilt_towards"
    TILT_AWAY = "tilt_away"


@dataclass(frozen=True, slots=True)
class Turn:
    """One turn about the ball."""

    way: Way
    degrees: int

    def rotation_world(self, stance: Stance) -> Float:
        """Return the rotation (3, 3) of the world about the ball."""
        # A positive turn about up moves what faces away to the left (up x away = -right). The top
        # goes left about -away (-away x up = -right), and towards him about right (right x up =
        # -away).
        axes = {
            Way.TURN_LEFT: stance.up,
            Way.TURN_RIGHT: -stance.up,
            Way.LEAN_LEFT: -stance.away,
            Way.LEAN_RIGHT: stance.away,
            Way.TILT_TOWARDS: stance.right,
            Way.TILT_AWAY: -stance.right,
        }
        return rotation_from_vector(np.radians(self.degrees) * axes[self.way])

    @property
    def words(self) -> str:
        """Return the instruction for the hand."""
        if self.way is Way.TURN_LEFT:
            return f"Turn {self.degrees}° left"
        if self.way is Way.TURN_RIGHT:
            return f"Turn {self.degrees}° right"
        if self.way is Way.LEAN_LEFT:
            return f"Lean {self.degrees}° left"
        if self.way is Way.LEAN_RIGHT:
            return f"Lean {self.degrees}° right"
        if self.way is Way.TILT_TOWARDS:
            return f"Tilt {self.degrees}° towards you"
        return f"Tilt {self.degrees}° away from you"


TURNS = tuple(Turn(way, degrees) for way in Way for degrees in STEPS_DEG)

_OPPOSITE = (
    {Way.TURN_LEFT, Way.TURN_RIGHT}, {Way.LEAN_LEFT, Way.LEAN_RIGHT},
    {Way.TILT_TOWARDS, Way.TILT_AWAY},
)  # fmt: skip
PAIRS = tuple(
    (Turn(one, first), Turn(other, second))
    for place, one in enumerate(Way)
    for other in tuple(Way)[place + 1 :]
    if {one, other} not in _OPPOSITE
    for first in (15, 30)
    for second in (15, 30)
)
"""Tried if no single turn suffices; in order."""
