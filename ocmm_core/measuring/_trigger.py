"""Trigger detection and the frames of each point, by exposure counters, not by blocks.

The touched side of the material is found by four methods. The direction of a point leads from the
material to the probe. For surfaces it only tells the side of the material, and the feature is
compensated as a whole (`features.measured`); for single points and lines the radius of the ball is
subtracted along it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Generic, TypeVar

import numpy as np

from ocmm_core import tracking
from ocmm_core.acquisition.frames import FrameFlag
from ocmm_core.geometry import Float, unit
from ocmm_core.measuring._point import Refusal, RefusalCode
from ocmm_core.measuring._stable_point import PointOptions

T = TypeVar("T")

MIN_FRAMES = 25
"""Minimum frames of a window, to estimate its scatter."""

_TRAIL_EVERY_S = 0.002
_TRAIL_STEP_MM = 0.5
"""The trail stores positions at least this far apart, to keep the approach while the ball rests."""
_TRAIL_LENGTH = 200
_APPROACH_REACH = 4.0
_PULL_WAIT_S = 1.5
"""Wait for the pull after the window; later motion is not a pull."""
_NEAR_MM = 1.0
"""Nearer positions show the noise of one frame rather than the path."""
_STRAIGHT_MM = 0.4
"""Largest lateral deviation within the straight part."""


@dataclass(frozen=True, slots=True)
class Touch:
    """The frames of one touch."""

    first_frame: int
    window: tracking.TrackBlock
    """Frames from the trigger on, as far as they arrived."""
    expected: int
    """Intended frames of the window."""
    trail_world: Float
    """(m, 3), mm: ball positions before the trigger, oldest first."""
    interrupted: bool = False
    """The stream was interrupted before the window was full."""
    pull_world: Float = field(default_factory=lambda: np.empty((0, 3)))
    """(k, 3), mm: ball positions after the window, oldest first; empty unless waited for."""
    skew: tracking.CameraSkew | None = None
    """Of cameras without proof of a common exposure time, which the frames were aligned by."""


class BallTrail:
    """Latest positions of a moving ball, at least `_TRAIL_STEP_MM` apart."""

    def __init__(self, frame_period_s: float) -> None:
        self._stride = max(round(_TRAIL_EVERY_S / frame_period_s), 1)
        self._trail: deque[Float] = deque(maxlen=_TRAIL_LENGTH)

    @property
    def places(self) -> Float:
        """Return them, (m, 3), mm, oldest first."""
        return np.array(self._trail).reshape(-1, 3)

    def clear(self) -> None:
        self._trail.clear()

    def extend(self, places: Float) -> None:
        self._trail.extend(places)

    def follow(self, block: tracking.TrackBlock, start: int, stop: int) -> None:
        """Take in some frames of a block."""
        part = slice(start, stop)
        due = (block.counter[part] % self._stride == 0) & (
            block.status[part] == tracking.FrameStatus.OK
        )
        for tip_world in block.tip_world[part][due]:
            last = self._trail[-1] if self._trail else None
            if last is None or float(np.linalg.norm(tip_world - last)) >= _TRAIL_STEP_MM:
                self._trail.append(tip_world)


class FrameCollector(ABC, Generic[T]):
    """Cut touches or paths out of the tracked frames; for one thread.

    An interruption of the stream ends the open one and restarts the trail.
    """

    def __init__(self, frame_period_s: float) -> None:
        self._trail = BallTrail(frame_period_s)
        self._button = True
        self._before_ns = 0

    def push(self, block: tracking.TrackBlock) -> list[T]:
        """Take in tracked frames and return what they complete."""
        found: list[T] = []
        breaks = tracking.interruptions(block.time_ns, self._before_ns)
        for first, last in pairwise(sorted({0, *breaks, len(block)})):
            if first in breaks:
                found += self._interrupt(block, first)
                # A button pressed during the gap is no trigger: the ball position then is unknown.
                self._button = True
                self._trail.clear()
            found += self._push(tracking.cut(block, first, last) if breaks else block)
        self._before_ns = int(block.time_ns[-1])
        return found

    @abstractmethod
    def _push(self, block: tracking.TrackBlock) -> list[T]:
        """Take in frames without an interruption."""

    @abstractmethod
    def _interrupt(self, block: tracking.TrackBlock, first: int) -> list[T]:
        """Forget frames before ``first``; return what they complete."""


class TouchCollector(FrameCollector[Touch]):
    """Cut the window of every trigger out of the tracked frames.

    A trigger is the probe button going down, or `arm` (key, pedal); it is ignored during a window.
    """

    def __init__(self, frame_period_s: float, options: PointOptions) -> None:
        super().__init__(frame_period_s)
        self.pulled = False
        """Complete a touch only when the ball is pulled away, or after 1.5 s; applies to windows
        that end from now on."""
        self._pull_mm = _APPROACH_REACH * options.approach_mm
        self._pull_frames = round(_PULL_WAIT_S / frame_period_s)
        self._held: Touch | None = None
        self._pull: list[Float] = []
        self._expected = max(round(options.window_s / frame_period_s), MIN_FRAMES)
        self._pieces: list[tracking.TrackBlock] = []
        self._end = -1
        self._armed = False

    @property
    def collecting(self) -> bool:
        """Return whether a window is open or a pull is awaited."""
        return self._end >= 0 or self._held is not None

    def arm(self) -> None:
        """Request a point with the next frame; ignored while a window is open."""
        self._armed = not self.collecting

    def _push(self, block: tracking.TrackBlock) -> list[Touch]:
        touches: list[Touch] = []
        start = 0
        while start < len(block):
            if self._held is not None:
                start, touch = self._follow_pull(block, start, self._held)
                touches += [touch] if touch is not None else []
            elif self._end < 0:
                start = self._watch(block, start)
            else:
                stop = int(np.searchsorted(block.counter, self._end))
                if stop > start:
                    self._pieces.append(tracking.cut(block, start, stop))
                    self._button = bool(block.flags[stop - 1] & FrameFlag.BUTTON)
                if stop == len(block):
                    return touches
                touch = self._complete(block, stop)
                if self.pulled and len(touch.window):
                    self._held = touch
                else:
                    touches.append(touch)
                start = stop
        return touches

    def _follow_pull(
        self, block: tracking.TrackBlock, start: int, held: Touch
    ) -> tuple[int, Touch | None]:
        """Follow the ball from ``start``; return the next frame and the completed touch."""
        latest = int(held.window.counter[-1]) + self._pull_frames
        contact = held.window.tip_world[held.window.status == tracking.FrameStatus.OK]
        for index in range(start, len(block)):
            over = int(block.counter[index]) > latest or not len(contact)
            if block.status[index] == tracking.FrameStatus.OK and not over:
                away = float(np.linalg.norm(block.tip_world[index] - contact[-1]))
                last = self._pull[-1] if self._pull else contact[-1]
                if float(np.linalg.norm(block.tip_world[index] - last)) >= _TRAIL_STEP_MM:
                    self._pull.append(block.tip_world[index])
                over = away >= self._pull_mm
            if over:
                return index + 1, self._end_pull(held)
        return len(block), None

    def _end_pull(self, held: Touch) -> Touch:
        pull = np.array(self._pull).reshape(-1, 3)
        self._held, self._pull = None, []
        # The button may still be down; and the way back leads to the next place.
        self._trail.extend(pull)
        return replace(held, pull_world=pull)

    def _interrupt(self, block: tracking.TrackBlock, first: int) -> list[Touch]:
        touches = [self._end_pull(self._held)] if self._held is not None else []
        if self._armed:
            self._end = int(block.counter[first]) + self._expected
        if self._end >= 0:
            touch = self._complete(block, first)
            touches.append(replace(touch, interrupted=len(touch.window) < touch.expected))
        self._armed = False
        return touches

    def _watch(self, block: tracking.TrackBlock, start: int) -> int:
        """Find a trigger from ``start`` on; return where the window begins, or the end."""
        down = (block.flags[start:] & FrameFlag.BUTTON) != 0
        before = np.concatenate([[self._button], down[:-1]])
        edges = np.flatnonzero(down & ~before)
        self._button = bool(down[-1])
        stop = start + int(edges[0]) if len(edges) else len(block)
        if self._armed:
            stop = start
        self._trail.follow(block, start, stop)
        if stop < len(block):
            self._armed = False
            self._end = int(block.counter[stop]) + self._expected
        return stop

    def _complete(self, block: tracking.TrackBlock, stop: int) -> Touch:
        window = tracking.join(self._pieces) if self._pieces else tracking.cut(block, stop, stop)
        first_frame = self._end - self._expected
        self._pieces, self._end = [], -1
        return Touch(first_frame, window, self._expected, self._trail.places)


def approach_direction(trail_world: Float, contact_world: Float, distance: float) -> Float | None:
    """Return the unit vector from the contact (3,), mm, towards the approach, or None.

    Mean direction of the last straight part of the path; far positions weigh more, which averages
    the tremor of the hand. None if that part is shorter than ``distance``, mm: the ball turned just
    before contact, or its last path was not tracked (a longer step may hide a corner). Up to four
    times ``distance`` is used. The trail (m, 3), mm, starts with the oldest.
    """
    before = np.zeros(3)
    away = trail_world[::-1] - contact_world
    lengths = np.linalg.norm(away, axis=1)
    total = np.zeros(3)
    reached = 0.0
    for vector, length in zip(away, lengths, strict=True):
        unseen = float(np.linalg.norm(vector - before)) > distance
        if length > _APPROACH_REACH * distance or unseen:
            break
        before = vector
        if length < _NEAR_MM:
            continue
        size = float(np.linalg.norm(total))
        if size > 0.0:
            along = float(vector @ total) / size
            aside = float(np.sqrt(max(length**2 - along**2, 0.0)))
            if along < reached - _STRAIGHT_MM or aside > _STRAIGHT_MM:
                break
            reached = max(reached, along)
        else:
            reached = float(length)
        total += vector * length
    return None if reached < distance else total / np.linalg.norm(total)


METHODS = ("approach", "pulled", "shank", "nominal")
"""By approach or retraction of the ball, axis of the probe, or normal of the nominal surface."""

WORDS = {"approach": "trail", "pulled": "pulled", "shank": "shank", "nominal": "nominal"}
"""Values of `MeasuredPoint.approach`."""


@dataclass(frozen=True, slots=True)
class Side:
    """Side of the probe at a touch."""

    direction: Float
    """(3,), unit, world: from the material towards the probe."""
    word: str


def side_of(
    method: str,
    touch: Touch,
    tip_world: Float,
    rotation_world_from_probe: Float,
    body: tracking.ProbeBody,
    approach_mm: float,
    nominal_normal: Float | None,
    time_s: float,
) -> Side | Refusal:
    """Return the direction of a point, or the reason why it is unknown.

    A ball that approached from behind the nominal surface, or against the axis of the probe, is
    refused. ``approach_mm`` is the required straight path of the ball; ``nominal_normal`` (3,),
    unit, world, is None if unknown.
    """
    came = approach_direction(touch.trail_world, tip_world, approach_mm)
    match method:
        case "approach":
            if came is None:
                return _refused(
                    "The approach direction of the ball is unknown.",
                    f"Move it away by {approach_mm:g} mm or more and touch again.",
                    time_s,
                )
            return Side(came, WORDS[method])
        case "pulled":
            pulled = approach_direction(touch.pull_world[::-1], tip_world, approach_mm)
            if pulled is None:
                return _refused(
                    "The ball was not retracted square to the surface after the touch.",
                    "Touch again and, once the point is taken, retract the ball by "
                    f"{4.0 * approach_mm:g} mm, square to the surface.",
                    time_s,
                )
            return Side(pulled, WORDS[method])
        case "shank":
            direction = rotation_world_from_probe @ shank_axis(body)
        case _:
            if nominal_normal is None or not np.any(nominal_normal):
                return _refused(
                    "The nominal surface direction is unknown here: the part frame is not "
                    "measured yet, or the ball is far from the nominal surface.",
                    "Measure the datum features first, or choose the approach direction instead.",
                    time_s,
                )
            direction = nominal_normal
    if came is not None and float(came @ direction) < 0.0:
        which = "the probe points" if method == "shank" else "the nominal surface faces"
        return _refused(
            (
                f"The ball approached from the side opposite to where {which}: one of the "
                "two is wrong."
            ),
            "Touch again from outside the material, or choose the approach direction instead.",
            time_s,
        )
    return Side(direction, WORDS[method])


def shank_axis(body: tracking.ProbeBody) -> Float:
    """Return the axis of the probe, (3,), unit, probe frame: from the ball to its LEDs."""
    return unit(body.leds_probe.mean(axis=0) - body.tip_probe)


def _refused(what: str, remedy: str, time_s: float) -> Refusal:
    return Refusal(RefusalCode.NO_APPROACH, what, remedy, time_s)
