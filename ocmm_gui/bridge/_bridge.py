"""Between the measuring station and Qt: state by signals, live values by a timer.

The station emits on its reconstruction thread. A Qt signal with a queued connection carries each
event to the window's thread; frames never travel this way, the timer pulls the latest snapshot.
"""

from __future__ import annotations

import contextlib
import logging
import threading
import time
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QObject, Qt, QTimer, Signal

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.records import (
    CalibrationOverview,
    CalibrationView,
    ProbeOverview,
    ProbeView,
)
from ocmm_core.errors import MeasuringError, OcmmError
from ocmm_core.export.report import ReportData
from ocmm_core.failure import contained
from ocmm_core.inspection.evaluation import JobHeader, JobView, LiveView, Probing, withdrawn
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import METHODS, MeasuredPoint, Refusal
from ocmm_core.station import BusView, MeasuringStation
from ocmm_gui.bridge._evaluator import Evaluator
from ocmm_gui.kit import Failed, Worker, active_feature

LIVE_MS = 31
"""Between two pulls of the live values: a little less than a thirtieth of a second."""

CLOSE_LIMIT_S = 1.5
"""How long the station may take to stop; the window closes within two seconds in any case."""

_LEAST_S = 0.1

LONG_S = 0.5
"""An evaluation that takes longer is shown."""

_log = logging.getLogger(__name__)


def _done(_answer: None = None) -> None:
    """Do nothing more: what came of it is told by the station."""


class StationBridge(QObject):
    """Deliver what the station says on the window's thread, and pass commands on.

    Parameters
    ----------
    station
        Owned from now on: `close` stops it.
    """

    live_changed = Signal(object)
    """Emits a `LiveView` every `LIVE_MS`."""
    job_changed = Signal(object)
    """Emits a `JobView` after every change of the job."""
    point_taken = Signal(object)
    """Emits the `MeasuredPoint` that was accepted."""
    point_refused = Signal(object)
    """Emits the `Refusal` of a touch."""
    bus_text_saved = Signal(object)
    """Emits the `Path` that the report of the bus was written to."""
    cameras_written = Signal()
    """The cameras store the intrinsics of the calibration."""
    plan_changed = Signal()
    """Another plan is measured now; emitted before the first `job_changed` of it."""
    job_left = Signal(str)
    """Emits what became of a job that another one was begun before it was finished."""
    job_begun = Signal()
    """Another job is measured now; its first `job_changed` follows when it is evaluated."""
    evaluating = Signal(bool)
    """Emits whether the job has been evaluated for longer than `LONG_S`."""
    failed = Signal(object)
    """Emits the `OcmmError` of a command."""

    # One signal each for the thread change; the public ones are emitted on the window's thread.
    _changed_elsewhere = Signal(object)
    _taken_elsewhere = Signal(object)
    _refused_elsewhere = Signal(object)
    _failed_elsewhere = Signal(object)
    _written_elsewhere = Signal()

    def __init__(self, station: MeasuringStation, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._station = station
        self._closed = False
        self._writing: threading.Thread | None = None
        self._job, self._plan = station.job(), station.plan
        self._selected = ""
        self._begins = self._evaluates = False
        # Whoever changes a job waits for its lock, which an evaluation may hold for seconds. A
        # touch waits for nobody: it is meant for the place where the ball is now.
        self._commands, self._takes = Worker("ocmm-commands", self), Worker("ocmm-take", self)
        queued = Qt.ConnectionType.QueuedConnection
        self._changed_elsewhere.connect(self._show_job, queued)
        self._taken_elsewhere.connect(self.point_taken, queued)
        self._refused_elsewhere.connect(self.point_refused, queued)
        self._failed_elsewhere.connect(self.failed, queued)
        self._written_elsewhere.connect(self.cameras_written, queued)
        # Fits and uncertainties cost neither the window its time nor the thread that tracks.
        self._evaluator = Evaluator(
            station.job, self._changed_elsewhere.emit, self._on_not_evaluated
        )
        # Before any listener that may fail: what comes after that one is not told.
        station.changed.connect(self._on_changed, priority=1)
        station.point_taken.connect(self._on_taken, priority=1)
        station.point_refused.connect(self._on_refused, priority=1)
        station.failed.connect(self._on_failed, priority=1)
        self._timer = QTimer(self)
        self._timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._timer.setInterval(LIVE_MS)
        self._timer.timeout.connect(self._pull_live)

    @property
    def station(self) -> MeasuringStation:
        """Return the station behind the bridge."""
        return self._station

    def start(self) -> None:
        """Start the station and the timer, and send the first snapshots."""
        self._evaluator.start()
        if self._begins:
            # The first touch is meant for the job that is being begun.
            self._commands.do(
                self._station.start, lambda _none: self._evaluator.wake(), self.failed.emit
            )
        else:
            try:
                self._station.start()
            except OcmmError as error:
                self.failed.emit(error)
            else:
                # With the start the job knows with what it is measured.
                self._evaluator.wake()
        self._timer.start()
        self._pull_live()
        self._show_job(self._job)

    def close(self) -> bool:
        """Stop the station within `CLOSE_LIMIT_S` and say whether it stopped; idempotent."""
        if self._closed:
            return True
        self._closed = True
        self._timer.stop()
        self._station.changed.disconnect(self._on_changed)
        self._station.point_taken.disconnect(self._on_taken)
        self._station.point_refused.disconnect(self._on_refused)
        self._station.failed.disconnect(self._on_failed)
        until = time.monotonic() + CLOSE_LIMIT_S
        self._station.request_stop()
        # What was asked for before is still done: the file is open until `close` of the station.
        for worker in (self._takes, self._commands):
            if not worker.close(until - time.monotonic()):
                _log.error("What was asked of the station last may not be done.")
        self._evaluator.close(until - time.monotonic())
        stopped = self._station.join(max(until - time.monotonic(), _LEAST_S))
        if self._writing is not None:
            # The end of the bus has ended it.
            self._writing.join(CLOSE_LIMIT_S)
        if not stopped:
            _log.error("The measuring station did not stop within %.1f s.", CLOSE_LIMIT_S)
        self._station.close()
        return stopped

    def live(self) -> LiveView:
        """Return the latest state of the machine."""
        return self._station.live()

    def job(self) -> JobView:
        """Return the job as it was shown last."""
        return self._job

    def take(self) -> None:
        """Take a point now."""
        if not self._closed:
            self._takes.do(self._station.take, _done, self.failed.emit)

    def undo(self) -> None:
        """Take the last point back."""
        self._command(self._station.undo)

    def finish(self) -> None:
        """Accept the active feature and go to the next."""
        self._command(self._station.finish)

    def flip(self) -> None:
        """Flip the compensation side of the last point."""
        self._command(self._station.flip)

    def redo(self) -> None:
        """Do again what was undone last."""
        self._change(lambda session: session.redo())

    def skip(self) -> None:
        """Leave out the feature that is looked at, or the active one."""
        name = self._job.looked_at
        self._change(lambda session: session.skip(name))

    def repeat(self) -> None:
        """Measure the active feature anew, or the last one where none is active."""
        shown = self._job.shown
        if shown is not None:
            self._change(lambda session: session.repeat(shown.name))

    def reopen(self) -> None:
        """Let the feature that is shown take points again, one that is done or skipped."""
        shown = self._job.shown
        if shown is not None:
            self._change(lambda session: session.reopen(shown.name))

    def toggle_order(self) -> None:
        """Probe in any order, or in that of the plan again."""
        order: Probing = "plan" if self._job.probing == "any" else "any"
        self._change(lambda session: session.set_order(order))

    def toggle_pause(self) -> None:
        """Take no points any more, or go on."""
        if self._job.paused:
            self._change(lambda session: session.resume())
        else:
            self._change(lambda session: session.pause())

    def next_side(self) -> None:
        """Find the side of the material of the active feature in the next way that suits it."""
        name, feature = self._job.active, active_feature(self._job)
        if feature is None:
            return
        start = METHODS.index(feature.compensation) + 1
        allowed = (*METHODS[start:], *METHODS[:start])

        def turn(session: InspectionSession) -> None:
            for method in allowed:
                # What says nothing about this shape is passed over.
                with contextlib.suppress(MeasuringError):
                    session.set_compensation(method, name)
                    return

        self._change(turn)

    def next_part(self, header: JobHeader) -> None:
        """Go on with a new job for another part; `job_begun` tells when it is there."""

        def begin() -> str:
            self._station.next_part(header)
            return ""

        self._begin(begin)

    def change_plan(self, path: Path, header: JobHeader) -> None:
        """Begin a job by the plan of a file; `job_begun` tells when it is there."""
        self._begin(lambda: self._station.change_plan(path, header))

    def go_on(self, path: Path) -> None:
        """Go on with a job that was left open; `job_begun` tells when it is there."""
        self._begin(lambda: self._station.go_on(path))

    def is_beginning(self) -> bool:
        """Return whether another job is being begun."""
        return self._begins

    def accept_alignment(self, words: str, done: Callable[[], None]) -> None:
        """Write into the job that the alignment was accepted; ``done`` is told when it is."""
        self._command(
            lambda: self._station.change(lambda session: session.accept_alignment(words)), done
        )

    def report(self, done: Callable[[ReportData], None], failed: Failed) -> None:
        """Give everything that a report can say about the job as it stands."""
        if not self._closed:
            self._commands.do(self._station.report, done, failed)

    def delete_point(self, number: int, reason: str) -> None:
        """Take a point out of its feature."""
        self._change(lambda session: session.delete_point(number, reason))

    def restore_point(self, number: int) -> None:
        """Put a deleted point back."""
        self._change(lambda session: session.restore_point(number))

    def refit(self) -> None:
        """Compute everything again from the raw observations."""
        self._change(lambda session: session.refit())

    def select(self, feature: str) -> None:
        """Look at a feature of the plan; one that is open gets the next touch."""
        self._selected = feature
        self._command(lambda: self._station.select(feature))

    def select_neighbour(self, step: int) -> None:
        """Look at the feature ``step`` places after the one that is shown.

        Behind the last one of a job that is done stands the verdict on the part.
        """
        job = self._job
        names = [feature.name for feature in job.features]
        # Keys that come faster than the job is evaluated count as well.
        shown = self._selected or job.looked_at or job.active
        if not names:
            return
        place = (names.index(shown) if shown in names else len(names)) + step
        if place >= len(names) and not job.active:
            self.select("")
        else:
            self.select(names[min(max(place, 0), len(names) - 1)])

    def bus(self) -> BusView | None:
        """Return what is known about the bus; None where the frames do not come over one."""
        return self._station.bus()

    def save_bus_text(self, path: Path) -> None:
        """Write the report of the bus to a file."""
        self._command(
            lambda: self._station.save_bus_text(path), lambda: self.bus_text_saved.emit(path)
        )

    def show_frames_to(self, watcher: Callable[[FrameBlock], None] | None) -> None:
        """Show all frames to a calibration procedure from now on, or to nobody."""
        self._station.show_frames_to(watcher)

    def calibration(self) -> CalibrationView:
        """Return what is to be said about the calibration now."""
        return self._station.calibration()

    def calibration_overview(self) -> CalibrationOverview:
        """Return what the store of the rig holds."""
        return self._station.calibration_overview()

    def probe(self) -> ProbeView:
        """Return what is to be said about probe and tip now."""
        return self._station.probe_view()

    def probe_overview(self) -> ProbeOverview:
        """Return what the records of the probe hold."""
        return self._station.probe_overview()

    def mount_tip(self, tip: str) -> None:
        """Say that a tip, maybe the same one again, was screwed on."""
        self._command(lambda: self._station.mount_tip(tip))

    def look_at_probe_records(self) -> None:
        """Let the station take in what a wizard has stored about the probe."""
        self._command(self._station.probe_records_changed)

    def write_to_cameras(self) -> None:
        """Store the intrinsics of the calibration in the cameras, in a thread of its own."""
        if self._closed or (self._writing is not None and self._writing.is_alive()):
            return

        def write() -> None:
            try:
                self._station.write_to_cameras()
            except Exception as error:
                self._failed_elsewhere.emit(contained(error, "Writing to the cameras"))
            else:
                self._written_elsewhere.emit()

        self._writing = threading.Thread(target=write, name="ocmm-write-cameras")
        self._writing.start()

    def _begin(self, call: Callable[[], str]) -> None:
        """Begin another job; meanwhile there is none that a command could mean."""

        def done(words: str) -> None:
            self._begins = False
            if words:
                self.job_left.emit(words)
            self.job_begun.emit()

        def failed(error: Exception) -> None:
            self._begins = False
            self.failed.emit(error)

        if self._may_command():
            self._begins = True
            self._commands.do(call, done, failed)

    def _change(self, verb: Callable[[InspectionSession], object]) -> None:
        self._command(lambda: self._station.change(verb))

    def _command(self, call: Callable[[], None], done: Callable[[], None] = _done) -> None:
        """Give a command, carried out after those before; an error goes out by signal."""

        def failed(error: Exception) -> None:
            self._selected = ""
            self.failed.emit(error)

        if self._may_command():
            self._commands.do(call, lambda _none: done(), failed)

    def _may_command(self) -> bool:
        if self._begins:
            self.failed.emit(
                MeasuringError(
                    "station.beginning", "Another job is being begun.", "Wait until it is there."
                )
            )
        return not (self._closed or self._begins)

    def _pull_live(self) -> None:
        self.live_changed.emit(self._station.live())
        evaluates = self._evaluator.busy_s() > LONG_S
        if evaluates is not self._evaluates:
            self._evaluates = evaluates
            self.evaluating.emit(evaluates)

    def _show_job(self, job: JobView) -> None:
        self._job, self._selected = job, ""
        if self._closed:
            return
        if self._station.plan is not self._plan:
            self._plan = self._station.plan
            self.plan_changed.emit()
        self.job_changed.emit(job)

    def _on_changed(self) -> None:
        self._evaluator.wake()

    def _on_not_evaluated(self, error: Exception) -> None:
        # On the thread of the evaluator; the station tells why.
        self._station.fail(error, "The evaluation")
        fault = self._station.fault
        if fault is not None:
            self._changed_elsewhere.emit(withdrawn(self._job, fault.error.what))

    def _on_taken(self, point: MeasuredPoint) -> None:
        self._taken_elsewhere.emit(point)

    def _on_refused(self, refusal: Refusal) -> None:
        self._refused_elsewhere.emit(refusal)

    def _on_failed(self, error: OcmmError) -> None:
        self._failed_elsewhere.emit(error)
