"""Another job, asked for in the window."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from ocmm_core.errors import OcmmError, StorageError
from ocmm_core.inspection.evaluation import JobHeader
from ocmm_core.station import MeasuringStation
from ocmm_gui.bridge._commands import CommandQueue

_CAN_BE_READ = ("job.locked", "job.not_sealed", "job.not_writable")


class JobChangeCommands(QObject):
    """Begin another job, or go on with one.

    Parameters
    ----------
    station
        Measures it.
    queue
        Carries the commands out.
    """

    job_left = Signal(str)
    """Emits what became of a job that another one was begun before it was finished."""
    only_to_look = Signal(Path)
    """Emits a job that cannot be gone on with: another program measures it, or it is not sealed
    here. It can be looked at."""
    job_begun = Signal()
    """Another job is measured now; its first `job_changed` follows when it is evaluated."""

    def __init__(self, station: MeasuringStation, queue: CommandQueue, parent: QObject) -> None:
        super().__init__(parent)
        self._jobs, self._job, self._queue = station.jobs, station.job, queue

    def next_part(self, header: JobHeader) -> None:
        """Go on with a new job for another part; `job_begun` tells when it is there."""

        def begin() -> str:
            self._jobs.next_part(header)
            return ""

        self._begin(begin)

    def change_plan(self, path: Path, header: JobHeader) -> None:
        """Begin a job by the plan of a file; `job_begun` tells when it is there."""
        self._begin(lambda: self._jobs.change_plan(path, header))

    def go_on(self, path: Path) -> None:
        """Go on with a job that was left open; `job_begun` tells when it is there.

        Where nothing can be added to it, `only_to_look` is emitted beside the error.
        """

        def go_on() -> str:
            try:
                return self._jobs.go_on(path)
            except StorageError as error:
                if error.code in _CAN_BE_READ:
                    self.only_to_look.emit(path)
                raise

        self._begin(go_on)

    def is_beginning(self) -> bool:
        """Return whether another job is being begun."""
        return self._queue.begins

    def _begin(self, call: Callable[[], str]) -> None:
        def done(words: str) -> None:
            if words:
                self.job_left.emit(words)
            self.job_begun.emit()

        def begin() -> str:
            words = call()
            # Evaluated before it is told: what is on the screen until then is of the job before.
            # Why it cannot be, the station tells.
            with contextlib.suppress(OcmmError):
                self._job.view()
            return words

        self._queue.begin(begin, done)
