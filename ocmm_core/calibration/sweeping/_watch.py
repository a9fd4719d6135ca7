"""Select poses of a sweep from frames, and detect when the ball rests in its cone.

The last frames of each 10 ms are averaged, as for a waved probe. A pose is recorded when the
probe has turned a little, which limits the session for a resting hand and at high frame rates. Only
the last poses and a pending batch are kept.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration import guided
from ocmm_core.calibration.pivot import pivot_of_poses
from ocmm_core.calibration.records import Finding
from ocmm_core.calibration.sweeping._progress import SweepProgress, second_range
from ocmm_core.calibration.sweeping._views import SweepPhase
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Pixels, unit
from ocmm_core.tracking import ProbeBody, solve

BATCH = 20

MOST_POSES = 4000
COUNTDOWN_S = 1.5
POSE_TURN = np.radians(0.4)

_LOOK_S = 0.01
_REST_S = 0.5
_REST_TURN = np.radians(2.0)
_REST_MM = 0.3
"""Apparent motion of a resting tip if its place in the probe is uncertain by a millimetre."""

_WINDOW = 60
_WINDOW_RANGE = np.radians(6.0)
_AGREE_MM = 0.15

_NEAR_MM, _ROUGHLY_NEAR_MM = 0.5, 2.0
_LEFT_S = 0.2
_LIFTED_MM = 5.0
_SEEN_MEMORY = 0.01
_HIDDEN = 0.3

INTO_CONE = "Put the ball into the cone and sweep the probe: recording starts automatically."
LIFT = (
    "First sweep complete: lift the ball out and leave the cone in place. Put the ball into "
    "another one, 30 mm or more away, or lean the probe another way."
)
BACK = "The ball left the cone: put it back and keep sweeping."
FULL = "More than enough poses: end the sweep."


@dataclass(frozen=True, slots=True)
class _Look:
    """One sample of the probe pose."""

    time_ns: int
    uv: Pixels
    rotation: Float
    origin: Float


class SweepWatch:
    """Processes the frames of one sweep; ``tip_known``: the tip has an expected place.

    ``first`` is the first sweep, for the second one.
    """

    def __init__(
        self, rig: Rig, body: ProbeBody, *, tip_known: bool, first: SweepProgress | None = None
    ) -> None:
        self._rig, self._body = rig, body
        self._tip: Float | None = body.tip_probe if tip_known else None
        self._measured = False
        self._first = first
        self._spots = guided.ProbeSpotAverager(
            rig, body, guided.waved_frames(rig), resting=False, distance_mm=-1.0
        )
        self._live = guided.Live(wanted=BATCH)
        self._recent: deque[_Look] = deque(maxlen=round(2.0 * _REST_S * 100))
        self._turned: deque[_Look] = deque(maxlen=_WINDOW)
        self._pending: list[_Look] = []
        self._anchors: list[_Look] = []
        self._last: Float | None = None
        self._taken = 0
        self._centre = np.full(3, np.nan)
        self._phase = SweepPhase.WAITING
        self._since_ns = 0
        self._inside_ns = 0
        self._now_ns = 0
        self._lifted = first is None
        self._elsewhere: Float | None = None
        self._seen = np.ones((len(rig.cameras), body.n_leds))

    @property
    def phase(self) -> SweepPhase:
        return self._phase

    @property
    def countdown_s(self) -> float | None:
        """Return the seconds until recording starts; None unless counting down."""
        if self._phase is not SweepPhase.COUNTDOWN:
            return None
        return max(COUNTDOWN_S - 1e-9 * (self._now_ns - self._since_ns), 0.0)

    @property
    def direction_world(self) -> Float:
        """Return the current probe direction, (3,), unit; NaN while unseen."""
        if not self._recent or not self._live.ready:
            return np.full(3, np.nan)
        return unit(self._recent[-1].rotation @ self._arm())

    @property
    def batch(self) -> tuple[Pixels, ...]:
        """Return the spots (C, L, 2), px, of the pending poses."""
        return tuple(look.uv for look in self._pending)

    @property
    def sigma_px(self) -> float:
        """Return the standard deviation of a spot of a pose, per axis."""
        return guided.sigma_of_mean(self._rig, guided.waved_frames(self._rig))

    def push(self, block: FrameBlock) -> None:
        frames = max(guided.waved_frames(self._rig), round(_LOOK_S * self._rig.frame_rate_hz))
        for first in range(0, len(block), frames):
            part = block.part(slice(first, first + frames))
            self._spots.push(part)
            self._now_ns = int(part.time_ns[-1])
            self._live = self._spots.live()
            look = self._sample() if self._live.ready else None
            if look is not None:
                self._judge(look)
            elif self._phase is SweepPhase.COUNTDOWN:
                self._phase = SweepPhase.WAITING

    def stored(self, progress: SweepProgress) -> None:
        """Clear the pending poses after they were stored, and update from the progress."""
        self._pending.clear()
        self._taken = progress.poses
        if progress.tip_probe is not None:
            self._tip, self._measured = progress.tip_probe, True
        if np.isfinite(progress.centre_world).all():
            self._centre = progress.centre_world

    def live(self) -> guided.Live:
        """Return the current view, and whether a batch can be recorded."""
        ready = len(self._pending) >= BATCH
        return replace(
            self._live,
            ready=ready,
            hint="" if ready else self._hint(),
            frames=len(self._pending),
            wanted=BATCH,
        )

    def warnings(self) -> tuple[Finding, ...]:
        found = []
        if not self._live.ready and self._live.hint == guided.STRANGE:
            what, _, remedy = guided.STRANGE.partition(": ")
            found.append(
                Finding("pivot.strange_lights", f"{what}.", remedy.capitalize(), refuses=False)
            )
        if self._elsewhere is not None:
            far = float(np.linalg.norm(self._elsewhere - self._home()))
            found.append(
                Finding(
                    "pivot.moved",
                    f"The ball is {far:.1f} mm from the start of this sweep: the cone moved, or "
                    "it is another one.",
                    "Clamp the cone and repeat this sweep.",
                    refuses=False,
                )
            )
        hidden = np.argwhere(self._seen < _HIDDEN) if self._live.ready else np.empty((0, 2), int)
        if len(hidden):
            camera, led = hidden[0]
            more = f", and {len(hidden) - 1} more views" if len(hidden) > 1 else ""
            found.append(
                Finding(
                    "pivot.hidden_leds",
                    f"LED {led + 1} is hidden from camera '{self._rig.cameras[camera].name}'"
                    f"{more}.",
                    "Turn the LEDs to the cameras, and keep hand and cable off them.",
                    refuses=False,
                )
            )
        return tuple(found)

    def _arm(self) -> Float:
        middle = self._body.leds_probe.mean(axis=0)
        arm: Float = middle - (self._body.tip_probe if self._tip is None else self._tip)
        return arm

    def _hint(self) -> str:
        if not self._live.ready:
            return self._live.hint
        if self._taken >= MOST_POSES:
            return FULL
        if self._phase is SweepPhase.WAITING:
            return INTO_CONE if self._lifted else LIFT
        if self._phase is SweepPhase.COUNTDOWN:
            return f"Ball in the cone: recording starts in {self.countdown_s:.0f} s."
        if self._phase is SweepPhase.LEFT:
            moved = [one for one in self.warnings() if one.code == "pivot.moved"]
            return f"{moved[0].what} {moved[0].remedy}" if moved else BACK
        return ""

    def _sample(self) -> _Look | None:
        uv = self._spots.average().uv
        seen = np.isfinite(uv).all(axis=2)
        self._seen += _SEEN_MEMORY * (seen - self._seen)
        pose = solve(uv[None], self._rig, self._body, self.sigma_px)
        if pose.status[0]:
            return None
        return _Look(self._now_ns, uv, pose.rotation_world_from_probe[0], pose.origin_world[0])

    def _judge(self, look: _Look) -> None:
        self._recent.append(look)
        if not self._turned or _turn(self._turned[-1].rotation, look.rotation) >= POSE_TURN:
            self._turned.append(look)
        if self._phase is SweepPhase.TAKING:
            self._follow(look)
            return
        centre = self._resting_at()
        if centre is None:
            if self._phase is SweepPhase.COUNTDOWN:
                self._phase = SweepPhase.WAITING
            elif not self._lifted and self._is_lifted():
                self._lifted = True
            return
        if self._phase is SweepPhase.WAITING:
            if self._lifted:
                self._phase, self._since_ns = SweepPhase.COUNTDOWN, look.time_ns
        elif self._phase is SweepPhase.COUNTDOWN:
            if look.time_ns - self._since_ns >= COUNTDOWN_S * 1e9:
                self._begin_taking(centre, look)
        elif self._phase is SweepPhase.LEFT:
            first = not self._taken + len(self._pending)
            if first or np.linalg.norm(centre - self._home()) <= self._reach():
                self._begin_taking(centre, look)
            else:
                self._elsewhere = centre

    def _begin_taking(self, centre: Float, look: _Look) -> None:
        if not self._taken + len(self._pending):
            self._centre = centre
        self._phase, self._inside_ns, self._elsewhere = SweepPhase.TAKING, look.time_ns, None

    def _home(self) -> Float:
        """Return the ball centre of this sweep, (3,), mm, from the current tip estimate."""
        if self._measured or self._tip is None or not self._anchors:
            return self._centre
        return np.median([one.rotation @ self._tip + one.origin for one in self._anchors], 0)

    def _follow(self, look: _Look) -> None:
        """Record a pose while the ball is in place, and detect when it leaves."""
        if not self._is_inside(look):
            if look.time_ns - self._inside_ns > _LEFT_S * 1e9:
                self._phase = SweepPhase.LEFT
                # Poses of the way out must not look like rest.
                self._recent.clear()
                self._turned.clear()
            return
        self._inside_ns = look.time_ns
        room = len(self._pending) < BATCH and self._taken + len(self._pending) < MOST_POSES
        if room and (self._last is None or _turn(self._last, look.rotation) >= POSE_TURN):
            self._pending.append(look)
            self._last = look.rotation
            if len(self._anchors) < BATCH:
                self._anchors.append(look)

    def _is_inside(self, look: _Look) -> bool:
        if self._tip is not None:
            off = np.linalg.norm(look.rotation @ self._tip + look.origin - self._home())
            if off <= self._reach():
                return True
        # The tip may differ from its document: then the paths decide.
        centre = None if self._measured else self._agreed()
        return centre is not None and bool(np.linalg.norm(centre - self._home()) <= self._reach())

    def _reach(self) -> float:
        return _NEAR_MM if self._measured else _ROUGHLY_NEAR_MM

    def _resting_at(self) -> Float | None:
        """Return the ball centre, (3,), mm; None if it moves or is undetermined."""
        if self._tip is not None:
            last = self._recent[-1]
            window = [one for one in self._recent if last.time_ns - one.time_ns <= _REST_S * 1e9]
            whole = last.time_ns - self._recent[0].time_ns >= 0.9 * _REST_S * 1e9
            turned = max(_turn(one.rotation, last.rotation) for one in window)
            if whole and turned >= _REST_TURN:
                tips = np.array([one.rotation @ self._tip + one.origin for one in window])
                centre: Float = np.median(tips, axis=0)
                if np.linalg.norm(tips - centre, axis=1).max() <= _REST_MM:
                    return centre
        return self._agreed()

    def _agreed(self) -> Float | None:
        """Return the rotation centre of the last poses, and store the resulting tip."""
        if len(self._turned) < _WINDOW:
            return None
        rotations = np.array([one.rotation for one in self._turned])
        if second_range(rotations) < _WINDOW_RANGE:
            return None
        origins = np.array([one.origin for one in self._turned])
        try:
            found = pivot_of_poses(rotations, origins, seed=None)
        except CalibrationError:
            return None
        if found.rms > _AGREE_MM:
            return None
        if not self._measured:
            self._tip = found.tip
        return found.centre

    def _is_lifted(self) -> bool:
        if self._first is None or self._first.tip_probe is None:
            return True
        last = self._recent[-1]
        tip = last.rotation @ self._first.tip_probe + last.origin
        return bool(np.linalg.norm(tip - self._first.centre_world) > _LIFTED_MM)


def _turn(a: Float, b: Float) -> float:
    return float(np.arccos(np.clip(0.5 * (np.sum(a * b) - 1.0), -1.0, 1.0)))
