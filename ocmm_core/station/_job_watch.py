"""The thread that compares the name of the measured job with its file, also while idle."""

from __future__ import annotations

import threading

from ocmm_core.station._faults import StationFaults
from ocmm_core.station._open_job import CurrentJob

_EVERY_S = 0.25
"""Well below the second after which a loss must be shown."""

PART = "The job file"


class JobWatch:
    """Make the station FAILED when its job is no longer on the disk under its name.

    Parameters
    ----------
    faults
        Keeps and tells the loss.
    """

    def __init__(self, current: CurrentJob, faults: StationFaults) -> None:
        self._current, self._faults = current, faults
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="ocmm-job-name")

    def start(self) -> None:
        """Start comparing; once."""
        self._thread.start()

    def close(self) -> None:
        """Stop, and wait for the end; may be called twice, and without a start."""
        self._stop.set()
        if self._thread.ident is not None:
            self._thread.join()

    def _run(self) -> None:
        try:
            while not self._stop.wait(_EVERY_S):
                error = self._current.now.file.check_name()
                if error is not None:
                    # Compared on: a rescue that no folder took is tried again.
                    self._faults.fail(error, PART)
        except Exception as error:
            self._faults.fail(error, PART)
