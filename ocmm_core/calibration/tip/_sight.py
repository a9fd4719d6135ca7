"""Judge the current ball position against the next wanted place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.guided import (
    AVERAGING,
    PLACE_DONE,
    STILL_FRAMES,
    Average,
    Live,
    ProbeSpotAverager,
    touch_of,
)
from ocmm_core.calibration.tip._state import TouchState
from ocmm_core.calibration.tip._steps import SPHERE, TAKING
from ocmm_core.calibration.tip._touch_hints import judge_in_cone, judge_on_sphere
from ocmm_core.calibration.tip._views import Countdown, Phase
from ocmm_core.errors import TrackingError

_APART_MM, _APART_RAD = 2.0, np.radians(8.0)


class Sight:
    """Averages spots of a ball that rests ``hold_s`` longer, or reports what prevents recording."""

    def __init__(self, state: TouchState, hold_s: float) -> None:
        self._state, self._hold_s = state, hold_s
        self._probe = ProbeSpotAverager(
            state.rig, state.body, STILL_FRAMES, resting=True, distance_mm=_APART_MM,
            turn_rad=_APART_RAD, inside=True,
        )  # fmt: skip
        self._watched, self._now_ns = 0, 0
        self._ready_ns: int | None = None
        self._judgement: tuple[tuple[int, int, str], Live] | None = None

    def feed(self, block: FrameBlock, step: str, version: int) -> None:
        """Process frames; ``version`` changes with the observations."""
        self._probe.feed(block)
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

    def taken(self, average: Average) -> None:
        """Register a recorded average: the same place is not offered again."""
        self._probe.taken(average)
        self._ready_ns = None

    def average(self) -> Average:
        return self._probe.average()

    def live(self, step: str, version: int) -> Live:
        """Return the view, and why it cannot be recorded yet; parameters as `feed`."""
        live = self._judged(step, version)
        left = self._left_s(live)
        if left > 0.0:
            return replace(live, ready=False, hint=f"Hold still: {left:.1f} s.")
        return live

    def countdown(self, step: str, version: int) -> Countdown:
        """Return the time until it can be recorded; parameters as `feed`."""
        live = self._judged(step, version)
        if live.ready and step in TAKING:
            left = self._left_s(live)
            share = 1.0 - left / self._hold_s if self._hold_s else 1.0
            return Countdown(Phase.RESTING if left else Phase.READY, left, share)
        if live.hint == AVERAGING and live.wanted:
            left = (live.wanted - live.frames) / self._state.rig.frame_rate_hz + self._hold_s
            return Countdown(Phase.RESTING, left, live.frames / live.wanted)
        taken = live.hint == PLACE_DONE
        return Countdown(Phase.TAKEN if taken else Phase.SEARCHING, 0.0, 0.0)

    def _judged(self, step: str, version: int) -> Live:
        """Return the view judged against the wanted place, without the rest time."""
        key = (self._watched, version, step)
        if self._judgement is None or self._judgement[0] != key:
            live = self._probe.live()
            hint = self._misplaced(step) if live.ready and step in TAKING else ""
            self._judgement = (key, replace(live, ready=False, hint=hint) if hint else live)
        return self._judgement[1]

    def _left_s(self, live: Live) -> float:
        if not live.ready or not self._hold_s:
            return 0.0
        since = self._now_ns if self._ready_ns is None else self._ready_ns
        return max(0.0, self._hold_s - 1e-9 * (self._now_ns - since))

    def _misplaced(self, step: str) -> str:
        """Return why the resting ball is not at a wanted place; empty if it is."""
        average = self._probe.average()
        try:
            touch = touch_of(average.uv, average.sigma_px, self._state.rig, self._state.body)
        except TrackingError as error:
            return error.remedy
        judge = judge_on_sphere if step == SPHERE else judge_in_cone
        return judge(self._state, touch)
