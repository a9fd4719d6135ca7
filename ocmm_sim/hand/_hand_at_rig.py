"""Probe of the virtual rig in the user's hand or the robot's."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field

import numpy as np

from ocmm_core.geometry import Float
from ocmm_core.part_model import PlacedPart
from ocmm_sim.hand import _led_hand as led_hand
from ocmm_sim.scene import SimulatedSource, VirtualRig

_MOST_RAD = np.radians(60.0)


@dataclass(frozen=True, slots=True)
class LedView:
    """How the probe is held."""

    taken: bool = False
    """The user leads it, not the robot."""
    hand: led_hand.HandView = field(default_factory=led_hand.HandView)
    clear_mm: float = led_hand.CLEAR_MM
    turn: tuple[float, float] = (0.0, 0.0)
    """(2,), rad: lean to the right and back."""


class HandAtRig:
    """Take the probe from the robot, lead it, and return it; a thread-safe source of frames."""

    def __init__(self, source: SimulatedSource, rig: VirtualRig) -> None:
        self._source, self._rig = source, rig
        self._lock = threading.RLock()
        self._hand: led_hand.MouseHand | None = None
        self._taken = False
        self._clear, self._turn = led_hand.CLEAR_MM, np.zeros(2)
        self._ray: tuple[Float, Float] | None = None

    @property
    def taken(self) -> bool:
        """Return whether the user holds the probe."""
        return self._taken

    def take_over(self) -> None:
        """Take over the probe in place; InputError if the part has no shape."""
        with self._lock:
            if self._taken:
                return
            hand = self._led()
            self._clear, self._turn, self._ray = led_hand.CLEAR_MM, np.zeros(2), None
            self._source.take_over(hand)
            self._taken = True

    def hand_back(self) -> None:
        """Return the probe to the robot, which measures the missing points."""
        with self._lock:
            if self._taken:
                self._source.hand_back()
                self._taken = False

    def point_at(self, origin_world: Float, toward_world: Float) -> None:
        """Lead the ball over the surface along a ray: (3,), mm, and (3,), unit."""
        with self._lock:
            self._ray = (np.array(origin_world), np.array(toward_world))
            self._lead()

    def nearer(self, step_mm: float) -> None:
        """Lead the ball nearer to the surface; below zero it is pressed on."""
        with self._lock:
            self._clear = float(
                np.clip(self._clear - step_mm, led_hand.NEAREST_MM, led_hand.FARTHEST_MM)
            )
            self._lead()

    def lean(self, right_rad: float, back_rad: float) -> None:
        """Lean the probe to the right and back, in addition to the surface's attitude."""
        with self._lock:
            turn = self._turn + np.array([right_rad, back_rad])
            self._turn = np.clip(turn, -_MOST_RAD, _MOST_RAD)
            self._lead()

    def touch_at(self, origin_world: Float, toward_world: Float) -> bool:
        """Touch the surface along a ray once, with the button; return whether it started."""
        with self._lock:
            if not self._taken or self._hand is None:
                return False
            self._clear = led_hand.CLEAR_MM
            self._ray = (np.array(origin_world), np.array(toward_world))
            return self._hand.touch(self._wish(self._hand))

    def touch_place(self, surface_world: Float, normal_world: Float) -> None:
        """Let the robot touch once at a place (3,), mm, with a normal (3,), unit, on no part."""
        self._source.touch(surface_world, normal_world)

    def touch_part(self) -> None:
        """Let the robot touch every feature of the part once."""
        self._source.extend([(one.name, 1) for one in self._rig.part.artefacts])

    def stop(self) -> None:
        """Let the robot drop the touches that are not finished."""
        self._source.interrupt()

    def press(self) -> None:
        """Press the button of the probe at the current place."""
        with self._lock:
            if self._taken and self._hand is not None:
                self._hand.press()

    def view(self) -> LedView:
        with self._lock:
            hand = self._hand
            seen = hand.view() if self._taken and hand is not None else led_hand.HandView()
            turn = (float(self._turn[0]), float(self._turn[1]))
            return LedView(self._taken, seen, self._clear, turn)

    def part(self) -> PlacedPart:
        """Return the part and its pose; InputError as `take_over`."""
        with self._lock:
            return self._led().part()

    def _led(self) -> led_hand.MouseHand:
        if self._hand is None:
            self._hand = led_hand.MouseHand(self._rig)
        return self._hand

    def _lead(self) -> None:
        if self._taken and self._hand is not None:
            self._hand.lead(self._wish(self._hand))

    def _wish(self, hand: led_hand.MouseHand) -> led_hand.HandTarget:
        if self._ray is None:
            # No mouse movement since take-over.
            return hand.wish_here(self._turn)
        return hand.wish_at(*self._ray, self._clear, self._turn)
