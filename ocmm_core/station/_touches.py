"""From tracked frames to durable points: the step after the frame loop, on its thread."""

from __future__ import annotations

from collections.abc import Callable

from ocmm_core.errors import OcmmError
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import Refusal, Touch
from ocmm_core.station._faults import StationEvents, StationFaults
from ocmm_core.station._frame_loop import Tracked
from ocmm_core.station._instruments import Instruments
from ocmm_core.station._live import LiveState
from ocmm_core.station._maintenance import StationMaintenance
from ocmm_core.station._name_watch import JOB
from ocmm_core.station._open_job import CurrentJob
from ocmm_core.station.stream import ButtonWatch

Intent = Callable[[int], str | None]
"""Returns the intended feature of a touch that ends at an exposure; None: the active one."""


class TouchTaker:
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
        """Return whether the ball is followed during its retract after a touch."""
        return self._current.now.session.awaits_pull

    def measure(self, tracked: Tracked) -> None:
        """Measure a block of frames; on the reconstruction thread."""
        block, track, pipeline = tracked.block, tracked.track, tracked.pipeline
        self._instruments.skew = tracked.skew
        for change in self._button.feed(block):
            self._events.emit(self._events.button, change)
        session = self._current.now.session
        if pipeline.home is not None and session.reference_home is None:
            # Durable before the first dependent point.
            session.keep_reference(pipeline.home)
        self._live.feed(block, track, pipeline, collecting=tracked.collecting)
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
                self._take(touch)
                continue
            time_s = float(tracked.block.time_ns[-1]) * 1e-9
            refusal = Refusal(code, blocker.what, blocker.remedy, time_s)
            try:
                refuse(session, refusal, self._events)
            except OcmmError as error:
                # A full disk cannot log it either; measuring resumes once it is cleared.
                self._faults.tell(error)

    def _take(self, touch: Touch) -> None:
        job, events = self._current.now, self._events
        feature = self._intent(touch.first_frame) if self._intent is not None else None
        try:
            # A service names its interface only while running, which it is before the first point.
            job.session.conditions.note_origin(simulated=self._instruments.simulated)
            outcome = job.session.touches.take(touch, feature)
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
