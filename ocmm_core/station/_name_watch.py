"""Threads that compare the names of open files with the files themselves, also while idle."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping

from ocmm_core.errors import OcmmError
from ocmm_core.station._faults import StationFaults

_EVERY_S = 0.25
"""Well below the second after which a loss must be shown."""

JOB = "The job file"
HISTORY = "The history of the calibration"
PROBE = "The history of the probe"


class NameWatch:
    """Make the station FAILED when a file is no longer on the disk under its name.

    `checks`: why lost, or None, by part; slow ones delay later ones. `faults`: reports it.
    """

    def __init__(
        self, checks: Mapping[str, Callable[[], OcmmError | None]], faults: StationFaults
    ) -> None:
        self._checks, self._faults = checks, faults
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="ocmm-names")

    def start(self) -> None:
        self._thread.start()

    def close(self) -> None:
        """Stop, and wait for the end; may be called twice, and without a start."""
        self._stop.set()
        if self._thread.ident is not None:
            self._thread.join()

    def _run(self) -> None:
        while not self._stop.wait(_EVERY_S):
            for part, check in self._checks.items():
                try:
                    error = check()
                except Exception as unexpected:
                    self._faults.fail(unexpected, part)
                    return
                if error is not None:
                    # Continue, to retry a rescue that no folder accepted.
                    self._faults.fail(error, part)
