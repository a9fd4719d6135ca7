"""The thread that puts the job of a station into the outbox when it is finished or paused.

It waits until a moment passes without a change, so that a burst of steps is one version. What it
does costs the measuring nothing: it reads the job file as any other program may.
"""

from __future__ import annotations

import logging
import threading
from pathlib import Path

from ocmm_core.archive import Outbox
from ocmm_core.errors import OcmmError
from ocmm_core.station import MeasuringStation
from ocmm_core.storage import JobFile

_log = logging.getLogger(__name__)

QUIET_S = 0.5
PART = "The hand-over to the archive"


class ArchiveWatch:
    """Put each job of a station into an outbox; made before the station starts, closed after it.

    Parameters
    ----------
    station
        Whose jobs.
    folder
        Of the outbox.
    """

    def __init__(self, station: MeasuringStation, folder: Path) -> None:
        self._station, self._folder = station, folder
        self._wake, self._end = threading.Event(), threading.Event()
        self._job = station.job.path
        self._put: tuple[Path, int] | None = None
        station.events.changed.connect(self._on_changed)
        self._thread = threading.Thread(target=self._run, name="archive")
        self._thread.start()

    def close(self) -> None:
        """Put in what is left; call it when the station has closed its job. May be called twice."""
        if self._end.is_set():
            return
        self._end.set()
        self._wake.set()
        self._thread.join()
        self._station.events.changed.disconnect(self._on_changed)
        self._try(self._job)

    def _on_changed(self) -> None:
        self._wake.set()

    def _run(self) -> None:
        while not self._end.is_set():
            self._wake.wait()
            self._wake.clear()
            # As long as something happens there will be another version.
            while not self._end.is_set() and self._wake.wait(QUIET_S):
                self._wake.clear()
            if self._end.is_set():
                return
            try:
                self._look()
            except Exception as error:
                if self._end.is_set():
                    return
                self._station.faults.note(error, PART)

    def _look(self) -> None:
        path = self._station.job.path
        if path != self._job:
            # The job before is closed: it is as far as it ever went.
            before, self._job = self._job, path
            self._try(before)
        if self._station.faults.measuring is not None:
            return
        view = self._station.job.view()
        if view.complete or view.paused:
            self._try(path)

    def _try(self, path: Path) -> None:
        """Put a job in, if it has a point; what goes wrong is told beside the measuring."""
        try:
            if not path.exists() or not _has_points(path):
                return
            with Outbox(self._folder) as outbox:
                outbox.put(path)
        except OcmmError as error:
            self._station.faults.note(error, PART)
            _log.warning("%s was not put into the outbox: %s", path, error)


def _has_points(path: Path) -> bool:
    from ocmm_core.inspection.archive import copy_of_job

    with copy_of_job(path) as copy, JobFile.open(copy, scratch=True) as job:
        return job.next_number() > 1
