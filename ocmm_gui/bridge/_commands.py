"""Commands of the window, run in sequence on threads that may wait for the job."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from typing import TypeVar

from PySide6.QtCore import QObject

from ocmm_core.errors import MeasuringError
from ocmm_core.inspection.evaluation import JobView
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.station import MeasuringStation
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
    """Send commands to the station.

    `failed`: Called with errors, on the window's thread.
    """

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

    def take(self) -> None:
        if not self.closed:
            self._takes.do(self._station.job.take, _done, self._failed)

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

    def ask(self, call: Callable[[], _T], done: Callable[[_T], None], failed: Failed) -> None:
        """Query a value after the queued commands."""
        if not self.closed:
            self._commands.do(call, done, failed)

    def begin(self, call: Callable[[], str], done: Callable[[str], None]) -> None:
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
