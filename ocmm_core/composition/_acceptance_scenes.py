"""Acceptance tests on a source: what the virtual rig shows, and points taken from frames."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime

import numpy as np

from ocmm_core.acceptance import (
    AcceptanceProcedure,
    AcceptanceSession,
    AcceptanceView,
    UsedArtefact,
)
from ocmm_core.acquisition.frames import AcquisitionState, FrameBlock, read_status
from ocmm_core.acquisition.recording import FrameRecorder
from ocmm_core.calibration.guided import (
    STILL_FRAMES,
    ProbeSpotAverager,
    handle_axis,
    to_spots,
)
from ocmm_core.camera import Rig
from ocmm_core.composition._acceptance_site import acceptance_feed
from ocmm_core.composition._calibrate_scenes import VirtualSite
from ocmm_core.composition._feeds import Feed
from ocmm_core.errors import CalibrationError, OcmmError
from ocmm_core.failure import contained
from ocmm_core.geometry import Float, unit
from ocmm_core.simulation.calibration_scenes import Scene, TouchSeats, TouchSphere, TouchWithTip
from ocmm_core.tracking import ProbeBody, solve

_BATCH = 80
_IDLE_S = 0.002
_APART_MM, _TURN_RAD = 1.5, 0.15
_CERTIFICATE = 45
_EXTREMES = np.radians(28.0)


def scenes_of_acceptance(
    site: VirtualSite, view: AcceptanceView, artefacts: Sequence[UsedArtefact], away: Float
) -> tuple[Scene, ...]:
    """Return the touches that a test still wants; artefacts are off by what their certificates say.

    Parameters
    ----------
    away
        (3,): from the cameras to the volume.
    """
    scenes: list[Scene] = []
    known = {one.role: one for one in artefacts}
    right = unit(np.cross(away, [0.0, 0.0, 1.0]))
    for number, (position, done) in enumerate(zip(view.positions, view.done, strict=True)):
        points = np.array(position.points_world * position.repeats)
        artefact = known.get(position.role)
        error = 0.0
        if artefact is not None:
            draw = np.random.default_rng([site.seed, _CERTIFICATE]).standard_normal()
            error = 0.5 * artefact.expanded * float(draw)
        seed = site.seed + 7 * number + 1000 * done
        left = points[done:]
        if not len(left):
            continue
        if position.role == "cone":
            leans = [1.0 if (done + one) % 2 else -1.0 for one in range(len(left))]
            handles = [
                np.cos(_EXTREMES) * np.array([0.0, 0.0, 1.0]) + lean * np.sin(_EXTREMES) * right
                for lean in leans
            ]
            scenes.append(_rest(left[0], handles, seed))
        elif position.handle is not None:
            scenes += [
                _rest(point, [np.array(position.handle)], seed + one)
                for one, point in enumerate(left)
            ]
        elif position.normals and artefact is not None:
            normals = np.array(position.normals * position.repeats)
            reach = float(np.linalg.norm(points[0] - points[1]))
            reach /= float(np.linalg.norm(normals[0] - normals[1]))
            centre = points[0] - reach * normals[0]
            scenes.append(
                TouchSphere(
                    centre=_vector(centre),
                    diameter=artefact.sizes[0] + error,
                    normals=tuple(_vector(one) for one in normals[done:]),
                    seed=seed,
                )
            )
        else:
            first = points[0]
            scale = 1.0
            if position.role == "bar" and artefact is not None:
                scale += error / (artefact.sizes[-1] - artefact.sizes[0])
            if position.role == "gauge block":
                # The second face is farther off than its certificate says.
                half = len(position.points_world) // 2
                wide = points[half] - points[0]
                later = (np.arange(len(points)) // half % 2)[:, None]
                left = (points + error * later * wide / np.linalg.norm(wide))[done:]
                first = left[0]
            scenes.append(
                TouchSeats(
                    tips=tuple(_vector(first + scale * (one - first)) for one in left), seed=seed
                )
            )
    return tuple(scenes)


def _rest(point: Float, handles: Sequence[Float], seed: int) -> TouchWithTip:
    return TouchWithTip(
        centre=(0.0, 0.0, 0.0), diameter=10.0, normals=(), cone=_vector(point),
        handles=tuple(_vector(one) for one in handles), seed=seed,
    )  # fmt: skip


def collect_acceptance(
    session: AcceptanceSession,
    feed: Feed,
    rig: Rig,
    body: ProbeBody,
    frames: int | None,
    *,
    temperature: Callable[[], float],
    told: Callable[[AcceptanceView, str], None],
    stop: Callable[[], bool] = lambda: False,
    recorder: FrameRecorder | None = None,
) -> None:
    """Take every point that rests where it is wanted, until all are taken or the source ends.

    Parameters
    ----------
    frames
        Of the script; None where the source does not end by itself.
    temperature
        Of the room, asked whenever the test wants it.
    told
        Called with the view and a hint while points are taken.
    stop
        Asked for between batches.

    Raises
    ------
    CalibrationError
        The source ended before the last point; what was taken is stored.
    """
    probe = ProbeSpotAverager(
        rig, body, STILL_FRAMES, resting=True, distance_mm=_APART_MM, turn_rad=_TURN_RAD
    )
    axis, seen, hint = handle_axis(body), 0, ""
    try:
        feed.acquisition.start()
        while session.current >= 0 and not stop():
            stopped = read_status(feed.ring).state is AcquisitionState.STOPPED
            block = feed.ring.read(_BATCH)
            if block is None:
                if stopped or (frames is not None and seen >= frames):
                    break
                time.sleep(_IDLE_S)
                continue
            if recorder is not None:
                recorder.append(block)
            seen += len(block)
            probe.feed(block)
            live = probe.live()
            if not live.ready:
                continue
            average = probe.average()
            pose = solve(average.uv[None], rig, body, average.sigma_px)
            tip = pose.tip_world[0]
            hint = session.hint(tip)
            if not hint:
                now = datetime.now(UTC)
                if session.needs_temperature():
                    session.note_temperature(temperature(), now)
                handle = unit(pose.rotation_world_from_probe[0] @ axis)
                hint = session.take(
                    tip, now, handle=handle, uv=to_spots(average.uv), sigma_px=average.sigma_px
                )
                probe.taken(average)
            told(session.view, hint)
    finally:
        feed.end()
        if recorder is not None:
            recorder.close()
    if session.current >= 0 and not stop():
        raise CalibrationError(
            "acceptance.source_ended",
            f"The source ended before the last point. {session.view.instruction} {hint}".strip(),
            "Start the command again: it continues this test.",
        )


class VirtualHand:
    """The hand at the virtual rig: it goes where the test wants a point, and waits until it counts.

    Called with who watches it shows frames, on a thread of its own; called with None it stops.

    Parameters
    ----------
    site, source, speed
        The rig, by which source it is seen, and times real time; zero is as fast as possible.
    procedure
        Says what is still wanted, and whether a touch waits to be taken.
    failed
        Told why no frames come any more.
    """

    def __init__(
        self,
        site: VirtualSite,
        source: str,
        speed: float,
        procedure: AcceptanceProcedure,
        failed: Callable[[OcmmError], None],
    ) -> None:
        self._site, self._source, self._speed = site, source, speed
        self._procedure, self._failed = procedure, failed
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self.shown_s = 0.0
        """Time of the virtual rig that was shown, s."""

    def __call__(self, watcher: Callable[[FrameBlock], None] | None) -> None:
        """Begin to show frames, or stop and wait until that is so."""
        if self._thread is not None:
            self._stop.set()
            self._thread.join()
            self._thread = None
        if watcher is not None:
            self._stop.clear()
            self._thread = threading.Thread(
                target=self._run, args=(watcher,), name="ocmm-virtual-hand"
            )
            self._thread.start()

    def _run(self, watcher: Callable[[FrameBlock], None]) -> None:
        try:
            while not self._stop.wait(_IDLE_S):
                if self._wanted():
                    self._show(watcher)
        except Exception as error:
            self._failed(contained(error, "The virtual rig", "All points so far are stored."))

    def _wanted(self) -> bool:
        view = self._procedure.view
        return view.base.step.name == "measure" and view.test.current >= 0

    def _show(self, watcher: Callable[[FrameBlock], None]) -> None:
        """Show what is still wanted from its beginning, until all was shown or it is not wanted."""
        view = self._procedure.view
        away = np.array(view.stage.instrument.away)
        scenes = scenes_of_acceptance(self._site, view.test, view.stage.artefacts, away)
        feed, frames = acceptance_feed(self._site, self._source, scenes, self._speed)
        plan, seen = len(view.test.positions), 0
        try:
            feed.acquisition.start()
            while not self._stop.is_set() and seen < frames and self._wanted():
                stopped = read_status(feed.ring).state is AcquisitionState.STOPPED
                block = feed.ring.read(_BATCH)
                if block is None:
                    if stopped:
                        return
                    self._stop.wait(_IDLE_S)
                    continue
                seen += len(block)
                self.shown_s += len(block) / self._rate_hz(block)
                watcher(block)
                # The wire waits for nobody.
                while not feed.live and self._procedure.ready and not self._stop.wait(_IDLE_S):
                    pass
                if len(self._procedure.view.test.positions) != plan:
                    return
        finally:
            feed.end()

    @staticmethod
    def _rate_hz(block: FrameBlock) -> float:
        if len(block) < 2:
            return np.inf
        span = int(block.time_ns[-1]) - int(block.time_ns[0])
        return float(1e9 * (len(block) - 1) / span)


def _vector(values: Float) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z
