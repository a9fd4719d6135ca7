"""Commands of the window, carried out one after the other on threads that may wait for the job."""

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
    """What the window shows of the job, which may be older than the job is."""

    def __init__(self, job: JobView) -> None:
        self.job = job
        """The job as it was shown last."""
        self.selected = ""
        """Feature that was selected since; keys come faster than the job is evaluated."""


def _done(_answer: None = None) -> None:
    """Do nothing more: what came of it is told by the station."""


class CommandQueue:
    """Give commands to the station.

    Parameters
    ----------
    station
        Carries them out.
    shown
        Forgets what was selected where a command fails.
    failed
        Told of errors, on the thread of the window.
    parent
        Owns the threads.
    """

    def __init__(
        self, station: MeasuringStation, shown: ShownJob, failed: Failed, parent: QObject
    ) -> None:
        self._station, self._shown, self._failed = station, shown, failed
        # Whoever changes a job waits for its lock, which an evaluation may hold for seconds. A
        # touch waits for nobody: it is meant for the place where the ball is now.
        self._commands, self._takes = Worker("ocmm-commands", parent), Worker("ocmm-take", parent)
        self.begins = False
        """Another job is being begun: there is none that a command could mean."""
        self.closed = False
        """Nothing is asked of the station any more."""

    def take(self) -> None:
        """Take a point now."""
        if not self.closed:
            self._takes.do(self._station.job.take, _done, self._failed)

    def do(self, call: Callable[[], None], done: Callable[[], None] = _done) -> None:
        """Give a command, carried out after those before; an error goes out by signal."""

        def failed(error: Exception) -> None:
            self._shown.selected = ""
            self._failed(error)

        if self._may_command():
            self._commands.do(call, lambda _none: done(), failed)

    def change(
        self, verb: Callable[[InspectionSession], object], done: Callable[[], None] = _done
    ) -> None:
        """Let the session do something, as `do`."""
        self.do(lambda: self._station.job.change(verb), done)

    def ask(self, call: Callable[[], _T], done: Callable[[_T], None], failed: Failed) -> None:
        """Ask for something that is found out after the commands before."""
        if not self.closed:
            self._commands.do(call, done, failed)

    def begin(self, call: Callable[[], str], done: Callable[[str], None]) -> None:
        """Begin another job; ``done`` is told what became of the one before."""

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
        """End after what was asked for before, or at a time of `time.monotonic`."""
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
