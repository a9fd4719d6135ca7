"""Acceptance tests on a source: what the virtual rig shows, and points taken from frames."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence

import numpy as np

from ocmm_core.acceptance import (
    AcceptanceProcedure,
    AcceptanceView,
    UsedArtefact,
)
from ocmm_core.acquisition.frames import AcquisitionState, FrameBlock, read_status
from ocmm_core.composition._acceptance_site import acceptance_feed
from ocmm_core.composition._calibrate_scenes import VirtualSite
from ocmm_core.composition._feeds import Feed
from ocmm_core.errors import CalibrationError, OcmmError
from ocmm_core.failure import contained
from ocmm_core.geometry import Float, unit
from ocmm_core.simulation.calibration_scenes import Scene, TouchSeats, TouchSphere, TouchWithTip

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


class _Hand(ABC):
    """Who touches where a test wants it, on a thread of its own, and waits until it counts.

    Called with who watches it shows frames; called with None it stops.

    Parameters
    ----------
    procedure
        Says what is still wanted, and whether a touch waits to be taken.
    failed
        Told why no frames come any more.
    """

    def __init__(self, procedure: AcceptanceProcedure, failed: Callable[[OcmmError], None]) -> None:
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
                target=self._run, args=(watcher,), name="ocmm-hand-of-a-test"
            )
            self._thread.start()

    def _run(self, watcher: Callable[[FrameBlock], None]) -> None:
        try:
            while not self._stop.wait(_IDLE_S):
                if self._wanted():
                    self._show(watcher)
        except Exception as error:
            self._failed(contained(error, self.named, "All points so far are stored."))
        finally:
            self.close()

    def close(self) -> None:
        """End the source; where there is none, nothing happens."""
        return

    @property
    @abstractmethod
    def named(self) -> str:
        """Return what shows the frames, as the beginning of a sentence."""

    @abstractmethod
    def _show(self, watcher: Callable[[FrameBlock], None]) -> None:
        """Show frames until what is wanted was shown, or nothing is wanted any more."""

    def _play(self, feed: Feed, watcher: Callable[[FrameBlock], None], frames: float) -> bool:
        """Show frames of a source that was started, and return whether it is over.

        Parameters
        ----------
        frames
            So many at most; infinite where the source ends by itself.
        """
        plan, seen = len(self._procedure.view.test.positions), 0
        while not self._stop.is_set() and seen < frames and self._wanted():
            stopped = read_status(feed.ring).state is AcquisitionState.STOPPED
            block = feed.ring.read(_BATCH)
            if block is None:
                if stopped:
                    return True
                self._stop.wait(_IDLE_S)
                continue
            seen += len(block)
            self.shown_s += len(block) / self._rate_hz(block)
            watcher(block)
            # The wire waits for nobody.
            while not feed.live and self._procedure.ready and not self._stop.wait(_IDLE_S):
                pass
            if len(self._procedure.view.test.positions) != plan:
                break
        return False

    def _wanted(self) -> bool:
        view = self._procedure.view
        return view.base.step.name == "measure" and view.test.current >= 0

    @staticmethod
    def _rate_hz(block: FrameBlock) -> float:
        if len(block) < 2:
            return np.inf
        span = int(block.time_ns[-1]) - int(block.time_ns[0])
        return float(1e9 * (len(block) - 1) / span)


class VirtualHand(_Hand):
    """The hand at the virtual rig: it goes where the test wants a point.

    Parameters
    ----------
    site, source, speed
        The rig, by which source it is seen, and times real time; zero is as fast as possible.
    procedure, failed
        As in `_Hand`.
    """

    def __init__(
        self,
        site: VirtualSite,
        source: str,
        speed: float,
        procedure: AcceptanceProcedure,
        failed: Callable[[OcmmError], None],
    ) -> None:
        super().__init__(procedure, failed)
        self._site, self._source, self._speed = site, source, speed

    @property
    def named(self) -> str:
        """Return what shows the frames, as the beginning of a sentence."""
        return "The virtual rig"

    def _show(self, watcher: Callable[[FrameBlock], None]) -> None:
        """Show what is still wanted from its beginning."""
        view = self._procedure.view
        away = np.array(view.stage.instrument.away)
        scenes = scenes_of_acceptance(self._site, view.test, view.stage.artefacts, away)
        feed, frames = acceptance_feed(self._site, self._source, scenes, self._speed)
        try:
            feed.acquisition.start()
            self._play(feed, watcher, frames)
        finally:
            feed.end()


class RecordedHand(_Hand):
    """A recording as the hand of a test: replayed once, and on from where it stands.

    A touch is shown once. What a test refused does not come again, and a retest gets the frames
    that come after those of the first run: nothing is measured twice with the same frames.

    Parameters
    ----------
    make
        Opens the recording; called when the first frame is wanted.
    procedure, failed
        As in `_Hand`.
    """

    def __init__(
        self,
        make: Callable[[], Feed],
        procedure: AcceptanceProcedure,
        failed: Callable[[OcmmError], None],
    ) -> None:
        super().__init__(procedure, failed)
        self._make = make
        self._feed: Feed | None = None

    @property
    def named(self) -> str:
        """Return what shows the frames, as the beginning of a sentence."""
        return "The recording"

    def close(self) -> None:
        """End the replay."""
        if self._feed is not None:
            self._feed.end()
            self._feed = None

    def _show(self, watcher: Callable[[FrameBlock], None]) -> None:
        """Show what comes next in the recording."""
        if self._feed is None:
            self._feed = self._make()
            self._feed.acquisition.start()
        if self._play(self._feed, watcher, np.inf):
            instruction = self._procedure.view.test.instruction
            self._stop.set()
            self._failed(
                CalibrationError(
                    "acceptance.source_ended",
                    f"The recording ended before the last point. {instruction}",
                    "End this test, and begin one with a recording of the whole test.",
                )
            )


def _vector(values: Float) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z
