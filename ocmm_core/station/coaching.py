"""Coach of a running station: samples a few times a second, and reports changes only.

In: the latest pose of the probe and its visible LEDs. Out: the ellipsoid of the ball, a steady
hint, or while the probe is lost one remedy with a picture, as a signal of changes.
`ocmm_core.coach` defines hints; it must not know a screen, nor the other packages of a station.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray
from psygnal import Signal

from ocmm_core import coach
from ocmm_core.camera import Rig
from ocmm_core.errors import TrackingError
from ocmm_core.geometry import Float
from ocmm_core.tracking import ProbeBody

_ALIKE = 0.1
"""mm: smaller differences of the ellipsoid are invisible."""
_ALIKE_RAD = float(np.radians(6.0))


@dataclass(frozen=True, slots=True, eq=False)
class LastPose:
    """Latest pose of the probe, and its visible LEDs."""

    rotation: Float
    tip_rig: Float
    """`rotation`, `tip_rig`: (3, 3) and (3,), mm, frame of the rig."""
    spots: Float
    """(C, L, 2), px, of that frame."""
    sensitivities: coach.Sensitivities


@dataclass(frozen=True, slots=True, eq=False)
class ProbeNow:
    """The last state of the probe."""

    good: bool
    lost: bool
    """Without pose, because too few LEDs are seen or they are ambiguous."""
    named: bool
    """LEDs are identified."""
    seen: NDArray[np.bool_]
    """(C, L): which camera sees which LED now."""
    last: LastPose | None
    """Of the last good frame; None before the first."""


@dataclass(frozen=True, slots=True, eq=False)
class CoachView:
    """Display next to the readout."""

    ellipsoid: coach.Ellipsoid | None = None
    hint: coach.Hint | None = None
    """A turn that would improve it; None if not worthwhile."""
    remedy: str = ""
    """Remedy while the probe is lost; else empty."""
    picture: coach.ProbePicture | None = None
    """Of the probe; None before its first search."""

    def looks_like(self, other: CoachView) -> bool:
        """Return whether two views are indistinguishable on the screen."""
        return (
            self.hint == other.hint
            and self.remedy == other.remedy
            and _same_ellipsoid(self.ellipsoid, other.ellipsoid)
            and _same_picture(self.picture, other.picture)
        )


NOTHING = CoachView()


def _same_ellipsoid(one: coach.Ellipsoid | None, other: coach.Ellipsoid | None) -> bool:
    if one is None or other is None:
        return one is other
    if not np.allclose(one.half_axes_mm, other.half_axes_mm, rtol=_ALIKE):
        return False
    if not np.allclose(one.outline_mm[:2], other.outline_mm[:2], rtol=_ALIKE):
        return False
    # An ellipse looks the same after half a turn, and a circle always.
    turned = abs(float(np.sin(one.outline_mm[2] - other.outline_mm[2])))
    round_enough = one.outline_mm[1] > (1.0 - _ALIKE) * one.outline_mm[0]
    return bool(round_enough or turned < np.sin(_ALIKE_RAD))


def _same_picture(one: coach.ProbePicture | None, other: coach.ProbePicture | None) -> bool:
    if one is None or other is None:
        return one is other
    reach = float(np.linalg.norm(one.leds, axis=1).max())
    return (
        one.turn == other.turn
        and one.known is other.known
        and np.array_equal(one.seen, other.seen)
        and float(np.abs(one.leds - other.leds).max()) < _ALIKE_RAD * reach
    )


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
        self._steady = coach.SteadyHint()
        self._shown = NOTHING
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="ocmm-coach", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def close(self, timeout_s: float) -> bool:
        """Stop; return whether in time, True if never started."""
        self._stop.set()
        if self._thread.ident is None:
            return True
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def view_at(self, now: ProbeNow | None, time_s: float) -> CoachView:
        """Return the coach's view of the probe at a time, s; times only grow."""
        if now is None:
            self._steady.push(None, time_s)
            return NOTHING
        rig, body, last = self._rig, self._body, now.last
        if last is None or not now.good:
            self._steady.push(None, time_s)
            if not now.lost:
                return NOTHING
            rotation, tip_rig = (None, None) if last is None else (last.rotation, last.tip_rig)
            found = coach.help_when_lost(rig, body, rotation, tip_rig, now.seen, named=now.named)
            return CoachView(remedy=found.remedy, picture=found.picture)
        held = coach.Held(last.rotation, last.tip_rig, now.seen)
        advice = coach.advise(rig, body, held, last.sensitivities)
        hint = self._steady.push(advice, time_s)
        turn = None if hint is None else hint.turns[0]
        picture = coach.picture_of(rig, body, last.rotation, now.seen, turn)
        try:
            (answer,) = last.sensitivities(last.spots[None])
        except TrackingError:
            return CoachView(picture=picture)
        covariance = coach.covariance_of(answer, rig, body)
        return CoachView(coach.ellipsoid_of(covariance, coach.stance_at(rig)), hint, "", picture)

    def _run(self) -> None:
        try:
            while not self._stop.wait(LOOK_S):
                view = self.view_at(self._seer.probe_now(), time.monotonic())
                if not view.looks_like(self._shown):
                    self._shown = view
                    self.changed.emit(view)
        except Exception as error:
            # Not part of measuring; its last report must not stay displayed.
            self._shown = NOTHING
            self._failed(error)
            self.changed.emit(NOTHING)
