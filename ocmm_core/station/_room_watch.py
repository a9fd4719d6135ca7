"""Thread that logs the thermometers of the register in the job, also while idle."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from ocmm_core.acceptance import LoggedTemperature, ThermometerLog
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.station._faults import StationFaults

_EVERY_S = 10.0
"""Between readings; the newest is stored at most `_LOOK_S` after the end of a feature."""
_LOOK_S = 0.5
_PART = "The log of the thermometers"


class RoomWatch:
    """Store readings of thermometers, or why they are suspect, in the job in use.

    `change`: applies an action to the session of that job.
    """

    def __init__(
        self,
        log: ThermometerLog,
        change: Callable[[Callable[[InspectionSession], object]], None],
        faults: StationFaults,
    ) -> None:
        self._log, self._change, self._faults = log, change, faults
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="ocmm-room")
        self._newest: LoggedTemperature | None = None

    def start(self) -> None:
        """Store a first reading, which so precedes the first point, and continue to log."""
        self._look()
        self._thread.start()

    def close(self) -> None:
        """Store the last reading and stop; may be called twice, and without a start."""
        self._stop.set()
        if self._thread.ident is not None:
            self._thread.join()

    def _run(self) -> None:
        read_s = time.monotonic()
        while not self._stop.wait(_LOOK_S):
            if time.monotonic() - read_s >= _EVERY_S:
                self._newest, read_s = None, time.monotonic()
            self._look()
        self._look()

    def _look(self) -> None:
        try:
            if self._newest is None:
                read = self._log.sample()
                # The first thermometer counts, unless any of them is suspect.
                self._newest = next((one for one in read if one.doubt), read[0])
            newest = self._newest
            self._change(lambda session: session.conditions.note_logged(newest))
        except Exception as error:
            self._faults.note(error, _PART)
            self._stop.set()
