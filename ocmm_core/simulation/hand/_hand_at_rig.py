"""The probe of the virtual rig in the hands of whoever sits before the screen, or of the robot."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field

import numpy as np

from ocmm_core.geometry import Float
from ocmm_core.part_model import PlacedPart
from ocmm_core.simulation.hand._led_hand import (
    CLEAR_MM,
    FARTHEST_MM,
    NEAREST_MM,
    HandView,
    MouseHand,
    Wish,
)
from ocmm_core.simulation.scene import SimulatedSource, VirtualRig

_MOST_RAD = np.radians(60.0)


@dataclass(frozen=True, slots=True)
class LedView:
    """How the probe is held."""

    taken: bool = False
    """Somebody leads it; else the robot hand does."""
    hand: HandView = field(default_factory=HandView)
    """What the hand does then."""
    clear_mm: float = CLEAR_MM
    """How far from the surface it is led."""
    turn: tuple[float, float] = (0.0, 0.0)
    """(2,), rad: how it is leaned to the right and back."""


class HandAtRig:
    """Take the probe over from the robot hand, lead it, and hand it back; for any thread.

    What comes of it is frames of the cameras, as of any other motion.
    """

    def __init__(self, source: SimulatedSource, rig: VirtualRig) -> None:
        self._source, self._rig = source, rig
        self._lock = threading.RLock()
        self._hand: MouseHand | None = None
        self._taken = False
        self._clear, self._turn = CLEAR_MM, np.zeros(2)
        self._ray: tuple[Float, Float] | None = None

    @property
    def taken(self) -> bool:
        """Return whether somebody else than the robot holds the probe."""
        return self._taken

    def take_over(self) -> None:
        """Take the probe where it is; it holds still until it is led.

        Raises
        ------
        InputError
            The part is known at places only, so that nothing would keep the ball out of it.
        """
        with self._lock:
            if self._taken:
                return
            hand = self._led()
            self._clear, self._turn, self._ray = CLEAR_MM, np.zeros(2), None
            self._source.take_over(hand)
            self._taken = True

    def hand_back(self) -> None:
        """Give the probe to the robot hand, which measures what is missing."""
        with self._lock:
            if self._taken:
                self._source.hand_back()
                self._taken = False

    def point_at(self, origin_world: Float, toward_world: Float) -> None:
        """Lead the ball over what is seen along a ray (3,), mm, and (3,), unit."""
        with self._lock:
            self._ray = (np.array(origin_world), np.array(toward_world))
            self._lead()

    def nearer(self, step_mm: float) -> None:
        """Lead the ball so much nearer to the surface; below zero it is pressed on."""
        with self._lock:
            self._clear = float(np.clip(self._clear - step_mm, NEAREST_MM, FARTHEST_MM))
            self._lead()

    def lean(self, right_rad: float, back_rad: float) -> None:
        """Lean the probe to the right and back, beside what the surface needs."""
        with self._lock:
            turn = self._turn + np.array([right_rad, back_rad])
            self._turn = np.clip(turn, -_MOST_RAD, _MOST_RAD)
            self._lead()

    def touch_at(self, origin_world: Float, toward_world: Float) -> bool:
        """Touch what is seen along a ray once, with the button; return whether it is begun."""
        with self._lock:
            if not self._taken or self._hand is None:
                return False
            self._clear = CLEAR_MM
            self._ray = (np.array(origin_world), np.array(toward_world))
            return self._hand.touch(self._wish(self._hand))

    def press(self) -> None:
        """Press the button of the probe where the ball is now."""
        with self._lock:
            if self._taken and self._hand is not None:
                self._hand.press()

    def view(self) -> LedView:
        """Return how the probe is held."""
        with self._lock:
            hand = self._hand
            seen = hand.view() if self._taken and hand is not None else HandView()
            turn = (float(self._turn[0]), float(self._turn[1]))
            return LedView(self._taken, seen, self._clear, turn)

    def part(self) -> PlacedPart:
        """Return what is touched, where it is; InputError as `take_over`."""
        with self._lock:
            return self._led().part()

    def _led(self) -> MouseHand:
        if self._hand is None:
            self._hand = MouseHand(self._rig)
        return self._hand

    def _lead(self) -> None:
        if self._taken and self._hand is not None:
            self._hand.lead(self._wish(self._hand))

    def _wish(self, hand: MouseHand) -> Wish:
        if self._ray is None:
            # The mouse has not moved since it was taken over.
            return hand.wish_here(self._turn)
        return hand.wish_at(*self._ray, self._clear, self._turn)
