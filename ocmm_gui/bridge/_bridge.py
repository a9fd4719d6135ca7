"""Bridge from the station to Qt: state by signals, live values by a timer.

The station emits on its reconstruction thread. Queued Qt connections carry each event to the
window's thread; frames never travel this way, the timer pulls the latest snapshot.

Includes the commands for job changes and maintenance.
"""

from __future__ import annotations

import contextlib
import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QCoreApplication, QEvent, QObject, Qt, QTimer, Signal

from ocmm_core.errors import OcmmError, StorageError
from ocmm_core.failure import contained
from ocmm_core.inspection.evaluation import JobHeader, JobView, withdrawn
from ocmm_core.measuring import MeasuredPoint, Refusal
from ocmm_core.station import MeasuringStation
from ocmm_core.station.coaching import CoachView
from ocmm_gui.bridge import _threads as threads

_CAN_BE_READ = ("job.locked", "job.not_sealed", "job.not_writable")


class JobChangeCommands(QObject):
    """Start another job, or resume one."""

    job_left = Signal(str)
    """Emits the fate of an unfinished job when another one starts."""
    only_to_look = Signal(Path)
    """Emits a job that is only viewed: measured by another program, or not sealed here."""
    job_begun = Signal()
    """Another job has started; its first `job_changed` follows its evaluation."""

    def __init__(
        self, station: MeasuringStation, queue: threads.CommandQueue, parent: QObject
    ) -> None:
        super().__init__(parent)
        self._jobs, self._job, self._queue = station.jobs, station.job, queue

    def next_part(self, header: JobHeader) -> None:
        """Start a job for another part; emits `job_begun`."""

        def start() -> str:
            self._jobs.next_part(header)
            return ""

        self._start(start)

    def change_plan(self, path: Path, header: JobHeader) -> None:
        """Start a job with the plan of a file; emits `job_begun`."""
        self._start(lambda: self._jobs.change_plan(path, header))

    def go_on(self, path: Path) -> None:
        """Resume an open job (`job_begun`); if read-only, also emit `only_to_look`."""

        def go_on() -> str:
            try:
                return self._jobs.go_on(path)
            except StorageError as error:
                if error.code in _CAN_BE_READ:
                    self.only_to_look.emit(path)
                raise

        self._start(go_on)

    def serve(self, start: Callable[[], str]) -> None:
        """Start a server that makes a job of its own; emits `job_begun`."""
        self._start(start)

    def is_beginning(self) -> bool:
        return self._queue.begins

    def _start(self, call: Callable[[], str]) -> None:
        def done(words: str) -> None:
            if words:
                self.job_left.emit(words)
            self.job_begun.emit()

        def start() -> str:
            words = call()
            # Evaluate first: until then the screen shows the previous job. The station reports
            # errors.
            with contextlib.suppress(OcmmError):
                self._job.view()
            return words

        self._queue.start_job(start, done)


class MaintenanceCommands(QObject):
    """Run maintenance commands on threads that may wait."""

    bus_text_saved = Signal(object)
    """Emits the `Path` of the written bus report."""
    cameras_written = Signal()
    """The cameras store the intrinsics of the calibration."""
    failed = Signal(object)
    """Emits the `OcmmError` of writing to the cameras."""

    # Private signals change the thread; public ones are emitted on the window's thread.
    _written_elsewhere = Signal()
    _failed_elsewhere = Signal(object)

    def __init__(
        self, station: MeasuringStation, queue: threads.CommandQueue, parent: QObject
    ) -> None:
        super().__init__(parent)
        self._maintenance, self._queue = station.maintenance, queue
        self._writing: threading.Thread | None = None
        queued = Qt.ConnectionType.QueuedConnection
        self._written_elsewhere.connect(self.cameras_written, queued)
        self._failed_elsewhere.connect(self.failed, queued)

    def save_bus_text(self, path: Path) -> None:
        self._queue.do(
            lambda: self._maintenance.save_bus_text(path), lambda: self.bus_text_saved.emit(path)
        )

    def mount_tip(self, tip: str) -> None:
        """Record that a tip was mounted, possibly the same one."""
        self._queue.do(lambda: self._maintenance.mount_tip(tip))

    def look_at_probe_records(self) -> None:
        """Make the station reload the probe records after a wizard."""
        self._queue.do(self._maintenance.probe_records_changed)

    def write_to_cameras(self) -> None:
        """Store the intrinsics of the calibration in the cameras, in a separate thread."""
        if self._queue.closed or (self._writing is not None and self._writing.is_alive()):
            return
        self._writing = threading.Thread(target=self._write, name="ocmm-write-cameras")
        self._writing.start()

    def join(self, limit_s: float) -> None:
        """Wait until writing ends; the end of the bus ends it."""
        if self._writing is not None:
            self._writing.join(limit_s)

    def _write(self) -> None:
        try:
            self._maintenance.write_to_cameras()
        except Exception as error:
            self._failed_elsewhere.emit(contained(error, "Writing to the cameras"))
        else:
            self._written_elsewhere.emit()


LIVE_MS = 31
"""Pull interval of live values: slightly less than 1/30 s."""

CLOSE_LIMIT_S = 1.5
"""Time limit for stopping the station; the window always closes within two seconds."""

_LEAST_S = 0.1

LONG_S = 0.5
"""Longer evaluations are indicated."""

_log = logging.getLogger(__name__)


class StationBridge(QObject):
    """Own the station, deliver its events on the window's thread, and provide commands."""

    live_changed = Signal(object)
    job_changed = Signal(object)
    point_taken = Signal(object)
    point_refused = Signal(object)
    coach_changed = Signal(object)
    """Emits the `CoachView` next to the readout when it changes."""
    plan_changed = Signal()
    """Another plan is in use; emitted before its first `job_changed`."""
    evaluating = Signal(bool)
    """Emits whether the job has been evaluated for longer than `LONG_S`."""
    failed = Signal(object)

    # Private signals change the thread; public ones are emitted on the window's thread.
    _changed_elsewhere = Signal(object)
    _taken_elsewhere = Signal(object)
    _refused_elsewhere = Signal(object)
    _coach_elsewhere = Signal(object)

    def __init__(self, station: MeasuringStation, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.station = station
        self._plan, self._evaluates = station.job.plan, False
        self.shown = threads.ShownJob(station.job.view())
        self._queue = threads.CommandQueue(station, self.shown, self.failed.emit, self)
        self.job = threads.JobCommands(self._queue, self.shown)
        self.choice = threads.ChoiceCommands(self._queue, self.shown)
        """Selection of features, and deletion of points."""
        self.results = threads.ResultCommands(station, self._queue)
        """Results: recompute, accept, report."""
        self.jobs = JobChangeCommands(station, self._queue, self)
        self.maintenance = MaintenanceCommands(station, self._queue, self)
        self.serving = threads.ServingCommands("ippdme", station, self._queue, self)
        self.screen = threads.ServingCommands("screen", station, self._queue, self)
        self.maintenance.failed.connect(self.failed)
        queued = Qt.ConnectionType.QueuedConnection
        self._changed_elsewhere.connect(self._show_job, queued)
        self._taken_elsewhere.connect(self.point_taken, queued)
        self._refused_elsewhere.connect(self.point_refused, queued)
        self._failures = deque[OcmmError]()
        self._coach_elsewhere.connect(self.coach_changed, queued)
        # Fits and uncertainties must delay neither the window nor the tracking thread.
        self._evaluator = threads.Evaluator(
            station.job.view, self._changed_elsewhere.emit, self._on_not_evaluated
        )
        # Before listeners that may fail: later ones would not be called.
        station.events.changed.connect(self._evaluator.wake, priority=1)
        station.events.point_taken.connect(self._on_taken, priority=1)
        station.events.point_refused.connect(self._on_refused, priority=1)
        station.faults.failed.connect(self._on_failed, priority=1)
        station.coach.changed.connect(self._on_coach)
        self._timer = QTimer(self, timerType=Qt.TimerType.PreciseTimer, interval=LIVE_MS)
        self._timer.timeout.connect(self._pull_live)

    def start(self) -> None:
        """Start the station and the timer, and send the first snapshots."""
        self._evaluator.start()
        self.station.coach.start()
        if self._queue.begins:
            # The first touch belongs to the job being started.
            self._queue.query(
                self.station.start, lambda _none: self._evaluator.wake(), self.failed.emit
            )
        else:
            try:
                self.station.start()
            except OcmmError as error:
                self.failed.emit(error)
            else:
                # The job's instruments are known from the start on.
                self._evaluator.wake()
        self._timer.start()
        self._pull_live()
        self._show_job(self.shown.job)

    def close(self) -> bool:
        """Stop the station within `CLOSE_LIMIT_S`; return whether it stopped; idempotent."""
        if self._queue.closed:
            return True
        self._queue.closed = True
        self._timer.stop()
        self.station.events.changed.disconnect(self._evaluator.wake)
        self.station.events.point_taken.disconnect(self._on_taken)
        self.station.events.point_refused.disconnect(self._on_refused)
        self.station.faults.failed.disconnect(self._on_failed)
        self.station.coach.changed.disconnect(self._on_coach)
        until = time.monotonic() + CLOSE_LIMIT_S
        self.station.request_stop()
        # Earlier commands are still executed: the file is open until `close` of the station.
        self._queue.close(until)
        self._evaluator.close(until - time.monotonic())
        self.serving.close()
        self.screen.close()
        stopped = self.station.join(max(until - time.monotonic(), _LEAST_S))
        self.maintenance.join(CLOSE_LIMIT_S)
        if not stopped:
            _log.error("The measuring station did not stop within %.1f s.", CLOSE_LIMIT_S)
        self.station.close()
        return stopped

    def _pull_live(self) -> None:
        self.live_changed.emit(self.station.looks.live())
        self.serving.poll()
        self.screen.poll()
        evaluates = self._evaluator.busy_s() > LONG_S
        if evaluates is not self._evaluates:
            self._evaluates = evaluates
            self.evaluating.emit(evaluates)

    def _show_job(self, job: JobView) -> None:
        self.shown.job, self.shown.selected = job, ""
        if self._queue.closed:
            return
        plan = self.station.job.plan
        if plan is not self._plan:
            self._plan = plan
            self.plan_changed.emit()
        self.job_changed.emit(job)

    def _on_not_evaluated(self, error: Exception) -> None:
        # On the evaluator's thread; the station reports the reason.
        self.station.faults.fail(error, "The evaluation")
        fault = self.station.faults.measuring
        if fault is not None:
            self._changed_elsewhere.emit(withdrawn(self.shown.job, fault.error.what))

    def _on_taken(self, point: MeasuredPoint) -> None:
        self._taken_elsewhere.emit(point)

    def _on_refused(self, refusal: Refusal) -> None:
        self._refused_elsewhere.emit(refusal)

    def _on_coach(self, view: CoachView) -> None:
        self._coach_elsewhere.emit(view)

    def _on_failed(self, error: OcmmError) -> None:
        self._failures.append(error)
        # Ahead of waiting changes: on a busy computer, showing one takes some tenths of a second.
        first = Qt.EventPriority.HighEventPriority.value
        QCoreApplication.postEvent(self, QEvent(QEvent.Type.User), first)

    def customEvent(self, _event: QEvent) -> None:
        """Report a failure on the thread of the window."""
        self.failed.emit(self._failures.popleft())
