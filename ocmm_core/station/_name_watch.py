"""Threads that run also while idle: names of open files, and thermometers."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping

from ocmm_core.acceptance import LoggedTemperature, ThermometerLog
from ocmm_core.errors import OcmmError
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.station._faults import StationFaults

_EVERY_S = 0.05
"""Rescue and window need most of the second after which a loss must be shown, on a busy computer.
"""

_READ_S, _LOOK_S = 10.0, 0.5
"""Between readings of thermometers; from the end of a feature to its stored reading."""

_CLOSE_S = 1.0

JOB = "The job file"
HISTORY = "The history of the calibration"
PROBE = "The history of the probe"
_ROOM = "The log of the thermometers"


class _PollingThread:
    """Thread that calls `_run` until it is closed."""

    def __init__(self, name: str) -> None:
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def start(self) -> None:
        self._thread.start()

    def close(self) -> None:
        """Stop, and wait for the end; may be called twice, and without a start.

        A sensor or disk that does not answer delays no window that closes.
        """
        self._stop.set()
        if self._thread.ident is not None:
            self._thread.join(_CLOSE_S)

    def _run(self) -> None:
        raise NotImplementedError


class NameWatch(_PollingThread):
    """Make the station FAILED when a file is no longer on the disk under its name.

    `checks`: return why a file is lost, or None, by its part of the station; a slow check delays
    later ones. `faults`: stores and reports the loss.
    """

    def __init__(
        self, checks: Mapping[str, Callable[[], OcmmError | None]], faults: StationFaults
    ) -> None:
        super().__init__("ocmm-names")
        self._checks, self._faults = checks, faults

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


class RoomWatch(_PollingThread):
    """Store readings of thermometers, or why they are suspect, in the job in use.

    `session`: returns that of the job. `change`: applies an action to it, and reports the change.
    """

    def __init__(
        self,
        log: ThermometerLog,
        session: Callable[[], InspectionSession],
        change: Callable[[Callable[[InspectionSession], object]], None],
        faults: StationFaults,
    ) -> None:
        super().__init__("ocmm-room")
        self._log, self._session, self._change, self._faults = log, session, change, faults
        self._newest: LoggedTemperature | None = None

    def _run(self) -> None:
        self._poll()
        read_s = time.monotonic()
        while not self._stop.wait(_LOOK_S):
            if time.monotonic() - read_s >= _READ_S:
                self._newest, read_s = None, time.monotonic()
            self._poll()
        self._poll()

    def _poll(self) -> None:
        try:
            if self._newest is None:
                # A server may send after 15 s: that delays neither the start nor the end.
                read = () if self._stop.is_set() else self._log.sample()
                if self._stop.is_set():
                    return
                # The first thermometer counts, unless any of them is suspect.
                self._newest = next((one for one in read if one.doubt), read[0])
            newest = self._newest
            # Every change is reported to the window and to streams.
            if not self._session().conditions.is_logged(newest):
                self._change(lambda session: session.conditions.note_logged(newest))
        except Exception as error:
            self._faults.note(error, _ROOM)
            self._stop.set()
