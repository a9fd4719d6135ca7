"""Points of an acceptance test taken as soon as the ball rests where it is wanted."""

from __future__ import annotations

import time
from collections.abc import Callable
from datetime import UTC, datetime

from ocmm_core.acceptance import AcceptanceSession, AcceptanceView
from ocmm_core.acquisition.frames import AcquisitionState, FrameBlock, read_status
from ocmm_core.calibration.guided import STILL_FRAMES, ProbeSpotAverager, handle_axis, to_spots
from ocmm_core.camera import Rig
from ocmm_core.composition import Feed
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import unit
from ocmm_core.tracking import ProbeBody, solve

_BATCH = 80
_IDLE_S = 0.002
_APART_MM, _TURN_RAD = 1.5, 0.15


class PointCollector:
    """Takes every point of a test that rests where it is wanted, from one source or several.

    What was taken last is known across sources and retests: a ball that still rests there gives no
    second point.

    Parameters
    ----------
    session
        Of the test.
    rig, body
        What is seen.
    temperature
        Of the room, asked whenever the test wants it.
    told
        Called with the view and a hint while points are taken.
    stop
        Asked for between batches.
    keep
        Given all frames as well, before they are looked at.
    """

    def __init__(
        self,
        session: AcceptanceSession,
        rig: Rig,
        body: ProbeBody,
        *,
        temperature: Callable[[], float],
        told: Callable[[AcceptanceView, str], None],
        stop: Callable[[], bool] = lambda: False,
        keep: Callable[[FrameBlock], None] = lambda block: None,
    ) -> None:
        self._session, self._rig, self._body = session, rig, body
        self._temperature, self._told, self._stop = temperature, told, stop
        self._keep = keep
        self._hint = ""
        self._axis = handle_axis(body)
        self._probe = ProbeSpotAverager(
            rig, body, STILL_FRAMES, resting=True, distance_mm=_APART_MM, turn_rad=_TURN_RAD
        )

    def collect(self, feed: Feed, frames: int | None = None) -> bool:
        """Take points from a source that was started, and return whether all are taken.

        Parameters
        ----------
        frames
            Of its script; None where the source does not end by itself.
        """
        session, seen = self._session, 0
        while session.current >= 0 and not self._stop():
            stopped = read_status(feed.ring).state is AcquisitionState.STOPPED
            block = feed.ring.read(_BATCH)
            if block is None:
                if stopped or (frames is not None and seen >= frames):
                    break
                time.sleep(_IDLE_S)
                continue
            self._keep(block)
            seen += len(block)
            self._probe.feed(block)
            if self._probe.live().ready:
                self._take()
        return session.current < 0

    def require_complete(self) -> None:
        """Raise CalibrationError where the source ended before the last point; all are stored."""
        if self._session.current >= 0 and not self._stop():
            instruction = self._session.view.instruction
            raise CalibrationError(
                "acceptance.source_ended",
                f"The source ended before the last point. {instruction} {self._hint}".strip(),
                "Start the command again: it continues this test. A recording is replayed from its "
                "beginning, in a new test.",
            )

    def _take(self) -> None:
        session, average = self._session, self._probe.average()
        pose = solve(average.uv[None], self._rig, self._body, average.sigma_px)
        tip = pose.tip_world[0]
        self._hint = session.hint(tip)
        if not self._hint:
            now = datetime.now(UTC)
            if session.needs_temperature():
                session.note_temperature(self._temperature(), now)
            handle = unit(pose.rotation_world_from_probe[0] @ self._axis)
            self._hint = session.take(
                tip, now, handle=handle, uv=to_spots(average.uv), sigma_px=average.sigma_px
            )
            self._probe.taken(average)
        self._told(session.view, self._hint)
