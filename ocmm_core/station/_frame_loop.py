"""Reconstruction thread: frames from the ring, tracked, with their touches, to durable points."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from typing import Protocol

from ocmm_core.acquisition import frames
from ocmm_core.acquisition.recording import FrameHistory
from ocmm_core.errors import OcmmError
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import (
    Path,
    PathCollector,
    PathProgress,
    PointOptions,
    Refusal,
    Touch,
    TouchCollector,
)
from ocmm_core.station._faults import StationEvents, StationFaults
from ocmm_core.station._instruments import Instruments
from ocmm_core.station._live import LiveState
from ocmm_core.station._looks import StationMaintenance
from ocmm_core.station._name_watch import JOB
from ocmm_core.station._open_job import CurrentJob, Gear
from ocmm_core.station.stream import ButtonWatch
from ocmm_core.tracking import (
    CameraSkew,
    ReferenceHome,
    SkewMeter,
    TrackBlock,
    TrackingOptions,
    TrackingPipeline,
)  # fmt: skip

_BATCH = 800
"""Maximum batch of tracked frames; 10 ms at 8 kHz are 80."""
_UNTIMED_BATCH = 20
"""The same while the skew of the cameras is learnt from them: it is used from the next batch on."""
_IDLE_S = 0.002


RECORDING = "The recording"


class FrameSink(Protocol):
    """Receives the raw frames, e.g. a recorder."""

    def append(self, block: frames.FrameBlock) -> None: ...

    def check_name(self) -> OcmmError | None:
        """Return why its file is not on the disk under its name; None if it is. Thread-safe."""
        ...

    def close(self) -> None:
        """Make everything durable and end."""
        ...


@dataclass(frozen=True, slots=True)
class Tracked:
    """A block of frames with its tracking result."""

    block: frames.FrameBlock
    track: TrackBlock
    touches: Sequence[Touch | Path]
    collecting: bool
    pipeline: TrackingPipeline
    """Its pipeline, for the labels and the reference body."""
    skew: CameraSkew | None = None
    """Of cameras without proof of a common exposure time."""
    path: PathProgress | None = None
    """Of the open path, if any."""


class MeasureStep(Protocol):
    """Consumer of tracked blocks; on the thread of the loop, and never during `exclusive`."""

    @property
    def awaits_pull(self) -> bool:
        """Return whether the ball is followed during its retract after a touch."""
        ...

    @property
    def expects_path(self) -> bool:
        """Return whether the button is held while the ball slides, for points along its path."""
        ...

    def measure(self, tracked: Tracked) -> None:
        """Make points of the touches, and update the live values."""
        ...


class FrameLoop:
    """Track frames and pass them on, on a separate thread.

    `ring`: Source of frames, owned by others. `tracking`, `point`: Options of tracking, and of
    touches. `home`: Pose of the reference body at the start of the job; None if not yet known.
    `step`: Receives every tracked block. `faults`: Stores why the loop or the recorder failed.
    `halt`: Ends the loop when set. `recorder`: Receives every raw frame. `history`: Keeps the last
    frames in memory. `skew`: Aligns frames of cameras without a common exposure time; else None.
    """

    def __init__(
        self,
        ring: frames.FrameRing,
        gear: Gear,
        tracking: TrackingOptions,
        point: PointOptions,
        *,
        home: ReferenceHome | None,
        step: MeasureStep,
        faults: StationFaults,
        halt: threading.Event,
        recorder: FrameSink | None = None,
        history: FrameHistory | None = None,
        skew: SkewMeter | None = None,
    ) -> None:
        self._ring, self._history, self._skew = ring, history, skew
        self._gear, self._stop = gear, halt
        self._tracking, self._point = tracking, point
        self._step, self._faults, self._recorder = step, faults, recorder
        self._pipeline = self.pipeline_from(home)
        self._collector: TouchCollector | PathCollector | None = None
        self._exclusive = threading.RLock()
        self._take, self._drained = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="ocmm-reconstruction")

    def start(self) -> None:
        self._thread.start()

    def arm(self) -> None:
        """Record a point at the next block, as if triggered."""
        self._take.set()

    def exclusive(self) -> AbstractContextManager[bool]:
        """Return a lock that keeps blocks from being measured."""
        return self._exclusive

    def pipeline_from(self, home: ReferenceHome | None) -> TrackingPipeline:
        """Return a pipeline relative to a first pose of the reference body; see `track_by`."""
        gear = self._gear
        return TrackingPipeline(gear.rig, gear.body, self._tracking, gear.reference, home)

    def track_by(self, pipeline: TrackingPipeline) -> None:
        """Track with another pipeline, relative to another first pose of the reference body.

        Labels are searched again, and a started touch is dropped: it belongs to neither pose.
        """
        with self._exclusive:
            self._pipeline, self._collector = pipeline, None

    def request_stop(self) -> None:
        """Request the end; returns immediately."""
        self._stop.set()

    def join(self, timeout_s: float) -> bool:
        """Wait for the end; return whether it came, True if never started."""
        if self._thread.ident is None:
            return True
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def wait_drained(self, timeout_s: float) -> bool:
        """Wait until the source has ended and all its frames are measured; return whether so."""
        return self._drained.wait(timeout_s)

    def _run(self) -> None:
        try:
            from scipy import optimize, special  # noqa: F401 - at the first touch, digits would pause

            while not self._stop.is_set():
                status = frames.read_status(self._ring)
                ended = status.state is frames.AcquisitionState.STOPPED
                # Frames written before the source's end flag are read after it.
                block = self._ring.read(_BATCH if self._skew is None else _UNTIMED_BATCH)
                if block is not None:
                    with self._exclusive:
                        self._push(block)
                elif ended:
                    if status.internal:
                        raise status.error("acquisition.failed", "")
                    return
                else:
                    self._stop.wait(_IDLE_S)
        except Exception as error:
            # Any error: without this thread the last number would stay displayed.
            self._faults.fail(error, "The reconstruction")
        finally:
            self._drained.set()

    def _push(self, block: frames.FrameBlock) -> None:
        if self._history is not None:
            self._history.append(block)
        if self._recorder is not None:
            try:
                self._recorder.append(block)
            except Exception as error:
                lost, self._recorder = self._recorder.check_name() is not None, None
                (self._faults.fail if lost else self._faults.note)(error, RECORDING)
        if self._skew is not None:
            aligned = self._skew.align(block)
            if aligned is None:
                return
            block = aligned
        track = self._pipeline.process(block)
        skew = None
        if self._skew is not None:
            # That of these frames: what they tell applies to the next ones.
            skew = self._skew.skew()
            self._skew.learn(track)
        collector = self._present_collector()
        if self._take.is_set():
            self._take.clear()
            collector.arm()
        touches: list[Touch | Path]
        if isinstance(collector, PathCollector):
            touches = [replace(path, untimed=skew is not None) for path in collector.push(track)]
        else:
            collector.pulled = self._step.awaits_pull
            touches = [replace(touch, skew=skew) for touch in collector.push(track)]
        path = collector.progress if isinstance(collector, PathCollector) else None
        self._step.measure(
            Tracked(block, track, touches, collector.collecting, self._pipeline, skew, path)
        )

    def _present_collector(self) -> TouchCollector | PathCollector:
        """Return that of touches or of paths, as the active feature is measured."""
        now, expects = self._collector, self._step.expects_path
        if now is None or (not now.collecting and isinstance(now, PathCollector) != expects):
            period_s = self._ring.word(frames.RingHeaderField.FRAME_PERIOD_NS) * 1e-9
            now = PathCollector(period_s) if expects else TouchCollector(period_s, self._point)
            self._collector = now
        return now


Intent = Callable[[int], str | None]
"""Returns the intended feature of a touch that ends at an exposure; None: the active one."""


class TouchRecorder:
    """Make points of touches; a `MeasureStep`.

    `live`: State of the latest frames. `maintenance`: Its procedures receive the frames instead of
    the job. `faults`, `events`: Receive the results of touches. `intent`, `follow`: Of a scripted
    operator, see `StationOptions`; None if the session decides.
    """

    def __init__(
        self,
        current: CurrentJob,
        live: LiveState,
        instruments: Instruments,
        maintenance: StationMaintenance,
        faults: StationFaults,
        events: StationEvents,
        intent: Intent | None,
        follow: Callable[[int], None] | None = None,
    ) -> None:
        self._current, self._live = current, live
        self._instruments, self._maintenance = instruments, maintenance
        self._faults, self._events = faults, events
        self._intent, self._follow = intent, follow
        self._button = ButtonWatch()

    @property
    def awaits_pull(self) -> bool:
        return self._current.now.session.awaits_pull

    @property
    def expects_path(self) -> bool:
        """Return whether the active feature is measured along paths."""
        return self._current.now.session.paths.expected

    def measure(self, tracked: Tracked) -> None:
        """Measure a block of frames; on the reconstruction thread."""
        block, track, pipeline = tracked.block, tracked.track, tracked.pipeline
        self._instruments.skew = tracked.skew
        for change in self._button.push(block):
            self._events.emit(self._events.button, change)
        session = self._current.now.session
        if pipeline.home is not None and session.reference_home is None:
            # Durable before the first dependent point.
            session.keep_reference(pipeline.home)
        path = session.paths.followed(tracked.path, track.tip_world[:: len(track) // 8 + 1])
        self._live.push(block, track, pipeline, collecting=tracked.collecting, path=path)
        self._instruments.watch_probe(block)
        if self._maintenance.takes(block):
            return
        if tracked.skew is None or tracked.skew.known:
            # An unknown skew looks like a moved camera.
            self._instruments.watch_cameras(track)
        if tracked.touches:
            self._judge(tracked, session)
        if self._follow is not None and not tracked.collecting:
            self._follow(int(block.counter[-1]))

    def _judge(self, tracked: Tracked, session: InspectionSession) -> None:
        code, blocker = self._instruments.blocking_reason()
        for touch in tracked.touches:
            if blocker is None:
                self._record(touch)
                continue
            time_s = float(tracked.block.time_ns[-1]) * 1e-9
            refusal = Refusal(code, blocker.what, blocker.remedy, time_s)
            try:
                refuse(session, refusal, self._events)
            except OcmmError as error:
                # A full disk cannot log it either; measuring resumes once it is cleared.
                self._faults.tell(error)

    def _record(self, touch: Touch | Path) -> None:
        job, events = self._current.now, self._events
        feature = self._intent(touch.first_frame) if self._intent is not None else None
        try:
            # A service names its interface only while running, which it is before the first point.
            job.session.conditions.note_origin(simulated=self._instruments.simulated)
            if isinstance(touch, Path):
                outcome = job.session.paths.record_path(touch, feature)
            else:
                outcome = job.session.touches.record_touch(touch, feature)
        except OcmmError as error:
            # A point that is not durable does not count. Measuring continues, unless the file is
            # lost.
            lost = job.file.given_up
            if lost is None:
                self._faults.tell(error)
            else:
                self._faults.fail(lost, JOB)
            return
        if isinstance(outcome, Refusal):
            events.emit(events.point_refused, outcome)
        else:
            job.probe.used()
            events.emit(events.point_taken, outcome)
        events.emit(events.changed)


def refuse(session: InspectionSession, refusal: Refusal, events: StationEvents) -> None:
    """Store and report that a touch gave no point."""
    session.touches.refuse(refusal)
    events.emit(events.point_refused, refusal)
    events.emit(events.changed)
