"""Steps of qualification and quick check, with hints to the user.

Hints give the reason why a resting ball is rejected, what is missing, and how the ball is placed
relative to the next required place.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration import guided
from ocmm_core.calibration.tip._sphere_layout import CONE_TOLERANCE, TOLERANCE
from ocmm_core.calibration.tip._state import TouchState
from ocmm_core.calibration.tip._views import Countdown, Phase
from ocmm_core.errors import TrackingError

PREPARE, SPHERE, CONE, RESULT = "prepare", "sphere", "cone", "result"
TAKING = (SPHERE, CONE)
"""Steps in which observations are taken."""


def steps_of(
    state: TouchState, on_sphere: guided.Gate, in_cone: guided.Gate
) -> tuple[guided.Step, ...]:
    """Return the steps; the gates out of those in which observations are taken are given."""
    use, next_words = state.begun.sphere.artefact.use, state.next_words()
    attitude = state.cone.next_attitude
    hold = "more" if attitude is None else state.cone.attitudes[attitude].name
    return (
        guided.Step(
            PREPARE,
            "Prepare",
            f"Clamp sphere '{use.name}' (serial {use.serial}) and a cone where the cameras see "
            f"them well; clean sphere, cone and ball. Tip '{state.begun.tip}' must be mounted.",
            guided.OPEN,
        ),
        guided.Step(
            SPHERE,
            "Sphere",
            f"Touch the sphere {next_words}." if next_words else "Enough points on the sphere.",
            on_sphere,
            len(state.on_sphere),
            state.wanted.points,
        ),
        guided.Step(
            CONE,
            "Cone",
            f"Put the ball into the cone and hold the probe {hold}."
            if not in_cone.open
            else "Enough attitudes taken.",
            in_cone,
            len(state.in_cone),
            len(state.wanted.attitudes.names),
        ),
        guided.Step(
            RESULT,
            "Result",
            "Review the result and store it.",
            guided.Gate(False, "This is the last step.", "Store the result."),
        ),
    )


_SAME_PLACE = np.radians(5.0)
_OFF_SPHERE_MM, _OFF_AT_FIRST_MM = 3.0, 12.0
_KNOWN_FROM = 4
"""Number of points from which the sphere's centre is reliable."""

_OFF_CONE_MM = 2.5
_CLEAR_MM = 5.0
_NEW_ATTITUDE = np.radians(10.0)


def judge_on_sphere(state: TouchState, touch: guided.RestingTouch) -> str:
    """Return why a resting ball is not a wanted point of the sphere, or empty text."""
    progress, centre = state.sphere, state.centre()
    if centre is None:
        return ""
    away = touch.tip_world - centre
    distance = float(np.linalg.norm(away))
    off = distance - state.reach
    known = len(progress.tips_world) >= _KNOWN_FROM
    if abs(off) > (_OFF_SPHERE_MM if known else _OFF_AT_FIRST_MM):
        return (
            f"The ball is {abs(off):.0f} mm {'off' if off > 0.0 else 'inside'} the sphere: rest "
            "it on the sphere."
        )
    if not known:
        return ""
    direction = away / distance
    if float((progress.directions_world @ direction).max()) > np.cos(_SAME_PLACE):
        return guided.PLACE_DONE
    free = state.wanted.places.directions[list(progress.missing)]
    if progress.next_place is not None and not (free @ direction > np.cos(TOLERANCE)).any():
        next_words = state.next_words()
        return f"This place is not needed: touch the sphere {next_words}."
    return ""


def judge_in_cone(state: TouchState, touch: guided.RestingTouch) -> str:
    """Return why a resting ball is not at a wanted attitude in the cone, or empty text."""
    progress, centre = state.cone, state.centre()
    handle = state.handle(touch)
    if len(progress.tips_world):
        off = float(np.linalg.norm(touch.tip_world - progress.tips_world.mean(axis=0)))
        if off > _OFF_CONE_MM:
            return (
                f"The ball is {off:.0f} mm from its place in the cone: put it there, or undo "
                "the attitudes."
            )
    elif centre is not None:
        clear = float(np.linalg.norm(touch.tip_world - centre)) - state.reach
        if clear < _CLEAR_MM:
            return "The ball is still on the sphere: put it into the cone."
    if progress.next_attitude is None:
        if float((progress.handles_world @ handle).max()) > np.cos(_NEW_ATTITUDE):
            return "This attitude is done: lean the probe another way."
        return ""
    missing = np.array([one.handle_world for one in progress.attitudes if one.point is None])
    if float((missing @ handle).max()) < np.cos(CONE_TOLERANCE):
        hold = progress.attitudes[progress.next_attitude].name
        return f"Keep the ball in the cone and hold the probe {hold}."
    return ""


def places_gate(state: TouchState) -> guided.Gate:
    progress, wanted = state.sphere, state.wanted
    touched = len(progress.places) - len(progress.missing)
    left = max(wanted.points - len(progress.tips_world), wanted.places_needed - touched)
    if left <= 0:
        return guided.OPEN
    some = "points on the sphere are" if left != 1 else "point on the sphere is"
    next_words = state.next_words() or "once more"
    return guided.Gate(False, f"{left} {some} missing.", f"Touch the sphere {next_words}.")


def attitudes_gate(state: TouchState) -> guided.Gate:
    attitudes, wanted = state.cone.attitudes, state.cone.next_attitude
    missing = sum(one.point is None for one in attitudes)
    if wanted is None:
        return guided.OPEN
    hold = attitudes[wanted].name
    return guided.Gate(
        False,
        f"{missing} of {len(attitudes)} attitudes in the cone to go.",
        f"Keep the ball in the cone and hold the probe {hold}.",
    )


_APART_MM, _APART_RAD = 2.0, np.radians(8.0)


class RestingBall:
    """Averages spots of a ball that rests ``hold_s`` longer, or reports what prevents recording."""

    def __init__(self, state: TouchState, hold_s: float) -> None:
        self._state, self._hold_s = state, hold_s
        self._probe = guided.ProbeSpotAverager(
            state.rig, state.body, guided.STILL_FRAMES, resting=True, distance_mm=_APART_MM,
            turn_rad=_APART_RAD, inside=True,
        )  # fmt: skip
        self._watched, self._now_ns = 0, 0
        self._ready_ns: int | None = None
        self._judgement: tuple[tuple[int, int, str], guided.Live] | None = None

    def push(self, block: FrameBlock, step: str, version: int) -> None:
        """Process frames; ``version`` changes with the observations."""
        self._probe.push(block)
        if not len(block):
            return
        self._watched += len(block)
        self._now_ns = int(block.time_ns[-1])
        if not self._hold_s:
            return
        if not self._judged(step, version).ready:
            self._ready_ns = None
        elif self._ready_ns is None:
            self._ready_ns = self._now_ns

    def taken(self, average: guided.Average) -> None:
        """Register a recorded average: the same place is not offered again."""
        self._probe.taken(average)
        self._ready_ns = None

    def average(self) -> guided.Average:
        return self._probe.average()

    def live(self, step: str, version: int) -> guided.Live:
        """Return the view, and why it cannot be recorded yet; parameters as `push`."""
        live = self._judged(step, version)
        left = self._left_s(live)
        if left > 0.0:
            return replace(live, ready=False, hint=f"Hold still: {left:.1f} s.")
        return live

    def countdown(self, step: str, version: int) -> Countdown:
        """Return the time until it can be recorded; parameters as `push`."""
        live = self._judged(step, version)
        if live.ready and step in TAKING:
            left = self._left_s(live)
            share = 1.0 - left / self._hold_s if self._hold_s else 1.0
            return Countdown(Phase.RESTING if left else Phase.READY, left, share)
        if live.hint == guided.AVERAGING and live.wanted:
            left = (live.wanted - live.frames) / self._state.rig.frame_rate_hz + self._hold_s
            return Countdown(Phase.RESTING, left, live.frames / live.wanted)
        taken = live.hint == guided.PLACE_DONE
        return Countdown(Phase.TAKEN if taken else Phase.SEARCHING, 0.0, 0.0)

    def _judged(self, step: str, version: int) -> guided.Live:
        """Return the view judged against the wanted place, without the rest time."""
        key = (self._watched, version, step)
        if self._judgement is None or self._judgement[0] != key:
            live = self._probe.live()
            hint = self._misplaced(step) if live.ready and step in TAKING else ""
            self._judgement = (key, replace(live, ready=False, hint=hint) if hint else live)
        return self._judgement[1]

    def _left_s(self, live: guided.Live) -> float:
        if not live.ready or not self._hold_s:
            return 0.0
        since = self._now_ns if self._ready_ns is None else self._ready_ns
        return max(0.0, self._hold_s - 1e-9 * (self._now_ns - since))

    def _misplaced(self, step: str) -> str:
        """Return why the resting ball is not at a wanted place; empty if it is."""
        average = self._probe.average()
        try:
            touch = guided.touch_of(average.uv, average.sigma_px, self._state.rig, self._state.body)
        except TrackingError as error:
            return error.remedy
        judge = judge_on_sphere if step == SPHERE else judge_in_cone
        return judge(self._state, touch)
