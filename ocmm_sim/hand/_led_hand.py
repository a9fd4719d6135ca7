"""Hand led from outside: targets are external, the motion is its own.

It is as fast as a human arm, trembles like the operator's, stops at the part, and presses the
button. Its frames are processed as any others. Motion is reproducible for equal targets and block
lengths; without targets it holds still.
"""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass, replace
from enum import Enum, auto

import numpy as np

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, rotation_from_vector
from ocmm_core.part_model import PartModel, PlacedPart
from ocmm_sim.hand import _kernel as kernel
from ocmm_sim.hand._shape_mesh import part_mesh
from ocmm_sim.hand._solids import Solid, Solids, solids_of
from ocmm_sim.scene import Motion, VirtualRig, attitude_at, draw_tremor, rotation_vector

MOST_LETTERS = 64
"""Maximum queued targets; older ones are dropped, as the latest counts."""

CLEAR_MM, NEAREST_MM, FARTHEST_MM = 12.0, -1.2, 60.0
"""Distances of the ball from the surface, mm; negative presses it on."""

TRAVEL_MM_S, APPROACH_MM_S = 320.0, 60.0
"""The virtual operator travels at 220 mm/s on average; touches are slow."""

_PRESS_MM = 1.0
_MOST_TILT = np.radians(65.0)
_TURN_RAD_S, _TURN_RATE = 2.5, 10.0
"""Wrist: maximum turning speed, and approach rate, 1/s."""
_AT_MM, _AT_MM_S, _TURNED_RAD = 0.15, 4.0, 0.05
_SETTLE_S, _DOWN_S, _HOLD_S = 0.16, 0.05, 0.34
"""On the surface before the button, pressed, and held after it: a window is 0.25 s."""
_GIVE_UP_S = 4.0
_FREE_SHARE = 0.5
_SWAY_MM = 4.0
"""Farther from the part than this the hand sways freely."""
_STREAM = 77
_REACH_MM = 3000.0
_OVER_MM = 14.0


@dataclass(frozen=True, slots=True)
class HandTarget:
    """A target of the ball, queued for the hand."""

    contact_part: Float
    normal_part: Float
    """`contact_part`, `normal_part`: (3,), mm and unit, part frame: ball centre in contact, and the
    way out; the normal is zero off the part, where the ball moves to ``contact_part`` itself."""
    clear_mm: float
    """Distance from there along the normal."""
    turn: Float
    """(2,), rad: lean to the right and back, in addition to the surface's attitude."""


@dataclass(frozen=True, slots=True)
class HandView:
    """State of the hand."""

    busy: bool = False
    """A requested touch is in progress."""
    touches: bool = False
    aim_world: Float | None = None
    normal_world: Float | None = None
    """`aim_world`, `normal_world`: (3,), mm, unit: target on the part and way out; None off it."""
    forgotten: int = 0
    """Dropped targets."""


class _Phase(Enum):
    FOLLOW = auto()
    GO = auto()
    APPROACH = auto()
    SETTLE = auto()
    DOWN = auto()
    HOLD = auto()
    LIFT = auto()


class MouseHand:
    """A `LedHand` over the part of a virtual rig; InputError if it has no shape.

    Thread-safe: one thread may lead it while another reads its motion.
    """

    def __init__(self, rig: VirtualRig) -> None:
        solids = solids_of(rig.part)
        if solids is None:
            raise InputError(
                "simulation.no_solids",
                f"The virtual part '{rig.part.name}' is known at single places only.",
                "Open the Demo to touch a part yourself.",
            )
        self._solids: Solids = solids
        self._pose = rig.part.T_world_from_part
        self._radius = rig.tip_radius
        self._period_s = rig.frame_period_ns * 1e-9
        self._lock = threading.Lock()
        self._letters: deque[HandTarget] = deque(maxlen=MOST_LETTERS)
        self._touch: HandTarget | None = None
        self._presses = 0
        self._forgotten = 0
        self._wish: HandTarget | None = None
        self._wanted: tuple[HandTarget, Float] | None = None
        self._state = np.zeros(kernel.N_STATE)
        self._attitude = np.zeros(3)
        self._phase, self._since_s, self._button_s = _Phase.FOLLOW, 0.0, 0.0
        self._mesh: PartModel | None = None
        self._name = rig.part.name
        self._over = max(map(_top, solids.items)) + self._radius + _OVER_MM
        self._waves = draw_tremor(np.random.default_rng([rig.seed, _STREAM]))

    # Calls of the leader.

    def wish_at(self, origin_world: Float, toward_world: Float, clear_mm: float, turn: Float) -> (
        HandTarget
    ):  # fmt: skip
        """Return the target on the surface seen along a ray, (3,) mm and unit."""
        inverse = self._pose.inverse()
        start = inverse.apply(origin_world)
        toward = np.ascontiguousarray(inverse.rotation @ toward_world)
        place, normal = np.empty(3), np.empty(3)
        if self._march(start, toward, _REACH_MM, place, normal) < _REACH_MM:
            clear = clear_mm
            if clear > 0.0:
                # In a bore it keeps clear of the opposite side.
                free = self._march(place + 1e-3 * normal, normal, 2.0 * clear, np.empty(3),
                                   np.empty(3))  # fmt: skip
                clear = min(clear, _FREE_SHARE * free)
            return HandTarget(place, normal, clear, turn)
        # Off the part: in the plane through the ball, perpendicular to the view.
        along = float((self._ball_part() - start) @ toward)
        return HandTarget(start + along * toward, np.zeros(3), 0.0, turn)

    def wish_here(self, turn: Float) -> HandTarget:
        """Return the target that holds the ball in place, leaned by `turn` (see `HandTarget`)."""
        return HandTarget(self._ball_part(), np.zeros(3), 0.0, turn)

    def lead(self, wish: HandTarget) -> None:
        """Queue a target; drop the oldest if full."""
        with self._lock:
            self._forgotten += len(self._letters) == MOST_LETTERS
            self._letters.append(wish)

    def touch(self, wish: HandTarget) -> bool:
        """Touch once: travel, approach, rest, press the button, lift.

        One more may be queued during a touch; False for a third, and off the part.
        """
        with self._lock:
            if self._touch is not None or not np.any(wish.normal_part):
                return False
            self._touch = replace(wish, clear_mm=max(wish.clear_mm, min(CLEAR_MM, 3.0)))
            return True

    def press(self) -> None:
        """Press the button of the probe at the current place."""
        with self._lock:
            self._presses = 1

    def view(self) -> HandView:
        with self._lock:
            wish, aim, normal = self._wish, None, None
            if wish is not None and np.any(wish.normal_part):
                aim = self._pose.apply(wish.contact_part - self._radius * wish.normal_part)
                normal = self._pose.rotation @ wish.normal_part
            busy = self._phase is not _Phase.FOLLOW or self._touch is not None
            touches = bool(self._state[kernel.TOUCHES] > 0.0)
            return HandView(busy, touches, aim, normal, self._forgotten)

    def part(self) -> PlacedPart:
        """Return the part and its pose."""
        if self._mesh is None:
            self._mesh = part_mesh(self._name, self._solids)
        return PlacedPart(self._mesh, self._pose, is_rough=False)

    # Interface `LedHand`.

    def pick_up(self, tip_world: Float, attitude: Float) -> None:
        """Take the probe at its current pose, and hold it."""
        with self._lock:
            self._letters.clear()
            self._touch, self._wish, self._presses = None, None, 0
            self._state[:] = 0.0
            self._state[kernel.PLACE : kernel.PLACE + 3] = self._pose.inverse().apply(tip_world)
            self._attitude = np.array(attitude)
            self._phase, self._since_s, self._button_s = _Phase.FOLLOW, 0.0, 0.0

    def place(self) -> tuple[Float, Float]:
        with self._lock:
            place = self._state[kernel.PLACE : kernel.PLACE + 3]
            return self._pose.apply(place), self._attitude.copy()

    def motion(self, times_s: Float) -> Motion:
        """Advance by the frames at the times (n,), s, towards the current target."""
        count = len(times_s)
        with self._lock:
            self._read_letters()
            aim, speed, attitude = self._decide(count * self._period_s)
            tips, gaps = np.empty((count, 3)), np.empty(count)
            contact = np.empty(count, dtype=np.bool_)
            kernel.drive(
                self._state, aim, speed, self._radius, self._period_s, self._solids.rows,
                self._solids.holes, tips, gaps, contact,
            )  # fmt: skip
            turns = self._turned(attitude, count)
            button = np.arange(count) * self._period_s < self._button_s
            self._button_s = max(self._button_s - count * self._period_s, 0.0)
        angles = self._waves[..., 1] * times_s[:, None, None, None] + self._waves[..., 2]
        waves = (self._waves[..., 0] * np.sin(angles)).sum(axis=-1)
        # The part holds a touching ball; near it the hand is guided.
        share = np.clip(gaps / _SWAY_MM, 0.0, 1.0)[:, None]
        tip_world = self._pose.apply(tips) + share * waves[:, 1]
        return Motion(_rotations(turns + waves[:, 0]), tip_world, button, contact)

    def _ball_part(self) -> Float:
        with self._lock:
            return self._state[kernel.PLACE : kernel.PLACE + 3].copy()

    def _march(
        self, start: Float, toward: Float, reach: float, place: Float, normal: Float
    ) -> float:
        return float(kernel.march(
            np.ascontiguousarray(start), toward, self._radius, reach, self._solids.rows,
            self._solids.holes, place, normal,
        ))  # fmt: skip

    def _read_letters(self) -> None:
        if self._letters and self._phase is _Phase.FOLLOW:
            self._wish = self._letters[-1]
            self._letters.clear()
        if self._presses and self._button_s == 0.0:
            self._button_s, self._presses = _DOWN_S, 0
        if self._touch is not None and self._phase is _Phase.FOLLOW:
            self._wish, self._touch = self._touch, None
            self._enter(_Phase.GO)

    def _enter(self, phase: _Phase) -> None:
        self._phase, self._since_s = phase, 0.0

    def _decide(self, block_s: float) -> tuple[Float, float, Float]:
        """Return the next ball target, the speed limit and the attitude (3,), rad."""
        now = self._state[kernel.PLACE : kernel.PLACE + 3].copy()
        wish = self._wish
        if wish is None:
            return now, TRAVEL_MM_S, self._attitude
        self._since_s += block_s
        hover = wish.contact_part + wish.clear_mm * wish.normal_part
        attitude = self._wanted_attitude(wish)
        self._step(now, hover, attitude)
        pressed = wish.contact_part - _PRESS_MM * wish.normal_part
        if self._phase in (_Phase.APPROACH, _Phase.SETTLE, _Phase.DOWN, _Phase.HOLD):
            return pressed, APPROACH_MM_S, attitude
        if self._phase is _Phase.LIFT or wish.clear_mm < CLEAR_MM:
            near = float(np.linalg.norm(hover - now)) < 2.0 * CLEAR_MM
            if near:
                return hover, APPROACH_MM_S, attitude
        return self._way(now, hover), TRAVEL_MM_S, attitude

    def _step(self, now: Float, hover: Float, attitude: Float) -> None:
        phase, since = self._phase, self._since_s
        speed = float(np.linalg.norm(self._state[kernel.VELOCITY : kernel.VELOCITY + 3]))
        there = float(np.linalg.norm(hover - now)) < _AT_MM and speed < _AT_MM_S
        # The wrist turns before the ball comes near: the probe may be hidden meanwhile.
        turned = float(np.linalg.norm(attitude - self._attitude)) < _TURNED_RAD
        touches = self._state[kernel.TOUCHES] > 0.0
        if phase is _Phase.GO and ((there and turned) or since > _GIVE_UP_S):
            self._enter(_Phase.APPROACH if there else _Phase.FOLLOW)
        elif phase is _Phase.APPROACH and (touches or since > _GIVE_UP_S):
            self._enter(_Phase.SETTLE if touches else _Phase.LIFT)
        elif phase is _Phase.SETTLE and since >= _SETTLE_S:
            self._button_s = _DOWN_S
            self._enter(_Phase.DOWN)
        elif phase is _Phase.DOWN and since >= _DOWN_S:
            self._enter(_Phase.HOLD)
        elif phase is _Phase.HOLD and since >= _HOLD_S:
            self._enter(_Phase.LIFT)
        elif phase is _Phase.LIFT and (there or since > 0.5):
            self._enter(_Phase.FOLLOW)

    def _way(self, now: Float, hover: Float) -> Float:
        """Return the next waypoint: straight, or over the part if it is in the way."""
        if self._is_free(now, hover):
            return hover
        over = np.array([hover[0], hover[1], self._over])
        if now[2] < self._over - 1.0 and not self._is_free(now, over):
            return np.array([now[0], now[1], self._over])
        if float(np.hypot(*(now - over)[:2])) < 0.5:
            return hover
        return over

    def _is_free(self, start: Float, end: Float) -> bool:
        way = float(np.linalg.norm(end - start))
        if way < _AT_MM:
            return True
        toward = (end - start) / way
        place, normal = np.empty(3), np.empty(3)
        # Off the surface on which it may still rest.
        kernel.distance(np.ascontiguousarray(start), self._solids.rows, self._solids.holes, normal)
        return self._march(start + 0.01 * normal, toward, way, place, normal) >= way - 0.05

    def _wanted_attitude(self, wish: HandTarget) -> Float:
        # Cached for many blocks of frames: the part does not move.
        if self._wanted is None or self._wanted[0] is not wish:
            self._wanted = wish, self._attitude_of(wish)
        return self._wanted[1]

    def _attitude_of(self, wish: HandTarget) -> Float:
        normal = self._pose.rotation @ wish.normal_part
        if not np.any(normal):
            normal = np.array([0.0, 0.0, 1.0])
        level = float(np.hypot(normal[0], normal[1]))
        bore = wish.clear_mm < 0.95 * CLEAR_MM and level > 0.5
        base = rotation_from_vector(attitude_at(normal, np.zeros(2), 0.0, bore=bore))
        turn = wish.turn * min(1.0, _MOST_TILT / max(float(np.linalg.norm(wish.turn)), 1e-9))
        return rotation_vector(rotation_from_vector(np.array([-turn[1], turn[0], 0.0])) @ base)

    def _turned(self, wanted: Float, count: int) -> Float:
        """Return attitudes (n, 3) towards the wanted one, and store the last."""
        steps = np.arange(1, count + 1)[:, None] * self._period_s
        way = wanted - self._attitude
        size = float(np.linalg.norm(way))
        share = 1.0 - np.exp(-_TURN_RATE * steps)
        share = np.minimum(share, _TURN_RAD_S * steps / max(size, 1e-12))
        turns: Float = self._attitude + share * way
        self._attitude = turns[-1].copy()
        return turns


def _top(solid: Solid) -> float:
    """Return the height of an upright solid, mm, part frame."""
    a, b, c = solid.sizes
    height = {kernel.BALL: a, kernel.ROUND: c, kernel.RING: b}.get(solid.kind, 0.0)
    return float(solid.origin[2]) + height


def _rotations(vectors: Float) -> Float:
    """Return the rotations (n, 3, 3) of rotation vectors (n, 3), after Rodrigues."""
    angle = np.maximum(np.linalg.norm(vectors, axis=1), 1e-12)[:, None, None]
    x, y, z = (vectors / angle[:, :, 0]).T
    none = np.zeros_like(x)
    skew = np.stack([none, -z, y, z, none, -x, -y, x, none], axis=1).reshape(-1, 3, 3)
    turned: Float = np.eye(3) + np.sin(angle) * skew + (1.0 - np.cos(angle)) * (skew @ skew)
    return turned
