"""Threads of the window: commands in sequence, and evaluation of the job at a limited rate.

Commands come from the window, from the inspector's keys, and about the server for programs.
The threads may wait for the job; the window does not.
"""

from __future__ import annotations

import contextlib
import logging
import threading
import time
from collections.abc import Callable
from typing import Any, TypeVar

from PySide6.QtCore import QObject, Signal

from ocmm_core.ambient import TypedRoom
from ocmm_core.errors import MeasuringError
from ocmm_core.export.report import ReportData
from ocmm_core.inspection.evaluation import JobView, Probing
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import METHODS
from ocmm_core.settings import Settings
from ocmm_core.station import MeasuringStation, ServiceState, StationService, start_service
from ocmm_gui.kit import active_feature
from ocmm_gui.work import Failed, Worker

_T = TypeVar("_T")

_log = logging.getLogger(__name__)


class ShownJob:
    """Job as displayed, possibly outdated."""

    def __init__(self, job: JobView) -> None:
        self.job = job
        self.selected = ""
        """Feature selected since; keys are faster than the evaluation."""


def _done(_answer: None = None) -> None:
    """Do nothing: the station reports the result."""


class CommandQueue:
    """Send commands to the station. `failed`: Called with errors, on the window's thread."""

    def __init__(
        self, station: MeasuringStation, shown: ShownJob, failed: Failed, parent: QObject
    ) -> None:
        self._station, self._shown, self._failed = station, shown, failed
        # Job changes wait for a lock that an evaluation may hold for seconds. A touch must not
        # wait: it refers to the current ball position.
        self._commands, self._takes = Worker("ocmm-commands", parent), Worker("ocmm-take", parent)
        self.begins = False
        """Another job is being started: commands would have no target."""
        self.closed = False
        """No more commands are accepted."""

    def record_point(self) -> None:
        if not self.closed:
            self._takes.do(self._station.job.record_point, _done, self._failed)

    def do(self, call: Callable[[], None], done: Callable[[], None] = _done) -> None:
        """Queue a command; errors are emitted by signal."""

        def failed(error: Exception) -> None:
            self._shown.selected = ""
            self._failed(error)

        if self._may_command():
            self._commands.do(call, lambda _none: done(), failed)

    def change(
        self, verb: Callable[[InspectionSession], object], done: Callable[[], None] = _done
    ) -> None:
        """Queue a session command, as `do`."""
        self.do(lambda: self._station.job.change(verb), done)

    def query(self, call: Callable[[], _T], done: Callable[[_T], None], failed: Failed) -> None:
        """Query a value after the queued commands."""
        if not self.closed:
            self._commands.do(call, done, failed)

    def start_job(self, call: Callable[[], str], done: Callable[[str], None]) -> None:
        """Start another job; ``done`` receives the fate of the previous one."""

        def begun(words: str) -> None:
            self.begins = False
            done(words)

        def failed(error: Exception) -> None:
            self.begins = False
            self._failed(error)

        if self._may_command():
            self.begins = True
            self._commands.do(call, begun, failed)

    def close(self, until: float) -> None:
        """Finish the queued commands until a time of `time.monotonic`."""
        for worker in (self._takes, self._commands):
            if not worker.close(until - time.monotonic()):
                _log.error("The last request to the station may not have been carried out.")

    def _may_command(self) -> bool:
        if self.begins:
            self._failed(
                MeasuringError(
                    "station.beginning", "Another job is starting.", "Wait until it has started."
                )
            )
        return not (self.closed or self.begins)


class JobCommands:
    """Commands on the shown or active feature, or on the whole job."""

    def __init__(self, queue: CommandQueue, shown: ShownJob) -> None:
        self._queue, self._shown = queue, shown

    def record_point(self) -> None:
        self._queue.record_point()

    def note_room(self, typed: TypedRoom, done: Callable[[], None]) -> None:
        who = self._shown.job.header.operator
        self._queue.change(lambda session: session.conditions.note_room(typed, who), done)

    def undo(self) -> None:
        self._queue.change(lambda session: session.steps.undo())

    def redo(self) -> None:
        self._queue.change(lambda session: session.steps.redo())

    def finish(self) -> None:
        """Accept the active feature and go to the next."""
        self._queue.change(lambda session: session.steps.finish())

    def flip(self) -> None:
        """Flip the compensation side of the last point."""
        self._queue.change(lambda session: session.points.flip())

    def skip(self) -> None:
        """Skip the shown feature, or the active one."""
        name = self._shown.job.looked_at
        self._queue.change(lambda session: session.steps.skip(name))

    def repeat(self) -> None:
        """Measure the active feature again, or the last one if none is active."""
        shown = self._shown.job.shown
        if shown is not None:
            self._queue.change(lambda session: session.steps.repeat(shown.name))

    def reopen(self) -> None:
        """Reopen the shown feature, done or skipped."""
        shown = self._shown.job.shown
        if shown is not None:
            self._queue.change(lambda session: session.steps.reopen(shown.name))

    def toggle_order(self) -> None:
        order: Probing = "plan" if self._shown.job.probing == "any" else "any"
        self._queue.change(lambda session: session.steps.set_order(order))

    def toggle_pause(self) -> None:
        if self._shown.job.paused:
            self._queue.change(lambda session: session.pausing.resume())
        else:
            self._queue.change(lambda session: session.pausing.pause())

    def next_side(self) -> None:
        """Use the next applicable side detection for the active feature."""
        name, feature = self._shown.job.active, active_feature(self._shown.job)
        if feature is None:
            return
        start = METHODS.index(feature.compensation) + 1
        allowed = (*METHODS[start:], *METHODS[:start])

        def turn(session: InspectionSession) -> None:
            for method in allowed:
                # Methods that do not apply to this shape are skipped.
                with contextlib.suppress(MeasuringError):
                    session.steps.set_compensation(method, name)
                    return

        self._queue.change(turn)


class ChoiceCommands:
    """Select a feature, and delete single points."""

    def __init__(self, queue: CommandQueue, shown: ShownJob) -> None:
        self._queue, self._shown = queue, shown

    def select(self, feature: str) -> None:
        """Show a feature of the plan; an open one gets the next touch."""
        self._shown.selected = feature
        self._queue.change(lambda session: session.steps.select(feature))

    def select_neighbour(self, step: int) -> None:
        """Show the feature ``step`` places on, or the part verdict after the last of a done job."""
        job = self._shown.job
        names = [feature.name for feature in job.features]
        # Keys faster than the evaluation also count.
        shown = self._shown.selected or job.looked_at or job.active
        if not names:
            return
        place = (names.index(shown) if shown in names else len(names)) + step
        if place >= len(names) and not job.active:
            self.select("")
        else:
            self.select(names[min(max(place, 0), len(names) - 1)])

    def delete_point(self, number: int, reason: str) -> None:
        self._queue.change(lambda session: session.points.delete_point(number, reason))

    def remove_commanding(self, feature: str) -> None:
        """Delete the points that command the fit of a feature."""
        self._queue.change(lambda session: session.remove_commanding(feature))

    def restore_point(self, number: int) -> None:
        self._queue.change(lambda session: session.points.restore_point(number))


class ResultCommands:
    def __init__(self, station: MeasuringStation, queue: CommandQueue) -> None:
        self._station, self._queue = station, queue

    def refit(self) -> None:
        """Recompute everything from the raw observations."""
        self._queue.change(lambda session: session.refit())

    def accept_alignment(self, words: str, done: Callable[[], None]) -> None:
        """Record the acceptance of the alignment; then call ``done``."""
        self._queue.change(lambda session: session.accept_alignment(words), done)

    def report(self, done: Callable[[ReportData], None], failed: Failed) -> None:
        self._queue.query(self._station.reports.data, done, failed)


class ServingCommands(QObject):
    """Start and stop a server, pass on words of the operator, and watch its state.

    `name`: in the group `ocmm.services`.
    """

    changed = Signal(object)
    """Emits the `ServiceState`; None while no server runs."""

    def __init__(
        self, name: str, station: MeasuringStation, queue: CommandQueue, parent: QObject
    ) -> None:
        super().__init__(parent)
        self._name, self._station, self._queue = name, station, queue
        self._service: StationService | None = None
        self._shown: ServiceState | None = None

    @property
    def runs(self) -> bool:
        return self._service is not None

    def start(self, hand: Any, settings: Settings) -> str:
        """Start the server with a job of its own; on a thread that may wait; OcmmError."""
        self._service = start_service(self._name, self._station, hand, settings)
        return ""

    def start_beside(self, settings: Settings) -> None:
        """Start the server next to the running job; errors by signal of the bridge."""

        def start() -> None:
            if self._service is None:
                self.start(None, settings)

        self._queue.do(start)

    def stop(self) -> None:
        self._queue.do(self.close)

    def operate(self, words: str) -> None:
        """Send a word of the operator to the program."""
        if self._service is not None:
            self._service.operate(words)

    def close(self) -> None:
        service, self._service = self._service, None
        if service is not None:
            service.close()

    def poll(self) -> None:
        """Emit the state if it has changed."""
        state = None if self._service is None else self._service.state()
        if state != self._shown:
            self._shown = state
            self.changed.emit(state)


_PAUSE_S = 0.04
"""Pause between evaluations, so that others get the job's lock."""


class Evaluator:
    """Evaluate the job after changes, once for simultaneous ones; ``failed`` gets exceptions."""

    def __init__(
        self,
        evaluate: Callable[[], JobView],
        tell: Callable[[JobView], None],
        failed: Callable[[Exception], None],
    ) -> None:
        self._evaluate, self._tell, self._failed = evaluate, tell, failed
        self._changed, self._stop = threading.Event(), threading.Event()
        self._since: float | None = None
        self._thread = threading.Thread(target=self._run, name="ocmm-evaluation", daemon=True)

    def start(self) -> None:
        if not self._thread.is_alive() and not self._stop.is_set():
            self._thread.start()

    def wake(self) -> None:
        """Evaluate soon; returns at once."""
        self._changed.set()

    def busy_s(self) -> float:
        """Return the duration of the current evaluation, s; zero if idle."""
        since = self._since
        return 0.0 if since is None else time.monotonic() - since

    def close(self, limit_s: float) -> None:
        """Stop after the current evaluation or the limit; idempotent."""
        self._stop.set()
        self._changed.set()
        if self._thread.is_alive():
            self._thread.join(max(limit_s, 0.0))

    def _run(self) -> None:
        while not self._stop.is_set():
            self._changed.wait()
            self._changed.clear()
            if self._stop.is_set():
                return
            self._since = time.monotonic()
            try:
                self._tell(self._evaluate())
            except Exception as error:
                # Otherwise the window would keep its outdated display.
                if not self._stop.is_set():
                    self._failed(error)
            finally:
                self._since = None
            self._stop.wait(_PAUSE_S)
