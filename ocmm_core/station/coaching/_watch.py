"""Thread of the coach: samples, computes, and reports changes."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import ClassVar, Protocol

from psygnal import Signal

from ocmm_core.camera import Rig
from ocmm_core.coach import (
    Held,
    SteadyHint,
    advise,
    covariance_of,
    ellipsoid_of,
    help_when_lost,
    picture_of,
    stance_at,
)
from ocmm_core.errors import TrackingError
from ocmm_core.station.coaching._view import NOTHING, CoachView, ProbeNow
from ocmm_core.tracking import ProbeBody

LOOK_S = 0.3
"""Sampling interval: a hand turns the probe in a second, and frames have priority."""


class Seer(Protocol):
    """Source of the probe's state; thread-safe."""

    def probe_now(self) -> ProbeNow | None:
        """Return the state; None while measuring is not allowed."""
        ...


class CoachWatch:
    """Sample the probe a few times a second, on a separate thread.

    Nothing is computed before `start`: a station without a screen needs no coach. `failed`:
    receives the error that ended the thread; measuring continues.
    """

    changed: ClassVar[Signal] = Signal(CoachView)
    """Emitted on the thread of the coach, on a visible change."""

    def __init__(
        self, rig: Rig, body: ProbeBody, seer: Seer, failed: Callable[[Exception], None]
    ) -> None:
        self._rig, self._body, self._seer, self._failed = rig, body, seer, failed
        self._steady = SteadyHint()
        self._shown = NOTHING
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="ocmm-coach", daemon=True)

    @property
    def shown(self) -> CoachView:
        return self._shown

    def start(self) -> None:
        self._thread.start()

    def close(self, timeout_s: float) -> bool:
        """Stop; return whether in time, True if never started."""
        self._stop.set()
        if self._thread.ident is None:
            return True
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def look(self, now: ProbeNow | None, time_s: float) -> CoachView:
        """Return the coach's view of the probe at a time, s; times only grow."""
        if now is None:
            self._steady.feed(None, time_s)
            return NOTHING
        rig, body, last = self._rig, self._body, now.last
        if last is None or not now.good:
            self._steady.feed(None, time_s)
            if not now.lost:
                return NOTHING
            rotation, tip_rig = (None, None) if last is None else (last.rotation, last.tip_rig)
            found = help_when_lost(rig, body, rotation, tip_rig, now.seen, named=now.named)
            return CoachView(remedy=found.remedy, picture=found.picture)
        held = Held(last.rotation, last.tip_rig, now.seen)
        advice = advise(rig, body, held, last.sensitivities)
        hint = self._steady.feed(advice, time_s)
        turn = None if hint is None else hint.turns[0]
        picture = picture_of(rig, body, last.rotation, now.seen, turn)
        try:
            (answer,) = last.sensitivities(last.spots[None])
        except TrackingError:
            return CoachView(picture=picture)
        covariance = covariance_of(answer, rig, body)
        return CoachView(ellipsoid_of(covariance, stance_at(rig)), hint, "", picture)

    def _run(self) -> None:
        try:
            while not self._stop.wait(LOOK_S):
                view = self.look(self._seer.probe_now(), time.monotonic())
                if not view.looks_like(self._shown):
                    self._shown = view
                    self.changed.emit(view)
        except Exception as error:
            # Not part of measuring; its last report must not stay displayed.
            self._shown = NOTHING
            self._failed(error)
            self.changed.emit(NOTHING)
