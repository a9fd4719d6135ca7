"""The thread of the coach: it looks, computes, and tells what has changed."""

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
"""Between two looks: a hand turns the probe in a second, and the frames need the processor more."""


class Seer(Protocol):
    """Knows how the probe was seen last; any thread."""

    def probe_now(self) -> ProbeNow | None:
        """Return it; None while nothing is to be said, because nothing may be measured."""
        ...


class CoachWatch:
    """Look at the probe a few times a second, on a thread of its own.

    Nothing is computed before `start`: a station without a screen needs no coach.

    Parameters
    ----------
    rig, body
        What is measured with.
    seer
        Knows how the probe was seen last.
    failed
        Told what ended the thread; measuring goes on without it.
    """

    changed: ClassVar[Signal] = Signal(CoachView)
    """Emitted on the thread of the coach, when something looks otherwise."""

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
        """Return what was told last."""
        return self._shown

    def start(self) -> None:
        """Begin to look; once."""
        self._thread.start()

    def close(self, timeout_s: float) -> bool:
        """End, and say whether it did in time; it has where it was never started."""
        self._stop.set()
        if self._thread.ident is None:
            return True
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def look(self, now: ProbeNow | None, time_s: float) -> CoachView:
        """Return what is to be said of the probe at a time, s; times only grow."""
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
            # It is beside the measuring; what it said last must not stand.
            self._shown = NOTHING
            self._failed(error)
            self.changed.emit(NOTHING)
